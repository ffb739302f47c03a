//! Friction: where the cloth rests on the body it holds on, up to Coulomb's limit.
//!
//! Each touching vertex has an anchor a on the body and a tangential spring that yields at μ_f N:
//!
//! E = μ_f N φ(|u|), u = (I − n nᵀ)(x − a), φ(y) = y²/2ε for y < ε, y − ε/2 beyond,
//!
//! so the force is μ_f N u/ε while it sticks and μ_f N û once it slips. N, n and a are those of the last
//! [`refresh`](Friction::refresh) (the lagging of Li and others: "Incremental potential contact", SIGGRAPH 2020), which makes
//! the force the gradient of an energy in between. A refresh also drags the anchor of a slipped vertex to ε behind it: the
//! return mapping of plasticity, here for statics. A state that repeats itself under a refresh is in equilibrium with
//! Coulomb's law: |f_t| ≤ μ_f N, opposed to the slip where equal.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ_f | friction coefficient | – |
//! | N | normal force | N |
//! | a | anchor: where the vertex touched first, dragged where it slipped | m |
//! | ε | elastic slip, [`ELASTIC_SLIP`] | m |
//!
//! Limits: statics has no history of its own; the anchors are where the solver's path first touched the body.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::contact::Touch;
use super::membrane::outer;

/// ε, m: how far a vertex moves before friction is full. Smaller is truer to Coulomb and stiffer to solve: at 0.5 mm the
/// tangential spring of a vertex under its own weight is some hundred times softer than a jersey.
pub(crate) const ELASTIC_SLIP: f64 = 5e-4;

/// Share of ε from which a hold counts as slipping in the Hessian: a dragged anchor is left at ε exactly, up to rounding,
/// and as a spring it would let the vertex creep by a fraction of ε a step.
const YIELDED: f64 = 0.999;

/// One vertex's hold on the body.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hold {
    vertex: u32,
    anchor: DVec3,
    normal: DVec3,
    /// μ_f N, N.
    limit: f64,
}

impl Hold {
    fn slip(&self, x: &[DVec3]) -> DVec3 {
        let d = x[self.vertex as usize] - self.anchor;
        d - self.normal * self.normal.dot(d)
    }
}

/// Every hold of a cloth on the body.
#[derive(Debug, Clone, Default)]
pub struct Friction {
    /// Of each vertex.
    coefficients: Arc<Vec<f64>>,
    holds: Vec<Hold>,
}

impl Friction {
    /// No friction.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// With each vertex's coefficient of Coulomb.
    #[must_use]
    pub(crate) fn new(coefficients: Arc<Vec<f64>>) -> Self {
        Self { coefficients, holds: Vec::new() }
    }

    /// Takes normal forces and normals from `touches` at `x`; keeps the anchors of those that held, drags those that
    /// slipped, lets go of those that left.
    pub(crate) fn refresh(&mut self, touches: &[Touch], x: &[DVec3]) {
        if self.coefficients.iter().all(|coefficient| *coefficient <= 0.0) {
            return;
        }
        let mut old = self.holds.iter().peekable();
        let mut holds = Vec::with_capacity(touches.len());
        for t in touches {
            while old.next_if(|h| h.vertex < t.vertex).is_some() {}
            let position = x[t.vertex as usize];
            let anchor = old.next_if(|h| h.vertex == t.vertex).map_or(position, |h| h.anchor);
            // The rounded distance is flatter than a distance in a crease, and pushes less; where a body goes through itself it is
            // steeper than any.
            let slope = t.normal.length();
            let normal = t.normal / if slope > 0.0 { slope } else { 1.0 };
            let mut hold = Hold {
                vertex: t.vertex,
                anchor,
                normal,
                limit: self.coefficients[t.vertex as usize] * t.force() * slope.min(1.0),
            };
            let slip = hold.slip(x);
            // The anchor stays in the tangent plane through the vertex; only the slip within ε is elastic.
            hold.anchor = position - slip.clamp_length_max(ELASTIC_SLIP);
            holds.push(hold);
        }
        self.holds = holds;
    }

    /// Energy at the lagged forces, J.
    #[must_use]
    pub fn energy(&self, x: &[DVec3]) -> f64 {
        self.holds.iter().map(|h| h.limit * huber(h.slip(x).length())).sum()
    }

    /// Adds the gradient, N.
    pub fn add_gradient(&self, x: &[DVec3], gradient: &mut [DVec3]) {
        for h in &self.holds {
            let u = h.slip(x);
            gradient[h.vertex as usize] += u * (h.limit / u.length().max(ELASTIC_SLIP));
        }
    }

    /// Each hold's Hessian block, N/m.
    pub(crate) fn hessian<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (u32, DMat3)> + 'a {
        self.holds.iter().map(|h| {
            let tangent = DMat3::IDENTITY - outer(h.normal, h.normal);
            (h.vertex, stiffening(h.limit, tangent, h.slip(x)))
        })
    }
}

/// How the force stiffens with the slip u (m) along a plane with this `tangent` projection, N/m.
pub(super) fn stiffening(limit: f64, tangent: DMat3, u: DVec3) -> DMat3 {
    let y = u.length();
    if y < YIELDED * ELASTIC_SLIP {
        tangent * (limit / ELASTIC_SLIP)
    } else {
        (tangent - outer(u / y, u / y)) * (limit / y)
    }
}

/// φ, m.
pub(super) fn huber(y: f64) -> f64 {
    if y < ELASTIC_SLIP { y * y / (2.0 * ELASTIC_SLIP) } else { y - 0.5 * ELASTIC_SLIP }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_crease_it_holds_along_the_surface_as_much_as_the_body_pushes() {
        let normal = DVec3::new(0.3, 0.0, 0.4);
        let touch = Touch { vertex: 0, depth: 1e-3, normal, stiffness: 100.0 };
        let mut friction = Friction::new(Arc::new(vec![0.3]));
        friction.refresh(&[touch], &[DVec3::ZERO]);
        let mut gradient = [DVec3::ZERO];
        friction.add_gradient(&[DVec3::new(4e-3, 0.0, -3e-3)], &mut gradient);
        let pushed = touch.force() * normal.length();
        assert!(gradient[0].dot(normal).abs() < 1e-15 && (gradient[0].length() - 0.3 * pushed).abs() < 1e-12);
    }

    #[test]
    fn a_gradient_steeper_than_a_distance_leaves_the_hessian_positive_and_the_slip_along_the_surface() {
        let normal = DVec3::new(12.0, -30.0, 20.0);
        let touch = Touch { vertex: 0, depth: 1e-3, normal, stiffness: 100.0 };
        let mut friction = Friction::new(Arc::new(vec![0.3]));
        friction.refresh(&[touch], &[DVec3::ZERO]);
        let x = [DVec3::new(3e-4, 1e-4, -2e-4)];
        let (_, block) = friction.hessian(&x).next().unwrap();
        let along = normal.normalize();
        for d in [DVec3::X, DVec3::Y, DVec3::Z, along, DVec3::new(1.0, 2.0, -1.0)] {
            assert!(d.dot(block * d) > -1e-12, "{d}: {}", d.dot(block * d));
        }
        let mut gradient = [DVec3::ZERO];
        friction.add_gradient(&x, &mut gradient);
        assert!(gradient[0].dot(along).abs() < 1e-15 && gradient[0].length() < 0.3 * touch.force() + 1e-12);
    }
}
