//! From the nodes' displacements to the vertices': an affine map a PART, blended smoothly over the seams.
//!
//! u(v) = Σ_p w_p(v) [D_p + A_p (x_v − x_p)], with weights w_p ≥ 0 that sum to one at each vertex. A_p, the displacement
//! gradient of PART p, is the least squares fit over its neighbours q in the coarse cloth of D_q − D_p = A_p (x_q − x_p),
//! each divided by its length; across the cloth, where no neighbour says anything, A_p is kept small (Tikhonov). The
//! weights are PART indicators after m sweeps of ½ (own + mean of the neighbours), which are never formed: the map is
//! linear, so the twelve numbers of each PART's affine map are swept instead.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | D_p, x_p | displacement and start of the node of p | m |
//! | A_p | displacement gradient | – |
//! | m | sweeps | – |
//!
//! A translation alone (A = 0) tears at the seams what the coarse cloth only turned: an affine displacement per PART holds
//! two to ten times more of a drape. Limits: not interpolating; a node's vertex moves by the blend, not exactly by D_p.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::nodes::CoarseMesh;
use crate::mesh::Topology;
use crate::parts::{Parts, UNASSIGNED};

/// Tikhonov weight of A_p relative to its fit: bends of the coarse cloth leave a tenth of a length out of plane, a
/// hundredth of its square.
const ACROSS: f64 = 1e-2;

/// An affine displacement: u(x) = offset + gradient · x.
#[derive(Debug, Clone, Copy)]
struct Affine {
    offset: DVec3,
    gradient: DMat3,
}

/// Displacement of each vertex at `x` from that of each node. Vertices outside every PART take what the sweeps bring.
#[must_use]
pub fn blend(
    topology: &Topology,
    parts: &Parts,
    coarse: &CoarseMesh,
    x: &[DVec3],
    node_displacement: &[DVec3],
    sweeps: usize,
) -> Vec<DVec3> {
    let maps = affine_maps(parts, coarse, x, node_displacement);
    let field = sweep(topology, parts, &maps, sweeps);
    field.iter().zip(x).map(|(map, &x)| map.offset + map.gradient * x).collect()
}

/// One translation a PART, blended as [`blend`] blends by default: what translations can hold.
#[must_use]
pub fn smooth_translations(topology: &Topology, parts: &Parts, translation: &[DVec3]) -> Vec<DVec3> {
    let maps: Vec<Affine> = translation.iter().map(|&offset| Affine { offset, gradient: DMat3::ZERO }).collect();
    let sweeps = sweeps_for(parts.part_of_vertex.len(), parts.len());
    sweep(topology, parts, &maps, sweeps).iter().map(|map| map.offset).collect()
}

/// Sweeps that smooth over half a PART: m sweeps spread a weight by about √m edges, and a PART of n vertices is √n wide.
/// At least two, or the seams stay creases; at most two hundred, for PARTs of thousands of vertices that hold no drape anyway.
#[must_use]
pub fn sweeps_for(vertices: usize, parts: usize) -> usize {
    (0.5 * vertices as f64 / parts.max(1) as f64).ceil().clamp(2.0, 200.0) as usize
}

/// The maps at the vertices after m sweeps.
fn sweep(topology: &Topology, parts: &Parts, maps: &[Affine], sweeps: usize) -> Vec<Affine> {
    let still = Affine { offset: DVec3::ZERO, gradient: DMat3::ZERO };
    let mut field: Vec<Affine> =
        parts.part_of_vertex.iter().map(|&p| if p == UNASSIGNED { still } else { maps[p as usize] }).collect();
    for _ in 0..sweeps {
        field = (0..field.len())
            .into_par_iter()
            .with_min_len(512)
            .map(|v| {
                let neighbours = topology.neighbours(v as u32);
                if neighbours.is_empty() {
                    return field[v];
                }
                let share = 0.5 / neighbours.len() as f64;
                let mut mean = Affine { offset: field[v].offset * 0.5, gradient: field[v].gradient * 0.5 };
                for &w in neighbours {
                    mean.offset += field[w as usize].offset * share;
                    mean.gradient += field[w as usize].gradient * share;
                }
                mean
            })
            .collect();
    }
    field
}

/// The affine map of each PART.
fn affine_maps(parts: &Parts, coarse: &CoarseMesh, x: &[DVec3], displacement: &[DVec3]) -> Vec<Affine> {
    let mut edges: Vec<[u32; 2]> = coarse
        .triangles
        .iter()
        .flat_map(|&[p, q, r]| [[p, q], [q, r], [r, p]])
        .map(|[p, q]| [p.min(q), p.max(q)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let mut normal = vec![DMat3::ZERO; parts.len()];
    let mut right = vec![DMat3::ZERO; parts.len()];
    for [p, q] in edges {
        let (i, j) = (p as usize, q as usize);
        let along = x[coarse.node_vertex[j] as usize] - x[coarse.node_vertex[i] as usize];
        let square = along.length_squared();
        if square <= 0.0 {
            continue;
        }
        let scaled = along / square;
        let change = displacement[j] - displacement[i];
        for k in [i, j] {
            normal[k] += outer(along, scaled);
            right[k] += outer(change, scaled);
        }
    }
    (0..parts.len())
        .map(|p| {
            let at = x[coarse.node_vertex[p] as usize];
            let trace = normal[p].x_axis.x + normal[p].y_axis.y + normal[p].z_axis.z;
            let gradient = if trace > 0.0 {
                right[p] * (normal[p] + DMat3::from_diagonal(DVec3::splat(ACROSS * trace))).inverse()
            } else {
                DMat3::ZERO
            };
            Affine { offset: displacement[p] - gradient * at, gradient }
        })
        .collect()
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
