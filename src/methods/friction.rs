//! Friction in time: Coulomb's law for implicit steps that are linearised once.
//!
//! A touching vertex sticks or slips. One that sticks has an anchor a where it took hold, and a spring to it:
//! f = −μ_f N u/ε, u = (I − n nᵀ)(x − a), until |u| > ε. One that slips is braked against the way d it goes in the step:
//! f = −μ_f N d/|d|, with the length of the step before in the denominator, so that the step stays linear; it never pulls the vertex
//! back, whatever the step. Under [`SLOW`] it takes hold again, its anchor where the spring pulls as the brake did.
//!
//! The friction of this project's statics ([`energy::friction`](crate::mechanics::energy::friction)) pulls a slipping vertex with
//! μ_f N towards its anchor. In steps of 20 ms a light vertex pressed on the body is thrown past it by centimetres, and back in the
//! next: that swing grew, and a pullover of 4,710 vertices flew apart by it.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ_f | friction coefficient | – |
//! | N | normal force where the step begins | N |
//! | d | tangential displacement in the step | m |
//! | ε | elastic slip, as in statics | m |
//!
//! Source: braking by the displacement of the step after Li and others: "Incremental potential contact", SIGGRAPH 2020; the anchors
//! are ours. Limits: one that slips slower than [`SLOW`] a step passes for one that sticks.

use glam::{DMat3, DVec3};

use crate::mechanics::energy::contact::Touch;
use crate::mechanics::energy::friction::ELASTIC_SLIP;
use crate::mesh::outer;

/// Tangential way in a step below which a slipping vertex takes hold, m: in steps of 20 ms an eighth of the speed that counts as rest.
pub(crate) const SLOW: f64 = 2.5e-5;

/// What a touching vertex does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// Held to a point, m.
    Sticks(DVec3),
    /// Going so far a step, m.
    Slips(f64),
}

/// One vertex's friction in this step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    vertex: u32,
    normal: DVec3,
    /// μ_f N, N.
    limit: f64,
    state: State,
}

/// The friction of every touching vertex.
#[derive(Debug, Clone, Default)]
pub(crate) struct Grip {
    coefficient: f64,
    held: Vec<Held>,
}

impl Grip {
    /// With Coulomb's coefficient.
    #[must_use]
    pub(crate) fn new(coefficient: f64) -> Self {
        Self { coefficient, held: Vec::new() }
    }

    /// Takes what touches at `x` (m), after a step in which the vertices went `way` (m).
    pub(crate) fn refresh(&mut self, touches: &[Touch], x: &[DVec3], way: impl Fn(usize) -> DVec3) {
        if self.coefficient <= 0.0 {
            return;
        }
        let mut old = self.held.iter().peekable();
        let mut held = Vec::with_capacity(touches.len());
        for t in touches {
            while old.next_if(|h| h.vertex < t.vertex).is_some() {}
            let before = old.next_if(|h| h.vertex == t.vertex).map(|h| h.state);
            let at = x[t.vertex as usize];
            let along = |v: DVec3| v - t.normal * t.normal.dot(v);
            let gone = along(way(t.vertex as usize));
            let state = match before {
                None => State::Sticks(at),
                Some(State::Sticks(anchor)) if along(at - anchor).length() <= ELASTIC_SLIP => State::Sticks(anchor),
                Some(State::Slips(_)) if gone.length() < SLOW => State::Sticks(at - gone * (ELASTIC_SLIP / SLOW)),
                Some(_) => State::Slips(gone.length().max(SLOW)),
            };
            held.push(Held { vertex: t.vertex, normal: t.normal, limit: self.coefficient * t.force(), state });
        }
        self.held = held;
    }

    /// Vertex, force (N) where the step begins, and stiffness (N/m) of each.
    pub(crate) fn terms<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (u32, DVec3, DMat3)> + 'a {
        self.held.iter().map(|h| {
            let n = h.normal;
            let tangent = DMat3::IDENTITY - outer(n, n);
            match h.state {
                State::Sticks(anchor) => {
                    let stiffness = tangent * (h.limit / ELASTIC_SLIP);
                    (h.vertex, -(stiffness * (x[h.vertex as usize] - anchor)), stiffness)
                }
                State::Slips(way) => (h.vertex, DVec3::ZERO, tangent * (h.limit / way)),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of unit mass pushed along a plane by `push` (N) under a normal force of 1 N: where it is after each of `steps`.
    fn pushed(push: impl Fn(usize) -> f64, friction: f64, steps: usize) -> Vec<f64> {
        let (h, mut x, mut v, mut grip) = (0.02, DVec3::ZERO, DVec3::ZERO, Grip::new(friction));
        let touch = Touch { vertex: 0, depth: 1e-3, normal: DVec3::Z, stiffness: 1e3 };
        let mut ways = Vec::new();
        for step in 0..steps {
            grip.refresh(&[touch], &[x], |_| v * h);
            let (_, force, stiffness) = grip.terms(&[x]).next().unwrap();
            let d = (1.0 * (v / h) + force + DVec3::X * push(step)).x / (1.0 / (h * h) + stiffness.x_axis.x);
            x.x += d;
            v = DVec3::X * (d / h);
            ways.push(x.x);
        }
        ways
    }

    #[test]
    fn what_is_pushed_by_less_than_friction_bears_stays_and_by_more_accelerates() {
        // Pushed at once it overshoots its hold, takes a new one, and stays there.
        let held = pushed(|_| 0.25, 0.3, 500);
        assert!(held.iter().all(|x| *x < 3.0 * ELASTIC_SLIP), "{:?}", held.last());
        assert!((held[499] - held[100]).abs() < 1e-6, "creeps");
        // a = (F − μN)/m.
        let gone = pushed(|_| 0.8, 0.3, 200);
        let exact = 0.5 * 0.5 * 4.0f64.powi(2);
        assert!((gone[199] / exact - 1.0).abs() < 0.05, "{} expected {exact}", gone[199]);
    }

    #[test]
    fn what_slides_comes_to_rest_where_coulomb_has_it_and_never_goes_back() {
        // Pushed for a second, then let go: it goes on for v²/2μg.
        let ways = pushed(|step| if step < 50 { 0.8 } else { 0.0 }, 0.3, 400);
        assert!(ways.windows(2).all(|w| w[1] >= w[0] - ELASTIC_SLIP), "went back");
        let exact = 0.25 + 0.25 / 0.6;
        // Backward Euler is of first order: 5 % in steps of 20 ms, 1 % in steps of 5.
        assert!((ways[399] / exact - 1.0).abs() < 0.08, "{} expected {exact}", ways[399]);
        assert!((ways[399] - ways[380]).abs() < 1e-6);
    }
}
