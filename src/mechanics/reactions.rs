//! Forces of a drape from its positions alone: the residual that no reaction of body, cloth and friction can balance.
//!
//! With g = ∇E of gravity, membrane and bending, a vertex is in equilibrium where a reaction R = g acts on it. A held vertex admits any
//! reaction. A vertex that touches the body admits those in Coulomb's cone,
//!
//! K = { R : R·n ≥ 0, |R − (R·n) n| ≤ μ_f R·n },
//!
//! and its reaction is the projection of g on K. Where cloth touches cloth, the two places receive opposite forces from such a
//! cone, distributed to their corners. The reactions minimise the residual, by block coordinate descent: one cone after the other,
//! exact in each step. The residual force r is zero if and only if admissible reactions hold every vertex in its place.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | g | gradient of the energy without contact | N |
//! | n | outward normal of the body | – |
//! | μ_f | friction coefficient | – |
//!
//! Source: the projection on a second-order cone in closed form (Parikh and Boyd: "Proximal algorithms", 2014, section 6.3.2). Limits:
//! a vertex touches within `TOUCH_MARGIN_M` of its offset, which depends on the mesh and changes with its strain.

use glam::DVec3;

use super::energy::field::SIDE;
use super::energy::{Cloth, Contacts, TOUCH_MARGIN_M, Touch};
use super::linear_algebra::norm;
use crate::body::distance::Body;

/// Largest residual over weight at rest: [`RefineOptions::default`](super::refine::RefineOptions)'s tolerance.
pub(crate) const MAX_RESIDUAL: f64 = 1e-3;

/// [`TOUCH_MARGIN_M`] for a place inside a triangle, m. The solver raises the offset of such places where the body is rougher than that.
const PLACE_MARGIN_M: f64 = 5e-4;

/// Most sweeps over all cones. Heuristic.
const MAX_SWEEPS: usize = 20_000;

/// Total change of all reactions in a sweep, over the weight, that ends the iteration. Heuristic.
const SWEEP_TOLERANCE: f64 = 1e-9;

/// Residual over weight that ends the iteration: a tenth of the largest at rest. At a hundredth, the sweeps are half of a small drape.
const BALANCED: f64 = 1e-4;

/// Sweeps between two checks of the decrease, and the ratio of two residuals above which the iteration ends, where the residual is not
/// that of a rest yet. Heuristic.
const CHECK_INTERVAL: usize = 200;
const MIN_DECREASE: f64 = 0.999;

/// The same where it is. A skirt of 16,000 vertices has 28,000 places that touch, over which 256 sweeps take less than one percent off the
/// residual.
const CHECK_INTERVAL_AT_REST: usize = 10;
const MIN_DECREASE_AT_REST: f64 = 0.9;

/// Share of μN below which a reaction sticks.
const STICKING_SHARE: f64 = 0.999;

/// Share of force and residual above which a reaction of the body is counted as insufficient.
const INSUFFICIENT_SHARE: f64 = 0.01;

/// A place of the cloth that touches the body or another place of the cloth, and the force there.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// The vertices that the force acts on, with their shares: one on the body, up to three of a place in a triangle, up to four of a gap of the
    /// cloth with itself.
    pub shares: Vec<(u32, f64)>,
    /// Unit normal of the contact.
    pub normal: DVec3,
    /// Depth below the offset, m; zero of a place inside a triangle.
    pub depth: f64,
    /// Contact stiffness, N/m: the penalty's κ A, or R·n over the depth where that is larger, because the solver has stiffened the penalty so
    /// that it bears R at this depth. At most `max_stiffening` times κ A.
    pub stiffness: f64,
    /// The force R, N.
    pub force: DVec3,
    /// Its normal part, N.
    pub normal_n: f64,
    /// μ_f.
    pub friction: f64,
    /// Whether friction is below its limit.
    pub sticks: bool,
    /// Whether the body exerts the force.
    pub of_body: bool,
}

impl Reaction {
    /// A reaction of zero.
    fn at(shares: Vec<(u32, f64)>, normal: DVec3, stiffness: f64, friction: f64, of_body: bool) -> Self {
        Self {
            shares,
            normal,
            depth: 0.0,
            stiffness,
            force: DVec3::ZERO,
            normal_n: 0.0,
            friction,
            sticks: false,
            of_body,
        }
    }
}

