//! Direct solve of (∇²E + ε M) d = b: sparse Cholesky, analysed once a garment, refactored in place.
//!
//! faer's supernodal LLᵀ in the garment's own elimination order. One thread does it all, so the bits do not depend on
//! how many there are.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::{DMat3, DVec3};

use crate::mechanics::energy::pattern::Pattern;

/// What can go wrong in a solve.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The symbolic analysis failed.
    #[error("the Hessian of {unknowns} unknowns cannot be analysed: {reason}")]
    Analysis {
        /// Scalar unknowns.
        unknowns: usize,
        /// What faer said.
        reason: String,
    },
    /// A pivot was not positive.
    #[error("the Hessian is not positive definite at unknown {index}: is a position not finite?")]
    NotPositive {
        /// Scalar unknown in elimination order.
        index: usize,
    },
}

/// A factorisation whose pattern is fixed.
pub struct Solver {
    symbolic: SymbolicCholesky<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
    factor: Vec<f64>,
    memory: MemBuffer,
    scratch: Vec<f64>,
}

impl std::fmt::Debug for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solver")
            .field("unknowns", &(self.starts.len() - 1))
            .field("factor", &self.factor.len())
            .finish()
    }
}

impl Solver {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// [`SolveError::Analysis`] where memory or index range do not suffice.
    pub fn new(pattern: &Pattern) -> Result<Self, SolveError> {
        let unknowns = 3 * pattern.unknowns();
        let mut starts = Vec::with_capacity(unknowns + 1);
        let mut rows: Vec<u32> = Vec::with_capacity(9 * pattern.rows.len());
        starts.push(0);
        for j in 0..pattern.unknowns() {
            for c in 0..3 {
                for (k, &i) in pattern.rows[pattern.column(j)].iter().enumerate() {
                    let from = if k == 0 { c } else { 0 };
                    rows.extend((from..3).map(|r| 3 * i + r));
                }
                starts.push(rows.len() as u32);
            }
        }
        let failed = |reason: String| SolveError::Analysis { unknowns, reason };
        let (upper_starts, upper_rows) = transposed(&starts, &rows);
        let upper = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &upper_starts, None, &upper_rows);
        let symbolic = factorize_symbolic_cholesky(
            upper,
            Side::Upper,
            SymmetricOrdering::Identity,
            // Supernodal always: the numeric phase then takes the lower half as it is.
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|e| failed(format!("{e:?}")))?;
        let need = faer::dyn_stack::StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        );
        let memory = MemBuffer::try_new(need).map_err(|e| failed(format!("{e:?}")))?;
        let factor = vec![0.0; symbolic.len_val()];
        Ok(Self { symbolic, values: vec![0.0; rows.len()], starts, rows, factor, memory, scratch: vec![0.0; unknowns] })
    }

    /// Numbers in the factor: a measure of its cost.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Factors the matrix of `blocks` plus `diagonal` (N/m for each unknown vertex).
    ///
    /// # Errors
    /// [`SolveError::NotPositive`] where a pivot is zero, negative or not a number.
    pub fn factorise(&mut self, pattern: &Pattern, blocks: &[DMat3], diagonal: &[f64]) -> Result<(), SolveError> {
        let mut at = 0;
        for (j, &shift) in diagonal.iter().enumerate() {
            for c in 0..3 {
                for (k, block) in blocks[pattern.column(j)].iter().enumerate() {
                    let column = block.col(c).to_array();
                    let from = if k == 0 { c } else { 0 };
                    self.values[at..at + 3 - from].copy_from_slice(&column[from..]);
                    if k == 0 {
                        self.values[at] += shift;
                    }
                    at += 3 - from;
                }
            }
        }
        let n = self.starts.len() - 1;
        let matrix = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows),
            &self.values,
        );
        self.symbolic
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

    /// Solves with the last factorisation; `x` holds the right side, then the solution, in elimination order.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        for (s, v) in self.scratch.chunks_exact_mut(3).zip(x.iter()) {
            v.write_to_slice(s);
        }
        let n = self.scratch.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.scratch, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        for (s, v) in self.scratch.chunks_exact(3).zip(x.iter_mut()) {
            *v = DVec3::from_slice(s);
        }
    }
}

/// The pattern of the transposed matrix, rows ascending: faer analyses the upper half and factors the lower.
fn transposed(starts: &[u32], rows: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = starts.len() - 1;
    let mut out = vec![0u32; n + 1];
    for &r in rows {
        out[r as usize + 1] += 1;
    }
    for i in 0..n {
        out[i + 1] += out[i];
    }
    let mut next = out.clone();
    let mut columns = vec![0; rows.len()];
    for j in 0..n {
        for &r in &rows[starts[j] as usize..starts[j + 1] as usize] {
            columns[next[r as usize] as usize] = j as u32;
            next[r as usize] += 1;
        }
    }
    (out, columns)
}
