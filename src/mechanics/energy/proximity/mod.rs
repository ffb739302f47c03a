//! Contact of the cloth with itself.
//!
//! Two places of a garment that are nearer than the offset h repel each other as the body repels the cloth:
//!
//! E = Σ ½ κ A (h − n·Σ w x)²  over the gaps with n·Σ w x < h.
//!
//! A gap is a vertex with the nearest point of a triangle, or the nearest points of two edges; w are the shares of its four vertices, which
//! sum to zero. The set of gaps, their shares and their normals are lagged: they are those of the last [`refresh`](Proximity::refresh), as the
//! anchors of friction are. Between two refreshes the energy is piecewise quadratic with exact gradient and Hessian, and a
//! state that a refresh leaves unchanged is in equilibrium with the true distances. Friction acts between the two places
//! in the plane of the gap by the law used on the body ([`friction`](super::friction)).
//!
//! **Under-relaxation.** The set of gaps changes discontinuously: two edges form a gap only while the nearest points lie between their ends,
//! and a gap whose feature pair changes is a new gap without history. Cloth at such a discontinuity has no state that a refresh
//! leaves unchanged, and the solver cycles between two. With under-relaxation a gap gains only a share of its stiffness at a
//! refresh (one that is no longer found is gone at once), so that the cloth converges to a mean of both forces (Filippov's solution of an
//! equation with a discontinuous right side).
//!
//! **Steps without penetration.** A penalty alone does not prevent cloth from passing through cloth. Each step is therefore checked before
//! it is taken ([`collision_filter`]): a step that would cause an intersection is shortened or cut, and the next refresh finds gaps there.
//! A garment without intersections stays without.
//!
//! **Starts that intersect.** Two states are known: the start, from a preview without self-contact, and the *clear* positions, which are mostly
//! free of intersections: the placement, or the garment put over the layer below. If the clear positions have no intersection, the start
//! becomes the farthest point on the straight way from them to the start, at shares 0.7ⁿ, that has none ([`retreat`](Proximity::retreat)).
//! Otherwise the cloth starts tangled, and is untangled ([`untangle`]; `refine::starts`).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | offset: thickness of the cloth, at least what its mesh resolves | m |
//! | w | shares of the vertices of a gap, positive on the first side | – |
//! | n | unit normal from the second place to the first | – |
//! | κ | stiffness: pressure over h minus the distance | N/m³ |
//! | A | rest area of the gap | m² |
//!
//! Between two fabrics thickness and friction are their means. The offset is smaller where the garment was placed nearer to itself. Limits: a gap
//! that closes for lack of stiffness grows stiffer only from refresh to refresh; intersecting pairs are counted, not their depth.

mod collision_filter;
pub(super) mod gap;
mod search;
pub(super) mod surface;
mod untangle;
mod verlet_list;

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::friction::ELASTIC_SLIP;
use crate::mechanics::solver_options::SolverOptions;
use crate::mesh::NONE;
use collision_filter::CollisionFilter;
pub(crate) use collision_filter::StepCheck;
use gap::{Gap, Kind};
use search::Spacing;
use surface::Surface;
use verlet_list::VerletList;

/// Factor by which an intersecting start retreats at a time.
const RETREAT_FACTOR: f64 = 0.7;

/// Share of the way below which the start retreats to the clear positions.
const MIN_RETREAT_SHARE: f64 = 0.02;

/// The gaps of a cloth with itself.
#[derive(Debug, Clone)]
pub struct Proximity {
    surface: Arc<Surface>,
    placed: Arc<Vec<DVec3>>,
    clear: Arc<Vec<DVec3>>,
    spacing: Spacing,
    friction: Arc<Vec<f64>>,
    gaps: Vec<Gap>,
    filter: CollisionFilter,
    /// Share of its stiffness that a gap gains at a refresh.
    under_relaxation: f64,
}

