//! How the energy curves about a drape: whether it is a minimum, how soft the softest way out is, and how far rest would be.
//!
//! H is the Hessian of gravity, membrane and bending as it is, by differences of the gradient, with what holds the touching vertices: κ A n nᵀ
//! along the normal and, where friction has something left, μ_f N/ε across it. B is the same with every triangle's negative part taken away
//! (as Newton's steps have it) and a damping ε M, so it can be factorised. Lanczos' method on B⁻¹H in the inner product of B finds the
//! smallest λ with H z = λ B z; most of the spectrum lies at one, so what is soft or negative stands apart and comes first.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | λ | curvature relative to B | – |
//! | ω² | zᵀHz / zᵀMz of the lowest: negative where the cloth would leave | 1/s² |
//! | r | force that nothing balances ([`reactions`](crate::mechanics::reactions)) | N |
//! | d | −B⁻¹ r: the next Newton step | m |
//!
//! Source: Lanczos' method for a pencil (Parlett: "The Symmetric Eigenvalue Problem", chapter 15), with full reorthogonalisation. Limits:
//! contacts are kept as they are, so a way out that lifts cloth off the body is not seen; λ is that of [`STEPS`] steps, an upper bound.

use faer::{Mat, Side};
use glam::{DMat3, DVec3};

use crate::mechanics::energy::friction::ELASTIC_SLIP;
use crate::mechanics::energy::membrane::outer;
use crate::mechanics::energy::pattern::HELD;
use crate::mechanics::energy::{Cloth, Contacts, HessianLayout};
use crate::mechanics::reactions::Forces;
use crate::mechanics::refine::{SolveError, Solver};

/// Steps of Lanczos' method.
const STEPS: usize = 40;

/// Damping in B, 1/s²: under a thousandth of what a hanging cloth swings with (g over a metre).
const DAMPING: f64 = 1e-2;

/// Longest move of a vertex in a difference of the gradient, m: the cloth's own non-linearity is of the order of its edges, a centimetre.
const DIFFERENCE: f64 = 1e-6;

/// λ above this is no way out but rounding.
const NEGATIVE: f64 = -1e-6;

/// The curvature about a drape.
#[derive(Debug, Clone)]
pub struct Curvature {
    /// ω² of the softest way, 1/s².
    pub lowest: f64,
    /// Ways on which the energy falls.
    pub ways_out: usize,
    /// The vertex that goes farthest on the softest.
    pub at: usize,
    /// The next Newton step of every vertex, m; zero where held.
    pub step: Vec<DVec3>,
}

impl Curvature {
    /// Of `cloth` about `x` (m), held up by `forces`.
    ///
    /// # Errors
    /// [`SolveError`] where B cannot be factorised.
    pub fn new(cloth: &Cloth, forces: &Forces, x: &[DVec3]) -> Result<Self, SolveError> {
        let mut pencil = Pencil::new(cloth, forces, x)?;
        let mut step: Vec<DVec3> = pencil.gather(&forces.rest);
        step.iter_mut().for_each(|d| *d = -*d);
        pencil.solver.solve(&pencil.layout.pattern, &pencil.blocks, &pencil.damped, true, &mut step)?;
        let (values, vector) = pencil.lanczos()?;
        let lowest = pencil.turned(&vector);
        let mass: f64 =
            vector.iter().zip(&pencil.layout.order).map(|(z, &v)| cloth.masses[v as usize] * z.length_squared()).sum();
        let farthest =
            (0..vector.len()).fold(0, |most, i| if vector[i].length() > vector[most].length() { i } else { most });
        Ok(Self {
            lowest: dot(&vector, &lowest) / mass,
            ways_out: values.iter().filter(|&&l| l < NEGATIVE).count(),
            at: pencil.layout.order.get(farthest).map_or(0, |&v| v as usize),
            step: pencil.scatter(&step),
        })
    }
}

/// H and B, over the free vertices in elimination order.
struct Pencil<'a> {
    cloth: &'a Cloth,
    layout: HessianLayout,
    x: &'a [DVec3],
    /// What contact adds to both: unknowns with their shares, and the matrix between them.
    contact: Vec<(Vec<(usize, f64)>, DMat3)>,
    solver: Solver,
    blocks: Vec<DMat3>,
    damped: Vec<f64>,
}

impl<'a> Pencil<'a> {
    fn new(cloth: &'a Cloth, forces: &Forces, x: &'a [DVec3]) -> Result<Self, SolveError> {
        let pushing = || forces.touching.iter().filter(|t| t.normal_n > 0.0);
        let pairs = pushing().flat_map(|t| t.shares.iter().flat_map(|(a, _)| t.shares.iter().map(|(b, _)| [*a, *b])));
        let layout = cloth.layout_with(x, pairs);
        let mut blocks = Vec::new();
        cloth.hessian_in(&layout, x, &Contacts::none(), &mut blocks);
        let mut contact = Vec::new();
        for t in pushing() {
            let along = outer(t.normal, t.normal);
            let across = if t.sticks { t.friction * t.normal_n / ELASTIC_SLIP } else { 0.0 };
            let block = along * t.stiffness + (DMat3::IDENTITY - along) * across;
            let free = t.shares.iter().map(|(v, w)| (layout.unknown[*v as usize], *w)).filter(|(i, _)| *i != HELD);
            let members: Vec<(u32, f64)> = free.collect();
            layout.add(&members, block, &mut blocks);
            contact.push((members.iter().map(|(i, w)| (*i as usize, *w)).collect(), block));
        }
        let damped = layout.order.iter().map(|&v| cloth.masses[v as usize] * DAMPING).collect();
        let solver = Solver::new(&layout.pattern)?;
        Ok(Self { cloth, layout, x, contact, solver, blocks, damped })
    }

