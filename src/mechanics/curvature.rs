//! How the energy curves about a state of rest: the softest ways out of it, and those on which it falls.
//!
//! H is the Hessian of gravity, membrane and bending as it is, by differences of the gradient, with what contact and friction hold as
//! they hold it there. B is any positive matrix near to it that is factorised: Newton's own, where what is negative was taken away.
//! With B = L Lᵀ, Lanczos' method on L⁻¹ H L⁻ᵀ finds the smallest λ with H z = λ B z, z = L⁻ᵀ y; most of the spectrum lies near one, so
//! what is soft or negative stands apart and comes first. By Sylvester's law there are as many negative λ as H has ways on which the energy
//! falls, whatever B, so that of single precision does. (On B⁻¹H in the inner product of B, which needs no halves of a solve, each vector
//! and B times it part a little more every step, and after some 28 nothing is left but rounding.)
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | H, B | Hessian, and what Newton takes for it | N/m |
//! | λ | curvature relative to B | – |
//! | L | B's factor | √(N/m) |
//! | z | a way out, of every free vertex, of length one by B | m |
//!
//! Source: Lanczos' method for a pencil (Parlett: "The Symmetric Eigenvalue Problem", chapter 15), with full reorthogonalisation. Limits:
//! contacts are kept as they are, so a way out that lifts cloth off the body is not seen; λ is that of so many steps, an upper bound.

use faer::{Mat, Side};
use glam::DVec3;

use super::columns::{Columns, dot};
use super::energy::{Cloth, Contacts, Held, HessianLayout, Scratch};
use super::newton::Solver;

/// Steps of Lanczos' method for whoever asks whether a rest lasts.
pub(crate) const STEPS: usize = 40;

/// Damping ε in their B, 1/s²: under a thousandth of what a hanging cloth swings with (g over a metre).
pub(crate) const DAMPING: f64 = 1e-2;

/// Longest move of a vertex in a difference of the gradient, m: the cloth's own non-linearity is of the order of its edges, a centimetre.
const DIFFERENCE: f64 = 1e-6;

/// λ above this is no way out but rounding.
pub(crate) const NEGATIVE: f64 = -1e-6;

/// What is left of a step over what it was, under which it is rounding in single precision: the ways there are have been found.
const EXHAUSTED: f64 = 1e-6;

/// Steps after which the lowest λ is asked for again, and the changes of it that end a search: one that leads out need not be known well;
/// of none one must be sure. Of some twenty searches none that had changed by less than a hundredth found a way out later.
const AGAIN: usize = 4;
const SETTLED: f64 = 0.05;
const SURE: f64 = 0.01;

/// How long to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Until {
    /// Steps at most.
    pub(crate) steps: usize,
    /// λ under which a way leads out, if that alone is asked: once it has settled which side the lowest is on, that is enough.
    pub(crate) clear: Option<f64>,
}

/// H, over the free vertices in elimination order.
pub(crate) struct Curved<'a> {
    pub(crate) cloth: &'a Cloth,
    pub(crate) layout: &'a HessianLayout,
    /// Where, m.
    pub(crate) x: &'a [DVec3],
    pub(crate) held: Vec<Held>,
}

/// What Lanczos' method has found.
pub(crate) struct Ritz {
    /// λ, ascending.
    pub(crate) values: Vec<f64>,
    /// z of the lowest, and of all that are negative.
    pub(crate) vectors: Vec<Vec<DVec3>>,
}

