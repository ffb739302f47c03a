//! A gap: two places of the cloth that are near each other, and the plane between them.

use glam::{DMat3, DVec3};

use crate::mechanics::energy::friction::{ELASTIC_SLIP, huber, tangential_stiffness};
use crate::mechanics::energy::membrane::outer;
use crate::mesh::NONE;

/// Identifies a gap across refreshes: the features it connects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    pub(crate) kind: Kind,
    /// The vertex and the corners of the opposite feature, the ends of both edges, or the ends of an edge and the corners of a triangle;
    /// [`NONE`] where there are fewer.
    pub(crate) vertices: [u32; 5],
    /// Number of the contact place within a triangle; [`NONE`] for a gap of the cloth with itself.
    pub(crate) place: u32,
}

/// The two features of a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// A vertex and a triangle, or an edge or a corner of one.
    Vertex,
    /// Two edges.
    Edges,
    /// An edge and the triangle that it intersects.
    Crossing,
    /// A place within a triangle, and the body.
    Body,
}

/// A gap as of the last refresh; its places and its plane are constant until the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gap {
    pub(crate) key: Key,
    /// w of each vertex: they sum to zero.
    pub(super) weights: [f64; 5],
    /// The point of the body, m; zero for a gap of the cloth with itself.
    pub(crate) body: DVec3,
    /// n, from the second place to the first.
    pub(crate) normal: DVec3,
    /// h: distance along n that the two places keep, m.
    pub(super) goal: f64,
    /// κ A, N/m.
    pub(crate) stiffness: f64,
    /// Initial κ A, N/m.
    pub(super) first: f64,
    /// Σ w x at the refresh, m: the origin of the slip.
    pub(super) from: DVec3,
    /// Elastic slip at the refresh, m.
    pub(super) slip: DVec3,
    /// μ N at the refresh, N.
    pub(super) limit: f64,
}

impl Gap {
    /// A gap without history; its plane is set by the caller.
    pub(crate) fn new(key: Key, weights: [f64; 5], goal: f64, stiffness: f64) -> Self {
        let [body, normal, from, slip] = [DVec3::ZERO; 4];
        Self { key, weights, body, normal, goal, stiffness, first: stiffness, from, slip, limit: 0.0 }
    }

    /// Σ w x minus the point of the body, m: from the second place to the first.
    pub(super) fn across(&self, x: &[DVec3]) -> DVec3 {
        self.members().map(|(v, w)| x[v as usize] * w).sum::<DVec3>() - self.body
    }

    /// Its vertices and their weights.
    pub(crate) fn members(&self) -> impl Iterator<Item = (u32, f64)> + use<> {
        self.key.vertices.into_iter().zip(self.weights).filter(|(v, _)| *v != NONE)
    }

    /// Mean of a quantity of the vertices, with equal weights of the two places of the cloth.
    pub(crate) fn mean(&self, of_vertices: &[f64]) -> f64 {
        // Differences to the first vertex, so that the mean of equal numbers has their bits.
        let first = of_vertices[self.key.vertices[0] as usize];
        let each = if self.key.kind == Kind::Body { 1.0 } else { 0.5 };
        first + each * self.members().map(|(v, w)| w.abs() * (of_vertices[v as usize] - first)).sum::<f64>()
    }

    /// h minus the distance at `x`, m: positive where the gap presses.
    pub(crate) fn depth(&self, x: &[DVec3]) -> f64 {
        self.goal - self.normal.dot(self.across(x))
    }

    /// Tangential slip at this Σ w x, m.
    fn tangential_slip(&self, across: DVec3) -> DVec3 {
        let u = across - self.from + self.slip;
        u - self.normal * self.normal.dot(u)
    }

    /// Energy (J) and force on the first place (N) at `x`.
    pub(super) fn energy_and_force(&self, x: &[DVec3]) -> (f64, DVec3) {
        let across = self.across(x);
        let depth = (self.goal - self.normal.dot(across)).max(0.0);
        let mut energy = 0.5 * self.stiffness * depth * depth;
        let mut force = self.normal * (self.stiffness * depth);
        if self.limit > 0.0 {
            let u = self.tangential_slip(across);
            let y = u.length();
            energy += self.limit * huber(y);
            force -= u * (self.limit / y.max(ELASTIC_SLIP));
        }
        (energy, force)
    }

    /// Second derivative of the energy by Σ w x, N/m; `None` where nothing presses.
    pub(super) fn hessian(&self, x: &[DVec3]) -> Option<DMat3> {
        let across = self.across(x);
        let pressed = self.goal > self.normal.dot(across);
        if !pressed && self.limit <= 0.0 {
            return None;
        }
        let nn = outer(self.normal, self.normal);
        let mut block = if pressed { nn * self.stiffness } else { DMat3::ZERO };
        if self.limit > 0.0 {
            block += tangential_stiffness(self.limit, DMat3::IDENTITY - nn, self.tangential_slip(across));
        }
        Some(block)
    }

    /// Takes over the slip and the raised stiffness of the same gap before the refresh, if the two places have not changed sides. The
    /// stiffness and the plane approach their new values by this share: where the nearest points of two states lie on two faces of the body or
    /// of the cloth, either state leads to the other, and a plane between both holds the gap at rest.
    pub(super) fn inherit(&mut self, before: &Self, x: &[DVec3], share: f64) {
        // Gaps near an intersection are left out, so a place on the other side went round an edge of the cloth.
        if before.normal.dot(self.normal) < 0.0 {
            return;
        }
        let end = self.stiffness.max(before.stiffness);
        self.stiffness = if share < 1.0 { before.stiffness + share * (end - before.stiffness) } else { end };
        if share < 1.0 {
            self.normal = before.normal.lerp(self.normal, share).normalize_or(self.normal);
            self.body = before.body.lerp(self.body, share);
        }
        let u = before.tangential_slip(before.across(x));
        self.slip = u - self.normal * self.normal.dot(u);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_went_round_an_edge_is_pushed_to_the_side_where_it_is() {
        let x = [DVec3::new(0.0, 0.0, 1e-3), DVec3::ZERO];
        let key = Key { kind: Kind::Vertex, vertices: [0, 1, NONE, NONE, NONE], place: NONE };
        let gap = |normal: DVec3, stiffness: f64| {
            let mut gap = Gap::new(key, [1.0, -1.0, 0.0, 0.0, 0.0], 2e-3, stiffness);
            (gap.normal, gap.from) = (normal, gap.across(&x));
            gap
        };
        for (before, stiffness) in [(DVec3::Z, 64.0), (DVec3::NEG_Z, 1.0)] {
            let mut now = gap(DVec3::Z, 1.0);
            now.inherit(&gap(before, 64.0), &x, 1.0);
            assert_eq!((now.normal, now.stiffness), (DVec3::Z, stiffness));
        }
    }
}
