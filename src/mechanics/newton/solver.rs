//! Direct solve of (∇²E + ε M) d = b: sparse Cholesky, analysed once a garment, refactored in place.
//!
//! faer's supernodal LLᵀ in the garment's own elimination order. One thread does it all, so the bits do not depend on
//! how many there are.
//!
//! It factors in single precision, which takes half the time, and mends the solution in double: d ← d + S⁻¹ (b − A d) until
//! what is left of b is under [`REST`] (iterative refinement; Higham: "Accuracy and Stability of Numerical Algorithms",
//! chapter 12). That works while the matrix's condition is under some 1e7: for knits, and for wovens while they are soft. The
//! first time it does not, or a pivot is lost that double precision holds, the solver takes double from then on.

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

/// Share of the right side that a mended solution may leave.
const REST: f64 = 1e-3;

/// Times a solution in single precision is mended at most: each takes off a factor of the condition times 1e-7.
const MENDS: usize = 4;

/// A factorisation whose pattern is fixed.
pub struct Solver {
    symbolic: SymbolicCholesky<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    single: Option<Factor<f32>>,
    double: Factor<f64>,
}

/// Numbers of one precision: the matrix's lower half by columns, its factor, and a right side.
struct Factor<T> {
    values: Vec<T>,
    factor: Vec<T>,
    side: Vec<T>,
    memory: MemBuffer,
}

impl std::fmt::Debug for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solver")
            .field("unknowns", &(self.starts.len() - 1))
            .field("factor", &self.factor_len())
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
        let single = Factor::new(&symbolic).map_err(&failed)?;
        let double = Factor::new(&symbolic).map_err(&failed)?;
        Ok(Self { symbolic, starts, rows, single: Some(single), double })
    }

    /// Numbers in the factor: a measure of its cost.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Solves (A + D) x = b for the matrix A of `blocks` and the diagonal D of `diagonal` (N/m for each unknown vertex); `x`
    /// holds b, then the solution, in elimination order. Double precision takes over where single does not do.
    ///
    /// # Errors
    /// [`SolveError::NotPositive`] where a pivot is zero, negative or not a number in double precision; where only
    /// `positive` matrices are expected, one that single precision loses is tried in double first.
    pub fn solve(
        &mut self,
        pattern: &Pattern,
        blocks: &[DMat3],
        diagonal: &[f64],
        positive: bool,
        x: &mut [DVec3],
    ) -> Result<(), SolveError> {
        let shape = Shape { symbolic: &self.symbolic, starts: &self.starts, rows: &self.rows };
        if let Some(single) = &mut self.single {
            match single.factorise(shape, pattern, blocks, diagonal) {
                Ok(()) if mended(single, shape.symbolic, pattern, blocks, diagonal, x) => return Ok(()),
                Err(lost) if !positive => return Err(lost),
                _ => self.single = None,
            }
        }
        self.double.factorise(shape, pattern, blocks, diagonal)?;
        self.double.solve(&self.symbolic, x);
        Ok(())
    }
}

/// Solves with a factor in single precision and mends the solution; where that fails, `x` is left as it was.
fn mended(
    single: &mut Factor<f32>,
    symbolic: &SymbolicCholesky<u32>,
    pattern: &Pattern,
    blocks: &[DMat3],
    diagonal: &[f64],
    x: &mut [DVec3],
) -> bool {
    let side = x.to_vec();
    let most = REST * norm(&side);
    let mut rest = Vec::new();
    single.solve(symbolic, x);
    for _ in 0..=MENDS {
        pattern.multiply(blocks, x, &mut rest);
        for (((r, b), d), shift) in rest.iter_mut().zip(&side).zip(x.iter()).zip(diagonal) {
            *r = *b - *r - *d * *shift;
        }
        let left = norm(&rest);
        if left <= most {
            return true;
        }
        if !left.is_finite() {
            break;
        }
        single.solve(symbolic, &mut rest);
        for (d, r) in x.iter_mut().zip(&rest) {
            *d += *r;
        }
    }
    x.copy_from_slice(&side);
    false
}
/// The matrix's pattern and its analysis.
#[derive(Clone, Copy)]
struct Shape<'a> {
    symbolic: &'a SymbolicCholesky<u32>,
    starts: &'a [u32],
    rows: &'a [u32],
}

/// The two precisions.
trait Precision: faer::traits::RealField + Copy {
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
    fn new(symbolic: &SymbolicCholesky<u32>) -> Result<Self, String> {
        let need = faer::dyn_stack::StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<T>(1, Par::Seq),
        );
        let memory = MemBuffer::try_new(need).map_err(|e| format!("{e:?}"))?;
        Ok(Self { values: Vec::new(), factor: Vec::new(), side: vec![T::ZERO; symbolic.nrows()], memory })
    }

    fn factorise(
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

    fn solve(&mut self, symbolic: &SymbolicCholesky<u32>, x: &mut [DVec3]) {
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

/// ‖x‖₂.
fn norm(x: &[DVec3]) -> f64 {
    x.iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
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
