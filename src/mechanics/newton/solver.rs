//! Direct solve of (∇²E + ε M) d = b: sparse Cholesky, analysed once a garment, refactored in place.
//!
//! faer's supernodal LLᵀ in the garment's own elimination order. One thread does it all, so the bits do not depend on
//! how many there are.
//!
//! It factors in single precision, which takes half the time, and mends the solution in double: d ← d + S⁻¹ (b − A d) until
//! what is left of b is under [`REST`] (iterative refinement; Higham: "Accuracy and Stability of Numerical Algorithms",
//! chapter 12). That works while the matrix's condition is under some 1e7: for knits, and for wovens while they are soft. The
//! first time it does not, or a pivot is lost that double precision holds, the solver takes double from then on.

use glam::{DMat3, DVec3};

use super::factor::{Factor, Matrix};
use super::forest::{Forest, Front};
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
    forest: Forest,
    single: Option<Factor<f32>>,
    double: Factor<f64>,
}

impl std::fmt::Debug for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solver")
            .field("unknowns", &(3 * self.forest.order.len()))
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
        let forest = Forest::new(pattern);
        Ok(Self { forest, single: Some(Factor::default()), double: Factor::default() })
    }

    /// Numbers in the factor: a measure of its cost.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.forest.fronts.iter().map(Front::panel_len).sum()
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
        let matrix = Matrix { blocks, diagonal };
        if let Some(single) = &mut self.single {
            match single.factorise(&self.forest, matrix) {
                Ok(()) if mended(single, &self.forest, pattern, matrix, x) => return Ok(()),
                Err(lost) if !positive => return Err(lost),
                _ => self.single = None,
            }
        }
        self.double.factorise(&self.forest, matrix)?;
        self.double.solve(&self.forest, x);
        Ok(())
    }

    /// Solves once more with the matrix of the last [`solve`](Self::solve), whose factor is kept; where single precision does not do for
    /// this right side, it is factorised in double.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn solve_again(
        &mut self,
        pattern: &Pattern,
        blocks: &[DMat3],
        diagonal: &[f64],
        x: &mut [DVec3],
    ) -> Result<(), SolveError> {
        let matrix = Matrix { blocks, diagonal };
        if let Some(single) = &mut self.single {
            if mended(single, &self.forest, pattern, matrix, x) {
                return Ok(());
            }
            self.single = None;
            self.double.factorise(&self.forest, matrix)?;
        }
        self.double.solve(&self.forest, x);
        Ok(())
    }
}

/// Solves with a factor in single precision and mends the solution; where that fails, `x` is left as it was.
fn mended(
    single: &mut Factor<f32>,
    forest: &Forest,
    pattern: &Pattern,
    Matrix { blocks, diagonal }: Matrix<'_>,
    x: &mut [DVec3],
) -> bool {
    let side = x.to_vec();
    let most = REST * norm(&side);
    let mut rest = Vec::new();
    single.solve(forest, x);
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
        single.solve(forest, &mut rest);
        for (d, r) in x.iter_mut().zip(&rest) {
            *d += *r;
        }
    }
    x.copy_from_slice(&side);
    false
}

/// ‖x‖₂.
fn norm(x: &[DVec3]) -> f64 {
    x.iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
}
