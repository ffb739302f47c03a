//! The coupled PART solve: PARTs as the nodes of a coarse cloth, in force balance all at once.
//!
//! Each PART, cut to a largest extent, is a node. Where three PARTs meet is a triangle of the coarse cloth, with the
//! membrane and bending stiffness of the fabric and rest lengths taken from the garment's rest shape: through it the neighbours
//! pull (the paper's F²). With gravity (F⁰) and the body's reaction (F¹) that is the very energy of
//! [`energy`](super::energy), on a mesh of some hundred nodes, and Newton's method with a direct solve settles it in
//! milliseconds: F⁰ + F¹ + F² = 0 at every node that is free. The displacements are blended to the vertices by an affine
//! map a PART; what the blend left in the body is pushed out. Finer PARTs may start from there.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | D | displacement of a PART | m |
//! | F⁰, F¹, F² | gravity, body reaction, pull of the neighbours | N |
//! | m | sweeps of the blend | – |
//!
//! The coarse cloth is softer than the fabric: flat triangles that cannot stretch can only fold along their edges (membrane
//! locking), which no fold of a few PARTs' width does. So its membrane is capped where its own weight would strain it by
//! [`CoupledOptions::coarse_strain`], resists compression less, and bends more easily.
//!
//! Source: Luo, Jiang and Cong's two stages, with "the force from the adjacent PARTs" (their spring model) generalised to
//! triangles, because springs alone neither shear nor bend. Limits: a fold narrower than about three PARTs cannot show, and one
//! near that limit comes out too stiff; the body is felt at the nodes only until the push-out.

mod blend;
mod bridges;
mod clearance;
mod nodes;
mod options;
mod rest;
mod settle;

use std::time::Instant;

use glam::DVec3;

pub use blend::{blend, smooth_translations, sweeps_for};
pub use clearance::push_out;
pub use nodes::CoarseMesh;
pub use options::{CoupledError, CoupledOptions, CoupledResult, PartResult, Stage};
pub use rest::coarse_rest;

use super::energy::{Cloth, Contacts, EnergyError, Friction, gravity};
use crate::distance::Body;
use crate::fabric::Fabric;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::Parts;
use bridges::cut_at_bridges;
use settle::{Goal, settle};

/// Distance a node keeps from the body, m: room for the body's roundness between nodes and for the softness of the contact.
const COARSE_OFFSET: f64 = 2e-3;

/// Contact stiffness of the coarse cloth, N/m³: 200 Pa, some ten times what a dress weighs on its shoulders, take up a
/// millimetre.
const COARSE_CONTACT: f64 = 2e5;

/// What is draped.
#[derive(Debug, Clone, Copy)]
pub struct Garment<'a> {
    /// The garment as placed: its triangles, and the positions the rest lengths are compared with.
    pub mesh: &'a TriMesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// Its rest shape.
    pub rest: &'a RestShape,
    /// What it is made of.
    pub fabric: &'a Fabric,
    /// Vertices that do not move.
    pub held: &'a [u32],
}

/// Solves the PARTs together, coarse to fine, from the vertex positions `start`.
///
/// # Errors
/// [`CoupledError`] where arrays do not match, an extent is not positive, or the PARTs make no cloth.
pub fn solve(
    garment: &Garment<'_>,
    body: &Body,
    parts: &Parts,
    start: &[DVec3],
    options: &CoupledOptions,
) -> Result<CoupledResult, CoupledError> {
    let expected = garment.mesh.vertex_count();
    check("the list of start positions", start.len(), expected)?;
    check("the list of vertex PARTs", parts.part_of_vertex.len(), expected)?;
    check("the rest shape", garment.rest.corners.len(), garment.mesh.triangles.len())?;
    if let Some(&bad) = options.extents_m.iter().find(|e| e.is_nan() || **e <= 0.0) {
        return Err(CoupledError::Extent(bad));
    }
    let min_vertices = options.min_vertices.max(least_vertices(garment, parts, options));
    let joined =
        if min_vertices > 1 { parts.join_small(garment.topology, garment.mesh, min_vertices) } else { parts.clone() };
    let mut result = CoupledResult {
        positions: start.to_vec(),
        parts: joined.clone(),
        part_results: Vec::new(),
        stages: Vec::new(),
        pushed_out: 0,
        warnings: Vec::new(),
    };
    let uncut = [f64::INFINITY];
    let extents = if options.extents_m.is_empty() { &uncut[..] } else { &options.extents_m };
    for &extent in extents {
        stage(garment, body, &joined, extent, options, &mut result)?;
    }
    let moved: Vec<DVec3> = result.positions.iter().zip(start).map(|(x, s)| *x - *s).collect();
    for (part, out) in result.parts.parts.iter().zip(&mut result.part_results) {
        out.displacement = part.vertices.iter().map(|&v| moved[v as usize]).sum::<DVec3>() / part.vertices.len() as f64;
    }
    Ok(result)
}

