//! Search for the gaps of a cloth with itself.
//!
//! Candidates are the pairs of near triangles of the [`VerletList`]. A vertex forms a gap with the nearest point of a triangle. If that
//! point lies on an edge or a corner, the gap is with the edge or the corner, and exists only if every triangle there yields it: otherwise
//! another triangle is nearer (feasible region of a feature; Chen and others: "Offset geometric contact", ACM TOG 44(4), 2025). Edges form
//! a gap only while the nearest points lie between their ends; at an end a vertex has a gap.
//!
//! Topological neighbours are always near. They press only below half of their distance as placed, and are ignored across a sliver. No gap is
//! kept wider than it was placed.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::query::details::closest_points_segment_segment_with_locations_nD as nearest_of_segments;
use parry3d_f64::shape::{SegmentPointLocation, Triangle, TrianglePointLocation};
use rayon::prelude::*;

use super::gap::{Gap, Key, Kind};
use super::surface::Surface;
use super::verlet_list::VerletList;
use crate::mechanics::solver_options::SelfContactOptions;
use crate::mesh::NONE;

/// Pressure that compresses half the offset, Pa. The layers of a garment press on each other by their weight, some 2 Pa each; where more
/// is needed a gap grows stiffer.
const HALF_OFFSET_PRESSURE: f64 = 200.0;

/// Distance below which two places have no normal, m; they form no gap until the next refresh.
const COINCIDENT_M: f64 = 1e-9;

/// Offset below which a gap is ignored, m.
const MIN_GOAL_M: f64 = 1e-5;

/// Offsets of a cloth from itself.
#[derive(Debug, Clone)]
pub(super) struct Spacing {
    /// Thickness at each vertex, m.
    thickness: Arc<Vec<f64>>,
    /// Least and largest offset on this mesh, m.
    bounds: [f64; 2],
    pub(super) options: SelfContactOptions,
}

impl Spacing {
    /// Offsets of a cloth of this thickness (m) at each vertex with this mean edge (m).
    pub(super) fn new(thickness: Arc<Vec<f64>>, edge_m: f64, options: SelfContactOptions) -> Self {
        let min = (options.min_offset_of_edge * edge_m).min(options.max_min_offset_m);
        Self { thickness, bounds: [min, (options.max_offset_of_edge * edge_m).max(min)], options }
    }

    /// h of two places with this mean thickness (m), m.
    fn offset(&self, thickness: f64) -> f64 {
        thickness.clamp(self.bounds[0], self.bounds[1])
    }

    /// κ for this offset (m), N/m³.
    pub(super) fn stiffness(offset: f64) -> f64 {
        HALF_OFFSET_PRESSURE / (0.5 * offset)
    }

    /// Largest offset, m.
    pub(super) fn max_offset(&self) -> f64 {
        self.offset(self.thickness.iter().copied().fold(0.0, f64::max))
    }
}

/// All gaps under `reach` (m) at `x`, sorted by key, among the pairs of a list that holds at `x`; `placed` are the positions before any
/// folding. Same bits on any number of threads.
pub(super) fn gaps(
    surface: &Surface,
    list: &VerletList,
    x: &[DVec3],
    placed: &[DVec3],
    spacing: &Spacing,
    reach: f64,
) -> Vec<Gap> {
    let search = Search { surface, x, placed, reach, spacing };
    let mut found: Vec<Found> = list
        .pairs(reach)
        .flat_map_iter(|[t, u]| {
            let mut found = Vec::new();
            search.vertices_of(t, u, &list.bounds(u).loosened(reach), &mut found);
            search.vertices_of(u, t, &list.bounds(t).loosened(reach), &mut found);
            search.edges_of(t, u, &mut found);
            found
        })
        .collect();
    // The sort is stable: of the same gap found from several triangles the first counts, whenever the list was built.
    found.par_sort_by_key(|f| f.gap.key);
    let found_from_all = |same: &[Found]| same.len() as u32 >= same[0].triangles;
    found.chunk_by(|a, b| a.gap.key == b.gap.key).filter(|same| found_from_all(same)).map(|same| same[0].gap).collect()
}

