//! Folds finer than a PART: how much of the membrane's stiffness is left under compression.
//!
//! A PART cannot fold within itself, and the cloth in it can: a ring of a skirt takes up what is too wide for where it hangs in
//! folds that no motion of the ring shows. Tension field theory says what that costs ([`membrane`]): next to nothing. A
//! strip of length ℓ buckles under π² B/ℓ², so the share of the stiffness k that a PART as wide as ℓ keeps under compression is
//!
//! r = π² B / (k ℓ²), and never more than the mesh's own.
//!
//! PARTs narrower than a fold make the folds themselves, if compression drives them to: there r is the mesh's own. Folds in cloth under
//! a tension T over a length L are
//!
//! λ = 2 √π (B/T)^¼ L^½
//!
//! wide (Cerda, Mahadevan: "Geometry and physics of wrinkling", Phys. Rev. Lett. 90, 2003), with T = ½ ρ g L what hangs below on average
//! and L the height of the garment: 21 cm for a jersey skirt of 60 cm. A PART counts as narrow up to [`NARROW`] λ.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | r | share of the stiffness under compression | – |
//! | B, k | largest bending, least membrane stiffness | N·m, N/m |
//! | ℓ | width of a PART: twice its farthest vertex's distance from its middle | m |
//! | λ, L, T | width of a fold, its length, the tension along it | m, m, N/m |
//!
//! Limits: one λ for the whole garment; a PART both long and narrow is as wide as it is long, so a narrow ring counts as wide.

use std::f64::consts::PI;

use glam::DVec3;

use crate::GRAVITY;
use crate::fabric::Fabric;
use crate::mechanics::energy::membrane::SLACK;
use crate::mesh::TriMesh;
use crate::parts::{Parts, UNASSIGNED};

#[cfg(doc)]
use crate::mechanics::energy::membrane;

/// Widths of a fold up to which a PART folds with its neighbours. Between one and three a dress in knit cut to 36 cm comes
/// from 28 to 5 mm of its rest; cut to 60 cm it comes no nearer at five.
const NARROW: f64 = 2.0;

/// What folds there are to make, by how wide the PARTs are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folding {
    /// λ, the width of a fold, m.
    pub width_m: f64,
    /// Share of the vertices in PARTs so narrow that they fold with their neighbours.
    pub share: f64,
}

impl Folding {
    /// Of these PARTs of a garment in this fabric.
    #[must_use]
    pub fn of(mesh: &TriMesh, parts: &Parts, fabric: &Fabric) -> Self {
        let width_m = fold_width(mesh, fabric);
        let folding = parts.parts.iter().filter(|part| width(mesh, &part.vertices) <= NARROW * width_m);
        let vertices: usize = folding.map(|part| part.vertices.len()).sum();
        Self { width_m, share: vertices as f64 / mesh.vertex_count().max(1) as f64 }
    }
}

/// Share r of each triangle: that of the widest PART it touches.
pub(super) fn shares(mesh: &TriMesh, parts: &Parts, fabric: &Fabric) -> Vec<f64> {
    let stiffness = fabric.stretch_weft_n_per_m.min(fabric.stretch_warp_n_per_m);
    let bending = fabric.bending_nm.into_iter().fold(0.0, f64::max);
    let narrow = NARROW * fold_width(mesh, fabric);
    let of_part: Vec<f64> = parts.map(|_, part| {
        let width = width(mesh, &part.vertices);
        if width <= narrow { SLACK } else { (PI * PI * bending / (stiffness * width * width)).min(SLACK) }
    });
    let of_triangle = |triangle: &[u32; 3]| {
        let parts = triangle.iter().map(|&v| parts.part_of_vertex[v as usize]).filter(|&p| p != UNASSIGNED);
        parts.map(|p| of_part[p as usize]).fold(SLACK, f64::min)
    };
    mesh.triangles.iter().map(of_triangle).collect()
}

/// λ, m.
fn fold_width(mesh: &TriMesh, fabric: &Fabric) -> f64 {
    let bending = fabric.bending_nm.into_iter().sum::<f64>() / 3.0;
    let length = mesh.bounds().map_or(0.0, |(low, high)| high.z - low.z);
    let tension = 0.5 * fabric.density_kg_per_m2 * GRAVITY * length;
    if tension > 0.0 { 2.0 * PI.sqrt() * (bending / tension).powf(0.25) * length.sqrt() } else { 0.0 }
}

/// ℓ, m.
fn width(mesh: &TriMesh, vertices: &[u32]) -> f64 {
    let at = |&v: &u32| mesh.positions[v as usize];
    let middle = vertices.iter().map(at).sum::<DVec3>() / vertices.len().max(1) as f64;
    2.0 * vertices.iter().map(|v| at(v).distance(middle)).fold(0.0, f64::max)
}
