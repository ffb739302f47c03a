//! Solves (∇²E + ε M) d = b by conjugate gradients, preconditioned by a sparse Cholesky factor.
//!
//! The factor L Lᵀ is that of a positive matrix near ∇²E + ε M, by fronts in the garment's own elimination order (`factor.rs`), with the same
//! bits on any number of threads. It is analysed once a garment and recomputed in place, in single precision, which takes half the time of
//! double. The gradients (Hestenes, Stiefel 1952) are in double. Where the factored matrix is ∇²E + ε M itself, (L Lᵀ)⁻¹(∇²E + ε M) is the identity
//! but for rounding, and one or two iterations are usual.
//!
//! ∇²E + ε M may be indefinite: the iterations end at a direction of negative curvature, and a solution before it is still a direction of descent; the
//! first one is (L Lᵀ)⁻¹ b (truncated Newton method; Steihaug 1983; Nocedal, Wright: "Numerical Optimization", 7.1).
//!
//! A positive matrix may lose a pivot by rounding: where stiffness is a million times that of a neighbour, where triangles are drawn a thousand
//! times too large, or because a body that goes through itself is no body to its gradients. Such a pivot is replaced by the diagonal entry of the
//! matrix, and the column below it by zero. Each changes the preconditioner by a matrix of rank two, which costs at most two
//! iterations of conjugate gradients.

use glam::{DMat3, DVec3};

use super::factor::{Factor, Matrix, SolveError};
use super::symbolic::{Front, SymbolicFactor};
use crate::mechanics::energy::sparsity::Pattern;
use crate::mechanics::linear_algebra::{dot, norm};

/// Most iterations of conjugate gradients. Of 51 solves of a dress in cotton, to a tenth of the right side, none took more than three.
const MAX_ITERATIONS: usize = 40;

