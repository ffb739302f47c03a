//! Whether a drape is a minimum of its energy, how soft the softest way out is, and how far rest would be.
//!
//! H is what `mechanics::curvature` has, with what holds the touching vertices: κ A n nᵀ along the normal and, where friction has
//! something left, μ_f N/ε across it. B is the same with every triangle's negative part taken away (as Newton's steps have it) and a
//! damping ε M, so it can be factorised.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ω² | zᵀHz / zᵀMz of the lowest: negative where the cloth would leave | 1/s² |
//! | r | force that nothing balances ([`reactions`](crate::mechanics::reactions)) | N |
//! | d | −B⁻¹ r: the next Newton step | m |
//!
//! Limits: contacts are kept as they are, so a way out that lifts cloth off the body is not seen; ω² is that of [`STEPS`] steps of
//! Lanczos' method, an upper bound.

use glam::{DMat3, DVec3};

use crate::mechanics::curvature::{Curved, DAMPING, NEGATIVE, STEPS, Until};
use crate::mechanics::energy::friction::ELASTIC_SLIP;
use crate::mechanics::energy::membrane::outer;
use crate::mechanics::energy::{Cloth, Contacts, Scratch};
use crate::mechanics::newton::dot;
use crate::mechanics::reactions::Forces;
use crate::mechanics::refine::{SolveError, Solver};

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
    pub(crate) fn new(cloth: &Cloth, forces: &Forces, x: &[DVec3]) -> Result<Self, SolveError> {
        let pushing = || forces.touching.iter().filter(|t| t.normal_n > 0.0);
        let pairs = pushing().flat_map(|t| t.shares.iter().flat_map(|(a, _)| t.shares.iter().map(|(b, _)| [*a, *b])));
        let layout = cloth.layout_with(x, pairs);
        let mut blocks = Vec::new();
        cloth.hessian_in(&layout, false, x, &Contacts::none(), &mut blocks);
        let mut held = Vec::new();
        for t in pushing() {
            let along = outer(t.normal, t.normal);
            let across = if t.sticks { t.friction * t.normal_n / ELASTIC_SLIP } else { 0.0 };
            let block = along * t.stiffness + (DMat3::IDENTITY - along) * across;
            let members = layout.free(t.shares.iter().copied());
            layout.add(&members, block, &mut blocks);
            held.push((members, block));
        }
        let damped: Vec<f64> = layout.order.iter().map(|&v| cloth.masses[v as usize] * DAMPING).collect();
        let curved = Curved { cloth, layout: &layout, x, held };
        let mut solver = Solver::new(&layout.pattern);
        let mut step = curved.gather(&forces.rest);
        step.iter_mut().for_each(|d| *d = -*d);
        solver.solve(&layout.pattern, &blocks, &damped, true, &mut step)?;
        let ritz = curved.lanczos(Until { steps: STEPS, clear: None }, &mut solver);
        let softest = &ritz.vectors[0];
        let turned = curved.turned(softest, &mut Scratch::default());
        let mass: f64 =
            softest.iter().zip(&layout.order).map(|(z, &v)| cloth.masses[v as usize] * z.length_squared()).sum();
        let farthest =
            (0..softest.len()).fold(0, |most, i| if softest[i].length() > softest[most].length() { i } else { most });
        Ok(Self {
            lowest: dot(softest, &turned) / mass,
            ways_out: ritz.values.iter().filter(|&&l| l < NEGATIVE).count(),
            at: layout.order.get(farthest).map_or(0, |&v| v as usize),
            step: curved.scatter(&step),
        })
    }
}