/// All forces of a drape.
#[derive(Debug, Clone)]
pub struct Forces {
    /// r of each vertex, N; zero where it is held.
    pub residual_forces: Vec<DVec3>,
    /// ‖r‖₂, N.
    pub residual: f64,
    /// Sum of all reactions minus the weight, N.
    pub unbalanced: DVec3,
    /// Sum of the reactions of the body, N.
    pub carried: DVec3,
    /// Sum of the reactions at held vertices, N.
    pub held: DVec3,
    /// ‖r‖₂ over the touching vertices, N: friction beyond the cone, and adhesion.
    pub touching_residual: f64,
    /// Number of reactions of the body whose residual exceeds a hundredth of the total force there.
    pub insufficient: usize,
    /// The reactions: vertices on the body ascending, places inside triangles, then the gaps of the cloth with itself.
    pub reactions: Vec<Reaction>,
}

impl Forces {
    /// The forces of `cloth` on `body` at `x` (m).
    #[must_use]
    pub fn new(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Self {
        Self::on(cloth, Some(body), x)
    }

    /// [`new`](Self::new) with an optional body.
    pub(crate) fn on(cloth: &Cloth, body: Option<&Body>, x: &[DVec3]) -> Self {
        // The gradient of a cloth is zero at held vertices; their reactions are the gradient with nothing held.
        let mut free = cloth.clone();
        free.held = vec![false; x.len()];
        let mut residual_forces = Vec::new();
        free.gradient(x, &Contacts::none(), &mut residual_forces);
        let mut held = DVec3::ZERO;
        for (force, _) in residual_forces.iter_mut().zip(&cloth.held).filter(|(_, held)| **held) {
            held += std::mem::take(force);
        }
        let mut reactions = contacts_at(cloth, body, x);
        solve_reactions(&mut reactions, &mut residual_forces, cloth);
        let (mut carried, mut insufficient) = (DVec3::ZERO, 0);
        let mut touches = vec![false; x.len()];
        for reaction in &reactions {
            for (v, w) in &reaction.shares {
                touches[*v as usize] = true;
                // The hold bears what the contact puts on a held corner.
                if cloth.held[*v as usize] {
                    held -= reaction.force * *w;
                }
            }
            if reaction.of_body {
                carried += reaction.force;
                let left =
                    reaction.shares.iter().map(|(v, _)| residual_forces[*v as usize].length()).fold(0.0, f64::max);
                insufficient += usize::from(left > INSUFFICIENT_SHARE * (reaction.force.length() + left));
            }
        }
        let touching = residual_forces.iter().zip(touches).filter(|(_, touches)| *touches);
        let touching_residual = touching.map(|(r, _)| r.length_squared()).sum::<f64>().sqrt();
        let unbalanced = DVec3::NEG_Z * cloth.weight + (carried + held);
        let residual = norm(&residual_forces);
        Self { residual_forces, residual, unbalanced, carried, held, touching_residual, insufficient, reactions }
    }
}

/// Minimises the residual forces (N) over the reactions, by accelerated sweeps over their cones. One sweep suffices if no two share a vertex.
fn solve_reactions(reactions: &mut [Reaction], residual_forces: &mut [DVec3], cloth: &Cloth) {
    let act = |shares: &[(u32, f64)], force: DVec3, residual_forces: &mut [DVec3]| {
        for (v, w) in shares.iter().filter(|(v, _)| !cloth.held[*v as usize]) {
            residual_forces[*v as usize] -= force * *w;
        }
    };
    for reaction in &*reactions {
        act(&reaction.shares, reaction.force, residual_forces);
    }
    let mut before: Vec<DVec3> = reactions.iter().map(|reaction| reaction.force).collect();
    let mut momentum = 1.0_f64;
    let (mut last, mut at_check) = (f64::INFINITY, f64::INFINITY);
    for sweep in 1..=MAX_SWEEPS {
        let mut changed = 0.0;
        for reaction in &mut *reactions {
            let free = || reaction.shares.iter().filter(|(v, _)| !cloth.held[*v as usize]);
            let squares: f64 = free().map(|(_, w)| w * w).sum();
            if squares <= 0.0 {
                continue;
            }
            let left: DVec3 = free().map(|(v, w)| residual_forces[*v as usize] * *w).sum();
            let force = project_on_cone(reaction.force + left / squares, reaction.normal, reaction.friction);
            let change = force - reaction.force;
            act(&reaction.shares, change, residual_forces);
            reaction.force = force;
            changed += change.length();
        }
        let residual = norm(residual_forces);
        if changed <= SWEEP_TOLERANCE * cloth.weight || residual <= BALANCED * cloth.weight {
            break;
        }
        let at_rest = residual <= MAX_RESIDUAL * cloth.weight;
        let (interval, most) =
            if at_rest { (CHECK_INTERVAL_AT_REST, MIN_DECREASE_AT_REST) } else { (CHECK_INTERVAL, MIN_DECREASE) };
        if sweep % interval == 0 {
            if residual > most * at_check {
                break;
            }
            at_check = residual;
        }
        // Nesterov's momentum, restarted where the residual grows (O'Donoghue, Candès: "Adaptive restart for accelerated gradient
        // schemes", 2015).
        if residual > last {
            momentum = 1.0;
        }
        last = residual;
        let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
        let ahead = if sweep < MAX_SWEEPS { (momentum - 1.0) / next } else { 0.0 };
        momentum = next;
        for (reaction, before) in reactions.iter_mut().zip(&mut before) {
            let further = (reaction.force - *before) * ahead;
            *before = reaction.force;
            reaction.force += further;
            act(&reaction.shares, further, residual_forces);
        }
    }
    for reaction in reactions {
        reaction.normal_n = reaction.force.dot(reaction.normal);
        let tangential = reaction.force - reaction.normal * reaction.normal_n;
        reaction.sticks = tangential.length() < STICKING_SHARE * reaction.friction * reaction.normal_n;
        if reaction.depth > 0.0 {
            let stiffest = cloth.solver.self_contact.max_stiffening.max(1.0) * reaction.stiffness;
            reaction.stiffness = (reaction.normal_n / reaction.depth).clamp(reaction.stiffness, stiffest);
        }
    }
}

/// Reduces `residual_forces` (N), which contain the forces of `contacts`, by the reactions that `contacts` miss: those of the cloth with itself,
/// of places inside triangles, and of vertices that the body keeps farther off.
pub(crate) fn solve_remaining_reactions(
    cloth: &Cloth,
    body: &Body,
    contacts: &Contacts<'_>,
    x: &[DVec3],
    residual_forces: &mut [DVec3],
) {
    let mut pushed = vec![false; x.len()];
    contacts.touches().iter().for_each(|t| pushed[t.vertex as usize] = true);
    let mut reactions = contacts_at(cloth, Some(body), x);
    reactions.retain(|r| !r.of_body || r.shares.len() > 1 || !pushed[r.shares[0].0 as usize]);
    solve_reactions(&mut reactions, residual_forces, cloth);
}

/// Contacts of the cloth with the body at `x`, then with itself, before their reactions are solved.
fn contacts_at(cloth: &Cloth, body: Option<&Body>, x: &[DVec3]) -> Vec<Reaction> {
    let mut all = body.map(|body| contacts_with_body(cloth, body, x)).unwrap_or_default();
    let mut proximity = cloth.proximity();
    proximity.refresh_with(x, Vec::new());
    let gaps = proximity.gaps().filter(|gap| gap.depth(x) > -TOUCH_MARGIN_M);
    // The force of the penalty is a good start.
    all.extend(gaps.map(|gap| Reaction {
        force: gap.normal * (gap.stiffness * gap.depth(x).max(0.0)),
        depth: gap.depth(x).max(0.0),
        ..Reaction::at(gap.members().collect(), gap.normal, gap.stiffness, gap.mean(&cloth.friction), false)
    }));
    all
}

/// Contacts of the cloth with the body at `x`.
fn contacts_with_body(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Vec<Reaction> {
    // The rounded distance exceeds the exact one by less than the side of the lattice. The solver raises the offsets of vertices that are
    // inside by the exact one alone, so the smaller of the two decides.
    let margin = TOUCH_MARGIN_M + SIDE;
    let distances: Vec<f64> = body.nearest_all(x).iter().map(|nearest| nearest.signed_distance).collect();
    // A vertex that is farther off touches by neither distance; the rounded one is not computed.
    let bound = |(v, s): (usize, &f64)| if *s > cloth.offsets[v] + margin { f64::INFINITY } else { *s };
    let contacts = cloth.new_contacts(body).with_margin(margin);
    let mut contacts = contacts.with_distances(x, distances.iter().enumerate().map(bound));
    contacts.update(x);
    let touches = |t: &&Touch| {
        let v = t.vertex as usize;
        t.depth > SIDE || distances[v] < cloth.offsets[v] + TOUCH_MARGIN_M
    };
    let of_vertex = |t: &Touch| {
        let friction = cloth.friction[t.vertex as usize];
        let normal = t.normal.normalize_or_zero();
        let depth = (t.depth - margin).max(0.0);
        Reaction { depth, ..Reaction::at(vec![(t.vertex, 1.0)], normal, t.stiffness, friction, true) }
    };
    let mut all: Vec<Reaction> = contacts.touches().iter().filter(touches).map(of_vertex).collect();
    for place in cloth.face_contacts().touching_places(body, x, &distances, PLACE_MARGIN_M) {
        let shares = || place.corners.into_iter().zip(place.shares);
        let mean = |of: &[f64]| shares().map(|(v, w)| of[v as usize] * w).sum::<f64>();
        let (stiffness, friction) = (contacts.stiffness() * mean(&cloth.areas), mean(&cloth.friction));
        all.push(Reaction::at(shares().filter(|(_, w)| *w > 0.0).collect(), place.normal, stiffness, friction, true));
    }
    all
}

/// The projection of `needed` on Coulomb's cone about `n` with friction μ.
fn project_on_cone(needed: DVec3, n: DVec3, friction: f64) -> DVec3 {
    let normal = needed.dot(n);
    let tangential = needed - n * normal;
    let t = tangential.length();
    if t <= friction * normal {
        return needed;
    }
    if friction * t <= -normal || t == 0.0 {
        return DVec3::ZERO;
    }
    let projected = (normal + friction * t) / (1.0 + friction * friction);
    n * projected + tangential * (friction * projected / t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::GRAVITY;
    use crate::mesh::samples::{cuboid, sheet};
    use proptest::prelude::*;

    /// A sheet of 8 cm lies on a box; the deeper it lies, the softer a contact bears its weight.
    #[test]
    fn a_contact_is_as_stiff_as_its_force_over_its_depth() {
        let mesh = sheet(4, 4, |i, j| DVec3::new(i - 2.0, j - 2.0, 0.0) * 0.02);
        let cloth = Cloth::sample(&mesh, "denim", &[]);
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let middle = 12;
        let stiffness_at = |depth: f64| {
            let x: Vec<DVec3> = mesh.positions.iter().zip(&cloth.offsets).map(|(x, h)| x.with_z(h - depth)).collect();
            let mut contacts = cloth.new_contacts(&body);
            contacts.update(&x);
            let first = contacts.touches().iter().find(|t| t.vertex == middle).unwrap().stiffness;
            let forces = Forces::new(&cloth, &body, &x);
            let of_middle = |r: &&Reaction| r.shares == [(middle, 1.0)];
            let reaction = forces.reactions.iter().find(of_middle).unwrap();
            assert!((reaction.normal_n - GRAVITY * cloth.masses[middle as usize]).abs() < 1e-6 * reaction.normal_n);
            (reaction.stiffness / first, reaction.normal_n / depth / first)
        };
        for depth in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9] {
            let (stiffness, secant) = stiffness_at(depth);
            let expected = secant.clamp(1.0, cloth.solver.self_contact.max_stiffening);
            assert!((stiffness / expected - 1.0).abs() < 1e-2, "depth {depth}: {stiffness} for {expected}");
        }
        assert!(stiffness_at(1e-4).0 < stiffness_at(1e-9).0);
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64].prop_map(DVec3::from_array)
    }

    proptest! {
        /// Moreau's decomposition: R = P + r with P in the cone, r in its polar cone, and the two orthogonal.
        #[test]
        fn projection_and_remainder_are_orthogonal(needed in vector(), n in vector(), friction in 0.0..1.5f64) {
            prop_assume!(n.length() > 0.1);
            let n = n.normalize();
            let projection = project_on_cone(needed, n, friction);
            let remainder = needed - projection;
            prop_assert!(projection.dot(remainder).abs() < 1e-12);
            let normal = projection.dot(n);
            prop_assert!(normal >= -1e-12 && (projection - n * normal).length() <= friction * normal + 1e-12);
            let (away, along) = (remainder.dot(n), (remainder - n * remainder.dot(n)).length());
            prop_assert!(friction * along <= -away + 1e-9, "{away} {along}");
        }
    }
}
