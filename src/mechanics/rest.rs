//! Criteria of rest: the one judgement of a drape and of its certificate.
//!
//! A cloth is at rest where admissible reactions balance its forces ([`Forces`]), the next Newton step hardly moves it, and the energy has
//! a minimum ([`Curvature`]). All three follow from the positions alone: neither contacts nor friction anchors of a solver are used. The
//! solver checks a state by these criteria before it reports convergence; a certificate states their values.
//!
//! | criterion | quantity | source of the limit |
//! |---|---|---|
//! | residual | ‖r‖₂ over the weight, r the unbalanced force | the solver's own tolerance |
//! | forces add up | \|Σ reactions − weight\| over the weight | one percent |
//! | friction | tangential force beyond μN, and pull towards the body, over the weight | the same |
//! | still moving | share of vertices that the next Newton step moves by over a millimetre | GarmentCode's simulator calls 1.5 % static |
//! | distance to rest | RMS of that step, mm | thickness of a garment's cloth |
//! | lowest curvature | ω² of the softest mode, 1/s²: negative at an unstable equilibrium | rounding |
//!
//! **Curvature.** H is the Hessian of `mechanics::curvature` plus the stiffness k of the touching vertices: k n nᵀ along the normal
//! ([`Reaction::stiffness`](super::reactions::Reaction)) and, where friction sticks, μ_f N/ε across it. B is the projected Hessian (without the negative part of each triangle, as in Newton's steps)
//! plus a damping ε M, so it can be factorised.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ω² | zᵀHz / zᵀMz of the lowest mode: negative at an unstable equilibrium | 1/s² |
//! | r | unbalanced force ([`reactions`](crate::mechanics::reactions)) | N |
//! | d | −B⁻¹ r: the next Newton step | m |
//!
//! Limits: contacts are fixed, so an instability that lifts cloth off the body is not detected; ω² comes from at most `MAX_LANCZOS_STEPS` steps of
//! Lanczos' method and is an upper bound.

use glam::{DMat3, DVec3};

use super::curvature::{HessianOperator, LANCZOS_DAMPING, MAX_LANCZOS_STEPS, NEGATIVE_CURVATURE};
use super::energy::friction::ELASTIC_SLIP;
use super::energy::membrane::outer;
use super::energy::{Cloth, Contacts, HessianKind, HessianLayout};
use super::linear_algebra::dot;
use super::newton::{FullSpace, SolveError, Solver};
use super::reactions::{Forces, MAX_RESIDUAL, Reaction};
use crate::body::distance::Body;

/// Largest difference of reactions and weight, over the weight. It exceeds [`MAX_RESIDUAL`], because residual forces in one direction add
/// up.
const MAX_IMBALANCE: f64 = 1e-2;

/// A vertex counts as moving if the next Newton step would displace it by more than this, m.
const MOVING_M: f64 = 1e-3;

/// Largest share of moving vertices: the limit of GarmentCode's simulator (2024) for a static garment.
const MAX_MOVING_SHARE: f64 = 0.015;

/// Largest RMS of the next Newton step, mm: the thickness of a thick cloth.
const MAX_STEP_RMS_MM: f64 = 1.0;

/// Least ω² of a stable equilibrium, 1/s². Modes between this value and zero need more than ten seconds to grow by a factor e and are
/// not distinguishable from rounding.
const MIN_CURVATURE: f64 = -1e-2;

/// Largest residual of the next Newton step, relative to that of the forces: soft directions move far by little force.
const STEP_TOLERANCE: f64 = 1e-4;

/// One criterion of rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criterion {
    /// Name of the criterion.
    pub name: &'static str,
    /// Measured value.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
    /// Largest value that passes; of the curvature the least.
    pub limit: f64,
    /// Whether the value is within the limit.
    pub passes: bool,
}

impl Criterion {
    fn at_most(name: &'static str, value: f64, unit: &'static str, limit: f64) -> Self {
        Self { name, value, unit, limit, passes: value <= limit }
    }

    /// Criteria of the forces of `cloth`.
    #[must_use]
    pub(crate) fn of_forces(forces: &Forces, cloth: &Cloth) -> [Self; 3] {
        let over_weight = |name, force: f64, limit| Self::at_most(name, force / cloth.weight, "of the weight", limit);
        [
            over_weight("residual", forces.residual, MAX_RESIDUAL),
            over_weight("forces add up", forces.unbalanced.length(), MAX_IMBALANCE),
            over_weight("friction", forces.touching_residual, MAX_RESIDUAL),
        ]
    }

    /// Criteria of the next Newton step (m) of every vertex.
    #[must_use]
    pub(crate) fn of_step(step: &[DVec3]) -> [Self; 2] {
        let n = step.len().max(1) as f64;
        let moving = step.iter().filter(|d| d.length() > MOVING_M).count() as f64;
        let rms = (step.iter().map(|d| d.length_squared()).sum::<f64>() / n).sqrt();
        [
            Self::at_most("still moving", moving / n, "of the vertices", MAX_MOVING_SHARE),
            Self::at_most("distance to rest", 1e3 * rms, "mm", MAX_STEP_RMS_MM),
        ]
    }

    /// The criterion of the curvature.
    #[must_use]
    pub(crate) fn of_curvature(curvature: &Curvature) -> Self {
        let (value, limit) = (curvature.lowest, MIN_CURVATURE);
        Self { name: "lowest curvature", value, unit: "1/s²", limit, passes: value >= limit }
    }
}

/// Reactions that push.
fn pushing(forces: &Forces) -> impl Iterator<Item = &Reaction> {
    forces.reactions.iter().filter(|t| t.normal_n > 0.0)
}

