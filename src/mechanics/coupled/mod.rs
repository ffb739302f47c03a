//! The coupled PART solve: all PARTs of a range table at once, in the energy of the whole cloth.
//!
//! Each PART moves by an affine map, blended over the seams ([`Motions`]). These maps are the unknowns; gravity is the paper's F⁰, contact
//! and friction are F¹, and the pull of the cloth is F². Cloth compressed within a PART wider than a fold is taken up by folds finer than
//! the PART (`folding.rs`): a ring of a skirt falls as the skirt does, without the folds. Two methods find the equilibrium ([`Method`]):
//!
//! - **ADMM** (`admm.rs`) for PARTs wider than two folds: local and global steps with one constant factor on sampled elements, in
//!   milliseconds;
//! - **Newton's method** (`hessian.rs`, `mechanics::newton`) for narrower PARTs, which fold: the energy of [`energy`](super::energy) over all
//!   vertices, with the vertices relaxed after each step, until the steps are short.
//!
//! Both end where Bᵀ∇E = 0: forces and moments balance on every PART.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | D | displacement of a PART | m |
//! | F⁰, F¹, F² | gravity, body reaction, pull of the neighbours | N |
//! | B | from the unknowns to displacements of the vertices | – |
//!
//! At the end no vertex is inside the body: a vertex nearer than its offset moves along ∇q, again where another part of the body is then
//! too near.
//!
//! Source: Luo, Jiang and Cong's two stages, with one displacement a PART generalised to an affine map, and "the force from the adjacent
//! PARTs" to the energy of the cloth between them. Limits: folds narrower than some two PARTs do not show. With ADMM, forces are sums over
//! sampled elements. With Newton's method the relaxations move vertices beyond the span of the maps, so that a result can be nearer to its
//! rest than the best affine maps.

mod admm;
mod elements;
mod folding;
mod hessian;
mod local_step;
mod motions;
mod options;
mod part_matrix;
mod sums;
mod weights;

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

pub use folding::Folding;
pub use motions::Motions;
pub use options::{CoupledError, CoupledOptions, CoupledResult, Method, Motion, PartResult};
pub use weights::Weights;

use super::energy::{Cloth, Contacts};
use super::newton::{NewtonState, StepLimits};
use super::refine::Record;
use crate::GRAVITY;
use crate::body::distance::Body;
use crate::mesh::{Topology, TriMesh};
use crate::parts::Parts;
use admm::Admm;
use hessian::Reduced;

/// Longest move of a vertex in one step, m: about the extent of a PART, over which the Hessian says nothing any more.
const MAX_MOVE_M: f64 = 0.1;

/// Share of the energy decrease of a relaxation below which its last three iterations end it: this saves half of the iterations without
/// a loss.
const RELAXATION_END_SHARE: f64 = 0.03;

/// Range of the damping ε, 1/s²: with the largest a free fall of a step is a millimetre. Heuristic.
const DAMPING_RANGE: [f64; 2] = [1e-2, 1e4];

/// Damping below which the length of a step measures convergence, 1/s²: at 1 it allows a free fall of ten metres.
const MAX_FINAL_DAMPING: f64 = 1.0;

/// Most moves of a vertex out of the body: the second is for narrow places (an armpit). Heuristic.
const MAX_PUSHES: usize = 4;

/// Share of its offset below which a vertex is pushed out; the rest is tolerance for rounding. Heuristic.
const NEAR_SHARE: f64 = 0.875;

/// The garment at one resolution.
#[derive(Debug, Clone, Copy)]
pub struct Garment<'a> {
    /// The garment as placed: the blending weights are measured along it.
    pub mesh: &'a TriMesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// Its cloth at full resolution.
    pub cloth: &'a Cloth,
}

/// Called with the vertex positions after every step; may end the solve with [`CoupledError::Interrupted`].
pub(crate) type StepCallback<'a> = &'a mut (dyn FnMut(&[DVec3]) -> ControlFlow<()> + Send);

