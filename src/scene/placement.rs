//! Placement of a garment around a body before the drape: distances, crossings, and orientation.

use glam::DVec3;
use serde::Serialize;

use super::SceneError;
use crate::base::quantiles::Percentiles;
use crate::body::distance::Body;
use crate::mesh::{Topology, TriMesh};

/// Largest distance, m, from the body to the nearest vertex of a garment that is worn: the loosest gown hangs from a
/// shoulder or a waist.
const MAX_BODY_DISTANCE: f64 = 1.0;

/// Distances from the body, m, at which cloth outside it and inside it counts half as [`closeness`]. Heuristics: clothes lie 2 to 8 cm
/// outside, and 1 cm inside where they were made for another body.
const HALF_OUTSIDE: f64 = 0.05;
const HALF_INSIDE: f64 = 0.01;

/// Share of cloth deeper than [`HALF_INSIDE`] that halves the closeness. A heuristic: three built-in garments have none in the right
/// frame, and 6 to 17 % turned by any quarter turn about the middle of the body.
const HALF_DEEP: f64 = 0.03;

/// Metrics of a garment around its body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Placement {
    /// Garment vertices inside the body.
    pub penetrating_vertices: usize,
    /// Depth of the deepest of them, m.
    pub deepest_m: f64,
    /// Pairs of a garment and a body triangle that cross, by exact predicates.
    pub crossing_pairs: usize,
    /// Signed distances of the garment's vertices to the body, m.
    pub clearance_m: Percentiles,
}

impl Placement {
    /// Measures a garment about its body.
    #[must_use]
    pub fn new(garment: &TriMesh, body: &Body) -> Self {
        let distance: Vec<f64> = body.nearest_all(&garment.positions).iter().map(|near| near.signed_distance).collect();
        Self {
            penetrating_vertices: distance.iter().filter(|&&q| q < 0.0).count(),
            deepest_m: distance.iter().fold(0.0, |deepest, &q| f64::max(deepest, -q)),
            crossing_pairs: body.crossing_pairs(garment).len(),
            clearance_m: Percentiles::of(&distance),
        }
    }

    /// Name and value of each metric, as rows of a table.
    pub(crate) fn rows(&self) -> Vec<(&'static str, String)> {
        let inside = match self.penetrating_vertices {
            0 => "none".to_owned(),
            n => format!("{n} vertices, up to {:.1} mm deep", 1e3 * self.deepest_m),
        };
        vec![
            ("inside the body", inside),
            ("triangle pairs that cross", self.crossing_pairs.to_string()),
            ("clearance, mm", self.clearance_m.text(1e3, 1)),
        ]
    }
}

/// How closely points (m) lie about a body, from 0 to 1: the mean of 1 / (1 + (q/h)²), q the signed distance of each and h that which
/// counts half, and by the same rule less for the share of deep points.
#[must_use]
pub fn closeness(body: &Body, points: &[DVec3]) -> f64 {
    let half = |x: f64, at: f64| 1.0 / (1.0 + (x / at).powi(2));
    let near: Vec<f64> = body.nearest_all(points).iter().map(|near| near.signed_distance).collect();
    let share = |sum: f64| sum / points.len().max(1) as f64;
    let close = near.iter().map(|&q| half(q, if q < 0.0 { HALF_INSIDE } else { HALF_OUTSIDE })).sum();
    let deep = near.iter().filter(|q| **q < -HALF_INSIDE).count() as f64;
    share(close) * half(share(deep), HALF_DEEP)
}

/// Rejects a garment of which every vertex is farther than [`MAX_BODY_DISTANCE`] from the body.
pub(super) fn check_near(garment: &TriMesh, body: &Body) -> Result<(), SceneError> {
    let distances = body.nearest_all(&garment.positions);
    let nearest = distances.iter().map(|near| near.signed_distance.abs()).fold(f64::INFINITY, f64::min);
    if nearest > MAX_BODY_DISTANCE { Err(SceneError::NotNear { nearest, limit: MAX_BODY_DISTANCE }) } else { Ok(()) }
}

/// Whether each triangle belongs to a connected part whose normals point towards the body and whose winding must be
/// reversed: a part of which the area-weighted sum of n · ∇q is negative.
#[must_use]
pub fn facing_body(garment: &TriMesh, body: &Body) -> Vec<bool> {
    let (component, count) = Topology::new(garment).components();
    let centroids: Vec<_> = (0..garment.triangles.len())
        .map(|t| {
            let [a, b, c] = garment.corners(t);
            (a + b + c) / 3.0
        })
        .collect();
    let mut outward = vec![0.0; count];
    let part = |t: usize| component[garment.triangles[t][0] as usize] as usize;
    for (t, near) in body.nearest_all(&centroids).iter().enumerate() {
        outward[part(t)] += garment.double_area_vector(t).dot(near.normal);
    }
    (0..garment.triangles.len()).map(|t| outward[part(t)] < 0.0).collect()
}
