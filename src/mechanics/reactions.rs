//! Forces of a drape from its positions alone, and what no reaction of the body could balance.
//!
//! With g = ∇E of gravity, membrane and bending, a vertex rests where something gives it the reaction R = g. A held vertex is given any.
//! One that touches the body is given what lies in Coulomb's cone,
//!
//! K = { R : R·n ≥ 0, |R − (R·n) n| ≤ μ_f R·n },
//!
//! and the nearest such force is P(R), R's projection on K. Where cloth touches cloth, the two places are given opposite forces of the same
//! kind, shared among their corners; then the reactions are those that leave least, one cone after the other (block coordinate descent,
//! exact in every step). What is left is the residual force r: zero if and only if reactions that body, cloth and friction can give hold
//! every vertex where it is.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | g | gradient of the energy without contact | N |
//! | n | outward normal of the body | – |
//! | μ_f | friction coefficient | – |
//!
//! Source: the projection on a second-order cone in closed form (Parikh and Boyd: "Proximal algorithms", 2014, section 6.3.2). Limits:
//! a vertex touches within `TOUCHING` of the distance that the cloth keeps, which is the mesh's own and changes with its strain.

use glam::DVec3;

use super::energy::contact::Touch;
use super::energy::proximity::touching_between;
use super::energy::{Cloth, Contacts, Friction};
use super::newton::norm;
use crate::body::distance::Body;

/// Within this of the distance that the cloth keeps a vertex counts as touching, m: a strain of a few percent changes that distance by a
/// tenth of a millimetre.
const TOUCHING: f64 = 2e-4;

/// A place between vertices counts as touching where it is nearer than it would keep by itself and this, m: it is kept farther off where the
/// body is rougher than that (`energy::cover`).
const BETWEEN_TOUCHING: f64 = 5e-4;

/// Turns in which reactions are given, at most, and the change of all of them, over the weight, that ends it.
const TURNS: usize = 3000;
const SETTLED: f64 = 1e-7;

/// Share of μN from which a vertex counts as about to slip.
const SLIPPING: f64 = 0.999;

/// A place of the cloth that touches the body or another place of it, and what it is given there.
#[derive(Debug, Clone, PartialEq)]
pub struct Touching {
    /// The vertices that the reaction goes to, with their shares: one on the body, up to three of a place between, up to four of a gap of the
    /// cloth with itself.
    pub shares: Vec<(u32, f64)>,
    /// Unit normal that the reaction pushes along.
    pub normal: DVec3,
    /// How fast it grows as they come nearer, N/m.
    pub stiffness: f64,
    /// The reaction R, N.
    pub reaction: DVec3,
    /// Its normal part, N.
    pub normal_n: f64,
    /// μ_f there.
    pub friction: f64,
    /// Whether friction has something left.
    pub sticks: bool,
    /// Whether it is the body that gives it.
    pub of_body: bool,
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
    /// Where it touches: vertices on the body ascending, places between them, then the cloth's gaps with itself.
    pub touching: Vec<Touching>,
}

impl Forces {
    /// Of `cloth` on `body` with its vertices at `x` (m).
    #[must_use]
    pub fn new(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Self {
        // The reaction of what is held is its own gradient, which a cloth leaves out.
        let mut loose = cloth.clone();
        loose.held = vec![false; x.len()];
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
            touching: touching(cloth, body, x),
        };
        for (rest, _) in forces.rest.iter_mut().zip(&cloth.held).filter(|(_, held)| **held) {
            forces.held += std::mem::take(rest);
        }
        grant(&mut forces.touching, &mut forces.rest, cloth);
        forces.residual = norm(&forces.rest);
        let mut met = vec![false; x.len()];
        for touching in &forces.touching {
            for (v, _) in &touching.shares {
                met[*v as usize] = true;
            }
            if touching.of_body {
                forces.carried += touching.reaction;
                let rest = touching.shares.iter().map(|(v, _)| forces.rest[*v as usize].length()).fold(0.0, f64::max);
                forces.beyond_count += usize::from(rest > 0.01 * (touching.reaction.length() + rest));
            }
        }
        let beyond = forces.rest.iter().zip(met).filter(|(_, met)| *met).map(|(r, _)| r.length_squared());
        forces.beyond = beyond.sum::<f64>().sqrt();
        forces.unbalanced += forces.carried + forces.held;
        forces
    }
}

