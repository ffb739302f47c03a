//! Tangential relaxation: each vertex to the density-weighted centroid of its triangles, then back to the surface.
//!
//! x ← Π(x + (I − n nᵀ)(c − x)) with c = Σ w_t c_t / Σ w_t, w_t = A_t / s⁴ (a centroidal Voronoi step for the density s⁻⁴;
//! Du, Faber, Gunzburger 1999), n the area-weighted normal, Π the projection. Boundary vertices move to the middle of their two
//! neighbours on the boundary.

use glam::DVec3;
use rayon::prelude::*;

use super::Surface;
use crate::mesh::NONE;
use crate::mesh::half_edge::{HalfEdgeMesh, previous};

/// Moves every vertex once.
pub(crate) fn relax(mesh: &mut HalfEdgeMesh, surface: &dyn Surface) {
    let moved: Vec<DVec3> = (0..mesh.positions.len() as u32)
        .into_par_iter()
        .with_min_len(256)
        .map(|v| {
            let p = mesh.positions[v as usize];
            if !mesh.is_vertex_alive(v) {
                return p;
            }
            let aim = if mesh.is_boundary(v) { along_boundary(mesh, v) } else { centroid(mesh, surface, v) };
            surface.project(aim, mesh.tags[v as usize])
        })
        .collect();
    mesh.positions = moved;
}

fn centroid(mesh: &HalfEdgeMesh, surface: &dyn Surface, v: u32) -> DVec3 {
    let p = mesh.positions[v as usize];
    let (mut normal, mut sum, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    mesh.around(v, |h| {
        let (b, c) = (mesh.vector(h), -mesh.vector(previous(h)));
        let area = b.cross(c);
        let middle = (b + c) / 3.0;
        let weight = area.length() / surface.relative_size(p + middle).powi(4);
        normal += area;
        sum += weight * middle;
        total += weight;
    });
    let n = normal.normalize_or_zero();
    if total <= 0.0 {
        return p;
    }
    let step = sum / total;
    p + step - step.dot(n) * n
}

fn along_boundary(mesh: &HalfEdgeMesh, v: u32) -> DVec3 {
    let p = mesh.positions[v as usize];
    let mut sum = DVec3::ZERO;
    mesh.around(v, |h| {
        if mesh.twin(h) == NONE {
            sum += mesh.vector(h);
        }
        let before = previous(h);
        if mesh.twin(before) == NONE {
            sum -= mesh.vector(before);
        }
    });
    // The mean of the two neighbours, half way, so that the loop cannot oscillate.
    p + 0.25 * sum
}
