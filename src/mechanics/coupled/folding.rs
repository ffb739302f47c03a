//! Folds finer than a PART: the buckling load of the cloth.
//!
//! A PART does not fold within itself, but its cloth can: a ring of a skirt that is too wide for its place folds up the excess,
//! although no motion of the ring shows it. By tension field theory their energy is close to zero ([`membrane`]). A strip of length ℓ buckles
//! under
//!
//! N = π² B / ℓ²,
//!
//! which is the compression that a PART as wide as ℓ resists.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | N | buckling load | N/m |
//! | B | largest bending stiffness | N·m |
//! | ℓ | width of a PART: twice its farthest vertex's distance from its middle | m |
//!
//! Source: Euler's load of a strip; tension fields after Wagner (1929) and Reissner (1938). Limits: a PART both long and narrow is as wide
//! as it is long.

use std::f64::consts::PI;

use glam::DVec3;

use crate::mechanics::energy::Cloth;
use crate::mechanics::energy::membrane::Triangle;
use crate::mesh::TriMesh;
use crate::parts::{Parts, UNASSIGNED};

#[cfg(doc)]
use crate::mechanics::energy::membrane;

/// Hanging length of a garment laid flat, over its widest extent. Heuristic.
const FLAT_HEIGHT_SHARE: f64 = 0.25;

/// Least width of a PART, m: one of a single vertex has none.
const MIN_WIDTH_M: f64 = 1e-3;

/// Buckling load π² B/ℓ² of each triangle, N/m: that of the widest PART it touches.
pub(super) fn buckling_loads(mesh: &TriMesh, parts: &Parts, cloth: &Cloth) -> Vec<f64> {
    let widths: Vec<f64> = parts.map(|_, part| width(mesh, &part.vertices));
    let load = |t: &Triangle| {
        let parts = t.vertices.iter().map(|&v| parts.part_of_vertex[v as usize]).filter(|&p| p != UNASSIGNED);
        let width = parts.map(|p| widths[p as usize]).fold(MIN_WIDTH_M, f64::max);
        let bending = cloth.fabrics[t.fabric as usize].bending_nm.into_iter().fold(0.0, f64::max);
        PI * PI * bending / (width * width)
    };
    cloth.triangles.iter().map(load).collect()
}

/// Whether a garment is laid flat: less high than a share of its extent.
pub(crate) fn is_flat(mesh: &TriMesh) -> bool {
    mesh.bounds().is_some_and(|(low, high)| high.z - low.z < FLAT_HEIGHT_SHARE * (high - low).max_element())
}

/// Height of the garment, m; of one laid flat, which hangs later, a share of its extent: its cloth would have no stiffness otherwise.
pub(super) fn hanging_height_m(mesh: &TriMesh) -> f64 {
    mesh.bounds().map_or(0.0, |(low, high)| (high.z - low.z).max(FLAT_HEIGHT_SHARE * (high - low).max_element()))
}

/// ℓ, m.
fn width(mesh: &TriMesh, vertices: &[u32]) -> f64 {
    let at = |&v: &u32| mesh.positions[v as usize];
    let middle = vertices.iter().map(at).sum::<DVec3>() / vertices.len().max(1) as f64;
    2.0 * vertices.iter().map(|v| at(v).distance(middle)).fold(0.0, f64::max)
}
