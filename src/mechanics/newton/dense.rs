//! A front's dense part: a panel's Cholesky factor, and what it takes from the rows below.
//!
//! With L₁₁ L₁₁ᵀ = A₁₁ and L₂₁ = A₂₁ L₁₁⁻ᵀ, what is left of the rows below is A₂₂ − L₂₁ L₂₁ᵀ. Large matrices are cut in halves until
//! faer's kernels, each on one thread, do the pieces; the pieces go to the threads there are. Where they are cut depends on the size
//! alone, and so do the bits.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::traits::math_utils::one;
use faer::{Accum, MatMut, MatRef, Par};

use super::factor::Precision;

/// Columns and rows up to which a piece is not cut.
const WIDE: usize = 192;
const TALL: usize = 384;

/// Memory that [`partial`] needs.
pub(super) fn memory<T: Precision>() -> StackReq {
    cholesky_in_place_scratch::<T>(WIDE, Par::Seq, Default::default())
}

/// Factors the columns of a panel, its diagonal block on top, lower half. The error is the column whose pivot is not positive.
pub(super) fn partial<T: Precision>(panel: MatMut<'_, T>, memory: &mut MemBuffer) -> Result<(), usize> {
    let n = panel.ncols();
    if n <= WIDE {
        let (mut top, bottom) = panel.split_at_row_mut(n);
        let memory = MemStack::new(memory);
        cholesky_in_place(top.rb_mut(), Default::default(), Par::Seq, memory, Default::default())
            .map_err(|LltError::NonPositivePivot { index }| index)?;
        below(top.rb(), bottom);
        return Ok(());
    }
    let half = (n / 2).next_multiple_of(16);
    let (mut left, right) = panel.split_at_col_mut(half);
    partial(left.rb_mut(), memory)?;
    let mut right = right.split_at_row_mut(half).1;
    subtract(right.rb_mut(), left.rb().split_at_row(half).1, Accum::Add);
    partial(right, memory).map_err(|index| half + index)
}

/// L₂₁ = A₂₁ L₁₁⁻ᵀ.
fn below<T: Precision>(top: MatRef<'_, T>, bottom: MatMut<'_, T>) {
    let rows = bottom.nrows();
    if rows > TALL {
        let (one, other) = bottom.split_at_row_mut((rows / 2).next_multiple_of(16));
        rayon::join(|| below(top, one), || below(top, other));
    } else if rows > 0 {
        solve_lower_triangular_in_place(top, bottom.transpose_mut(), Par::Seq);
    }
}

/// C − L Lᵀ, or − L Lᵀ alone, in the lower trapezoid of C; L may have more rows than C has columns.
pub(super) fn subtract<T: Precision>(c: MatMut<'_, T>, l: MatRef<'_, T>, onto: Accum) {
    let n = c.ncols();
    if n > WIDE {
        let half = (n / 2).next_multiple_of(16);
        let (left, right) = c.split_at_col_mut(half);
        let right = right.split_at_row_mut(half).1;
        rayon::join(|| subtract(left, l, onto), || subtract(right, l.split_at_row(half).1, onto));
        return;
    }
    let (triangle, rest) = c.split_at_row_mut(n);
    let (top, bottom) = l.split_at_row(n);
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    let minus = -one::<T>();
    matmul(triangle, lower, onto, top, full, top.transpose(), full, minus, Par::Seq);
    product(rest, bottom, top, onto);
}

/// C − A Bᵀ, or − A Bᵀ alone.
fn product<T: Precision>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>, onto: Accum) {
    let rows = c.nrows();
    if rows > TALL {
        let half = (rows / 2).next_multiple_of(16);
        let ((one, other), (a, below)) = (c.split_at_row_mut(half), a.split_at_row(half));
        rayon::join(|| product(one, a, b, onto), || product(other, below, b, onto));
    } else if rows > 0 {
        faer::linalg::matmul::matmul(c, onto, a, b.transpose(), -one::<T>(), Par::Seq);
    }
}