/// Vertices that the least area of a PART holds on average; 1 where the range table says itself how PARTs are cut.
fn least_vertices(garment: &Garment<'_>, parts: &Parts, options: &CoupledOptions) -> usize {
    if parts.own_extent.contains(&true) {
        return 1;
    }
    let finest = options.extents_m.iter().copied().filter(|e| e.is_finite()).fold(f64::INFINITY, f64::min);
    let area: f64 = garment.rest.areas().iter().sum();
    let least = options.least_area * finest * finest * garment.mesh.vertex_count() as f64 / area;
    if least.is_finite() { least as usize } else { 1 }
}

/// One solve: cut, settle, blend, push out.
fn stage(
    garment: &Garment<'_>,
    body: &Body,
    joined: &Parts,
    extent_m: f64,
    options: &CoupledOptions,
    result: &mut CoupledResult,
) -> Result<(), CoupledError> {
    let began = Instant::now();
    let Garment { mesh, topology, rest, fabric, held } = *garment;
    let parts = if extent_m.is_finite() { joined.cut_to_extent(mesh, topology, extent_m) } else { joined.clone() };
    let mut is_held = vec![false; mesh.vertex_count()];
    for &vertex in held {
        let count = mesh.vertex_count();
        *is_held.get_mut(vertex as usize).ok_or(EnergyError::Held { vertex, count })? = true;
    }
    let (parts, coarse) = cut_at_bridges(mesh, topology, parts, &is_held, extent_m);
    if coarse.triangles.is_empty() {
        return Err(CoupledError::NoCloth { parts: parts.len() });
    }
    let nodes = TriMesh::new(coarse.nodes_of(&result.positions), coarse.triangles.clone());
    let coarse_shape = coarse_rest(mesh, topology, rest, &parts, &coarse);
    let held_nodes: Vec<u32> =
        (0..parts.len() as u32).filter(|&p| is_held[coarse.node_vertex[p as usize] as usize]).collect();
    let fabric = &Fabric { bending_nm: fabric.bending_nm.map(|b| b * options.bending_share), ..fabric.clone() };
    let mut cloth = Cloth::new(&nodes, &Topology::new(&nodes), &coarse_shape, fabric, &held_nodes)?
        .with_slack(options.compression_share);
    let fine_offset = cloth.offset;
    load(&mut cloth, garment, &parts);
    let height = mesh.bounds().map_or(0.0, |(low, high)| high.z - low.z);
    cloth = cloth.softened(height, options.coarse_strain).unwrap_or(cloth);
    let setup = began.elapsed();

    let began = Instant::now();
    let goal = Goal {
        tolerance: options.tolerance,
        max_steps: options.max_steps,
        damping: options.damping,
        least_move_m: options.least_move_m,
    };
    let mut contacts = soft_contacts(&mut cloth, body, &nodes.positions);
    let settled = settle(&cloth, &mut contacts, nodes.positions.clone(), goal)?;
    let last = settled.history.last().copied();
    let solve = began.elapsed();

    let began = Instant::now();
    let mut displacement: Vec<DVec3> = settled.positions.iter().zip(&nodes.positions).map(|(y, x)| *y - *x).collect();
    let stranded = carry_loose(&parts, &coarse, &mut displacement);
    let sweeps = options.blend_sweeps.unwrap_or_else(|| sweeps_for(mesh.vertex_count(), parts.len()));
    let moves = blend(topology, &parts, &coarse, &result.positions, &displacement, sweeps);
    for ((x, u), &held) in result.positions.iter_mut().zip(&moves).zip(&is_held) {
        if !held {
            *x += *u;
        }
    }
    result.pushed_out = push_out(body, &is_held, fine_offset, &mut result.positions);
    let blend = began.elapsed();

    result.part_results = balance(&cloth, &contacts, &settled.positions);
    let residual = last.map_or(0.0, |h| h.residual_over_weight);
    warn(result, &parts, &coarse, stranded, extent_m);
    if residual > options.tolerance && last.is_some_and(|h| h.iteration >= options.max_steps) {
        result.warnings.push(format!(
            "the coarse cloth of {} PARTs stopped after {} steps at a residual of {residual:.1e} of its weight (asked: {:.0e})",
            parts.len(),
            options.max_steps,
            options.tolerance
        ));
    }
    result.stages.push(Stage {
        extent_m,
        part_count: parts.len(),
        triangle_count: coarse.triangles.len(),
        steps: last.map_or(0, |h| h.iteration),
        residual_over_weight: residual,
        energy: last.map_or(0.0, |h| h.energy),
        positions: result.positions.clone(),
        history: settled.history,
        setup,
        solve,
        blend,
    });
    result.parts = parts;
    Ok(())
}

