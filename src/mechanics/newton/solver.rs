//! Direct solve of (∇²E + ε M) d = b: sparse Cholesky, analysed once a garment, refactored in place.
//!
//! LLᵀ by fronts in the garment's own elimination order (`factor.rs`), with the same bits on any number of threads.
//!
//! It factors in single precision, which takes half the time, and refines the solution in double: d ← d + S⁻¹ (b − A d) until
//! what is left of b is under [`REFINEMENT_TOLERANCE`] (iterative refinement; Higham: "Accuracy and Stability of Numerical Algorithms",
//! chapter 12). That works while the matrix's condition is under some 1e7: for knits, and for wovens while they are soft. The
//! first time it does not, or a pivot is lost that double precision holds, the solver takes double from then on.
//!
//! A positive matrix may lose a pivot in double, too: by rounding, where triangles are drawn a thousand times too large beside their neighbours,
//! or because a body that goes through itself is no body to its gradients. Shares of the sum of each row are then added to the diagonal.
//! Scaled to a unit diagonal, a matrix is factorised wherever its least eigenvalue is over some n times the rounding (Higham, theorem 10.7),
//! which the first share is; with the last one, the diagonal outweighs its row, and any finite matrix is positive (Gershgorin).

use glam::{DMat3, DVec3};

use super::factor::{Factor, Matrix, SolveError};
use super::symbolic::{Front, SymbolicFactor};
use crate::mechanics::energy::sparsity::Pattern;
use crate::mechanics::linear_algebra::norm;

/// Largest residual of a refined solution, relative to the right side.
const REFINEMENT_TOLERANCE: f64 = 1e-3;

/// Most steps of iterative refinement: each reduces the error by the condition number times 1e-7.
const MAX_REFINEMENTS: usize = 4;

/// Shares of the sums of its rows that are added to the diagonal of a matrix which double precision loses, one after the other.
const RIDGES: [f64; 6] = [1e-13, 1e-11, 1e-9, 1e-6, 1e-3, 2.0];

/// A factorisation whose pattern is fixed.
pub struct Solver {
    symbolic: SymbolicFactor,
    single: Option<Factor<f32>>,
    double: Factor<f64>,
}

impl std::fmt::Debug for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solver")
            .field("unknowns", &(3 * self.symbolic.order.len()))
            .field("factor", &self.factor_len())
            .finish()
    }
}

impl Solver {
    /// Analyses the pattern.
    #[must_use]
    pub fn new(pattern: &Pattern) -> Self {
        Self { symbolic: SymbolicFactor::new(pattern), single: Some(Factor::default()), double: Factor::default() }
    }

    /// Numbers in the factor: a measure of its cost.
    #[must_use]
    pub(crate) fn factor_len(&self) -> usize {
        self.symbolic.fronts.iter().map(Front::panel_len).sum()
    }

    /// Solves (A + D) x = b for the matrix A of `blocks` and the diagonal D of `diagonal` (N/m for each unknown vertex); `x`
    /// holds b, then the solution, in elimination order. Double precision takes over where single does not do.
    ///
    /// # Errors
    /// [`SolveError::NotPositive`] where a pivot is zero, negative or not a number; where only `positive` matrices are expected, one that
    /// single precision loses is tried in double, and then with more on its diagonal, so that numbers alone are refused which are not
    /// finite.
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
            match single.factorise(&self.symbolic, matrix) {
                Ok(()) if refined_solve(single, &self.symbolic, pattern, matrix, x) => return Ok(()),
                Err(lost) if !positive => return Err(lost),
                _ => self.single = None,
            }
        }
        self.factorise_in_double(pattern, matrix, positive)?;
        self.double.solve(&self.symbolic, x);
        Ok(())
    }

    fn factorise_in_double(&mut self, pattern: &Pattern, matrix: Matrix<'_>, positive: bool) -> Result<(), SolveError> {
        let mut done = self.double.factorise(&self.symbolic, matrix);
        if done.is_ok() || !positive {
            return done;
        }
        let sums = row_sums(pattern, matrix);
        for share in RIDGES {
            let raised =
                matrix.diagonal.iter().zip(&sums).map(|(shift, sum)| shift + share * sum + f64::MIN_POSITIVE.sqrt());
            let diagonal: Vec<f64> = raised.collect();
            done = self.double.factorise(&self.symbolic, Matrix { diagonal: &diagonal, ..matrix });
            if done.is_ok() {
                break;
            }
        }
        done
    }

    /// L⁻¹ x with the factor of the last [`solve`](Self::solve), L Lᵀ being a positive definite matrix near that one; in the order of elimination.
    pub(crate) fn lower(&mut self, x: &[DVec3]) -> Vec<f64> {
        let Self { symbolic, single, double } = self;
        single.as_mut().map_or_else(|| double.lower(symbolic, x), |single| single.lower(symbolic, x))
    }

    /// L⁻ᵀ y, y being as [`lower`](Self::lower) gives it.
    pub(crate) fn upper(&mut self, y: &[f64]) -> Vec<DVec3> {
        let Self { symbolic, single, double } = self;
        single.as_mut().map_or_else(|| double.upper(symbolic, y), |single| single.upper(symbolic, y))
    }
}

