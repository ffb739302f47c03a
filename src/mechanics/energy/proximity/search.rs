//! Which places of a cloth are near each other.
//!
//! Candidates are the triangles that are near each other ([`near`](super::verlet_list)). A vertex faces the nearest point of a triangle; where
//! that lies on an edge or a corner, it faces the edge or the corner, and only if it does so from every triangle there: else another
//! of them is nearer (the feasible region of a feature; Chen and others: "Offset geometric contact", ACM TOG 44(4), 2025). Edges face
//! each other between their ends alone; at the ends a vertex faces something.
//!
//! Neighbours are near because they are neighbours. Where the garment as placed kept them well apart they count as any other places do;
//! else they press only where they come to less than half as near as they were placed, and are left out across a sliver. No gap is kept
//! wider than it was placed.

use glam::DVec3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::query::details::closest_points_segment_segment_with_locations_nD as nearest_of_segments;
use parry3d_f64::shape::{SegmentPointLocation, Triangle, TrianglePointLocation};
use rayon::prelude::*;

use super::Apart;
use super::gap::{Gap, Key, Kind};
use super::surface::Skin;
use super::verlet_list::Near;
use crate::mesh::NONE;

/// Nearer than this (m) there is no direction between two places any more, and they wait for the next time.
const COINCIDENT: f64 = 1e-9;

/// Neighbours count as far apart where the garment as placed keeps them this many times as far as they are looked for.
const KEPT_APART: f64 = 2.0;

/// Neighbours press where they are nearer than this share of how far apart they were placed,
const OF_NEIGHBOURS: f64 = 0.5;

/// and not at all where that is less than this, m.
const LEAST_GOAL: f64 = 1e-5;

/// A share of a vertex's area that its edges stand for, of which it has some three and each faces several others.
const OF_EDGES: f64 = 0.25;

/// All gaps under `reach` (m) at `x`, sorted by key, among triangles that are `near`; `placed` is where nothing was folded yet. Same bits on
/// any number of threads.
pub(super) fn gaps(skin: &Skin, near: &Near, x: &[DVec3], placed: &[DVec3], apart: &Apart, reach: f64) -> Vec<Gap> {
    let look = Look { skin, x, placed, reach, apart };
    let mut found: Vec<Found> = near
        .pairs(reach)
        .flat_map_iter(|[t, u]| {
            let mut found = Vec::new();
            look.vertices_of(t, u, &near.bounds(u).loosened(reach), &mut found);
            look.vertices_of(u, t, &near.bounds(t).loosened(reach), &mut found);
            look.edges_of(t, u, &mut found);
            found
        })
        .collect();
    // Stable: of the same gap, seen from several triangles, the first counts, whatever the list was made for.
    found.par_sort_by_key(|f| f.gap.key);
    let seen_from_all = |same: &[Found]| same.len() as u32 >= same[0].faces;
    found.chunk_by(|a, b| a.gap.key == b.gap.key).filter(|same| seen_from_all(same)).map(|same| same[0].gap).collect()
}

/// A gap, and from how many triangles it must be found to be one.
struct Found {
    gap: Gap,
    faces: u32,
}

struct Look<'a> {
    skin: &'a Skin,
    x: &'a [DVec3],
    placed: &'a [DVec3],
    reach: f64,
    apart: &'a Apart,
}