impl Curved<'_> {
    /// Values of the unknowns, in their order.
    pub(crate) fn gather(&self, all: &[DVec3]) -> Vec<DVec3> {
        self.layout.order.iter().map(|&v| all[v as usize]).collect()
    }

    /// Values of all vertices, zero where held.
    pub(crate) fn scatter(&self, unknowns: &[DVec3]) -> Vec<DVec3> {
        let mut all = vec![DVec3::ZERO; self.x.len()];
        for (&v, z) in self.layout.order.iter().zip(unknowns) {
            all[v as usize] = *z;
        }
        all
    }

    /// H z.
    pub(crate) fn turned(&self, z: &[DVec3], scratch: &mut Scratch) -> Vec<DVec3> {
        let longest = z.iter().map(|z| z.length()).fold(0.0, f64::max);
        let h = DIFFERENCE / longest.max(f64::MIN_POSITIVE);
        let whole = self.scatter(z);
        let mut gradient_at = |h: f64| {
            let there: Vec<DVec3> = self.x.iter().zip(&whole).map(|(x, z)| *x + *z * h).collect();
            let mut gradient = Vec::new();
            self.cloth.evaluate(&there, &Contacts::none(), &mut gradient, scratch);
            gradient
        };
        let (ahead, behind) = (self.gather(&gradient_at(h)), self.gather(&gradient_at(-h)));
        let differences = ahead.iter().zip(&behind).map(|(a, b)| (*a - *b) / (2.0 * h));
        let mut turned: Vec<DVec3> = differences.collect();
        for (members, block) in &self.held {
            let across: DVec3 = members.iter().map(|&(i, w)| z[i as usize] * w).sum();
            members.iter().for_each(|&(i, w)| turned[i as usize] += *block * across * w);
        }
        turned
    }

    /// As many steps as asked for, by the factor in `solver`; each costs a solve with it and two gradients.
    pub(crate) fn lanczos(&self, until: Until, solver: &mut Solver) -> Ritz {
        let n = self.layout.order.len();
        let mut basis = Columns::default();
        let mut scratch = Scratch::default();
        let mut matrix = Mat::<f64>::zeros(until.steps.min(3 * n), until.steps.min(3 * n));
        // A start that leans to no side, the same on every machine: multiples of the golden section.
        let start = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let begin: Vec<DVec3> =
            (0..n).map(|i| DVec3::new(start(3 * i + 1), start(3 * i + 2), start(3 * i + 3))).collect();
        let mut y = solver.lower(&begin);
        let (mut steps, mut before) = (0, 0.0);
        while steps < matrix.nrows() {
            let whole = dot(&y, &y).sqrt();
            // Of the last two first, which in exact arithmetic are all there is to take off; then of all, what rounding has left.
            for first in [steps.saturating_sub(2), 0] {
                let shares = basis.times(first, &y);
                basis.less(first, &shares, &mut y);
            }
            let length = dot(&y, &y).sqrt();
            // Also where nothing was there.
            if length.is_nan() || length <= EXHAUSTED * whole {
                break;
            }
            y.iter_mut().for_each(|y| *y /= length);
            let turned = self.turned(&solver.upper(&y), &mut scratch);
            basis.push(std::mem::replace(&mut y, solver.lower(&turned)));
            // The whole row, not two of its numbers: H is by differences, and only nearly symmetric.
            for (j, value) in basis.times(0, &y).into_iter().enumerate() {
                matrix[(steps, j)] = value;
                matrix[(j, steps)] = value;
            }
            steps += 1;
            if steps % AGAIN == 0 {
                let lowest = lowest_of(&matrix, steps);
                let still = |clear: f64| if lowest < clear { SETTLED } else { SURE };
                if until.clear.is_some_and(|clear| (lowest - before).abs() < still(clear) * before.abs()) {
                    break;
                }
                before = lowest;
            }
        }
        let small = matrix.submatrix(0, 0, steps, steps).to_owned();
        let Ok(eigen) = small.self_adjoint_eigen(Side::Lower) else {
            return Ritz { values: Vec::new(), vectors: vec![vec![DVec3::ZERO; n]] };
        };
        let values: Vec<f64> = (0..steps).map(|i| eigen.S()[i]).collect();
        let wanted = values.iter().filter(|l| **l < NEGATIVE).count().max(1);
        let vector = |k: usize| {
            let shares: Vec<f64> = (0..steps).map(|i| eigen.U()[(i, k)]).collect();
            if k < steps { solver.upper(&basis.sum(&shares)) } else { vec![DVec3::ZERO; n] }
        };
        let vectors = (0..wanted).map(vector).collect();
        Ritz { values, vectors }
    }
}

/// The lowest λ after so many steps.
fn lowest_of(matrix: &Mat<f64>, steps: usize) -> f64 {
    let small = matrix.submatrix(0, 0, steps, steps).to_owned();
    small.self_adjoint_eigenvalues(Side::Lower).map_or(0.0, |values| values[0])
}
