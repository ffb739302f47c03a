//! Curvature of the energy about a drape: stability, softest mode, and the next Newton step.
//!
//! H is the Hessian of `mechanics::curvature` plus the stiffness of the touching vertices: κ A n nᵀ along the normal and, where
//! friction sticks, μ_f N/ε across it. B is the projected Hessian (without the negative part of each triangle, as in Newton's steps)
//! plus a damping ε M, so it can be factorised.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ω² | zᵀHz / zᵀMz of the lowest mode: negative at an unstable equilibrium | 1/s² |
//! | r | unbalanced force ([`reactions`](crate::mechanics::reactions)) | N |
//! | d | −B⁻¹ r: the next Newton step | m |
//!
//! Limits: contacts are fixed, so an instability that lifts cloth off the body is not detected; ω² comes from [`MAX_LANCZOS_STEPS`] steps of
//! Lanczos' method and is an upper bound.

use glam::{DMat3, DVec3};

use crate::mechanics::curvature::{
    HessianOperator, LANCZOS_DAMPING, LanczosOptions, MAX_LANCZOS_STEPS, NEGATIVE_CURVATURE,
};
use crate::mechanics::energy::friction::ELASTIC_SLIP;
use crate::mechanics::energy::membrane::outer;
use crate::mechanics::energy::{Cloth, ContactBlock, Contacts, HessianKind, Scratch};
use crate::mechanics::linear_algebra::dot;
use crate::mechanics::reactions::Forces;
use crate::mechanics::refine::{SolveError, Solver};

/// The curvature about a drape.
#[derive(Debug, Clone)]
pub struct Curvature {
    /// ω² of the softest mode, 1/s².
    pub lowest: f64,
    /// Number of modes of negative curvature.
    pub unstable_modes: usize,
    /// The vertex with the largest displacement in the softest mode.
    pub at: usize,
    /// The next Newton step of every vertex, m; zero where held.
    pub step: Vec<DVec3>,
}

impl Curvature {
    /// The curvature of `cloth` about `x` (m), with the reactions of `forces`.
    ///
    /// # Errors
    /// [`SolveError`] if B cannot be factorised.
    pub(crate) fn new(cloth: &Cloth, forces: &Forces, x: &[DVec3]) -> Result<Self, SolveError> {
        let pushing = || forces.reactions.iter().filter(|t| t.normal_n > 0.0);
        let pairs = pushing().flat_map(|t| t.shares.iter().flat_map(|(a, _)| t.shares.iter().map(|(b, _)| [*a, *b])));
        let layout = cloth.layout_with(x, pairs);
        let mut blocks = Vec::new();
        cloth.hessian_in(&layout, HessianKind::Projected, x, &Contacts::none(), &mut blocks);
        let mut contacts = Vec::new();
        for t in pushing() {
            let along = outer(t.normal, t.normal);
            let across = if t.sticks { t.friction * t.normal_n / ELASTIC_SLIP } else { 0.0 };
            let block = along * t.stiffness + (DMat3::IDENTITY - along) * across;
            let members = layout.free(t.shares.iter().copied());
            layout.add(&members, block, &mut blocks);
            contacts.push(ContactBlock { members, block });
        }
        let damped: Vec<f64> = layout.order.iter().map(|&v| cloth.masses[v as usize] * LANCZOS_DAMPING).collect();
        let hessian = HessianOperator { cloth, layout: &layout, x, contacts };
        let mut solver = Solver::new(&layout.pattern);
        let mut step = hessian.gather(&forces.residual_forces);
        step.iter_mut().for_each(|d| *d = -*d);
        solver.solve(&layout.pattern, &blocks, &damped, true, &mut step)?;
        let ritz = hessian.lanczos(LanczosOptions { max_steps: MAX_LANCZOS_STEPS, decisive: None }, &mut solver);
        let softest = &ritz.vectors[0];
        let turned = hessian.apply(softest, &mut Scratch::default());
        let mass: f64 =
            softest.iter().zip(&layout.order).map(|(z, &v)| cloth.masses[v as usize] * z.length_squared()).sum();
        let farthest =
            (0..softest.len()).fold(0, |most, i| if softest[i].length() > softest[most].length() { i } else { most });
        Ok(Self {
            lowest: dot(softest, &turned) / mass,
            unstable_modes: ritz.values.iter().filter(|&&l| l < NEGATIVE_CURVATURE).count(),
            at: layout.order.get(farthest).map_or(0, |&v| v as usize),
            step: hessian.scatter(&step),
        })
    }
}