/// Gives all places what leaves least of `rest` (N): each in turn what lies nearest in its cone, as long as that changes anything. One turn
/// is enough where no two share a vertex.
fn grant(touching: &mut [Touching], rest: &mut [DVec3], cloth: &Cloth) {
    for touching in &*touching {
        let free = touching.shares.iter().filter(|(v, _)| !cloth.held[*v as usize]);
        free.for_each(|(v, w)| rest[*v as usize] -= touching.reaction * *w);
    }
    for _ in 0..TURNS {
        let mut changed = 0.0;
        for touching in &mut *touching {
            let free = || touching.shares.iter().filter(|(v, _)| !cloth.held[*v as usize]);
            let squares: f64 = free().map(|(_, w)| w * w).sum();
            if squares <= 0.0 {
                continue;
            }
            let left: DVec3 = free().map(|(v, w)| rest[*v as usize] * *w).sum();
            let given = within_cone(touching.reaction + left / squares, touching.normal, touching.friction);
            let more = given - touching.reaction;
            for (v, w) in free() {
                rest[*v as usize] -= more * *w;
            }
            touching.reaction = given;
            changed += more.length();
        }
        if changed <= SETTLED * cloth.weight {
            break;
        }
    }
    for touching in touching {
        touching.normal_n = touching.reaction.dot(touching.normal);
        let across = touching.reaction - touching.normal * touching.normal_n;
        touching.sticks = across.length() < SLIPPING * touching.friction * touching.normal_n;
    }
}

/// Takes from `rest` (N) what the cloth can give itself at `x`, and the body where it keeps vertices farther off than `contacts`, which have
/// pushed already, know of.
pub(crate) fn grant_beside(cloth: &Cloth, body: &Body, contacts: &Contacts<'_>, x: &[DVec3], rest: &mut [DVec3]) {
    let mut pushed = vec![false; x.len()];
    contacts.touches().iter().for_each(|t| pushed[t.vertex as usize] = true);
    let mut beside = touching(cloth, body, x);
    beside.retain(|t| !t.of_body || t.shares.len() > 1 || !pushed[t.shares[0].0 as usize]);
    grant(&mut beside, rest, cloth);
}

/// Where the cloth touches the body at `x`, and then where it touches itself.
fn touching(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Vec<Touching> {
    let stiffness = cloth.contact_stiffness();
    let offsets: Vec<f64> = cloth.offsets.iter().map(|offset| offset + TOUCHING).collect();
    let mut contacts = Contacts::new(body, [&cloth.areas, &offsets], &cloth.held, stiffness, Friction::none());
    contacts.update(x);
    let at_body = |t: &Touch| Touching {
        of_body: true,
        ..Touching::at(
            vec![(t.vertex, 1.0)],
            t.normal.normalize_or_zero(),
            t.stiffness,
            cloth.friction[t.vertex as usize],
        )
    };
    let mut all: Vec<Touching> = contacts.touches().iter().map(at_body).collect();
    for (corners, shares, normal) in touching_between(cloth, body, x, BETWEEN_TOUCHING) {
        let mean = |of: &[f64]| corners.iter().zip(shares).map(|(&v, w)| of[v as usize] * w).sum::<f64>();
        let (stiffness, friction) = (stiffness * mean(&cloth.areas), mean(&cloth.friction));
        let shares = corners.into_iter().zip(shares).filter(|(_, w)| *w > 0.0).collect();
        all.push(Touching { of_body: true, ..Touching::at(shares, normal, stiffness, friction) });
    }
    let mut itself = cloth.proximity();
    itself.refresh(x);
    let gaps = itself.gaps().filter(|gap| gap.depth(x) > -TOUCHING);
    // What the solver's law pushes with is near to what is needed.
    all.extend(gaps.map(|gap| Touching {
        reaction: gap.normal * (gap.stiffness * gap.depth(x).max(0.0)),
        ..Touching::at(gap.members().collect(), gap.normal, gap.stiffness, gap.mean(&cloth.friction))
    }));
    all
}

impl Touching {
    fn at(shares: Vec<(u32, f64)>, normal: DVec3, stiffness: f64, friction: f64) -> Self {
        Self {
            shares,
            normal,
            stiffness,
            reaction: DVec3::ZERO,
            normal_n: 0.0,
            friction,
            sticks: false,
            of_body: false,
        }
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