/// Pairs of vertices that these reactions couple.
pub(crate) fn coupled_by(forces: &Forces) -> impl Iterator<Item = [u32; 2]> {
    pushing(forces).flat_map(|t| t.shares.iter().flat_map(|(a, _)| t.shares.iter().map(|(b, _)| [*a, *b])))
}

/// A contact's part of the Hessian: unknowns with their shares, and the matrix between them.
struct ContactBlock {
    members: Vec<(u32, f64)>,
    /// N/m.
    block: DMat3,
}

/// The energy to second order about a state of a cloth, with the reactions of its contacts.
pub(crate) struct Linearised<'a> {
    cloth: &'a Cloth,
    x: &'a [DVec3],
    layout: &'a HessianLayout,
    contacts: Vec<ContactBlock>,
    blocks: &'a mut Vec<DMat3>,
    solver: &'a mut Solver,
    /// The next Newton step of every vertex, m; zero where held.
    pub(crate) step: Vec<DVec3>,
}

/// The curvature about a drape.
#[derive(Debug, Clone)]
pub struct Curvature {
    /// ω² of the softest mode, 1/s².
    pub lowest: f64,
    /// Number of modes of negative curvature that were found, a lower bound.
    pub unstable_modes: usize,
    /// The vertex with the largest displacement in the softest mode.
    pub at: usize,
    /// The next Newton step of every vertex, m; zero where held.
    pub step: Vec<DVec3>,
    /// The unstable modes, or the softest mode; each a displacement of every vertex.
    pub(crate) modes: Vec<Vec<DVec3>>,
}

impl<'a> Linearised<'a> {
    /// About `x` (m), with the reactions of `forces`; B is factorised in `space`.
    ///
    /// # Errors
    /// [`SolveError`] if B cannot be factorised.
    pub(crate) fn new(
        cloth: &'a Cloth,
        forces: &Forces,
        x: &'a [DVec3],
        space: &'a mut FullSpace,
    ) -> Result<Self, SolveError> {
        space.couple(cloth, x, || coupled_by(forces));
        let (layout, solver, blocks) = space.parts(cloth);
        cloth.hessian_in(layout, HessianKind::Projected, x, &Contacts::none(), blocks);
        let mut contacts = Vec::new();
        for t in pushing(forces) {
            let along = outer(t.normal, t.normal);
            let across = if t.sticks { t.friction * t.normal_n / ELASTIC_SLIP } else { 0.0 };
            let block = along * t.stiffness + (DMat3::IDENTITY - along) * across;
            let members = layout.free(t.shares.iter().copied());
            layout.add(&members, block, blocks);
            contacts.push(ContactBlock { members, block });
        }
        let damped: Vec<f64> = layout.order.iter().map(|&v| cloth.masses[v as usize] * LANCZOS_DAMPING).collect();
        let mut unknowns: Vec<DVec3> = layout.order.iter().map(|&v| -forces.residual_forces[v as usize]).collect();
        solver.factorise(blocks, &damped)?;
        solver.solve(&layout.pattern, blocks, &damped, STEP_TOLERANCE, &mut unknowns);
        let step = layout.scatter(&unknowns, x.len());
        Ok(Self { cloth, x, layout, contacts, blocks, solver, step })
    }

    /// The softest modes.
    pub(crate) fn curvature(self) -> Curvature {
        let Self { cloth, x, layout, contacts, blocks, solver, step } = self;
        cloth.hessian_in(layout, HessianKind::True, x, &Contacts::none(), blocks);
        contacts.iter().for_each(|c| layout.add(&c.members, c.block, blocks));
        let hessian = HessianOperator { pattern: &layout.pattern, blocks };
        let ritz = hessian.lanczos(MAX_LANCZOS_STEPS, solver);
        let softest = &ritz.vectors[0];
        let turned = hessian.apply(softest);
        let mass: f64 =
            softest.iter().zip(&layout.order).map(|(z, &v)| cloth.masses[v as usize] * z.length_squared()).sum();
        let farthest =
            (0..softest.len()).fold(0, |most, i| if softest[i].length() > softest[most].length() { i } else { most });
        Curvature {
            lowest: dot(softest, &turned) / mass,
            unstable_modes: ritz.values.iter().filter(|&&l| l < NEGATIVE_CURVATURE).count(),
            at: layout.order.get(farthest).map_or(0, |&v| v as usize),
            modes: ritz.vectors.iter().map(|z| layout.scatter(z, x.len())).collect(),
            step,
        }
    }
}

/// A state judged by all criteria.
#[derive(Debug, Clone)]
pub(crate) struct RestState {
    pub(crate) forces: Forces,
    pub(crate) curvature: Curvature,
    /// The criteria, those of the forces first.
    pub(crate) criteria: [Criterion; 6],
}

impl RestState {
    /// Judges `cloth` on `body`, if there is one, at `x` (m).
    ///
    /// # Errors
    /// [`SolveError`] if the projected Hessian cannot be factorised.
    pub(crate) fn new(cloth: &Cloth, body: Option<&Body>, x: &[DVec3]) -> Result<Self, SolveError> {
        let forces = Forces::on(cloth, body, x);
        let curvature = Linearised::new(cloth, &forces, x, &mut FullSpace::default())?.curvature();
        let [residual, balance, friction] = Criterion::of_forces(&forces, cloth);
        let [moving, distance] = Criterion::of_step(&curvature.step);
        let lowest = Criterion::of_curvature(&curvature);
        Ok(Self { forces, curvature, criteria: [residual, balance, friction, moving, distance, lowest] })
    }
}