/// Solves the PARTs together from the vertex positions `start`.
///
/// # Errors
/// [`CoupledError`] where arrays do not match or there is no PART.
pub fn solve(
    garment: &Garment<'_>,
    body: &Body,
    parts: &Parts,
    start: &[DVec3],
    options: &CoupledOptions,
) -> Result<CoupledResult, CoupledError> {
    solve_given(garment, body, parts, start, Known::default(), options, &mut |_| ControlFlow::Continue(()))
}

/// Known distances, and the accuracy that the next stage needs.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known<'a> {
    /// Signed distances of the garment as placed, m; none where they are not known.
    pub distance_m: &'a [f64],
    /// The solve ends early when the last six steps contribute less than this share of the total energy decrease.
    pub least_share: f64,
}

/// Number of the last steps whose contribution ends a solve early: see [`Known::least_share`].
const LAST_STEPS: usize = 6;

/// [`solve`] with known distances, calling `on_step` after each step.
///
/// # Errors
/// As there; [`CoupledError::Interrupted`] where `on_step` ends it.
pub(crate) fn solve_given(
    garment: &Garment<'_>,
    body: &Body,
    parts: &Parts,
    start: &[DVec3],
    given: Known<'_>,
    options: &CoupledOptions,
    on_step: StepCallback<'_>,
) -> Result<CoupledResult, CoupledError> {
    let Garment { mesh, topology, cloth } = *garment;
    check("the list of start positions", start.len(), mesh.vertex_count())?;
    check("the list of vertex PARTs", parts.part_of_vertex.len(), mesh.vertex_count())?;
    if parts.is_empty() {
        return Err(CoupledError::NoParts);
    }
    if solved_by_admm(mesh, parts, cloth, options.method) {
        return solve_by_admm(garment, body, parts, start, given.distance_m, options, on_step);
    }
    let began = Instant::now();
    let weights = Weights::new(topology, &mesh.positions, parts).without(&cloth.held);
    let mut tangent = Reduced::new(cloth, Motions::new(parts, weights, start, options.motion));
    let loose = cloth.clone().with_compression_ratios(folding::compression_ratios(mesh, parts, cloth));
    let soft = loose.softened(folding::hanging_height_m(mesh), options.soft_strain).unwrap_or(loose);
    let setup = began.elapsed();

    let began = Instant::now();
    let contacts = soft.contacts_from_distances(body, start, true, &mesh.positions, given.distance_m.iter().copied());
    let mut descent =
        NewtonState::new(&soft, contacts, start.to_vec(), options.damping).with_relaxation_end(RELAXATION_END_SHARE);
    let history = settle(&mut descent, &mut tangent, given, options, on_step)?;
    let residual = tangent.residual(&descent.state()) / cloth.weight;
    let mut results = balance(&descent, parts);
    let mut positions = descent.x;
    let leave =
        |(v, &held): (usize, &bool)| held || descent.contacts.is_clear(v, positions[v], NEAR_SHARE * cloth.offsets[v]);
    let leave: Vec<bool> = cloth.held.iter().enumerate().map(leave).collect();
    let pushed_out = push_out(body, &leave, &cloth.offsets, &mut positions);
    for (part, out) in parts.parts.iter().zip(&mut results) {
        let moved = part.vertices.iter().map(|&v| positions[v as usize] - start[v as usize]).sum::<DVec3>();
        out.displacement = moved / part.vertices.len() as f64;
    }
    let mut warnings = Vec::new();
    if history.len() > options.max_steps {
        warnings.push(format!(
            "the {} PARTs were still moving after {} steps; their forces balance to {residual:.1e} of the weight",
            parts.len(),
            options.max_steps
        ));
    }
    Ok(CoupledResult {
        positions,
        parts: results,
        unknowns: tangent.unknowns(),
        residual_over_weight: residual,
        history,
        pushed_out,
        setup,
        solve: began.elapsed(),
        warnings,
    })
}

/// Share of the garment in PARTs that fold with their neighbours from which Newton's method solves them.
const FOLDING_SHARE: f64 = 0.5;

