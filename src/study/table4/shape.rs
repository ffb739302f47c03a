//! Where a drape hangs and how wide it is: what a tailor measures of it, besides distances of vertices.
//!
//! The hem is the garment's lowest edge as placed, its height the mean of its vertices'. Girths are lengths of the largest closed curve
//! in which a level plane cuts the cloth: [`ABOVE_HEM`] over the hem, half way, and [`BELOW_ARMPITS`] under the armpits, or
//! [`BELOW_TOP`] under the garment's top where that is lower. The planes are those of the canonical drape for all entrants of a row.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::body::girth::{Plane, section};
use crate::garment::sewing::Landmarks;
use crate::scene::Scene;

/// Height of the first girth over the hem, m.
const ABOVE_HEM: f64 = 0.02;
/// Depth of the last girth under the garment's top, m.
const BELOW_TOP: f64 = 0.03;
/// Depth of the last girth under the body's armpits, m: a sleeve leaves its bodice lower than the arm its trunk.
const BELOW_ARMPITS: f64 = 0.08;

/// Where a drape hangs and how wide it is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Silhouette {
    /// Height of the hem, cm; `None` for cloth without an edge.
    pub hem_cm: Option<f64>,
    /// Girths near the hem, half way and near the top, cm; `None` where no closed curve is.
    pub girths_cm: [Option<f64>; 3],
}

/// Where to measure.
#[derive(Debug, Clone)]
pub(super) struct Tape {
    hem: Vec<u32>,
    heights: [f64; 3],
}

impl Tape {
    /// By the canonical drape (m).
    pub(super) fn new(scene: &Scene, canonical: &[DVec3]) -> Self {
        let mean = |edge: &[u32], x: &[DVec3]| edge.iter().map(|&v| x[v as usize].z).sum::<f64>() / edge.len() as f64;
        let placed = &scene.garment.positions;
        let loops = scene.topology.boundary_loops().into_iter().filter(|edge| !edge.is_empty());
        let hem = loops.min_by(|a, b| mean(a, placed).total_cmp(&mean(b, placed))).unwrap_or_default();
        let (low, high) =
            canonical.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.z), h.max(p.z)));
        let bottom = if hem.is_empty() { low } else { mean(&hem, canonical) } + ABOVE_HEM;
        let armpit = Landmarks::of(scene.body.mesh()).armpit_z.unwrap_or(high);
        let top = (high - BELOW_TOP).min(armpit - BELOW_ARMPITS);
        Self { hem, heights: [bottom, 0.5 * (bottom + top), top] }
    }

    pub(super) fn measure(&self, scene: &Scene, x: &[DVec3]) -> Silhouette {
        let draped = scene.garment.with_positions(x.to_vec());
        let hem = self.hem.iter().map(|&v| x[v as usize].z).sum::<f64>() / self.hem.len().max(1) as f64;
        let girth = |z: f64| {
            let curves = section(&draped, Plane::horizontal(z)).into_iter().filter(|curve| curve.closed);
            curves.map(|curve| 100.0 * curve.length()).max_by(f64::total_cmp)
        };
        Silhouette { hem_cm: (!self.hem.is_empty()).then_some(100.0 * hem), girths_cm: self.heights.map(girth) }
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
        let tape = Tape::new(&scene, &scene.garment.positions);
        let wider: Vec<DVec3> =
            scene.garment.positions.iter().map(|p| DVec3::new(1.1 * p.x, 1.1 * p.y, p.z - 0.01)).collect();
        let found = tape.measure(&scene, &wider);
        assert!((found.hem_cm.unwrap() - 49.0).abs() < 1e-9);
        let round = 100.0 * 0.22 * std::f64::consts::TAU;
        for girth in found.girths_cm {
            assert!((girth.unwrap() / round - 1.0).abs() < 2e-3, "{girth:?} expected {round}");
        }
    }
}
