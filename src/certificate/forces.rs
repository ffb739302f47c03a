//! Forces of a drape from its positions alone, and what no reaction of the body could balance.
//!
//! With g = ∇E of gravity, membrane and bending, a vertex rests where something gives it the reaction R = g. A held vertex is given any.
//! One that touches the body is given what lies in Coulomb's cone,
//!
//! K = { R : R·n ≥ 0, |R − (R·n) n| ≤ μ_f R·n },
//!
//! and the nearest such force is P(R), R's projection on K. What is left, r = R − P(R) where it touches and r = g elsewhere, is the residual
//! force: zero if and only if a reaction that body and friction can give holds every vertex where it is.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | g | gradient of the energy without contact | N |
//! | n | outward normal of the body | – |
//! | μ_f | friction coefficient | – |
//!
//! Source: the projection on a second-order cone in closed form (Parikh and Boyd: "Proximal algorithms", 2014, section 6.3.2). Limits:
//! a vertex touches within [`TOUCHING`] of the distance that the cloth keeps, which is the mesh's own and changes with its strain.

use glam::DVec3;

use crate::distance::Body;
use crate::mechanics::energy::contact::Touch;
use crate::mechanics::energy::{Cloth, Contacts, Friction};

/// Within this of the distance that the cloth keeps a vertex counts as touching, m: a strain of a few percent changes that distance by a
/// tenth of a millimetre.
const TOUCHING: f64 = 2e-4;

/// Share of μN from which a vertex counts as about to slip.
pub(super) const SLIPPING: f64 = 0.999;

/// A vertex that touches, and what the body gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// Where.
    pub touch: Touch,
    /// The reaction P(R), N.
    pub reaction: DVec3,
    /// Its normal part, N.
    pub normal_n: f64,
    /// Whether friction has something left.
    pub sticks: bool,
}

/// All forces of a drape.
#[derive(Debug, Clone)]
pub struct Forces {
    /// r of each vertex, N; zero where it is held.
    pub rest: Vec<DVec3>,
    /// ‖r‖₂, N.
    pub residual: f64,
    /// Sum of all reactions less the weight, N.
    pub unbalanced: DVec3,
    /// What the body gives, N.
    pub carried: DVec3,
    /// What held vertices are given, N.
    pub held: DVec3,
    /// ‖r‖₂ over the touching vertices, N: friction beyond its cone, and pull towards the body.
    pub beyond: f64,
    /// Touching vertices with more of it than a hundredth of what they are given.
    pub beyond_count: usize,
    /// The vertices that touch, ascending.
    pub touching: Vec<Touching>,
}

impl Forces {
    /// Of `cloth` on `body` with its vertices at `x` (m).
    #[must_use]
    pub fn new(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Self {
        let stiffness = cloth.contacts(body, x).stiffness();
        let nothing = vec![false; x.len()];
        let offset = cloth.offset + TOUCHING;
        let mut contacts = Contacts::new(body, &cloth.areas, &cloth.held, offset, stiffness, Friction::none());
        contacts.update(x);
        // The reaction of what is held is its own gradient, which a cloth leaves out.
        let mut loose = cloth.clone();
        loose.held = nothing;
        let mut gradient = Vec::new();
        loose.gradient(x, &Contacts::none(), &mut gradient);
        let mut forces = Self {
            rest: gradient,
            residual: 0.0,
            unbalanced: DVec3::NEG_Z * cloth.weight,
            carried: DVec3::ZERO,
            held: DVec3::ZERO,
            beyond: 0.0,
            beyond_count: 0,
            touching: Vec::new(),
        };
        for (rest, _) in forces.rest.iter_mut().zip(&cloth.held).filter(|(_, held)| **held) {
            forces.held += std::mem::take(rest);
        }
        for &touch in contacts.touches() {
            forces.grant(touch, cloth.friction);
        }
        forces.residual = forces.rest.iter().map(|r| r.length_squared()).sum::<f64>().sqrt();
        forces.beyond = forces.beyond.sqrt();
        forces.unbalanced += forces.carried + forces.held;
        forces
    }

    /// Gives a touching vertex what the body can.
    fn grant(&mut self, touch: Touch, friction: f64) {
        let needed = self.rest[touch.vertex as usize];
        let n = touch.normal.normalize_or_zero();
        let reaction = within_cone(needed, n, friction);
        let rest = needed - reaction;
        self.rest[touch.vertex as usize] = rest;
        self.carried += reaction;
        self.beyond += rest.length_squared();
        self.beyond_count += usize::from(rest.length() > 0.01 * needed.length());
        let normal_n = reaction.dot(n);
        let sticks = (reaction - n * normal_n).length() < SLIPPING * friction * normal_n;
        self.touching.push(Touching { touch, reaction, normal_n, sticks });
    }
}

/// The force nearest to `needed` that a body with normal `n` and friction μ can give.
fn within_cone(needed: DVec3, n: DVec3, friction: f64) -> DVec3 {
    let normal = needed.dot(n);
    let tangential = needed - n * normal;
    let t = tangential.length();
    if t <= friction * normal {
        return needed;
    }
    if friction * t <= -normal || t == 0.0 {
        return DVec3::ZERO;
    }
    let given = (normal + friction * t) / (1.0 + friction * friction);
    n * given + tangential * (friction * given / t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(DVec3::from_array)
    }

    proptest! {
        /// Moreau: R = P + r with P in the cone, r in its polar, and the two at right angles.
        #[test]
        fn what_is_given_and_what_is_left_are_at_right_angles(needed in vector(), n in vector(), friction in 0.0..1.5f64) {
            prop_assume!(n.length() > 0.1);
            let n = n.normalize();
            let given = within_cone(needed, n, friction);
            let left = needed - given;
            prop_assert!(given.dot(left).abs() < 1e-12);
            let normal = given.dot(n);
            prop_assert!(normal >= -1e-12 && (given - n * normal).length() <= friction * normal + 1e-12);
            let (away, along) = (left.dot(n), (left - n * left.dot(n)).length());
            prop_assert!(friction * along <= -away + 1e-9, "{away} {along}");
        }
    }
}