/// Whether these PARTs are solved by ADMM alone. A garment laid flat is not: it has far to go, and its levels say little about where it will lie.
pub(crate) fn solved_by_admm(mesh: &TriMesh, parts: &Parts, cloth: &Cloth, method: Method) -> bool {
    match method {
        Method::Auto => !folding::is_flat(mesh) && Folding::of(mesh, parts, cloth).share < FOLDING_SHARE,
        Method::Admm => true,
        Method::Newton => false,
    }
}

/// Iterations of ADMM after which vertices in the body are pushed out and the maps restart from there: an affine map does not follow the
/// body, so the few vertices that touch hold the others off it. With one push-out at the end, pullovers end up to 4 mm farther from the
/// canonical drape. The cloth sinks at each push-out, so their number is limited by [`CoupledOptions::max_iterations`].
const CONFORM_INTERVAL: usize = 8;

/// [`solve`] by ADMM. Of the options it takes the motion, `max_iterations` and `least_change_m`.
fn solve_by_admm(
    garment: &Garment<'_>,
    body: &Body,
    parts: &Parts,
    start: &[DVec3],
    distance_m: &[f64],
    options: &CoupledOptions,
    on_step: StepCallback<'_>,
) -> Result<CoupledResult, CoupledError> {
    let Garment { mesh, topology, cloth } = *garment;
    let began = Instant::now();
    let weights = Weights::new(topology, &mesh.positions, parts).without(&cloth.held);
    let motions = Motions::new(parts, weights, start, options.motion);
    let queried: Vec<f64>;
    let distance_m = if distance_m.len() == start.len() {
        distance_m
    } else {
        queried = body.nearest_all(start).into_iter().map(|near| near.signed_distance).collect();
        &queried
    };
    let compression = folding::buckling_loads(mesh, parts, cloth);
    let mut admm = Admm::new(cloth, body, &motions, start, folding::hanging_height_m(mesh), &compression, distance_m)?;
    let setup = began.elapsed();

    let began = Instant::now();
    let mut positions = start.to_vec();
    let mut moves = Vec::new();
    // A vertex that moved by less than its distance from the body does not touch it.
    let clear = |x: &[DVec3]| -> Vec<bool> {
        (0..x.len()).map(|v| cloth.held[v] || distance_m[v] - x[v].distance(start[v]) > cloth.offsets[v]).collect()
    };
    for iteration in 1..=options.max_iterations {
        let ends = admm.iterate() < options.least_change_m || iteration == options.max_iterations;
        if on_step(&positions).is_break() {
            return Err(CoupledError::Interrupted);
        }
        if !ends && iteration % CONFORM_INTERVAL != 0 {
            continue;
        }
        motions.prolong(start, admm.unknowns(), &mut moves);
        positions.iter_mut().zip(&moves).for_each(|(x, d)| *x += *d);
        if ends {
            break;
        }
        push_out(body, &clear(&positions), &cloth.offsets, &mut positions);
        admm.rebase(&positions);
    }
    let forces = admm.forces();
    let residual_over_weight = admm.residual_over_weight(start, &forces);
    let pushed_out = push_out(body, &clear(&positions), &cloth.offsets, &mut positions);
    let results = parts.map(|_, part| {
        let over = |of: &dyn Fn(usize) -> DVec3| -> DVec3 { part.vertices.iter().map(|&v| of(v as usize)).sum() };
        let reaction = over(&|v| forces.body[v]);
        PartResult {
            displacement: over(&|v| positions[v] - start[v]) / part.vertices.len() as f64,
            gravity: over(&|v| DVec3::NEG_Z * (cloth.masses[v] * GRAVITY)),
            reaction,
            pull: over(&|v| if cloth.held[v] { DVec3::ZERO } else { forces.cloth[v] }),
            resultant: reaction.length(),
            in_contact: reaction != DVec3::ZERO,
            held: part.vertices.iter().any(|&v| cloth.held[v as usize]),
        }
    });
    Ok(CoupledResult {
        positions,
        parts: results,
        unknowns: motions.unknowns(),
        residual_over_weight,
        history: Vec::new(),
        pushed_out,
        setup,
        solve: began.elapsed(),
        warnings: Vec::new(),
    })
}

