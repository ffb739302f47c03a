//! Bridges: seams that the coarse cloth would come apart at.
//!
//! A coarse triangle is where three PARTs meet. Two PARTs of a strap one PART wide meet along a seam from edge to edge, with no third
//! at either end: no triangle holds them, and a dress hangs from its shoulders by nothing. So the PARTs on both sides of
//! such a seam are cut to half the extent, and to half of that, until there are two abreast or [`ROUNDS`] are over.
//!
//! Limits: cloth narrower than an eighth of the extent stays a bridge; PARTs that the range table cuts itself, or that nothing cuts
//! (whole rings), are left as they are, and what of them is in no triangle follows its neighbours.

use super::nodes::CoarseMesh;
use crate::mesh::{Topology, TriMesh};
use crate::parts::Parts;

/// Times an extent is halved at most.
const ROUNDS: usize = 3;

/// `parts`, cut to `extent_m` (m), with those beside bridges cut further, and their coarse cloth.
pub(super) fn cut_at_bridges(
    mesh: &TriMesh,
    topology: &Topology,
    mut parts: Parts,
    held: &[bool],
    extent_m: f64,
) -> (Parts, CoarseMesh) {
    let mut coarse = CoarseMesh::new(mesh, topology, &parts, held);
    let mut extent = extent_m;
    for _ in 0..ROUNDS {
        let beside = beside_bridges(&parts, &coarse);
        if !extent.is_finite() || !beside.contains(&true) {
            break;
        }
        extent *= 0.5;
        parts = parts.cut_some_to_extent(mesh, topology, extent, &beside);
        coarse = CoarseMesh::new(mesh, topology, &parts, held);
    }
    (parts, coarse)
}

/// Whether each PART has a neighbour that it shares no coarse triangle with, and may be cut.
fn beside_bridges(parts: &Parts, coarse: &CoarseMesh) -> Vec<bool> {
    let mut held_together: Vec<[u32; 2]> = coarse
        .triangles
        .iter()
        .flat_map(|&[p, q, r]| [[p, q], [q, r], [r, p]])
        .map(|[p, q]| [p.min(q), p.max(q)])
        .collect();
    held_together.sort_unstable();
    let mut beside = vec![false; parts.len()];
    for seam in &parts.seams {
        if held_together.binary_search(&seam.parts).is_err() {
            for p in seam.parts.map(|p| p as usize) {
                beside[p] = parts.own_extent.get(parts.parts[p].level as usize) != Some(&true);
            }
        }
    }
    beside
}
