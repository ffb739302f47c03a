//! Differences of two drapes as shapes, independent of vertex correspondence along the surface.
//!
//! - Symmetric Hausdorff distance: max over the vertices of either of the distance to the other's surface. Exact from vertices
//!   to triangles both ways; a lower bound of the distance of the surfaces, whose triangles may be farther apart inside.
//! - Normal angle: arccos n_i·n'_i of matching vertex normals, mean weighted by the reference's vertex areas.
//! - Section girth: length of the curve in which the horizontal plane z = h cuts the cloth, folds and sleeves included:
//!   Σ over the triangles of the length of their cut.
//! - Hem height: mean z of the lowest boundary loop.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::summary::MM_PER_M;
use crate::base::math;
use crate::body::distance::{Body, DistanceError};
use crate::mesh::{Topology, TriMesh};

/// Heights of the sections, as shares of the height from the reference's lowest vertex to its highest. Heuristic: spread evenly, away
/// from the edges.
const SECTIONS: [f64; 4] = [0.1, 0.3, 0.5, 0.7];

/// One horizontal section through both drapes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct SectionGirth {
    /// Height of the plane, m.
    pub height_m: f64,
    /// Length of the cut through the result, mm.
    pub result_mm: f64,
    /// Length of the cut through the reference, mm.
    pub reference_mm: f64,
}

/// Symmetric Hausdorff distance of two positions of one mesh, m.
pub(crate) fn hausdorff(mesh: &TriMesh, a: &[DVec3], b: &[DVec3]) -> Result<f64, DistanceError> {
    let one_way = |from: &[DVec3], to: &[DVec3]| -> Result<f64, DistanceError> {
        // The sign of the distance is not used, so an open surface is enough.
        let surface = Body::new_open(&mesh.with_positions(to.to_vec()))?;
        Ok(surface.nearest_all(from).iter().map(|p| p.signed_distance.abs()).fold(0.0, f64::max))
    };
    Ok(one_way(a, b)?.max(one_way(b, a)?))
}

/// Mean angle between matching vertex normals, degrees; vertices without a normal in either are left out.
pub(crate) fn mean_normal_angle_deg(result: &TriMesh, reference: &TriMesh) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    let normals = result.vertex_normals();
    for ((n, m), area) in normals.iter().zip(reference.vertex_normals()).zip(reference.vertex_areas()) {
        if *n != DVec3::ZERO && m != DVec3::ZERO {
            // atan2 is accurate near zero, where arccos is not.
            sum += area * math::atan2(n.cross(m).length(), n.dot(m)).to_degrees();
            weight += area;
        }
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}

/// Length of the cut of a mesh with the plane z = `height`, m.
pub(crate) fn section_length(mesh: &TriMesh, height: f64) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| {
            let corners = mesh.corners(t);
            let mut ends = [DVec3::ZERO; 2];
            let mut found = 0;
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                // A half-open interval, so that a corner in the plane counts once.
                if (a.z < height) != (b.z < height) && found < 2 {
                    ends[found] = a + (b - a) * ((height - a.z) / (b.z - a.z));
                    found += 1;
                }
            }
            if found == 2 { ends[0].distance(ends[1]) } else { 0.0 }
        })
        .sum()
}

/// Four sections through both drapes, low to high.
pub(crate) fn section_girths(result: &TriMesh, reference: &TriMesh) -> Vec<SectionGirth> {
    let Some((low, high)) = reference.bounds() else { return Vec::new() };
    SECTIONS
        .par_iter()
        .map(|share| {
            let height_m = low.z + share * (high.z - low.z);
            let girth = |mesh| MM_PER_M * section_length(mesh, height_m);
            SectionGirth { height_m, result_mm: girth(result), reference_mm: girth(reference) }
        })
        .collect()
}

/// Mean height of the boundary loop that is lowest in `reference`, in both drapes: (result, reference), m. `None` for a
/// garment without an edge.
pub(crate) fn hem_heights(topology: &Topology, result: &[DVec3], reference: &[DVec3]) -> Option<(f64, f64)> {
    let hem = lowest_edge(topology, reference)?;
    Some((mean_height(&hem, result), mean_height(&hem, reference)))
}

/// The boundary loop of least mean height.
pub(crate) fn lowest_edge(topology: &Topology, positions: &[DVec3]) -> Option<Vec<u32>> {
    let loops = topology.boundary_loops().into_iter();
    loops.min_by(|a, b| mean_height(a, positions).total_cmp(&mean_height(b, positions)))
}

/// Mean z of some vertices, m.
pub(crate) fn mean_height(vertices: &[u32], positions: &[DVec3]) -> f64 {
    vertices.iter().map(|&v| positions[v as usize].z).sum::<f64>() / vertices.len() as f64
}
