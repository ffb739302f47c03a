//! Untangling: cloth that intersects itself is moved apart along the intersection line.
//!
//! Two surfaces intersect along a line that ends at edges or is closed. For an edge with unit direction E that intersects a triangle of
//! normal N, the line continues in each triangle at the edge along R, in both planes. Moving the edge against the triangle by δ changes the
//! length of the line by −G·δ with
//!
//! G = Σ (R − 2 (E·R)/(E·N) N)  over the triangles at the edge,
//!
//! so the edge is pulled along G by a mean edge, and the triangle against it, until no line is left. No choice of sides is needed.
//! Source: Volino and Magnenat-Thalmann: "Resolving surface collisions through intersection contour minimization", ACM TOG
//! 25(3), 2006, equation 3.
//!
//! Limits: a contour that cannot shrink (a tube pulled over a tube the wrong way round) remains.

use std::collections::BTreeMap;

use glam::DVec3;

use super::gap::{Gap, Key, Kind};
use super::surface::Surface;
use crate::mesh::NONE;

/// Gaps of this stiffness, N/m³, that pull apart the intersecting `pairs` of triangles at `x`.
pub(super) fn gaps(surface: &Surface, x: &[DVec3], pairs: &[[u32; 2]], stiffness: f64) -> Vec<Gap> {
    let mut found = BTreeMap::new();
    for &[t, u] in pairs {
        for (one, other) in [(t, u), (u, t)] {
            let [a, b, c] = surface.triangles[one as usize];
            for side in [[a, b], [b, c], [c, a]] {
                let edge = surface.topology.edge_between(side[0], side[1]);
                if let Some(gap) = edge.and_then(|edge| crossing(surface, x, edge, other as usize, stiffness)) {
                    found.insert(gap.key, gap);
                }
            }
        }
    }
    found.into_values().collect()
}

fn crossing(surface: &Surface, x: &[DVec3], edge: usize, triangle: usize, stiffness: f64) -> Option<Gap> {
    let ([p, q], corners) = (surface.topology.edges[edge], surface.triangles[triangle]);
    if corners.contains(&p) || corners.contains(&q) {
        return None;
    }
    let ends = [p, q].map(|v| x[v as usize]);
    let [a, b, c] = corners.map(|v| x[v as usize]);
    let double_area = (b - a).cross(c - a);
    let n = double_area.normalize_or_zero();
    let along = ends[1] - ends[0];
    let share = n.dot(a - ends[0]) / n.dot(along);
    let at = ends[0] + along * share;
    let of = |u: DVec3, v: DVec3| (u - at).cross(v - at).dot(n) / double_area.length();
    let shares = [of(b, c), of(c, a), of(a, b)];
    // Rounding at a corner does not matter: the neighbouring edge intersects as well.
    if !(0.0..=1.0).contains(&share) || !shares.iter().all(|s| *s >= 0.0) {
        return None;
    }
    let e = along.normalize_or_zero();
    let mut g = DVec3::ZERO;
    for wing in surface.wings[edge].into_iter().filter(|w| *w != NONE) {
        let inward = x[wing as usize] - at;
        let line = n.cross(along.cross(inward)).normalize_or_zero();
        // R points into the triangle, to the side of the third corner.
        let across = inward - e * e.dot(inward);
        let r = if line.dot(across) < 0.0 { -line } else { line };
        g += r - n * (2.0 * e.dot(r) / e.dot(n));
    }
    let length = g.length();
    let key = Key { kind: Kind::Crossing, vertices: [p, q, corners[0], corners[1], corners[2]], place: NONE };
    let weights = [1.0 - share, share, -shares[0], -shares[1], -shares[2]];
    let mut gap = Gap::new(key, weights, 0.0, stiffness * surface.edge_areas[edge]);
    gap.normal = g / length;
    gap.goal = gap.normal.dot(gap.across(x)) + surface.edge_m;
    (length > 1e-6 && gap.goal.is_finite()).then_some(gap)
}
