//! One gap: two places of the cloth that are near each other, and the plane between them.

use glam::{DMat3, DVec3};

use crate::mechanics::energy::friction::{ELASTIC_SLIP, huber, stiffening};
use crate::mechanics::energy::membrane::outer;
use crate::mesh::NONE;

/// A gap that has faded to less than this share of its stiffness is gone.
const FADED: f64 = 1e-3;

/// What makes a gap the same one at another time: whose it is and between which features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) kind: Kind,
    /// The vertex and the corners of its feature, the ends of both edges, or those of an edge and the corners of a triangle; [`NONE`]
    /// where there are fewer.
    pub(super) vertices: [u32; 5],
    /// Which of the places that are kept off the body it is; [`NONE`] for a gap of the cloth with itself.
    pub(super) place: u32,
}

/// What faces what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// A vertex and a triangle, or an edge or a corner of one.
    Vertex,
    /// Two edges.
    Edges,
    /// An edge and the triangle that it crosses.
    Crossing,
    /// A place within a triangle, and the body.
    Body,
}

/// A gap as it was when it was last looked for: places and plane stay until the next time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    pub(super) key: Key,
    /// w of each vertex: they add up to zero.
    pub(super) weights: [f64; 5],
    /// The place on the body that it is taken from, m; zero of a gap of the cloth with itself.
    pub(super) body: DVec3,
    /// n, from the second place to the first.
    pub(in crate::mechanics) normal: DVec3,
    /// h: how far apart along n the two places are kept, m.
    pub(super) goal: f64,
    /// κ A, N/m.
    pub(in crate::mechanics) stiffness: f64,
    /// κ A to begin with, N/m.
    pub(super) first: f64,
    /// Whether it is there no more, and fades.
    pub(super) going: bool,
    /// From here on friction counts: Σ w x then, m.
    pub(super) from: DVec3,
    /// Elastic slip that it began with there, m.
    pub(super) slip: DVec3,
    /// μ N of then, N.
    pub(super) limit: f64,
}

impl Gap {
    /// A gap without a past, no plane in it yet.
    pub(super) fn new(key: Key, weights: [f64; 5], goal: f64, stiffness: f64) -> Self {
        let [body, normal, from, slip] = [DVec3::ZERO; 4];
        Self { key, weights, body, normal, goal, stiffness, first: stiffness, going: false, from, slip, limit: 0.0 }
    }

    /// Σ w x, less the place on the body, m: from the second place to the first.
    pub(super) fn across(&self, x: &[DVec3]) -> DVec3 {
        self.members().map(|(v, w)| x[v as usize] * w).sum::<DVec3>() - self.body
    }

    /// Its vertices and their weights.
    pub(crate) fn members(&self) -> impl Iterator<Item = (u32, f64)> + use<> {
        self.key.vertices.into_iter().zip(self.weights).filter(|(v, _)| *v != NONE)
    }

    /// The mean of what its vertices have, each place of the cloth counting alike.
    pub(crate) fn mean(&self, of: &[f64]) -> f64 {
        // Where all have the same it is that one to the last bit.
        let first = of[self.key.vertices[0] as usize];
        let each = if self.key.kind == Kind::Body { 1.0 } else { 0.5 };
        first + each * self.members().map(|(v, w)| w.abs() * (of[v as usize] - first)).sum::<f64>()
    }

    /// What is missing to the goal at `x`, m: positive where they press.
    pub(crate) fn depth(&self, x: &[DVec3]) -> f64 {
        self.goal - self.normal.dot(self.across(x))
    }

    /// The part of the slip since [`from`](Self::from) along the plane, m.
    fn slipped(&self, across: DVec3) -> DVec3 {
        let u = across - self.from + self.slip;
        u - self.normal * self.normal.dot(u)
    }

    /// Its energy (J) and the force on the first place (N), at `x`.
    pub(super) fn push(&self, x: &[DVec3]) -> (f64, DVec3) {
        let across = self.across(x);
        let depth = (self.goal - self.normal.dot(across)).max(0.0);
        let mut energy = 0.5 * self.stiffness * depth * depth;
        let mut force = self.normal * (self.stiffness * depth);
        if self.limit > 0.0 {
            let u = self.slipped(across);
            let y = u.length();
            energy += self.limit * huber(y);
            force -= u * (self.limit / y.max(ELASTIC_SLIP));
        }
        (energy, force)
    }

    /// How the force stiffens with Σ w x, N/m; none where nothing presses.
    pub(super) fn hessian(&self, x: &[DVec3]) -> Option<DMat3> {
        let across = self.across(x);
        let pressed = self.goal > self.normal.dot(across);
        if !pressed && self.limit <= 0.0 {
            return None;
        }
        let nn = outer(self.normal, self.normal);
        let mut block = if pressed { nn * self.stiffness } else { DMat3::ZERO };
        if self.limit > 0.0 {
            block += stiffening(self.limit, DMat3::IDENTITY - nn, self.slipped(across));
        }
        Some(block)
    }

    /// Takes over what the same gap had before: its slip, and a stiffness that had to grow; one that comes or goes nears what it will be by
    /// this share.
    pub(super) fn continues(&mut self, before: &Self, x: &[DVec3], share: f64) {
        let end = if self.going { 0.0 } else { self.stiffness.max(before.stiffness) };
        self.stiffness = if share < 1.0 { before.stiffness + share * (end - before.stiffness) } else { end };
        // A place that went through has the other side's normal now, and must go back.
        if before.normal.dot(self.normal) < 0.0 {
            self.normal = -self.normal;
        }
        let u = before.slipped(before.across(x));
        self.slip = u - self.normal * self.normal.dot(u);
    }
}

/// Adds to the gaps of now those of `before` that are none any more, until they have faded.
pub(super) fn stay(before: &[Gap], gaps: &mut Vec<Gap>) {
    let mut now = gaps.iter().map(|gap| gap.key).peekable();
    let mut staying = Vec::new();
    for gap in before {
        while now.next_if(|key| *key < gap.key).is_some() {}
        let gone = now.peek() != Some(&gap.key) && gap.key.kind != Kind::Crossing;
        if gone && gap.stiffness > FADED * gap.first {
            staying.push(Gap { going: true, ..*gap });
        }
    }
    gaps.extend(staying);
    gaps.sort_unstable_by_key(|gap| gap.key);
}