/// Newton steps until they are short.
fn settle(
    descent: &mut NewtonState<'_, '_>,
    tangent: &mut Reduced,
    given: Known<'_>,
    options: &CoupledOptions,
    on_step: StepCallback<'_>,
) -> Result<Vec<Record>, CoupledError> {
    let limits =
        StepLimits { longest_move_m: MAX_MOVE_M, relaxing: options.relaxing, relaxing_trial: options.relaxing_trial };
    let mut history = vec![descent.record(0, None, true)];
    for iteration in 1..=options.max_steps {
        let advance = descent.advance(tangent, limits)?;
        history.push(descent.record(iteration, Some(advance), true));
        if on_step(&descent.x).is_break() {
            return Err(CoupledError::Interrupted);
        }
        let still = advance.accepted && advance.step_length >= 1.0 && advance.largest_move_m < options.least_move_m;
        if still && descent.damping <= MAX_FINAL_DAMPING || !advance.accepted && descent.damping >= DAMPING_RANGE[1] {
            break;
        }
        let fell = |steps: usize| history[history.len() - 1 - steps].energy - descent.energy;
        if iteration > LAST_STEPS && fell(LAST_STEPS) < given.least_share * fell(iteration) {
            break;
        }
        if advance.share >= 1.0 {
            descent.damping = (descent.damping * 0.3).max(DAMPING_RANGE[0]);
        } else if advance.share < 0.3 {
            descent.damping = (descent.damping * 3.0).min(DAMPING_RANGE[1]);
        }
    }
    Ok(history)
}

/// F⁰, F¹ and F² of each PART: sums over its own vertices.
fn balance(descent: &NewtonState<'_, '_>, parts: &Parts) -> Vec<PartResult> {
    let (cloth, x, contacts) = (descent.cloth, &descent.x, &descent.contacts);
    let mut all = Vec::new();
    cloth.gradient(x, &Contacts::none(), &mut all);
    let weight = |v: usize| DVec3::new(0.0, 0.0, cloth.masses[v] * GRAVITY);
    let mut reaction = vec![DVec3::ZERO; x.len()];
    contacts.add_gradient(&mut reaction);
    contacts.friction.add_gradient(x, &mut reaction);
    parts.map(|_, part| {
        let over = |force: &dyn Fn(usize) -> DVec3| -> DVec3 { part.vertices.iter().map(|&v| force(v as usize)).sum() };
        let reaction = -over(&|v| reaction[v]);
        PartResult {
            displacement: DVec3::ZERO,
            gravity: -over(&weight),
            reaction,
            pull: over(&|v| if cloth.held[v] { DVec3::ZERO } else { weight(v) - all[v] }),
            resultant: reaction.length(),
            in_contact: reaction != DVec3::ZERO,
            held: part.vertices.iter().any(|&v| cloth.held[v as usize]),
        }
    })
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), CoupledError> {
    if found == expected { Ok(()) } else { Err(CoupledError::Count { what, found, expected }) }
}

/// Moves every vertex that is not held to at least its offset (m) from the body; returns how many moved.
pub fn push_out(body: &Body, held: &[bool], offsets_m: &[f64], positions: &mut [DVec3]) -> usize {
    let moved: Vec<bool> = positions
        .par_iter_mut()
        .with_min_len(128)
        .zip(held)
        .zip(offsets_m)
        .map(|((x, &held), &offset_m)| {
            let mut moved = false;
            for _ in 0..if held { 0 } else { MAX_PUSHES } {
                let near = body.nearest(*x);
                if near.signed_distance >= NEAR_SHARE * offset_m {
                    break;
                }
                *x += near.normal * (offset_m - near.signed_distance);
                moved = true;
            }
            moved
        })
        .collect();
    moved.iter().filter(|&&m| m).count()
}