    /// Values of the unknowns, in their order.
    fn gather(&self, all: &[DVec3]) -> Vec<DVec3> {
        self.layout.order.iter().map(|&v| all[v as usize]).collect()
    }

    /// Values of all vertices, zero where held.
    fn scatter(&self, unknowns: &[DVec3]) -> Vec<DVec3> {
        let mut all = vec![DVec3::ZERO; self.x.len()];
        for (&v, z) in self.layout.order.iter().zip(unknowns) {
            all[v as usize] = *z;
        }
        all
    }

    /// B⁻¹ r, in place, with the factor there is.
    fn solve(&mut self, r: &mut [DVec3]) -> Result<(), SolveError> {
        self.solver.solve_again(&self.layout.pattern, &self.blocks, &self.damped, r)
    }

    /// H z.
    fn turned(&self, z: &[DVec3]) -> Vec<DVec3> {
        let longest = z.iter().map(|z| z.length()).fold(0.0, f64::max);
        let h = DIFFERENCE / longest.max(f64::MIN_POSITIVE);
        let whole = self.scatter(z);
        let gradient_at = |h: f64| {
            let there: Vec<DVec3> = self.x.iter().zip(&whole).map(|(x, z)| *x + *z * h).collect();
            let mut gradient = Vec::new();
            self.cloth.gradient(&there, &Contacts::none(), &mut gradient);
            gradient
        };
        let (ahead, behind) = (self.gather(&gradient_at(h)), self.gather(&gradient_at(-h)));
        let differences = ahead.iter().zip(&behind).map(|(a, b)| (*a - *b) / (2.0 * h));
        let mut turned: Vec<DVec3> = differences.collect();
        for (members, block) in &self.contact {
            let across: DVec3 = members.iter().map(|&(i, w)| z[i] * w).sum();
            members.iter().for_each(|&(i, w)| turned[i] += *block * across * w);
        }
        turned
    }

    /// The Ritz values, ascending, and the vector of the lowest.
    fn lanczos(&mut self) -> Result<(Vec<f64>, Vec<DVec3>), SolveError> {
        let n = self.layout.order.len();
        let (mut basis, mut turned): (Vec<Vec<DVec3>>, Vec<Vec<DVec3>>) = (Vec::new(), Vec::new());
        let mut matrix = Mat::<f64>::zeros(STEPS.min(3 * n), STEPS.min(3 * n));
        // A start that leans to no side, the same on every machine: multiples of the golden section.
        let start = |i: usize| (i as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let mut r: Vec<DVec3> =
            (0..n).map(|i| DVec3::new(start(3 * i + 1), start(3 * i + 2), start(3 * i + 3))).collect();
        let mut steps = 0;
        while steps < matrix.nrows() {
            let mut w = r.clone();
            self.solve(&mut w)?;
            // Twice is enough (Parlett, section 6.9).
            for _ in 0..2 {
                for (v, u) in basis.iter().zip(&turned) {
                    let share = dot(&w, u);
                    add(&mut w, v, -share);
                    add(&mut r, u, -share);
                }
            }
            let length = dot(&w, &r).max(0.0).sqrt();
            if length <= 1e-12 || length.is_nan() {
                break;
            }
            for (w, r) in w.iter_mut().zip(&mut r) {
                *w /= length;
                *r /= length;
            }
            let hv = self.turned(&w);
            basis.push(w);
            turned.push(std::mem::replace(&mut r, hv));
            // The whole row, not two of its numbers: H is by differences, and only nearly symmetric.
            for (j, v) in basis.iter().enumerate() {
                let value = dot(v, &r);
                matrix[(steps, j)] = value;
                matrix[(j, steps)] = value;
            }
            steps += 1;
        }
        let small = matrix.submatrix(0, 0, steps, steps).to_owned();
        let Ok(eigen) = small.self_adjoint_eigen(Side::Lower) else { return Ok((Vec::new(), vec![DVec3::ZERO; n])) };
        let values: Vec<f64> = (0..steps).map(|i| eigen.S()[i]).collect();
        let mut vector = vec![DVec3::ZERO; n];
        for (i, v) in basis.iter().enumerate() {
            add(&mut vector, v, eigen.U()[(i, 0)]);
        }
        Ok((values, vector))
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// a ← a + t b.
fn add(a: &mut [DVec3], b: &[DVec3], t: f64) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += *b * t;
    }
}