/// Solves with a factor in single precision and iterative refinement. Returns whether that converged; otherwise `x` is unchanged.
fn refined_solve(
    single: &mut Factor<f32>,
    symbolic: &SymbolicFactor,
    pattern: &Pattern,
    Matrix { blocks, diagonal }: Matrix<'_>,
    x: &mut [DVec3],
) -> bool {
    let right_side = x.to_vec();
    let tolerance = REFINEMENT_TOLERANCE * norm(&right_side);
    let mut residual = Vec::new();
    single.solve(symbolic, x);
    for _ in 0..=MAX_REFINEMENTS {
        pattern.multiply(blocks, x, &mut residual);
        for (((r, b), d), shift) in residual.iter_mut().zip(&right_side).zip(x.iter()).zip(diagonal) {
            *r = *b - *r - *d * *shift;
        }
        let left = norm(&residual);
        if left <= tolerance {
            return true;
        }
        if !left.is_finite() {
            break;
        }
        single.solve(symbolic, &mut residual);
        for (d, r) in x.iter_mut().zip(&residual) {
            *d += *r;
        }
    }
    x.copy_from_slice(&right_side);
    false
}

/// For each unknown a bound on what stands in each of its rows, N/m: added to the diagonal, it outweighs all beside it.
fn row_sums(pattern: &Pattern, Matrix { blocks, diagonal }: Matrix<'_>) -> Vec<f64> {
    let mut sums = diagonal.to_vec();
    for (column, range) in pattern.starts.windows(2).enumerate() {
        let range = range[0] as usize..range[1] as usize;
        for (block, &row) in blocks[range.clone()].iter().zip(&pattern.rows[range]) {
            let sum: f64 = block.to_cols_array().iter().map(|entry| entry.abs()).sum();
            sums[row as usize] += sum;
            if row as usize != column {
                sums[column] += sum;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::{Cloth, Contacts};
    use crate::mesh::samples::sheet;

    /// Nothing holds a sheet that has no mass in the matrix either: it may go anywhere, and the matrix is singular.
    #[test]
    fn matrices_that_lose_a_pivot_are_solved_and_non_finite_ones_are_refused() {
        let mesh = sheet(5, 5, |i, j| DVec3::new(i, 0.0, j) * 0.01);
        let cloth = Cloth::sample(&mesh, "denim", &[]);
        let mut blocks = Vec::new();
        cloth.hessian(&mesh.positions, &Contacts::none(), &mut blocks);
        let (pattern, none) = (cloth.pattern(), vec![0.0; mesh.vertex_count()]);
        // Forces that add up to nothing, turning included: some displacement balances them.
        let mut pull = vec![DVec3::ZERO; mesh.vertex_count()];
        for (i, &v) in cloth.order().iter().enumerate() {
            let row = (mesh.positions[v as usize].z / 0.01).round();
            pull[i].z = [-1e-2, 0.0, 0.0, 0.0, 0.0, 1e-2][row as usize];
        }
        let mut x = pull.clone();
        let mut solver = Solver::new(pattern);
        let lost = solver.solve(pattern, &blocks, &none, false, &mut x);
        assert!(matches!(lost, Err(SolveError::NotPositive { .. })), "{lost:?}");
        solver.solve(pattern, &blocks, &none, true, &mut x).unwrap();
        let mut back = Vec::new();
        pattern.multiply(&blocks, &x, &mut back);
        let off = back.iter().zip(&pull).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{off} N of a hundredth");
        // One that is not positive at all still gives a way to go, along which the energy falls.
        let own = pattern.starts[7] as usize;
        blocks[own] -= DMat3::from_diagonal(DVec3::splat(1e7));
        let mut way = pull.clone();
        solver.solve(pattern, &blocks, &none, true, &mut way).unwrap();
        assert!(way.iter().zip(&pull).map(|(d, b)| d.dot(*b)).sum::<f64>() > 0.0);
        blocks[0].x_axis.x = f64::NAN;
        let refused = solver.solve(pattern, &blocks, &none, true, &mut pull);
        assert!(matches!(refused, Err(SolveError::NotPositive { .. })), "{refused:?}");
    }
}