impl Look<'_> {
    /// The vertices that triangle `t` owns, against triangle `u`, whose box loosened by the reach is `around`.
    fn vertices_of(&self, t: usize, u: usize, around: &Aabb, found: &mut Vec<Found>) {
        let corners = self.skin.triangles[u];
        for v in self.skin.own_vertices[t].into_iter().filter(|v| *v != NONE && !corners.contains(v)) {
            let p = self.x[v as usize];
            if !around.contains_local_point(p) {
                continue;
            }
            let [a, b, c] = corners.map(|v| self.x[v as usize]);
            let (nearest, at) = Triangle::new(a, b, c).project_local_point_and_get_location(p, true);
            if p.distance_squared(nearest.point) > self.reach * self.reach {
                continue;
            }
            let Some(shares) = at.barycentric_coordinates() else { continue };
            let faces = match at {
                TrianglePointLocation::OnVertex(i) => self.skin.vertex_triangles[corners[i as usize] as usize],
                TrianglePointLocation::OnEdge(i, _) => self.triangles_at(corners, i),
                _ => 1,
            };
            let mut to: [(u32, f64); 3] = [0, 1, 2].map(|i| (corners[i], -shares[i]));
            for (v, share) in &mut to {
                *v = if *share == 0.0 { NONE } else { *v };
            }
            to.sort_unstable_by_key(|(v, _)| *v);
            let key = Key { kind: Kind::Vertex, vertices: [v, to[0].0, to[1].0, to[2].0, NONE], place: NONE };
            let weights = [1.0, to[0].1, to[1].1, to[2].1, 0.0];
            let area = self.skin.vertex_areas[v as usize];
            if let Some(gap) = self.gap(key, weights, area) {
                found.push(Found { gap, faces });
            }
        }
    }

    /// How many triangles there are at side `i` of one with these corners, as parry3d counts sides.
    fn triangles_at(&self, corners: [u32; 3], i: u32) -> u32 {
        let [a, b, c] = corners;
        let side = [[a, b], [b, c], [a, c]][i as usize];
        self.skin.topology.edge_between(side[0], side[1]).map_or(1, |e| self.skin.topology.edge_valence[e])
    }

    /// The edges that triangle `t` owns against those that `u` owns.
    fn edges_of(&self, t: usize, u: usize, found: &mut Vec<Found>) {
        for e in self.skin.own_edges[t].into_iter().filter(|e| *e != NONE) {
            for f in self.skin.own_edges[u].into_iter().filter(|f| *f != NONE) {
                self.edges(e, f, found);
            }
        }
    }

    fn edges(&self, e: u32, f: u32, found: &mut Vec<Found>) {
        let edges = &self.skin.topology.edges;
        let ([a, b], [c, d]) = (edges[e as usize], edges[f as usize]);
        if a == c || a == d || b == c || b == d {
            return;
        }
        let [p, q, r, s] = [a, b, c, d].map(|v| self.x[v as usize]);
        let apart = (p.min(q) - r.max(s)).max(r.min(s) - p.max(q));
        if apart.max_element() > self.reach {
            return;
        }
        let (SegmentPointLocation::OnEdge([p_share, q_share]), SegmentPointLocation::OnEdge([r_share, s_share])) =
            nearest_of_segments((&p, &q), (&r, &s))
        else {
            return;
        };
        let across = p * p_share + q * q_share - r * r_share - s * s_share;
        if across.length_squared() > self.reach * self.reach {
            return;
        }
        let key = Key { kind: Kind::Edges, vertices: [a, b, c, d, NONE], place: NONE };
        let area = OF_EDGES * self.skin.edge_areas[e as usize].min(self.skin.edge_areas[f as usize]);
        if let Some(gap) = self.gap(key, [p_share, q_share, -r_share, -s_share, 0.0], area) {
            found.push(Found { gap, faces: 1 });
        }
    }

    fn gap(&self, key: Key, weights: [f64; 5], area: f64) -> Option<Gap> {
        let mut gap = Gap::new(key, weights, 0.0, 0.0);
        let thickness = gap.mean(&self.apart.thickness);
        let offset = self.apart.offset(thickness);
        (gap.goal, gap.stiffness) = (offset, Apart::stiffness(offset) * area);
        gap.first = gap.stiffness;
        // What was placed nearer than that is not pushed farther apart than it was.
        let placed = gap.across(self.placed).length();
        gap.goal = gap.goal.min(placed.max(thickness));
        if placed < KEPT_APART * self.reach && self.belongs(&gap) {
            gap.goal = gap.goal.min(OF_NEIGHBOURS * placed);
        }
        gap.from = gap.across(self.x);
        let distance = gap.from.length();
        gap.normal = gap.from / distance;
        (distance > COINCIDENT && gap.goal > LEAST_GOAL).then_some(gap)
    }

    /// Whether the two places are near because they are neighbours.
    fn belongs(&self, gap: &Gap) -> bool {
        let (one, other): (Vec<_>, Vec<_>) = gap.members().partition(|(_, w)| *w > 0.0);
        let near = |(a, _): &(u32, f64)| {
            let around = self.skin.topology.neighbours(*a);
            other.iter().any(|(b, _)| around.contains(b))
        };
        one.iter().any(near) || gap.members().any(|(v, _)| self.skin.frail[v as usize])
    }
}
