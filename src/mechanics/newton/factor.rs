//! One sparse Cholesky factor, in one of two precisions, refactored in place.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::{DMat3, DVec3};

use super::SolveError;
use crate::mechanics::energy::pattern::Pattern;

/// Numbers of one precision: the matrix's lower half by columns, its factor, and a right side.
pub(super) struct Factor<T> {
    values: Vec<T>,
    factor: Vec<T>,
    side: Vec<T>,
    memory: MemBuffer,
}

/// The matrix's pattern and its analysis.
#[derive(Clone, Copy)]
pub(super) struct Shape<'a> {
    pub(super) symbolic: &'a SymbolicCholesky<u32>,
    pub(super) starts: &'a [u32],
    pub(super) rows: &'a [u32],
}

/// The two precisions.
pub(super) trait Precision: faer::traits::RealField + Copy {
    const ZERO: Self;
    fn of(x: f64) -> Self;
    fn wide(self) -> f64;
}

impl Precision for f32 {
    const ZERO: Self = 0.0;
    fn of(x: f64) -> Self {
        x as Self
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Precision for f64 {
    const ZERO: Self = 0.0;
    fn of(x: f64) -> Self {
        x
    }
    fn wide(self) -> f64 {
        self
    }
}

impl<T: Precision> Factor<T> {
    pub(super) fn new(symbolic: &SymbolicCholesky<u32>) -> Result<Self, String> {
        let need = faer::dyn_stack::StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<T>(1, Par::Seq),
        );
        let memory = MemBuffer::try_new(need).map_err(|e| format!("{e:?}"))?;
        Ok(Self { values: Vec::new(), factor: Vec::new(), side: vec![T::ZERO; symbolic.nrows()], memory })
    }

    pub(super) fn factorise(
        &mut self,
        shape: Shape<'_>,
        pattern: &Pattern,
        blocks: &[DMat3],
        diagonal: &[f64],
    ) -> Result<(), SolveError> {
        // Filled when first used: a solver seldom needs both.
        self.factor.resize(shape.symbolic.len_val(), T::ZERO);
        self.values.clear();
        for (j, &shift) in diagonal.iter().enumerate() {
            for c in 0..3 {
                for (k, block) in blocks[pattern.column(j)].iter().enumerate() {
                    let column = block.col(c).to_array();
                    let (from, shift) = if k == 0 { (c, shift) } else { (0, 0.0) };
                    self.values.push(T::of(column[from] + shift));
                    self.values.extend(column[from + 1..].iter().map(|&x| T::of(x)));
                }
            }
        }
        let n = shape.starts.len() - 1;
        let matrix = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, shape.starts, None, shape.rows),
            &self.values,
        );
        shape
            .symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                matrix,
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map(|_| ())
            .map_err(|faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index }| {
                SolveError::NotPositive { index }
            })
    }

    pub(super) fn solve(&mut self, symbolic: &SymbolicCholesky<u32>, x: &mut [DVec3]) {
        for (s, v) in self.side.chunks_exact_mut(3).zip(x.iter()) {
            s.copy_from_slice(&v.to_array().map(T::of));
        }
        let n = self.side.len();
        LltRef::new(symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.side, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        for (s, v) in self.side.chunks_exact(3).zip(x.iter_mut()) {
            *v = DVec3::new(s[0].wide(), s[1].wide(), s[2].wide());
        }
    }
}