impl Proximity {
    /// Self-contact without gaps yet, of a cloth with these placed and clear positions (m) and this thickness (m) and friction of each vertex.
    pub(super) fn new(
        surface: Arc<Surface>,
        [placed, clear]: [Arc<Vec<DVec3>>; 2],
        [thickness, friction]: [Arc<Vec<f64>>; 2],
        options: &SolverOptions,
    ) -> Self {
        let SolverOptions { self_contact, collision_filter, .. } = *options;
        let spacing = Spacing::new(thickness, surface.edge_m, self_contact);
        let reach = self_contact.search_reach * spacing.max_offset();
        let list = VerletList::new(Arc::clone(&surface), reach, self_contact.list_margin_of_edge * surface.edge_m);
        let filter = CollisionFilter::new(Arc::clone(&surface), list, collision_filter);
        Self { surface, placed, clear, spacing, friction, gaps: Vec::new(), filter, under_relaxation: 1.0 }
    }

    /// Searches the gaps at `x` (m), beside these gaps to the body; gaps that existed before keep their history.
    pub(crate) fn refresh_with(&mut self, x: &[DVec3], to_body: Vec<Gap>) {
        let Self { surface, placed, spacing, friction, filter, .. } = self;
        let (max_offset, options) = (spacing.max_offset(), spacing.options);
        let mut gaps = search::gaps(surface, filter.list(x), x, placed, spacing, options.search_reach * max_offset);
        let crossing = filter.current(x);
        if !crossing.is_empty() {
            let untangling = untangle::gaps(surface, x, crossing, Spacing::stiffness(max_offset));
            // Near an intersection the side of a gap is unknown.
            gaps.retain(|gap| !gap.members().any(|(v, _)| filter.is_tangled(v)));
            gaps.extend(untangling);
        }
        gaps.extend(to_body);
        gaps.sort_unstable_by_key(|gap| gap.key);
        let share = self.under_relaxation;
        let mut before = self.gaps.iter().peekable();
        for gap in &mut gaps {
            while before.next_if(|b| b.key < gap.key).is_some() {}
            let previous = before.next_if(|b| b.key == gap.key);
            gap.from = gap.across(x);
            if gap.key.kind == Kind::Crossing {
                continue;
            }
            match previous {
                Some(previous) => gap.inherit(previous, x, share),
                None => gap.stiffness *= share,
            }
            let depth = gap.depth(x);
            gap.limit = gap.mean(friction) * gap.stiffness * depth.max(0.0);
            // The friction limit keeps the present pressure; the stiffness grows for the next steps.
            if depth > (1.0 - options.narrow_share) * gap.goal && share == 1.0 {
                gap.stiffness *= options.stiffening.min(options.max_stiffening * gap.first / gap.stiffness);
            }
            gap.slip = if gap.limit > 0.0 { gap.slip.clamp_length_max(ELASTIC_SLIP) } else { DVec3::ZERO };
        }
        self.gaps = gaps;
    }

    /// Sets the share of its stiffness that a gap gains at a refresh; 1 turns under-relaxation off.
    pub(crate) fn set_under_relaxation(&mut self, share: f64) {
        self.under_relaxation = share;
    }

    /// Adds the gradient (N) at `x` at vertices that are not `held`; returns the energy, J.
    pub(super) fn add_gradient(&self, x: &[DVec3], held: &[bool], gradient: &mut [DVec3]) -> f64 {
        let mut energy = 0.0;
        for gap in &self.gaps {
            let (of_gap, force) = gap.energy_and_force(x);
            if of_gap > 0.0 {
                energy += of_gap;
                for (v, w) in gap.members().filter(|(v, _)| !held[*v as usize]) {
                    gradient[v as usize] -= force * w;
                }
            }
        }
        energy
    }