/// Gives each node the mass and the area of its whole PART: the coarse triangles end at the nodes.
fn load(cloth: &mut Cloth, garment: &Garment<'_>, parts: &Parts) {
    let mut areas = vec![0.0; parts.len()];
    for (triangle, corners) in garment.mesh.triangles.iter().zip(&garment.rest.corners) {
        let third = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]).abs() / 6.0;
        for &v in triangle {
            if let Some(area) = areas.get_mut(parts.part_of_vertex[v as usize] as usize) {
                *area += third;
            }
        }
    }
    cloth.masses = areas.iter().map(|a| a * garment.fabric.density_kg_per_m2).collect();
    cloth.weight = crate::GRAVITY * cloth.masses.iter().sum::<f64>();
    cloth.areas = areas;
}

/// Loose nodes take the mean displacement of their neighbours, wave by wave; returns how many no wave reaches.
fn carry_loose(parts: &Parts, coarse: &CoarseMesh, displacement: &mut [DVec3]) -> usize {
    if coarse.loose.is_empty() {
        return 0;
    }
    let neighbours = parts.neighbours();
    let mut known = vec![true; parts.len()];
    for &p in &coarse.loose {
        known[p as usize] = false;
    }
    let mut left = coarse.loose.clone();
    loop {
        let mut found = Vec::new();
        for &p in &left {
            let sure: Vec<u32> = neighbours[p as usize].iter().copied().filter(|&q| known[q as usize]).collect();
            if !sure.is_empty() {
                let mean = sure.iter().map(|&q| displacement[q as usize]).sum::<DVec3>() / sure.len() as f64;
                found.push((p, mean));
            }
        }
        if found.is_empty() {
            return left.len();
        }
        for &(p, mean) in &found {
            displacement[p as usize] = mean;
            known[p as usize] = true;
        }
        left.retain(|&p| !known[p as usize]);
    }
}

/// Contact as a coarse node feels it: see [`settle`].
fn soft_contacts<'b>(cloth: &mut Cloth, body: &'b Body, x: &[DVec3]) -> Contacts<'b> {
    cloth.offset = cloth.offset.max(COARSE_OFFSET);
    let friction = Friction::new(cloth.friction);
    let mut contacts = Contacts::new(body, &cloth.areas, &cloth.held, cloth.offset, COARSE_CONTACT, friction).exact();
    contacts.update(x);
    contacts.friction_refresh(x);
    contacts
}

/// F⁰, F¹ and F² of each node at rest.
fn balance(cloth: &Cloth, contacts: &Contacts<'_>, x: &[DVec3]) -> Vec<PartResult> {
    let mut all = Vec::new();
    cloth.gradient(x, &Contacts::none(), &mut all);
    let mut weight = vec![DVec3::ZERO; x.len()];
    gravity::add_gradient(&cloth.masses, &mut weight);
    let mut reaction = vec![DVec3::ZERO; x.len()];
    contacts.add_gradient(&mut reaction);
    contacts.friction.add_gradient(x, &mut reaction);
    (0..x.len())
        .map(|p| {
            let held = cloth.held[p];
            let pull = if held { DVec3::ZERO } else { weight[p] - all[p] };
            PartResult {
                displacement: DVec3::ZERO,
                gravity: -weight[p],
                reaction: -reaction[p],
                pull,
                resultant: reaction[p].length(),
                in_contact: reaction[p] != DVec3::ZERO,
                held,
            }
        })
        .collect()
}

/// Says what a user should know about a stage.
fn warn(result: &mut CoupledResult, parts: &Parts, coarse: &CoarseMesh, stranded: usize, extent_m: f64) {
    if !coarse.loose.is_empty() {
        result.warnings.push(format!(
            "{} of {} PARTs (extent {:.1} cm) meet no two others in a triangle and follow their neighbours",
            coarse.loose.len(),
            parts.len(),
            100.0 * extent_m
        ));
    }
    if stranded > 0 {
        result.warnings.push(format!("{stranded} PARTs have no neighbour that moves, and keep still"));
    }
    if parts.unassigned > 0 {
        result.warnings.push(format!("{} vertices are in no PART and follow their neighbours", parts.unassigned));
    }
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), CoupledError> {
    if found == expected { Ok(()) } else { Err(CoupledError::Count { what, found, expected }) }
}
