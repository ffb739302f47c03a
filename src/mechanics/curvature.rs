//! How the energy curves about a state of rest: the softest ways out of it, and those on which it falls.
//!
//! H is the Hessian of gravity, membrane and bending as it is, by differences of the gradient, with what contact and friction hold as
//! they hold it there. B is any positive matrix near to it that is factorised: Newton's own, where what is negative was taken away.
//! Lanczos' method on B⁻¹H in the inner product of B finds the smallest λ with H z = λ B z; most of the spectrum lies at one, so what
//! is soft or negative stands apart and comes first. By Sylvester's law there are as many negative λ as H has ways on which the energy
//! falls, whatever B.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | H, B | Hessian, and what Newton takes for it | N/m |
//! | λ | curvature relative to B | – |
//! | z | a way out, of every free vertex, of length one by B | m |
//!
//! Source: Lanczos' method for a pencil (Parlett: "The Symmetric Eigenvalue Problem", chapter 15), with full reorthogonalisation. Limits:
//! contacts are kept as they are, so a way out that lifts cloth off the body is not seen; λ is that of so many steps, an upper bound.

use faer::{Mat, Side};
use glam::DVec3;

use super::columns::{Columns, dot, flat, vectors};
use super::energy::{Cloth, Contacts, Held, HessianLayout, Scratch};
use super::newton::SolveError;

/// Steps of Lanczos' method for whoever asks whether a rest lasts.
pub(crate) const STEPS: usize = 40;

/// Damping ε in their B, 1/s²: under a thousandth of what a hanging cloth swings with (g over a metre).
pub(crate) const DAMPING: f64 = 1e-2;

/// Longest move of a vertex in a difference of the gradient, m: the cloth's own non-linearity is of the order of its edges, a centimetre.
const DIFFERENCE: f64 = 1e-6;

/// λ above this is no way out but rounding.
pub(crate) const NEGATIVE: f64 = -1e-6;

/// Steps after which the lowest λ is asked for again, and the change of it that ends a search for a negative one.
const AGAIN: usize = 4;
const SETTLED: f64 = 0.05;

/// How long to search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Until {
    /// Steps at most.
    pub(crate) steps: usize,
    /// A λ under this, and settled, is enough.
    pub(crate) clear: f64,
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

    /// As many steps as asked for, with `solve` for B⁻¹ r in place; each costs that and two gradients.
    pub(crate) fn lanczos(
        &self,
        until: Until,
        mut solve: impl FnMut(&mut [DVec3]) -> Result<(), SolveError>,
    ) -> Result<Ritz, SolveError> {
        let n = self.layout.order.len();
        let (mut basis, mut turned) = (Columns::default(), Columns::default());
        let mut scratch = Scratch::default();
        let mut matrix = Mat::<f64>::zeros(until.steps.min(3 * n), until.steps.min(3 * n));
        // A start that leans to no side, the same on every machine: multiples of the golden section.
        let start = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let mut r: Vec<DVec3> =
            (0..n).map(|i| DVec3::new(start(3 * i + 1), start(3 * i + 2), start(3 * i + 3))).collect();
        let (mut steps, mut before) = (0, 0.0);
        while steps < matrix.nrows() {
            let mut w = r.clone();
            solve(&mut w)?;
            let (mut w, mut v) = (flat(&w), flat(&r));
            // Of the last two first, which in exact arithmetic are all there is to take off; then of all, what rounding has left.
            for first in [steps.saturating_sub(2), 0] {
                let shares = turned.times(first, &w);
                basis.less(first, &shares, &mut w);
                turned.less(first, &shares, &mut v);
            }
            let length = dot(&w, &v).max(0.0).sqrt();
            if length <= 1e-12 || length.is_nan() {
                break;
            }
            w.iter_mut().chain(&mut v).for_each(|x| *x /= length);
            r = self.turned(&vectors(&w), &mut scratch);
            basis.push(w);
            turned.push(v);
            // The whole row, not two of its numbers: H is by differences, and only nearly symmetric.
            for (j, value) in basis.times(0, &flat(&r)).into_iter().enumerate() {
                matrix[(steps, j)] = value;
                matrix[(j, steps)] = value;
            }
            steps += 1;
            if steps % AGAIN == 0 {
                let lowest = lowest_of(&matrix, steps);
                if lowest < until.clear && lowest > (1.0 + SETTLED) * before {
                    break;
                }
                before = lowest;
            }
        }
        let small = matrix.submatrix(0, 0, steps, steps).to_owned();
        let Ok(eigen) = small.self_adjoint_eigen(Side::Lower) else {
            return Ok(Ritz { values: Vec::new(), vectors: vec![vec![DVec3::ZERO; n]] });
        };
        let values: Vec<f64> = (0..steps).map(|i| eigen.S()[i]).collect();
        let wanted = values.iter().filter(|l| **l < NEGATIVE).count().max(1);
        let vector = |k: usize| {
            let shares: Vec<f64> = (0..steps).map(|i| eigen.U()[(i, k)]).collect();
            vectors(&basis.sum(&shares))
        };
        let vectors = (0..wanted).map(|k| if k < steps { vector(k) } else { vec![DVec3::ZERO; n] }).collect();
        Ok(Ritz { values, vectors })
    }
}

/// The lowest λ after so many steps.
fn lowest_of(matrix: &Mat<f64>, steps: usize) -> f64 {
    let small = matrix.submatrix(0, 0, steps, steps).to_owned();
    small.self_adjoint_eigenvalues(Side::Lower).map_or(0.0, |values| values[0])
}
