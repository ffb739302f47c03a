//! Places within a triangle that keep off the body, as gaps to it.
//!
//! A place is Σ w x over the corners. Seen from there the body is a plane: through its nearest point, across its normal there. A place that
//! is deep in the body is asked to go no farther at a time than [`STRIDE`].

use glam::DVec3;

use super::gap::{Gap, Key, Kind, NONE};
use crate::distance::Body;
use crate::mesh::lattice;

/// A place is asked to go no farther than this between two looks, m.
const STRIDE: f64 = 0.01;

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

    /// The gap to the body, by this number.
    pub(in crate::mechanics::energy) fn gap(&self, number: u32, body: &Body, x: &[DVec3]) -> Gap {
        let ([a, b, c], [s, t, u]) = (self.corners, self.shares);
        let key = Key { kind: Kind::Body, vertices: [a, b, c, NONE, NONE], place: number };
        let mut gap = Gap::new(key, [s, t, u, 0.0, 0.0], self.offset, self.stiffness);
        let near = body.nearest(self.at(x));
        (gap.body, gap.normal) = (near.point, near.normal);
        if gap.goal - near.signed_distance > STRIDE {
            gap.goal = near.signed_distance + STRIDE;
            // It is on its way, not pressed.
            gap.first = 0.0;
        }
        gap
    }
}
