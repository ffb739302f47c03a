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
//! PARTs" to the energy of the cloth between them. Limits: no folds, however narrow the PARTs; forces are sums over sampled elements.

mod admm;
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
use crate::parts::Parts;
use admm::Admm;

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
    let mut clearance = Clearance::new(start, surface.to_vec());
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
        clearance.push_out(body, &cloth.held, &cloth.offsets, &mut positions);
        admm.rebase(&positions);
    }
    let forces = admm.forces();
    let residual_over_weight = admm.residual_over_weight(&forces);
    let pushed_out = clearance.push_out(body, &cloth.held, &cloth.offsets, &mut positions);
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
        pushed_out,
        setup,
        solve: began.elapsed(),
    })
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), CoupledError> {
    if found == expected { Ok(()) } else { Err(CoupledError::Count { what, found, expected }) }
}

/// Moves every vertex that is not held to at least its offset (m) from the body; returns how many moved.
pub fn push_out(body: &Body, held: &[bool], offsets_m: &[f64], positions: &mut [DVec3]) -> usize {
    let mut clearance = Clearance::new(positions, body.nearest_all(positions));
    clearance.push_out(body, held, offsets_m, positions)
}

/// The last known point of the body of each vertex. A vertex that has moved by less than its distance since does not touch the body.
pub(super) struct Clearance {
    /// Position of each vertex at its last query, m.
    at: Vec<DVec3>,
    surface: Vec<SurfacePoint>,
}

impl Clearance {
    /// The vertices at these positions (m) with their points of the body.
    pub(super) fn new(at: &[DVec3], surface: Vec<SurfacePoint>) -> Self {
        Self { at: at.to_vec(), surface }
    }

    /// Moves every vertex that is not held to at least its offset (m) from the body; returns how many moved.
    pub(super) fn push_out(&mut self, body: &Body, held: &[bool], offsets_m: &[f64], x: &mut [DVec3]) -> usize {
        let clear = |v: usize| held[v] || self.surface[v].signed_distance - x[v].distance(self.at[v]) > offsets_m[v];
        let mut left: Vec<u32> = (0..x.len()).filter(|&v| !clear(v)).map(|v| v as u32).collect();
        let mut moved = 0;
        for push in 0..MAX_PUSHES {
            let points: Vec<DVec3> = left.iter().map(|&v| x[v as usize]).collect();
            let hints: Vec<u32> = left.iter().map(|&v| self.surface[v as usize].triangle).collect();
            let mut found = body.nearest_all_from(&points, &hints).into_iter();
            left.retain(|&v| {
                let v = v as usize;
                let Some(near) = found.next() else { return false };
                (self.at[v], self.surface[v]) = (x[v], near);
                let inside = near.signed_distance < NEAR_SHARE * offsets_m[v];
                if inside {
                    x[v] += near.normal * (offsets_m[v] - near.signed_distance);
                }
                inside
            });
            if push == 0 {
                moved = left.len();
            }
        }
        moved
    }
}
