//! Friction in time: Coulomb's law for implicit steps that are linearised once.
//!
//! A touching vertex sticks or slips. One that sticks has an anchor a, where its contact began, and a spring to it:
//! f = −μ_f N u/ε, u = (I − n nᵀ)(x − a), until |u| > ε. One that slips is braked against its displacement d in the step:
//! f = −μ_f N d/|d|. The denominator is the length of the step before, so that the step stays linear; the force never pulls the vertex
//! back, in steps of any length. Below [`STICK_DISPLACEMENT`] it sticks again, with the anchor where the spring's force equals the
//! braking force.
//!
//! The friction of this project's statics ([`energy::friction`](crate::mechanics::energy::friction)) pulls a slipping vertex with
//! μ_f N towards its anchor. In steps of 20 ms that overshoots: a light vertex pressed on the body is thrown past its anchor by
//! centimetres, and back in the next step, with growing amplitude. A pullover of 4,710 vertices diverged by it.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ_f | friction coefficient | – |
//! | N | normal force at the start of the step | N |
//! | d | tangential displacement in the step | m |
//! | ε | elastic slip, as in statics | m |
//!
//! Source: braking by the displacement of the step after Li and others: "Incremental potential contact", SIGGRAPH 2020; the anchors
//! are ours. Limits: a vertex that slips by less than [`STICK_DISPLACEMENT`] a step counts as sticking.

use glam::{DMat3, DVec3};

use crate::mechanics::energy::Touch;
use crate::mechanics::energy::friction::ELASTIC_SLIP;
use crate::mesh::outer;

/// Tangential displacement in a step below which a slipping vertex sticks, m: in steps of 20 ms an eighth of the speed that counts as
/// rest. Larger values end sliding early. A heuristic.
const STICK_DISPLACEMENT: f64 = 2.5e-5;

/// Sticking or slipping.
#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// by a spring to this anchor, m.
    Sticks(DVec3),
    /// by this displacement a step, m.
    Slips(f64),
}

/// The friction of one vertex in this step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct VertexFriction {
    vertex: u32,
    normal: DVec3,
    /// μ_f N, N.
    limit: f64,
    state: State,
}

/// The friction of all touching vertices.
#[derive(Debug, Clone, Default)]
pub(crate) struct Friction {
    coefficient: f64,
    vertices: Vec<VertexFriction>,
}

impl Friction {
    /// Friction with this coefficient and no contact yet.
    pub(crate) fn new(coefficient: f64) -> Self {
        Self { coefficient, vertices: Vec::new() }
    }

    /// Updates the state to the contacts at `x` (m), after a step of these displacements (m).
    pub(crate) fn refresh(&mut self, touches: &[Touch], x: &[DVec3], displacement: impl Fn(usize) -> DVec3) {
        if self.coefficient <= 0.0 {
            return;
        }
        let mut old = self.vertices.iter().peekable();
        let mut vertices = Vec::with_capacity(touches.len());
        for t in touches {
            while old.next_if(|h| h.vertex < t.vertex).is_some() {}
            let before = old.next_if(|h| h.vertex == t.vertex).map(|h| h.state);
            let at = x[t.vertex as usize];
            let along = |v: DVec3| v - t.normal * t.normal.dot(v);
            let slip = along(displacement(t.vertex as usize));
            let state = match before {
                None => State::Sticks(at),
                Some(State::Sticks(anchor)) if along(at - anchor).length() <= ELASTIC_SLIP => State::Sticks(anchor),
                Some(State::Slips(_)) if slip.length() < STICK_DISPLACEMENT => {
                    State::Sticks(at - slip * (ELASTIC_SLIP / STICK_DISPLACEMENT))
                }
                Some(_) => State::Slips(slip.length().max(STICK_DISPLACEMENT)),
            };
            vertices.push(VertexFriction {
                vertex: t.vertex,
                normal: t.normal,
                limit: self.coefficient * t.force(),
                state,
            });
        }
        self.vertices = vertices;
    }

    /// Vertex, force at the start of the step (N) and stiffness (N/m) of each.
    pub(crate) fn terms<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (u32, DVec3, DMat3)> + 'a {
        self.vertices.iter().map(|h| {
            let n = h.normal;
            let tangent = DMat3::IDENTITY - outer(n, n);
            match h.state {
                State::Sticks(anchor) => {
                    let stiffness = tangent * (h.limit / ELASTIC_SLIP);
                    (h.vertex, -(stiffness * (x[h.vertex as usize] - anchor)), stiffness)
                }
                State::Slips(slip) => (h.vertex, DVec3::ZERO, tangent * (h.limit / slip)),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions after each of `steps` of a block of unit mass pushed along a plane by `push` (N) under a normal force of 1 N.
    fn pushed(push: impl Fn(usize) -> f64, coefficient: f64, steps: usize) -> Vec<f64> {
        let (h, mut x, mut v, mut friction) = (0.02, DVec3::ZERO, DVec3::ZERO, Friction::new(coefficient));
        let touch = Touch { vertex: 0, depth: 1e-3, normal: DVec3::Z, stiffness: 1e3 };
        let mut positions = Vec::new();
        for step in 0..steps {
            friction.refresh(&[touch], &[x], |_| v * h);
            let (_, force, stiffness) = friction.terms(&[x]).next().unwrap();
            let d = (1.0 * (v / h) + force + DVec3::X * push(step)).x / (1.0 / (h * h) + stiffness.x_axis.x);
            x.x += d;
            v = DVec3::X * (d / h);
            positions.push(x.x);
        }
        positions
    }

    #[test]
    fn a_push_below_the_friction_force_moves_nothing_and_a_larger_one_accelerates() {
        // The sudden push exceeds the elastic slip once; then the block sticks at a new anchor.
        let stuck = pushed(|_| 0.25, 0.3, 500);
        assert!(stuck.iter().all(|x| *x < 3.0 * ELASTIC_SLIP), "{:?}", stuck.last());
        assert!((stuck[499] - stuck[100]).abs() < 1e-6, "creeps");
        // a = (F − μN)/m.
        let moved = pushed(|_| 0.8, 0.3, 200);
        let exact = 0.5 * 0.5 * 4.0f64.powi(2);
        assert!((moved[199] / exact - 1.0).abs() < 0.05, "{} expected {exact}", moved[199]);
    }

    #[test]
    fn a_sliding_block_stops_where_coulomb_predicts_and_never_goes_back() {
        // Pushed for a second, then released: it slides on for v²/2μg.
        let positions = pushed(|step| if step < 50 { 0.8 } else { 0.0 }, 0.3, 400);
        assert!(positions.windows(2).all(|w| w[1] >= w[0] - ELASTIC_SLIP), "went back");
        let exact = 0.25 + 0.25 / 0.6;
        // Backward Euler is of first order: 5 % in steps of 20 ms, 1 % in steps of 5.
        assert!((positions[399] / exact - 1.0).abs() < 0.08, "{} expected {exact}", positions[399]);
        assert!((positions[399] - positions[380]).abs() < 1e-6);
    }
}
