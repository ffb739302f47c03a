//! The coupled PART solve: all PARTs of a range table at once, in the energy of the whole cloth.
//!
//! Each PART moves by an affine map, blended over the seams ([`Motions`]). These maps are the unknowns; gravity is the paper's F⁰, contact
//! and friction are F¹, and the pull of the cloth is F². Cloth compressed within a PART is taken up by folds finer than the PART
//! (`folding.rs`): a ring of a skirt falls as the skirt does, without the folds. Local and global steps with one constant factor on sampled
//! elements (ADMM, `admm.rs`) find the equilibrium in milliseconds, where Bᵀ∇E = 0: forces and moments balance on every PART.
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
//! PARTs" to the energy of the cloth between them. Limits: no folds, however narrow the PARTs; forces are sums over sampled
//! elements, shared between PARTs by the blending weights.

mod admm;
mod clearance;
mod elements;
mod folding;
mod local_step;
mod motions;
mod options;
mod part_matrix;
mod sampling;
mod weights;

use std::ops::ControlFlow;
use std::time::Instant;

pub(super) use clearance::Clearance;
pub use clearance::push_out;
pub(crate) use folding::is_flat;
use glam::DVec3;
pub use motions::Motions;
pub use options::{CoupledError, CoupledOptions, CoupledResult, Motion, PartResult};
pub(crate) use weights::Bands;
pub use weights::Weights;

use super::energy::Cloth;
use crate::GRAVITY;
use crate::body::distance::{Body, SurfacePoint};
use crate::mesh::{Topology, TriMesh};
use crate::parts::{Parts, UNASSIGNED};
use admm::Admm;

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

/// Asked between iterations; may end the solve with [`CoupledError::Interrupted`].
pub(crate) type Asked<'a> = &'a (dyn Fn() -> ControlFlow<()> + Sync);

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
    let surface = body.nearest_all(start);
    solve_from(garment, body, parts, (start, &surface), &Bands::default(), options, &|| ControlFlow::Continue(()))
}

/// PARTs up to which [`CoupledOptions::max_iterations`] holds. An iteration carries a change from one PART to the next, and a garment of n
/// PARTs is about √n of them across, so the limit grows with √n beyond. With 40 iterations a woven pullover in 934 PARTs ends 9.1 mm from
/// the canonical drape, with 100 5.0 mm; one in 150 PARTs ends no nearer with more.
const PARTS_OF_LIMIT: f64 = 150.0;

/// Iterations after which vertices in the body are pushed out and the maps restart from there: an affine map does not follow the
/// body, so the few vertices that touch hold the others off it. With one push-out at the end, pullovers end up to 4 mm farther from the
/// canonical drape. The cloth sinks at each push-out, so their number is limited by [`CoupledOptions::max_iterations`].
const CONFORM_INTERVAL: usize = 8;

/// [`solve`] from positions with known points of the body. `bands` keeps what other PARTs of the same garment have computed, and does not
/// change the result.
///
/// # Errors
/// As there; [`CoupledError::Interrupted`] where `asked` breaks off.
pub(crate) fn solve_from(
    garment: &Garment<'_>,
    body: &Body,
    parts: &Parts,
    (start, surface): (&[DVec3], &[SurfacePoint]),
    bands: &Bands,
    options: &CoupledOptions,
    asked: Asked<'_>,
) -> Result<CoupledResult, CoupledError> {
    let Garment { mesh, topology, cloth } = *garment;
    check("the list of start positions", start.len(), mesh.vertex_count())?;
    check("the list of surface points", surface.len(), mesh.vertex_count())?;
    check("the list of vertex PARTs", parts.part_of_vertex.len(), mesh.vertex_count())?;
    if parts.is_empty() {
        return Err(CoupledError::NoParts);
    }
    let began = Instant::now();
    let weights = || bands.weights(topology, &mesh.positions, parts).without(&cloth.held);
    let (motions, compression) = rayon::join(
        || Motions::new(parts, weights(), start, options.motion),
        || folding::buckling_loads(mesh, parts, cloth),
    );
    let mut admm = Admm::new(cloth, body, &motions, start, folding::hanging_height_m(mesh), &compression, surface)?;
    let setup = began.elapsed();

    let began = Instant::now();
    let mut positions = start.to_vec();
    let mut clearance = Clearance::new(start, surface);
    let limit = options.max_iterations as f64 * (parts.len() as f64 / PARTS_OF_LIMIT).sqrt().max(1.0);
    let limit = limit as usize;
    for iteration in 1..=limit {
        let ends = admm.iterate() < options.least_change_m || iteration == limit;
        if asked().is_break() {
            return Err(CoupledError::Interrupted);
        }
        if !ends && iteration % CONFORM_INTERVAL != 0 {
            continue;
        }
        admm.displace(&mut positions);
        if ends {
            break;
        }
        clearance.push_out_of_planes(body, &cloth.held, &cloth.offsets, &mut positions);
        admm.rebase(&positions);
    }
    let forces = admm.forces();
    let residual_over_weight = admm.residual_over_weight(&forces);
    let pushed_out = clearance.push_out(body, &cloth.held, &cloth.offsets, &mut positions);
    let gravity = |v: usize| DVec3::NEG_Z * (cloth.masses[v] * GRAVITY);
    let pull = |v: usize| if cloth.held[v] { DVec3::ZERO } else { forces.cloth[v] };
    let [gravity, reaction, pull] =
        [&gravity as Field<'_>, &|v| forces.body[v], &pull].map(|force| on_parts(parts, &motions.weights, force));
    let results = parts.map(|p, part| {
        let displacement: DVec3 = part.vertices.iter().map(|&v| positions[v as usize] - start[v as usize]).sum();
        PartResult {
            displacement: displacement / part.vertices.len() as f64,
            gravity: gravity[p],
            reaction: reaction[p],
            pull: pull[p],
            resultant: reaction[p].length(),
            in_contact: reaction[p] != DVec3::ZERO,
            held: part.vertices.iter().any(|&v| cloth.held[v as usize]),
        }
    });
    Ok(CoupledResult {
        positions,
        parts: results,
        unknowns: motions.unknowns(),
        residual_over_weight,
        pushed_out,
        setup,
        solve: began.elapsed(),
    })
}

/// A force at each vertex, N.
type Field<'a> = &'a dyn Fn(usize) -> DVec3;

/// The forces on the PARTs: the force at a vertex is shared by its weights, so forces that balance in the PARTs' coordinates cancel on every
/// PART. A held vertex has no weights and counts for its own PART.
fn on_parts(parts: &Parts, weights: &Weights, force: Field<'_>) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; parts.len()];
    for v in 0..weights.len() {
        let held = [(parts.part_of_vertex[v], 1.0)];
        let shares = if weights.of(v).is_empty() { &held } else { weights.of(v) };
        for &(p, share) in shares.iter().filter(|share| share.0 != UNASSIGNED) {
            sums[p as usize] += force(v) * share;
        }
    }
    sums
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), CoupledError> {
    if found == expected { Ok(()) } else { Err(CoupledError::Count { what, found, expected }) }
}