    /// Hessian of each pressing gap: block (v, w) is the matrix (N/m) times the shares of v and w.
    pub(super) fn hessian<'a>(&'a self, x: &'a [DVec3]) -> impl Iterator<Item = (&'a Gap, DMat3)> + 'a {
        self.gaps.iter().filter_map(|gap| Some((gap, gap.hessian(x)?)))
    }

    /// Pairs of vertices that a gap couples.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let pairs = |gap: &Gap| {
            let v = gap.key.vertices;
            (1..v.len()).flat_map(move |i| (0..i).map(move |j| [v[i], v[j]]))
        };
        self.gaps.iter().flat_map(pairs).filter(|[a, b]| *a != NONE && *b != NONE)
    }

    /// All gaps of the cloth with itself, without intersections.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = &Gap> {
        self.gaps.iter().filter(|gap| matches!(gap.key.kind, Kind::Vertex | Kind::Edges))
    }

    /// Number of gaps that press at `x`.
    #[cfg(test)]
    pub(crate) fn pressing(&self, x: &[DVec3]) -> usize {
        self.gaps.iter().filter(|gap| gap.depth(x) > 0.0).count()
    }

    /// Normal forces of the gaps at `x`, N.
    #[cfg(test)]
    pub(crate) fn forces(&self, x: &[DVec3]) -> impl Iterator<Item = DVec3> {
        self.gaps.iter().map(|gap| gap.normal * (gap.stiffness * gap.depth(x).max(0.0)))
    }

    /// Checks the step from `from`, where the last one ended, to `to`, of which some vertices may go only up to a share: see [`StepCheck`].
    pub(super) fn check_step(&mut self, from: &[DVec3], to: &mut [DVec3], shares: &[(u32, f64)]) -> StepCheck {
        self.filter.check(from, to, shares)
    }

    /// Number of pairs of triangles that intersect at `x`, where the last step ended.
    pub(crate) fn crossings(&mut self, x: &[DVec3]) -> usize {
        self.filter.current(x).len()
    }

    /// Moves the cloth from `x` to `to` (m) if that adds no intersections; returns whether it did.
    pub(super) fn move_to(&mut self, x: &[DVec3], to: &[DVec3]) -> bool {
        let crossing = self.filter.crossing_at(to);
        let moves = crossing.len() <= self.filter.current(x).len();
        if moves {
            self.filter.begin(crossing);
        }
        moves
    }

    /// The clear positions, m.
    pub(crate) fn clear(&self) -> &[DVec3] {
        &self.clear
    }

    /// Moves an intersecting `x` (m) back towards the clear positions until nothing intersects. If these intersect, too, leaves it
    /// unchanged and returns whether they have fewer intersections.
    pub(crate) fn retreat(&mut self, x: &mut Vec<DVec3>) -> Option<bool> {
        let crossing = self.filter.current(x).len();
        if crossing == 0 {
            return None;
        }
        let at_clear = self.filter.crossing_at(&self.clear).len();
        if at_clear > 0 {
            return Some(at_clear < crossing);
        }
        let end = std::mem::replace(x, self.clear.to_vec());
        let mut share = 1.0;
        while share > MIN_RETREAT_SHARE {
            share *= RETREAT_FACTOR;
            let there: Vec<DVec3> = self.clear.iter().zip(&end).map(|(a, b)| a.lerp(*b, share)).collect();
            if self.filter.crossing_at(&there).is_empty() {
                *x = there;
                break;
            }
        }
        self.filter.begin(Vec::new());
        None
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanics::energy::Cloth;
    use crate::mesh::samples::folded;

    #[test]
    fn an_intersecting_start_retreats_to_a_state_without_intersections() {
        let mesh = folded(|_| false);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        assert_eq!(cloth.proximity().crossings(&mesh.positions), 0);
        let tangled = folded(|j| j % 4 < 2).positions;
        let mut start = tangled.clone();
        let mut proximity = cloth.proximity();
        assert_eq!(proximity.retreat(&mut start), None);
        assert!(start != tangled && start != mesh.positions, "a part of the way is free of intersections");
        assert_eq!(cloth.proximity().crossings(&start), 0);
    }
}
