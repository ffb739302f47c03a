//! A front's dense part: a panel's Cholesky factor, and what it takes from the rows below.
//!
//! With L₁₁ L₁₁ᵀ = A₁₁ and L₂₁ = A₂₁ L₁₁⁻ᵀ, what is left of the rows below is A₂₂ − L₂₁ L₂₁ᵀ. Large matrices are cut in halves until
//! faer's kernels, each on one thread, do the pieces; the pieces go to the threads there are. Where they are cut depends on the size
//! alone, and so do the bits.

use std::ops::{AddAssign, Neg, SubAssign};

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::traits::RealField;
use faer::traits::math_utils::one;
use faer::{Accum, MatMut, MatRef, Par};

/// The two precisions.
pub(super) trait Precision: RealField + Copy + Into<f64> + Neg<Output = Self> + AddAssign + SubAssign {}

impl Precision for f32 {}
impl Precision for f64 {}

/// Columns and rows up to which a piece is not cut.
const MAX_COLUMNS: usize = 192;
const MAX_ROWS: usize = 384;

/// Memory that [`factor_panel`] needs.
pub(super) fn scratch_size<T: Precision>() -> StackReq {
    cholesky_in_place_scratch::<T>(MAX_COLUMNS, Par::Seq, Default::default())
}

/// Factors the columns of a panel, its diagonal block on top, lower half. The error is the column whose pivot is not positive.
pub(super) fn factor_panel<T: Precision>(panel: MatMut<'_, T>, memory: &mut MemBuffer) -> Result<(), usize> {
    let n = panel.ncols();
    if n <= MAX_COLUMNS {
        let (mut top, bottom) = panel.split_at_row_mut(n);
        let memory = MemStack::new(memory);
        cholesky_in_place(top.rb_mut(), Default::default(), Par::Seq, memory, Default::default())
            .map_err(|LltError::NonPositivePivot { index }| index)?;
        solve_below(top.rb(), bottom);
        return Ok(());
    }
    let half = (n / 2).next_multiple_of(16);
    let (mut left, right) = panel.split_at_col_mut(half);
    factor_panel(left.rb_mut(), memory)?;
    let mut right = right.split_at_row_mut(half).1;
    subtract_product(right.rb_mut(), left.rb().split_at_row(half).1, Accum::Add);
    factor_panel(right, memory).map_err(|index| half + index)
}

/// L₂₁ = A₂₁ L₁₁⁻ᵀ.
fn solve_below<T: Precision>(top: MatRef<'_, T>, bottom: MatMut<'_, T>) {
    let rows = bottom.nrows();
    if rows > MAX_ROWS {
        let (one, other) = bottom.split_at_row_mut((rows / 2).next_multiple_of(16));
        rayon::join(|| solve_below(top, one), || solve_below(top, other));
    } else if rows > 0 {
        solve_lower_triangular_in_place(top, bottom.transpose_mut(), Par::Seq);
    }
}

/// C − L Lᵀ, or − L Lᵀ alone, in the lower trapezoid of C; L may have more rows than C has columns.
pub(super) fn subtract_product<T: Precision>(c: MatMut<'_, T>, l: MatRef<'_, T>, onto: Accum) {
    let n = c.ncols();
    if n > MAX_COLUMNS {
        let half = (n / 2).next_multiple_of(16);
        let (left, right) = c.split_at_col_mut(half);
        let right = right.split_at_row_mut(half).1;
        rayon::join(|| subtract_product(left, l, onto), || subtract_product(right, l.split_at_row(half).1, onto));
        return;
    }
    let (triangle, rest) = c.split_at_row_mut(n);
    let (top, bottom) = l.split_at_row(n);
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    let minus = -one::<T>();
    matmul(triangle, lower, onto, top, full, top.transpose(), full, minus, Par::Seq);
    subtract_rectangle(rest, bottom, top, onto);
}

/// C − A Bᵀ, or − A Bᵀ alone.
fn subtract_rectangle<T: Precision>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>, onto: Accum) {
    let rows = c.nrows();
    if rows > MAX_ROWS {
        let half = (rows / 2).next_multiple_of(16);
        let ((one, other), (a, below)) = (c.split_at_row_mut(half), a.split_at_row(half));
        rayon::join(|| subtract_rectangle(one, a, b, onto), || subtract_rectangle(other, below, b, onto));
    } else if rows > 0 {
        faer::linalg::matmul::matmul(c, onto, a, b.transpose(), -one::<T>(), Par::Seq);
    }
}
