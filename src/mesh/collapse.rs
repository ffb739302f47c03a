//! What a collapse makes of the triangles about it.

use glam::DVec3;

use super::half_edge::{HalfEdgeMesh, previous};

/// A collapse may turn no triangle further than this: cos 60°.
const LARGEST_TURN: f64 = 0.5;

/// A triangle one of whose corners moves.
pub(crate) struct Moved {
    /// As they were, the one that moves first, m.
    pub(crate) corners: [DVec3; 3],
    /// Whether it turns too far, or is left without area.
    pub(crate) turns: bool,
    /// Its longer side at the corner that moves, afterwards, m.
    pub(crate) longest: f64,
}

impl HalfEdgeMesh {
    /// Calls `f` with every triangle at `v` but those that `gone` is in, as it is when `v` moves to `to`, m.
    pub(crate) fn around_moved(&self, v: u32, gone: u32, to: DVec3, mut f: impl FnMut(Moved)) {
        let from = self.positions[v as usize];
        self.around(v, |h| {
            let ends = [self.target(h), self.origin(previous(h))];
            if !ends.contains(&gone) {
                let [b, c] = ends.map(|v| self.positions[v as usize]);
                let (old, new) = ((b - from).cross(c - from), (b - to).cross(c - to));
                let turns = new.dot(old) < LARGEST_TURN * new.length() * old.length() || new.length_squared() <= 0.0;
                f(Moved { corners: [from, b, c], turns, longest: b.distance(to).max(c.distance(to)) });
            }
        });
    }
}