/// A gap, and the number of triangles that must yield it.
struct Found {
    gap: Gap,
    triangles: u32,
}

struct Search<'a> {
    surface: &'a Surface,
    x: &'a [DVec3],
    placed: &'a [DVec3],
    reach: f64,
    spacing: &'a Spacing,
}

impl Search<'_> {
    /// Gaps of the vertices that triangle `t` owns with triangle `u`; `around` is the box of `u` enlarged by the reach.
    fn vertices_of(&self, t: usize, u: usize, around: &Aabb, found: &mut Vec<Found>) {
        let corners = self.surface.triangles[u];
        for v in self.surface.own_vertices[t].into_iter().filter(|v| *v != NONE && !corners.contains(v)) {
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
            let triangles = match at {
                TrianglePointLocation::OnVertex(i) => self.surface.vertex_triangles[corners[i as usize] as usize],
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
            let area = self.surface.vertex_areas[v as usize];
            if let Some(gap) = self.gap(key, weights, area) {
                found.push(Found { gap, triangles });
            }
        }
    }

    /// Number of triangles at side `i` (in parry3d's order) of the triangle with these corners.
    fn triangles_at(&self, corners: [u32; 3], i: u32) -> u32 {
        let [a, b, c] = corners;
        let side = [[a, b], [b, c], [a, c]][i as usize];
        self.surface.topology.edge_between(side[0], side[1]).map_or(1, |e| self.surface.topology.edge_valence[e])
    }

    /// Gaps of the edges that triangle `t` owns with those that `u` owns.
    fn edges_of(&self, t: usize, u: usize, found: &mut Vec<Found>) {
        for e in self.surface.own_edges[t].into_iter().filter(|e| *e != NONE) {
            for f in self.surface.own_edges[u].into_iter().filter(|f| *f != NONE) {
                self.edges(e, f, found);
            }
        }
    }

    fn edges(&self, e: u32, f: u32, found: &mut Vec<Found>) {
        let edges = &self.surface.topology.edges;
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
        let area = self.spacing.options.edge_area_share
            * self.surface.edge_areas[e as usize].min(self.surface.edge_areas[f as usize]);
        if let Some(gap) = self.gap(key, [p_share, q_share, -r_share, -s_share, 0.0], area) {
            found.push(Found { gap, triangles: 1 });
        }
    }

    fn gap(&self, key: Key, weights: [f64; 5], area: f64) -> Option<Gap> {
        let mut gap = Gap::new(key, weights, 0.0, 0.0);
        let thickness = gap.mean(&self.spacing.thickness);
        let offset = self.spacing.offset(thickness);
        (gap.goal, gap.stiffness) = (offset, Spacing::stiffness(offset) * area);
        gap.first = gap.stiffness;
        // Places that were placed nearer are not pushed farther apart than that.
        let placed = gap.across(self.placed).length();
        gap.goal = gap.goal.min(placed.max(thickness));
        let neighbour_goal = self.spacing.options.neighbour_share * placed;
        if neighbour_goal < gap.goal && self.are_neighbours(&gap) {
            gap.goal = neighbour_goal;
        }
        gap.from = gap.across(self.x);
        let distance = gap.from.length();
        gap.normal = gap.from / distance;
        (distance > COINCIDENT_M && gap.goal > MIN_GOAL_M).then_some(gap)
    }

    /// Whether the two places are topological neighbours or touch a sliver.
    fn are_neighbours(&self, gap: &Gap) -> bool {
        let (one, other): (Vec<_>, Vec<_>) = gap.members().partition(|(_, w)| *w > 0.0);
        let near = |(a, _): &(u32, f64)| {
            let around = self.surface.topology.neighbours(*a);
            other.iter().any(|(b, _)| around.contains(b))
        };
        one.iter().any(near) || gap.members().any(|(v, _)| self.surface.near_sliver[v as usize])
    }
}
