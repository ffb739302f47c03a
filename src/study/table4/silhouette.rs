//! Hem height and girths of a drape.
//!
//! The hem is the garment's lowest edge as placed; its height is the mean height of its vertices. A girth is the length of
//! the largest closed curve in which a level plane cuts the cloth. The planes lie [`ABOVE_HEM`] over the hem, half way, and
//! [`BELOW_ARMPITS`] under the armpits, or [`BELOW_TOP`] under the garment's top where that is lower. All methods of a row
//! are cut at the planes of the canonical drape.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::quantiles::extremes;
use crate::body::girth::{Plane, section};
use crate::garment::sewing::Landmarks;
use crate::scene::Scene;
use crate::study::accuracy::shape::{lowest_edge, mean_height};

/// Height of the first girth over the hem, m. Heuristic: just above the edge, whose folds are the largest.
const ABOVE_HEM: f64 = 0.02;
/// Depth of the last girth under the garment's top, m. Heuristic: just below the edge.
const BELOW_TOP: f64 = 0.03;
/// Depth of the last girth under the body's armpits, m. A sleeve leaves its bodice lower than the arm leaves the trunk; a
/// smaller depth would cut the sleeves too.
const BELOW_ARMPITS: f64 = 0.08;

/// Hem height and girths of a drape.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Silhouette {
    /// Height of the hem, cm; `None` for cloth without an edge.
    pub hem_cm: Option<f64>,
    /// Girths near the hem, half way and near the top, cm; `None` where the plane cuts no closed curve.
    pub girths_cm: [Option<f64>; 3],
}

/// The hem and the heights of the planes.
#[derive(Debug, Clone)]
pub(super) struct SectionHeights {
    hem: Option<Vec<u32>>,
    heights: [f64; 3],
}

impl SectionHeights {
    /// The planes of the canonical drape (m).
    pub(super) fn new(scene: &Scene, canonical: &[DVec3]) -> Self {
        let hem = lowest_edge(&scene.topology, &scene.garment.positions);
        let (low, high) = extremes(canonical.iter().map(|p| p.z));
        let bottom = hem.as_ref().map_or(low, |hem| mean_height(hem, canonical)) + ABOVE_HEM;
        let armpit = Landmarks::of(scene.body.mesh()).armpit_z.unwrap_or(high);
        let top = (high - BELOW_TOP).min(armpit - BELOW_ARMPITS);
        Self { hem, heights: [bottom, 0.5 * (bottom + top), top] }
    }

    /// Hem and girths of the garment at `positions` (m).
    pub(super) fn measure(&self, scene: &Scene, positions: &[DVec3]) -> Silhouette {
        let draped = scene.garment.with_positions(positions.to_vec());
        let girth = |z: f64| {
            let curves = section(&draped, Plane::horizontal(z)).into_iter().filter(|curve| curve.closed);
            curves.map(|curve| 100.0 * curve.length()).max_by(f64::total_cmp)
        };
        let hem_cm = self.hem.as_ref().map(|hem| 100.0 * mean_height(hem, positions));
        Silhouette { hem_cm, girths_cm: self.heights.map(girth) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;

    #[test]
    fn a_tube_has_its_hem_and_its_girths() {
        // A tube of radius 20 cm from 0.5 to 1.1 m about a box from 0 to 2 m.
        let corner = |i: usize| {
            DVec3::new((i & 1) as f64 - 0.5, (i >> 1 & 1) as f64 - 0.5, 4.0 * (i >> 2 & 1) as f64)
                * DVec3::new(0.2, 0.2, 0.5)
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let body = TriMesh::new(
            (0..8).map(corner).collect(),
            quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        );
        let (n, rows) = (64u32, 7u32);
        let at = |k: u32, j: u32| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            DVec3::new(0.2 * cos, 0.2 * sin, 0.5 + 0.1 * f64::from(j))
        };
        let positions = (0..rows).flat_map(|j| (0..n).map(move |k| at(k, j))).collect();
        let cell = |k: u32, j: u32| {
            let [a, b, c, d] = [(k, j), ((k + 1) % n, j), ((k + 1) % n, j + 1), (k, j + 1)].map(|(k, j)| j * n + k);
            [[a, b, c], [a, c, d]]
        };
        let triangles = (0..rows - 1).flat_map(|j| (0..n).flat_map(move |k| cell(k, j))).collect();
        let scene = Scene::of_meshes(&body, TriMesh::new(positions, triangles)).unwrap();
        let heights = SectionHeights::new(&scene, &scene.garment.positions);
        let wider: Vec<DVec3> =
            scene.garment.positions.iter().map(|p| DVec3::new(1.1 * p.x, 1.1 * p.y, p.z - 0.01)).collect();
        let found = heights.measure(&scene, &wider);
        assert!((found.hem_cm.unwrap() - 49.0).abs() < 1e-9);
        let round = 100.0 * 0.22 * std::f64::consts::TAU;
        for girth in found.girths_cm {
            assert!((girth.unwrap() / round - 1.0).abs() < 2e-3, "{girth:?} expected {round}");
        }
    }
}
