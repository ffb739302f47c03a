//! Places within a triangle that keep off the body, as gaps to it.
//!
//! A place is Σ w x over the corners. Seen from there the body is a plane: through its nearest point, across its normal there. Where a place
//! is in the body and the nearest way out leads back through the cloth or along it, nothing is asked: that pulls a limb farther through.

use glam::DVec3;

use super::gap::{Gap, Key, Kind};
use crate::body::distance::{Body, OUTWARD, SurfacePoint};
use crate::mechanics::energy::Cloth;
use crate::mechanics::energy::membrane::Triangle;
use crate::mesh::{NONE, lattice};

/// The distance that a place keeps is the cloth's thickness, but at least this, m: what the body rises between two places of a lattice.
const LEAST_OFFSET: f64 = 6e-4;

/// What is deeper than this is not asked out, m: contact may be felt too late by as much as a triangle sags, not by more.
const DEEPEST: f64 = 0.015;

/// A place within a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mechanics::energy) struct Place {
    /// The corners.
    pub(in crate::mechanics::energy) corners: [u32; 3],
    /// w of each.
    pub(in crate::mechanics::energy) shares: [f64; 3],
    /// Distance it keeps from the body, m.
    pub(in crate::mechanics::energy) offset: f64,
    /// κ A, N/m; none of a place that was given up.
    pub(in crate::mechanics::energy) stiffness: f64,
}

impl Place {
    /// Where it is, m.
    pub(in crate::mechanics::energy) fn at(&self, x: &[DVec3]) -> DVec3 {
        lattice::place(self.corners.map(|v| x[v as usize]), self.shares)
    }

    /// The gap to the body, by this number; `None` where there is no way out of it, for cloth that is wound outward.
    pub(in crate::mechanics::energy) fn gap(&self, number: u32, body: &Body, x: &[DVec3]) -> Option<Gap> {
        let ([a, b, c], [s, t, u]) = (self.corners, self.shares);
        let near = body.nearest(self.at(x));
        if !self.leads_out(&near, x) {
            return None;
        }
        let key = Key { kind: Kind::Body, vertices: [a, b, c, NONE, NONE], place: number };
        let mut gap = Gap::new(key, [s, t, u, 0.0, 0.0], self.offset, self.stiffness);
        (gap.body, gap.normal) = (near.point, near.normal);
        Some(gap)
    }

    /// Whether the way to the point of the body that is `near` leads out of the cloth as well.
    pub(in crate::mechanics::energy) fn leads_out(&self, near: &SurfacePoint, x: &[DVec3]) -> bool {
        let [a, b, c] = self.corners.map(|v| x[v as usize]);
        let out = (b - a).cross(c - a).normalize_or_zero();
        near.signed_distance >= 0.0 || near.signed_distance > -DEEPEST && near.normal.dot(out) > OUTWARD
    }
}

/// The distance that a place within a triangle keeps, m.
pub(in crate::mechanics::energy) fn offset(cloth: &Cloth, triangle: &Triangle) -> f64 {
    let thickness = triangle.vertices.iter().map(|&v| cloth.thickness[v as usize]).sum::<f64>() / 3.0;
    thickness.max(LEAST_OFFSET)
}

/// Places between the vertices of a cloth at `x` (m) that touch the body, within `margin` (m) of what they would keep: the corners with their
/// shares, and the body's normal. As the distance to the body has slope at most one, those of the vertices tell which need not be asked.
pub(in crate::mechanics) fn touching_between(
    cloth: &Cloth,
    body: &Body,
    x: &[DVec3],
    margin: f64,
) -> Vec<([u32; 3], [f64; 3], DVec3)> {
    let far: Vec<f64> = body.nearest_all(x).iter().map(|near| near.signed_distance).collect();
    let mut asked: Vec<(&Triangle, [f64; 3], DVec3)> = Vec::new();
    for t in &*cloth.triangles {
        let keeps = offset(cloth, t) + margin;
        let corners = t.vertices.map(|v| x[v as usize]);
        let clear = |at: DVec3| {
            t.vertices.iter().zip(corners).any(|(&v, corner)| far[v as usize] - corner.distance(at) > keeps)
        };
        let all = lattice::lattice(t.longest_side_m()).map(|shares| (t, shares, lattice::place(corners, shares)));
        asked.extend(all.filter(|(_, _, at)| !clear(*at)));
    }
    let found = body.nearest_all(&asked.iter().map(|(_, _, at)| *at).collect::<Vec<_>>());
    let touches =
        asked.into_iter().zip(found).filter(|((t, ..), near)| near.signed_distance < offset(cloth, t) + margin);
    touches.map(|((t, shares, _), near)| (t.vertices, shares, near.normal)).collect()
}
