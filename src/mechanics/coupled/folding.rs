//! Folds finer than a PART: the compression ratio of the membrane.
//!
//! A PART does not fold within itself, but its cloth can: a ring of a skirt that is too wide for its place folds up the excess,
//! although no motion of the ring shows it. By tension field theory their energy is close to zero ([`membrane`]). A
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
//! and L the height of the garment: 21 cm for a jersey skirt of 60 cm. A PART counts as narrow up to [`MAX_FOLD_WIDTHS`] λ.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | r | compression ratio: share of the stiffness under compression | – |
//! | B, k | largest bending, least membrane stiffness | N·m, N/m |
//! | ℓ | width of a PART: twice its farthest vertex's distance from its middle | m |
//! | λ, L, T | width of a fold, its length, the tension along it | m, m, N/m |
//!
//! Several fabrics have a λ each, under the garment's mean weight. Limits: λ does not depend on the place; a PART both long and narrow
//! is as wide as it is long, so a narrow ring counts as wide.

use std::f64::consts::PI;

use glam::DVec3;

use crate::GRAVITY;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::energy::membrane::{COMPRESSION_RATIO, Triangle};
use crate::mesh::TriMesh;
use crate::parts::{Part, Parts, UNASSIGNED};

#[cfg(doc)]
use crate::mechanics::energy::membrane;

/// Widths of a fold up to which a PART folds with its neighbours. Between one and three a dress in knit cut to 36 cm comes
/// from 28 to 5 mm of its rest; cut to 60 cm it comes no nearer at five.
const MAX_FOLD_WIDTHS: f64 = 2.0;

/// Hanging length of a garment laid flat, over its widest extent. Heuristic.
const FLAT_HEIGHT_SHARE: f64 = 0.25;

/// Least width of a PART, m: one of a single vertex has none.
const MIN_WIDTH_M: f64 = 1e-3;

/// Width of the folds, and the share of the garment in PARTs narrow enough to form them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folding {
    /// λ, the width of a fold, m; of several fabrics the narrowest.
    pub width_m: f64,
    /// Share of the vertices in PARTs so narrow that they fold with their neighbours.
    pub share: f64,
}

impl Folding {
    /// Of these PARTs of a garment.
    #[must_use]
    pub(crate) fn of(mesh: &TriMesh, parts: &Parts, cloth: &Cloth) -> Self {
        let folds = fold_widths(mesh, cloth);
        let mut fold_of_vertex = vec![folds[0]; mesh.vertex_count()];
        for t in cloth.triangles.iter().rev() {
            t.vertices.iter().for_each(|&v| fold_of_vertex[v as usize] = folds[t.fabric as usize]);
        }
        let folding = |part: &Part| {
            let width = width(mesh, &part.vertices);
            part.vertices.iter().filter(|&&v| width <= MAX_FOLD_WIDTHS * fold_of_vertex[v as usize]).count()
        };
        let vertices: usize = parts.parts.iter().map(folding).sum();
        let width_m = folds.into_iter().fold(f64::INFINITY, f64::min);
        Self { width_m, share: vertices as f64 / mesh.vertex_count().max(1) as f64 }
    }
}

/// Share r of each triangle: that of the widest PART it touches, in its own fabric.
pub(super) fn compression_ratios(mesh: &TriMesh, parts: &Parts, cloth: &Cloth) -> Vec<f64> {
    let widths: Vec<f64> = parts.map(|_, part| width(mesh, &part.vertices));
    let share = |(fabric, fold): (&Fabric, f64)| -> Vec<f64> {
        let stiffness = fabric.stretch_weft_n_per_m.min(fabric.stretch_warp_n_per_m);
        let bending = fabric.bending_nm.into_iter().fold(0.0, f64::max);
        let of_part = |&width: &f64| {
            if width <= MAX_FOLD_WIDTHS * fold {
                COMPRESSION_RATIO
            } else {
                (PI * PI * bending / (stiffness * width * width)).min(COMPRESSION_RATIO)
            }
        };
        widths.iter().map(of_part).collect()
    };
    let of_part: Vec<Vec<f64>> = cloth.fabrics.iter().zip(fold_widths(mesh, cloth)).map(share).collect();
    let of_triangle = |t: &Triangle| {
        let parts = t.vertices.iter().map(|&v| parts.part_of_vertex[v as usize]).filter(|&p| p != UNASSIGNED);
        parts.map(|p| of_part[t.fabric as usize][p as usize]).fold(COMPRESSION_RATIO, f64::min)
    };
    cloth.triangles.iter().map(of_triangle).collect()
}

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
pub(super) fn is_flat(mesh: &TriMesh) -> bool {
    mesh.bounds().is_some_and(|(low, high)| high.z - low.z < FLAT_HEIGHT_SHARE * (high - low).max_element())
}

/// Height of the garment, m; of one laid flat, which hangs later, a share of its extent: its cloth would have no stiffness otherwise.
pub(super) fn hanging_height_m(mesh: &TriMesh) -> f64 {
    mesh.bounds().map_or(0.0, |(low, high)| (high.z - low.z).max(FLAT_HEIGHT_SHARE * (high - low).max_element()))
}

/// λ of each fabric, m: its own bending under what the garment weighs on average.
fn fold_widths(mesh: &TriMesh, cloth: &Cloth) -> Vec<f64> {
    let length = hanging_height_m(mesh);
    // As the first one's and what the others have more of, so that of one fabric it is that one's to the last bit.
    let of_first = cloth.fabrics[0].density_kg_per_m2;
    let denser = |t: &Triangle| t.area * (cloth.fabrics[t.fabric as usize].density_kg_per_m2 - of_first);
    let more = cloth.triangles.iter().map(denser).sum::<f64>() / cloth.triangles.iter().map(|t| t.area).sum::<f64>();
    let tension = 0.5 * (of_first + more) * GRAVITY * length;
    let fold = |fabric: &Fabric| {
        let bending = fabric.bending_nm.into_iter().sum::<f64>() / 3.0;
        if tension > 0.0 { 2.0 * PI.sqrt() * (bending / tension).sqrt().sqrt() * length.sqrt() } else { 0.0 }
    };
    cloth.fabrics.iter().map(fold).collect()
}

/// ℓ, m.
fn width(mesh: &TriMesh, vertices: &[u32]) -> f64 {
    let at = |&v: &u32| mesh.positions[v as usize];
    let middle = vertices.iter().map(at).sum::<DVec3>() / vertices.len().max(1) as f64;
    2.0 * vertices.iter().map(|v| at(v).distance(middle)).fold(0.0, f64::max)
}
