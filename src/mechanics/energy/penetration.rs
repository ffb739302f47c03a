//! Vertices inside the body though contact holds them: told by the exact distance, mended in what contact goes by.
//!
//! Contact goes by a rounded distance q ([`field`](super::field)), which at a narrow place is more than the exact one s by as much as a thin cloth
//! is thick: a vertex may keep its offset h and still be inside. No stiffness mends that; h + q − s for h does, since then
//! κ A (h + q − s − q) = κ A (h − s). Only where q itself is under zero is the contact pressed in, and κ too small.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s | exact signed distance to the body, negative inside | m |
//! | q | rounded distance | m |
//! | h | distance that a vertex keeps | m |
//! | κ, A | contact stiffness, area of the vertex | N/m³, m² |
//!
//! Limits: q − s is taken where the vertex is, and changes as it slides. What does not touch by q is not looked at. The pressure that is told
//! afterwards (`mechanics::fit`) goes by h as it was: at such a vertex it is less than what carries it.

use glam::DVec3;

use super::contact::{Contacts, Touch};
use super::field::SIDE;

/// Times that κ grows where a contact is pressed in.
const STIFFER: f64 = 4.0;

/// A vertex inside the body.
struct Inside {
    vertex: u32,
    /// q and s there, m.
    rounded: f64,
    exact: f64,
}

impl Contacts<'_> {
    /// Vertices inside the body at the positions `x` last updated, and the deepest's depth (m), by the exact distance.
    #[must_use]
    pub(crate) fn penetration(&self, x: &[DVec3]) -> (usize, f64) {
        self.inside(x).fold((0, 0.0), |(n, deepest), inside| (n + 1, deepest.max(-inside.exact)))
    }

    /// Keeps out what is inside the body at the positions `x` last updated, if anything is; takes effect with the next
    /// [`update`](Self::update).
    pub(crate) fn keep_out(&mut self, x: &[DVec3]) -> bool {
        let inside: Vec<Inside> = self.inside(x).collect();
        let (any, mut pressed) = (!inside.is_empty(), false);
        for Inside { vertex, rounded, exact } in inside {
            let v = vertex as usize;
            self.offsets[v] += (rounded - exact).max(0.0);
            self.keep(v, x[v], rounded);
            pressed |= rounded <= 0.0;
        }
        if pressed {
            self.stiffen(STIFFER);
        }
        any
    }

    fn inside(&self, x: &[DVec3]) -> impl Iterator<Item = Inside> {
        let of_touch = move |&Touch { vertex, depth, .. }: &Touch| {
            let rounded = self.offsets[vertex as usize] - depth;
            // The rounded distance is more than the exact one by less than the lattice's side: see `field`.
            let body = self.body().filter(|_| rounded < SIDE)?;
            let exact = body.nearest(x[vertex as usize]).signed_distance;
            (exact < 0.0).then_some(Inside { vertex, rounded, exact })
        };
        self.touches.iter().filter_map(of_touch)
    }
}
