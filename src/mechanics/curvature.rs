//! Curvature of the energy about a state of equilibrium: its softest directions, and the directions in which it decreases.
//!
//! H is the true Hessian of membrane and bending, plus the stiffness of contact and friction as it is in that state. B is a positive
//! definite matrix near H that has been factorised: the projected Hessian of Newton's method.
//! With B = L Lᵀ, Lanczos' method on L⁻¹ H L⁻ᵀ finds the smallest λ with H z = λ B z, z = L⁻ᵀ y. Most of the spectrum lies near one, so
//! soft and negative directions are separated from it and converge first. By Sylvester's law of inertia the number of negative λ equals the
//! number of independent directions in which the energy decreases, for any B; a factor in single precision therefore suffices. (On B⁻¹H in the
//! inner product of B, which needs no half solves, each vector and B times it diverge by rounding; after some 28 steps only
//! rounding is left.)
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | H, B | true Hessian, and the factorised matrix near it | N/m |
//! | λ | curvature relative to B | – |
//! | L | factor of B | √(N/m) |
//! | z | direction over all free vertices, of norm one by B | m |
//!
//! Source: Lanczos' method for a pencil (Parlett: "The Symmetric Eigenvalue Problem", chapter 15), with full reorthogonalisation. Limits:
//! contacts are constant, so a direction that lifts cloth off the body is not found; λ is an upper bound, and the method ends once the smallest is
//! known, so that of several negative ones some may be missed.

use glam::{DMat3, DVec3};

use super::energy::sparsity::Pattern;
use super::linear_algebra::{Basis, dot_flat, symmetric_eigen};
use super::newton::Solver;

/// Most steps of Lanczos' method that decide whether an equilibrium is stable. Evidence: of some twenty searches none found a negative λ
/// later.
pub(crate) const MAX_LANCZOS_STEPS: usize = 40;

/// Ratio of the residual of the smallest λ to it below which the search ends: an eigenvalue is within this share of it. Evidence: of thirteen
/// searches each ends after 8 to 28 steps.
const CONVERGED: f64 = 0.05;

/// Steps between two checks of that.
const CHECK_INTERVAL: usize = 4;

/// Damping ε in B for that decision, 1/s²: under a thousandth of the squared frequency of hanging cloth (g over a metre).
pub(crate) const LANCZOS_DAMPING: f64 = 1e-2;

/// λ below this is negative; above, it may be rounding.
pub(crate) const NEGATIVE_CURVATURE: f64 = -1e-6;

/// Ratio of the norm of a Lanczos vector after orthogonalisation to that before below which it is rounding in single precision: the space is
/// exhausted.
const EXHAUSTED: f64 = 1e-6;

/// H over the free vertices in elimination order.
pub(crate) struct HessianOperator<'a> {
    pub(crate) pattern: &'a Pattern,
    /// N/m.
    pub(crate) blocks: &'a [DMat3],
}

/// Ritz values and vectors of the smallest λ.
pub(crate) struct Ritz {
    /// λ, ascending.
    pub(crate) values: Vec<f64>,
    /// z of the smallest λ, and of all negative ones.
    pub(crate) vectors: Vec<Vec<DVec3>>,
}

impl HessianOperator<'_> {
    /// H z.
    pub(crate) fn apply(&self, z: &[DVec3]) -> Vec<DVec3> {
        let mut product = Vec::new();
        self.pattern.multiply(self.blocks, z, &mut product);
        product
    }

    /// Lanczos' method with the factor in `solver`; a step costs a solve and a product.
    pub(crate) fn lanczos(&self, max_steps: usize, solver: &mut Solver) -> Ritz {
        let n = self.pattern.unknowns();
        let mut basis = Basis::default();
        let size = max_steps.min(3 * n);
        // Row by row.
        let mut matrix = vec![0.0; size * size];
        let ritz = |matrix: &[f64], steps: usize| {
            symmetric_eigen((0..steps).flat_map(|i| matrix[i * size..][..steps].iter().copied()).collect(), steps)
        };
        // A start without symmetry, the same on every machine: multiples of the golden section.
        let start = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let begin: Vec<DVec3> =
            (0..n).map(|i| DVec3::new(start(3 * i + 1), start(3 * i + 2), start(3 * i + 3))).collect();
        let mut y = solver.lower(&begin);
        let mut steps = 0;
        while steps < size {
            let norm_before = dot_flat(&y, &y).sqrt();
            // First against the last two vectors, which suffices in exact arithmetic; then against all, for rounding.
            for first in [steps.saturating_sub(2), 0] {
                let shares = basis.transposed_times(first, &y);
                basis.subtract(first, &shares, &mut y);
            }
            let norm = dot_flat(&y, &y).sqrt();
            // The norm is NaN where there is no unknown.
            if norm.is_nan() || norm <= EXHAUSTED * norm_before {
                break;
            }
            if steps > 0 && steps.is_multiple_of(CHECK_INTERVAL) {
                let (values, shares) = ritz(&matrix, steps);
                // The residual of the smallest Ritz value.
                if norm * shares[0][steps - 1].abs() <= CONVERGED * values[0].abs() {
                    break;
                }
            }
            y.iter_mut().for_each(|y| *y /= norm);
            let product = self.apply(&solver.upper(&y));
            basis.push(std::mem::replace(&mut y, solver.lower(&product)));
            // The whole row instead of its two entries: the factor is in single precision.
            for (j, value) in basis.transposed_times(0, &y).into_iter().enumerate() {
                matrix[steps * size + j] = value;
                matrix[j * size + steps] = value;
            }
            steps += 1;
        }
        let (values, shares) = ritz(&matrix, steps);
        let wanted = values.iter().filter(|l| **l < NEGATIVE_CURVATURE).count().max(1);
        let vector = |k: usize| shares.get(k).map_or(vec![DVec3::ZERO; n], |shares| solver.upper(&basis.times(shares)));
        let vectors = (0..wanted).map(vector).collect();
        Ritz { values, vectors }
    }
}
