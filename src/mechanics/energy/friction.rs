//! Coulomb friction between the cloth and the body.
//!
//! Each vertex in contact has an anchor a on the body and a tangential spring that yields at μ_f N:
//!
//! E = μ_f N φ(|u|), u = (I − n nᵀ)(x − a), φ(y) = y²/2ε for y < ε, y − ε/2 beyond.
//!
//! The force is μ_f N u/ε while the vertex sticks and μ_f N û once it slips. N, n and a are those of the last
//! [`refresh`](Friction::refresh) (lagged friction: Li and others: "Incremental potential contact", SIGGRAPH 2020), so the force
//! is the gradient of an energy between two refreshes. A refresh drags the anchor of a slipped vertex to a distance of ε: the
//! return mapping of plasticity, used here in statics. A state that a refresh leaves unchanged is in equilibrium with
//! Coulomb's law: |f_t| ≤ μ_f N, opposed to the slip where equal.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ_f | friction coefficient | – |
//! | N | normal force | N |
//! | a | anchor: the point of first contact, dragged by slip | m |
//! | ε | elastic slip, [`ELASTIC_SLIP`] | m |
//!
//! Limits: statics has no physical history; the anchors are the points where the path of the solver first touched the body.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::membrane::outer;

/// ε, m: the slip at which friction reaches its limit. A smaller value is closer to Coulomb's law and gives a stiffer system. At
/// 0.5 mm the tangential spring of a vertex under its own weight is some hundred times softer than a jersey.
pub(crate) const ELASTIC_SLIP: f64 = 5e-4;

/// Share of ε from which the Hessian treats an anchor as slipping. A dragged anchor lies at ε up to rounding; treated as a
/// spring it would let the vertex creep by a fraction of ε a step.
const YIELDED: f64 = 0.999;

/// A vertex nearer to the body than its offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The vertex.
    pub vertex: u32,
    /// h − q, m: positive.
    pub depth: f64,
    /// ∇q, outward. Its length is one except where a crease is rounded.
    pub normal: DVec3,
    /// κ A_i, N/m.
    pub stiffness: f64,
}

impl Touch {
    /// The normal force κ A_i (h − q), N.
    #[must_use]
    pub fn force(&self) -> f64 {
        self.stiffness * self.depth
    }
}

/// The tangential spring of one vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Anchor {
    vertex: u32,
    /// a, m.
    position: DVec3,
    normal: DVec3,
    /// μ_f N, N.
    limit: f64,
}

impl Anchor {
    fn slip(&self, x: &[DVec3]) -> DVec3 {
        let d = x[self.vertex as usize] - self.position;
        d - self.normal * self.normal.dot(d)
    }
}

/// The tangential springs of a cloth on the body.
#[derive(Debug, Clone, Default)]
pub struct Friction {
    /// Coulomb's coefficient of each vertex.
    coefficients: Arc<Vec<f64>>,
    anchors: Vec<Anchor>,
}

impl Friction {
    /// Friction with Coulomb's coefficient of each vertex.
    #[must_use]
    pub(crate) fn new(coefficients: Arc<Vec<f64>>) -> Self {
        Self { coefficients, anchors: Vec::new() }
    }

    /// Takes normal forces and normals from `touches` at `x`. Anchors of vertices that stick are kept, those of vertices that slip are
    /// dragged, those of vertices that left the body are dropped.
    pub(crate) fn refresh(&mut self, touches: &[Touch], x: &[DVec3]) {
        if self.coefficients.iter().all(|coefficient| *coefficient <= 0.0) {
            return;
        }
        let mut old = self.anchors.iter().peekable();
        let mut anchors = Vec::with_capacity(touches.len());
        for t in touches {
            while old.next_if(|a| a.vertex < t.vertex).is_some() {}
            let here = x[t.vertex as usize];
            let position = old.next_if(|a| a.vertex == t.vertex).map_or(here, |a| a.position);
            // The gradient of the rounded distance is shorter than one in a crease, where the body pushes less. Where a body
            // intersects itself it may be longer.
            let slope = t.normal.length();
            let normal = t.normal / if slope > 0.0 { slope } else { 1.0 };
            let limit = self.coefficients[t.vertex as usize] * t.force() * slope.min(1.0);
            let mut anchor = Anchor { vertex: t.vertex, position, normal, limit };
            // The anchor lies in the tangent plane through the vertex; only the slip within ε is elastic.
            anchor.position = here - anchor.slip(x).clamp_length_max(ELASTIC_SLIP);
            anchors.push(anchor);
        }
        self.anchors = anchors;
    }

    /// Energy at the lagged forces, J.
    #[must_use]
    pub fn energy(&self, x: &[DVec3]) -> f64 {
        self.anchors.iter().map(|a| a.limit * huber(a.slip(x).length())).sum()
    }

    /// Adds the gradient, N.
    pub fn add_gradient(&self, x: &[DVec3], gradient: &mut [DVec3]) {
        for a in &self.anchors {
            let u = a.slip(x);
            gradient[a.vertex as usize] += u * (a.limit / u.length().max(ELASTIC_SLIP));
        }
    }

    /// Each vertex's Hessian block, N/m.
    pub(crate) fn hessian<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (u32, DMat3)> + 'a {
        self.anchors.iter().map(|a| {
            let tangent = DMat3::IDENTITY - outer(a.normal, a.normal);
            (a.vertex, tangential_stiffness(a.limit, tangent, a.slip(x)))
        })
    }
}

/// Second derivative of the friction energy by the slip u (m) in the plane that `tangent` projects on, N/m.
pub(super) fn tangential_stiffness(limit: f64, tangent: DMat3, u: DVec3) -> DMat3 {
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

    /// Friction of μ_f = 0.3 anchored at the origin under a contact with this gradient of the distance.
    fn anchored(normal: DVec3) -> (Touch, Friction) {
        let touch = Touch { vertex: 0, depth: 1e-3, normal, stiffness: 100.0 };
        let mut friction = Friction::new(Arc::new(vec![0.3]));
        friction.refresh(&[touch], &[DVec3::ZERO]);
        (touch, friction)
    }

    #[test]
    fn friction_in_a_crease_is_tangential_and_limited_by_the_force_of_the_body() {
        let normal = DVec3::new(0.3, 0.0, 0.4);
        let (touch, friction) = anchored(normal);
        let mut gradient = [DVec3::ZERO];
        friction.add_gradient(&[DVec3::new(4e-3, 0.0, -3e-3)], &mut gradient);
        let pushed = touch.force() * normal.length();
        assert!(gradient[0].dot(normal).abs() < 1e-15 && (gradient[0].length() - 0.3 * pushed).abs() < 1e-12);
    }

    #[test]
    fn a_gradient_longer_than_one_leaves_the_hessian_positive_and_the_friction_tangential() {
        let normal = DVec3::new(12.0, -30.0, 20.0);
        let (touch, friction) = anchored(normal);
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