/// A factorisation whose pattern is fixed.
pub struct Solver {
    symbolic: SymbolicFactor,
    factor: Factor,
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
        Self { symbolic: SymbolicFactor::new(pattern), factor: Factor::default() }
    }

    /// Numbers in the factor: a measure of its cost.
    #[must_use]
    pub(crate) fn factor_len(&self) -> usize {
        self.symbolic.fronts.iter().map(Front::panel_len).sum()
    }

    /// Factors A + D for a positive matrix A of `blocks` and the diagonal D of `diagonal`, N/m for each unknown vertex, in elimination order.
    ///
    /// # Errors
    /// [`SolveError::NotPositive`] where a number is not finite, [`SolveError::NoRoom`] without memory.
    pub fn factorise(&mut self, blocks: &[DMat3], diagonal: &[f64]) -> Result<(), SolveError> {
        self.factor.factorise(&self.symbolic, Matrix { blocks, diagonal })
    }

    /// Solves (A + D) x = b to a residual of `tolerance` times that of zero, with the factor of the last [`factorise`](Self::factorise) as
    /// preconditioner; `x` holds b, then the solution, in elimination order. A may be another matrix than the factored one, and indefinite:
    /// see the top of the file.
    pub fn solve(&mut self, pattern: &Pattern, blocks: &[DMat3], diagonal: &[f64], tolerance: f64, x: &mut [DVec3]) {
        let Self { symbolic, factor } = self;
        let mut residual = x.to_vec();
        let tolerance = tolerance * norm(&residual);
        factor.solve(symbolic, x);
        let (mut direction, mut image) = (x.to_vec(), Vec::new());
        let mut gamma = dot(&residual, &direction);
        for iteration in 0..MAX_ITERATIONS {
            pattern.multiply(blocks, &direction, &mut image);
            image.iter_mut().zip(&direction).zip(diagonal).for_each(|((q, p), shift)| *q += *p * *shift);
            let curvature = dot(&direction, &image);
            if curvature.is_nan() || curvature <= 0.0 {
                // The solution so far, or the first direction.
                return;
            }
            let alpha = gamma / curvature;
            if iteration == 0 {
                x.fill(DVec3::ZERO);
            }
            x.iter_mut().zip(&direction).for_each(|(x, p)| *x += *p * alpha);
            residual.iter_mut().zip(&image).for_each(|(r, q)| *r -= *q * alpha);
            if norm(&residual) <= tolerance {
                return;
            }
            image.copy_from_slice(&residual);
            factor.solve(symbolic, &mut image);
            let next = dot(&residual, &image);
            let beta = next / gamma;
            gamma = next;
            direction.iter_mut().zip(&image).for_each(|(p, z)| *p = *z + *p * beta);
        }
    }

    /// L⁻¹ x with the factor of the last [`factorise`](Self::factorise), in the order of elimination.
    pub(crate) fn lower(&mut self, x: &[DVec3]) -> Vec<f64> {
        self.factor.lower(&self.symbolic, x)
    }

    /// L⁻ᵀ y, y being as [`lower`](Self::lower) gives it.
    pub(crate) fn upper(&mut self, y: &[f64]) -> Vec<DVec3> {
        self.factor.upper(&self.symbolic, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::{Cloth, Contacts};
    use crate::mesh::samples::sheet;

    /// A sheet held at one edge: its pattern, projected Hessian, damping and a pull on every vertex, in elimination order.
    fn held_sheet() -> (Cloth, Vec<DMat3>, Vec<f64>, Vec<DVec3>) {
        let mesh = sheet(5, 5, |i, j| DVec3::new(i, 0.0, j) * 0.01);
        let cloth = Cloth::sample(&mesh, "denim", &[30, 31, 32, 33, 34, 35]);
        let mut blocks = Vec::new();
        cloth.hessian(&mesh.positions, &Contacts::none(), &mut blocks);
        let n = cloth.order().len();
        let pull = (0..n).map(|i| DVec3::new(0.3, 1.0, -0.7) * 1e-2 * (1.3 * i as f64).sin()).collect();
        (cloth, blocks, vec![0.5; n], pull)
    }

    #[test]
    fn a_matrix_other_than_the_factored_one_is_solved_to_the_tolerance() {
        let (cloth, factored, damping, pull) = held_sheet();
        let pattern = cloth.pattern();
        // Every fifth vertex also lies on something.
        let mut blocks = factored.clone();
        pattern.starts.iter().take(damping.len()).step_by(5).for_each(|&own| {
            blocks[own as usize] += DMat3::from_diagonal(DVec3::new(0.0, 50.0, 0.0));
        });
        let mut solver = Solver::new(pattern);
        solver.factorise(&factored, &damping).unwrap();
        let residual_of = |x: &[DVec3]| {
            let mut image = Vec::new();
            pattern.multiply(&blocks, x, &mut image);
            image.iter_mut().zip(x).zip(&damping).for_each(|((q, x), shift)| *q += *x * *shift);
            image.iter().zip(&pull).map(|(q, b)| (*q - *b).length_squared()).sum::<f64>().sqrt() / norm(&pull)
        };
        let solved = |solver: &mut Solver, tolerance| {
            let mut x = pull.clone();
            solver.solve(pattern, &blocks, &damping, tolerance, &mut x);
            x
        };
        let [coarse, fine] = [0.1, 1e-8].map(|tolerance| residual_of(&solved(&mut solver, tolerance)));
        assert!(fine <= 1e-8 && coarse <= 0.1 && coarse > 1e-6, "{coarse} {fine}");
        // The factor alone does not solve it.
        let mut unchanged = pull.clone();
        solver.solve(pattern, &factored, &damping, 1e-8, &mut unchanged);
        assert!(residual_of(&unchanged) > 0.1);
    }

    #[test]
    fn the_step_of_an_indefinite_matrix_points_downhill() {
        let (cloth, factored, damping, pull) = held_sheet();
        let pattern = cloth.pattern();
        let mut solver = Solver::new(pattern);
        solver.factorise(&factored, &damping).unwrap();
        let solved = |solver: &mut Solver, less: f64| {
            // Compressed cloth at one vertex.
            let mut blocks = factored.clone();
            blocks[pattern.starts[7] as usize] -= DMat3::from_diagonal(DVec3::splat(less));
            let mut x = pull.clone();
            solver.solve(pattern, &blocks, &damping, 1e-8, &mut x);
            x
        };
        // So far below zero that the first direction has negative curvature: it is the step.
        let first = solved(&mut solver, 1e6);
        for (less, goes_on) in [(10.0, true), (1e4, false)] {
            let x = solved(&mut solver, less);
            assert!(x.iter().zip(&pull).map(|(d, b)| d.dot(*b)).sum::<f64>() > 0.0, "{less}");
            let apart = x.iter().zip(&first).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max) / norm(&first);
            assert_eq!(apart > 1e-3, goes_on, "{less}: {apart}");
        }
    }

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
        solver.factorise(&blocks, &none).unwrap();
        solver.solve(pattern, &blocks, &none, 1e-4, &mut x);
        let mut back = Vec::new();
        pattern.multiply(&blocks, &x, &mut back);
        let off = back.iter().zip(&pull).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{off} N of a hundredth");
        // One that is not positive at all still gives a way to go, along which the energy falls.
        let own = pattern.starts[7] as usize;
        blocks[own] -= DMat3::from_diagonal(DVec3::splat(1e7));
        let mut way = pull.clone();
        solver.factorise(&blocks, &none).unwrap();
        solver.solve(pattern, &blocks, &none, 1e-4, &mut way);
        assert!(way.iter().zip(&pull).map(|(d, b)| d.dot(*b)).sum::<f64>() > 0.0);
        blocks[0].x_axis.x = f64::NAN;
        let refused = solver.factorise(&blocks, &none);
        assert!(matches!(refused, Err(SolveError::NotPositive { .. })), "{refused:?}");
    }
}
