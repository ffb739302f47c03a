//! Garment vertices moved out of the body before a drape.
//!
//! [`push_out`] moves vertices that start inside the body, and [`pull_off_protrusions`] pulls cloth off toes or thumbs that
//! poke through a face without containing a vertex. Both prescribe displacements for a few vertices. Moving those vertices
//! alone creases the cloth and inverts triangles. So displacements are smoothed over rings of neighbours (umbrella averages)
//! and the constraint is restored, in turn. Vertices beyond the rings keep their positions to the bit.
//!
//! # Vertices inside the body
//! Vertices with q < 0 move along ∇q until q reaches the clearance. If a triangle is inverted, the attempt is repeated with
//! twice as many rings.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body | m |
//! | floor | least q of a vertex: the clearance for vertices that start inside, else the smaller of clearance and starting q | m |
//!
//! Limits: repairs placements that are wrong by a few centimetres. A vertex deeper than [`MAX_DEPTH`] may come out on the
//! wrong side of a limb; those are counted and reported.
//!
//! # Protrusions
//! A trouser leg placed about a leg may have the toes poke through its front: no vertex is inside, and the nearest way out is
//! up above the foot and down below it. A triangle that crosses the body has a protrusion where the nearest way out leads
//! back through the cloth or along it; the right direction is the outer normal of the cloth. Each such triangle moves that way
//! until it is outside, smoothed as above, until no protrusion is left.
//!
//! Limits: only what reaches less than [`MAX_PROTRUSION`] beyond the cloth is a protrusion. Where the number of protrusions
//! does not fall, or the cloth would intersect itself in more pairs than before, it keeps its place: a garment that was not
//! made for the body is not repaired here.

use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::Body;
use crate::mesh::lattice::{lattice, place};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::mesh::{Topology, TriMesh, longest_side};

/// Beyond this depth, m, the nearest surface may be that of the far side: half the thickness of a slender forearm.
const MAX_DEPTH: f64 = 0.03;
/// Rings smoothed in the first attempt; each further attempt doubles them. A heuristic.
const FIRST_RINGS: usize = 3;
/// Attempts with doubled rings: up to 3 · 2⁴ = 48 rings, half a garment.
const ATTEMPTS: usize = 5;
/// Rounds of smoothing and restoring the constraint in one attempt. More rounds smooth wider; a heuristic.
const SMOOTHING_ROUNDS: usize = 24;
/// Umbrella averages in one round; a heuristic.
const SWEEPS: usize = 4;
/// Least clearance, m: a micrometre is far above the rounding of distances at body size.
const MIN_CLEARANCE: f64 = 1e-6;
/// Share of the clearance by which the floor may be missed: rounding of the last step.
const FLOOR_TOLERANCE: f64 = 1e-6;

/// Least cosine between the way out of the body and the cloth's outer normal at which that way counts as leading outward.
pub(crate) const OUTWARD: f64 = 0.3;
/// Least depth of a protrusion, m; contact pushes out shallower triangles.
const MIN_PROTRUSION_DEPTH: f64 = 2e-3;
/// Longest protrusion beyond the cloth, m: a foot less its heel.
const MAX_PROTRUSION: f64 = 0.12;
/// Least and largest stride of the march to the outside, m.
const STRIDE: [f64; 2] = [2e-4, 0.01];
/// Distances from the body, m, of a triangle that was pulled off and of its neighbours.
const PULLED_CLEARANCE: f64 = 4e-3;
const NEIGHBOUR_CLEARANCE: f64 = 1e-3;
/// Attempts at pulling cloth off.
const PULLS: usize = 8;
/// Width of the smoothed region over the longest displacement, and the bounds of its rings; heuristics.
const REGION_WIDTH: f64 = 3.0;
const REGION_RINGS: [f64; 2] = [3.0, 24.0];

/// The repairs of a garment's placement.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PushOutReport {
    /// Vertices found inside the body.
    pub found_inside: usize,
    /// Depth of the deepest of them, m.
    pub deepest_m: f64,
    /// Vertices so deep that they may have been pushed out on the wrong side.
    pub too_deep: usize,
    /// Vertices moved, smoothed neighbours included.
    pub moved: usize,
    /// Longest displacement, m.
    pub farthest_m: f64,
    /// Vertices still inside.
    pub left_inside: usize,
    /// Triangles turned by more than a right angle.
    pub turned_over: usize,
    /// Longest displacement that pulled cloth off protrusions of the body (toes, a thumb), m; zero without protrusions.
    #[serde(rename = "off_ends_m")]
    pub protrusion_move_m: f64,
}

impl PushOutReport {
    /// Whether every vertex is outside and no triangle inverted.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.left_inside == 0 && self.turned_over == 0 && self.too_deep == 0
    }
}

impl fmt::Display for PushOutReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found_inside, too_deep, moved, left_inside, turned_over, .. } = self;
        let [deepest, farthest, ends] = [self.deepest_m, self.farthest_m, self.protrusion_move_m].map(|m| 1e3 * m);
        if ends > 0.0 {
            f.write_str("the body stuck through the garment (a foot, a hand?); ")?;
            write!(f, "the garment was pulled off that end by up to {ends:.0} mm; ")?;
        }
        if *found_inside == 0 {
            return f.write_str("no vertex of the garment starts inside the body");
        }
        write!(f, "{found_inside} vertices of the garment started up to {deepest:.1} mm inside the body; ")?;
        write!(f, "pushed out and smoothed, {moved} moved by up to {farthest:.1} mm")?;
        if *too_deep > 0 {
            write!(f, "; {too_deep} were deeper than {:.0} mm and may be on the wrong side now: ", 1e3 * MAX_DEPTH)?;
            f.write_str("place the garment better")?;
        }
        if *left_inside > 0 {
            write!(f, "; {left_inside} are still inside")?;
        }
        if *turned_over > 0 {
            write!(f, "; {turned_over} triangles were turned over")?;
        }
        Ok(())
    }
}

/// Moves the garment's vertices out of the body: those that start inside end at least `clearance` (m) away from it.
/// Vertices that start outside move only with a neighbour, and never nearer to the body than the smaller of `clearance` and
/// their starting distance.
#[must_use]
pub fn push_out(garment: &TriMesh, body: &Body, clearance: f64) -> (TriMesh, PushOutReport) {
    let clearance = clearance.max(MIN_CLEARANCE);
    let q: Vec<f64> = body.nearest_all(&garment.positions).iter().map(|near| near.signed_distance).collect();
    let inside: Vec<u32> = (0..q.len() as u32).filter(|&v| q[v as usize] < 0.0).collect();
    let mut report = PushOutReport {
        found_inside: inside.len(),
        deepest_m: q.iter().fold(0.0, |deepest, &q| f64::max(deepest, -q)),
        too_deep: q.iter().filter(|&&q| q < -MAX_DEPTH).count(),
        ..PushOutReport::default()
    };
    let floor: Vec<f64> = q.iter().map(|&q| if q < 0.0 { clearance } else { q.min(clearance) }).collect();
    let topology = Topology::new(garment);
    let mut best: Option<(usize, usize, TriMesh)> = None;
    for attempt in 0..if inside.is_empty() { 0 } else { ATTEMPTS } {
        let region = rings(&topology, &inside, FIRST_RINGS << attempt, vec![false; q.len()]);
        let moved = push_attempt(garment, body, &topology, &region, &floor, FLOOR_TOLERANCE * clearance);
        let left = body.nearest_all(&moved.positions).iter().filter(|near| near.signed_distance < 0.0).count();
        let inverted = (0..garment.triangles.len())
            .filter(|&t| garment.double_area_vector(t).dot(moved.double_area_vector(t)) < 0.0)
            .count();
        if best.as_ref().is_none_or(|&(l, i, _)| (left, inverted) < (l, i)) {
            best = Some((left, inverted, moved));
        }
        if (left, inverted) == (0, 0) {
            break;
        }
    }
    let Some((left_inside, turned_over, moved)) = best else { return (garment.clone(), report) };
    let lengths = garment.positions.iter().zip(&moved.positions).map(|(p, q)| p.distance(*q));
    report.moved = lengths.clone().filter(|&d| d > 0.0).count();
    report.farthest_m = lengths.fold(0.0, f64::max);
    report.left_inside = left_inside;
    report.turned_over = turned_over;
    (moved, report)
}

/// One attempt on the vertices of `region`: smooths and restores `floor`, restoring last.
fn push_attempt(
    garment: &TriMesh,
    body: &Body,
    topology: &Topology,
    region: &[u32],
    floor: &[f64],
    tolerance: f64,
) -> TriMesh {
    let mut displacement = vec![DVec3::ZERO; garment.vertex_count()];
    // Returns whether the floor held already.
    let restore = |displacement: &mut [DVec3]| {
        let moved: Vec<DVec3> =
            region.iter().map(|&v| garment.positions[v as usize] + displacement[v as usize]).collect();
        let mut holds = true;
        for (&v, near) in region.iter().zip(body.nearest_all(&moved)) {
            let missing = floor[v as usize] - near.signed_distance;
            if missing > tolerance {
                displacement[v as usize] += missing * near.normal;
                holds = false;
            }
        }
        holds
    };
    restore(&mut displacement);
    for _ in 0..SMOOTHING_ROUNDS {
        smooth(topology, region, &mut displacement);
        restore(&mut displacement);
    }
    // Out of one of two surfaces that are close may be into the other: restore until the floor holds, or for as many rounds.
    let _ = (0..SMOOTHING_ROUNDS).any(|_| restore(&mut displacement));
    garment.with_positions(garment.positions.iter().zip(&displacement).map(|(p, d)| p + d).collect())
}

/// Umbrella averages of a displacement field over the vertices of `region`.
fn smooth(topology: &Topology, region: &[u32], displacement: &mut [DVec3]) {
    for _ in 0..SWEEPS {
        let means: Vec<DVec3> = region.iter().map(|&v| neighbour_mean(topology, displacement, v)).collect();
        region.iter().zip(means).for_each(|(&v, mean)| displacement[v as usize] = mean);
    }
}

/// Mean of a field over the neighbours of a vertex.
pub(crate) fn neighbour_mean(topology: &Topology, field: &[DVec3], v: u32) -> DVec3 {
    let neighbours = topology.neighbours(v);
    neighbours.iter().map(|&w| field[w as usize]).sum::<DVec3>() / neighbours.len().max(1) as f64
}

/// Vertices within `rings` edges of the seeds, ascending. Paths through `excluded` vertices do not count.
fn rings(topology: &Topology, seeds: &[u32], rings: usize, excluded: Vec<bool>) -> Vec<u32> {
    let mut reached = excluded;
    let mut region: Vec<u32> = Vec::new();
    let mut front = seeds.to_vec();
    for _ in 0..=rings {
        front.retain(|&v| !std::mem::replace(&mut reached[v as usize], true));
        region.extend(&front);
        front = front.iter().flat_map(|&v| topology.neighbours(v)).copied().collect();
    }
    region.sort_unstable();
    region
}

/// A triangle that the body pokes through.
struct Protrusion {
    corners: [u32; 3],
    /// Barycentric coordinates of the point that must move farthest.
    weights: [f64; 3],
    /// Unit outer normal of the cloth.
    direction: DVec3,
    /// Length of the displacement along it, m.
    distance: f64,
}

/// Positions (m) at which no part of the body pokes through `garment`, whose winding is outward; vertices that are `held`
/// stay. `None` where there are no protrusions or they cannot be removed.
pub(crate) fn pull_off_protrusions(body: &Body, garment: &TriMesh, held: &[bool]) -> Option<Vec<DVec3>> {
    let mut mesh = garment.clone();
    let mut found = protrusions(body, &mesh);
    if found.is_empty() {
        return None;
    }
    let intersections = self_intersecting_pairs(&mesh).len();
    let topology = Topology::new(garment);
    for _ in 0..PULLS {
        mesh = pull_attempt(body, &mesh, &topology, held, &found);
        let left = protrusions(body, &mesh);
        if left.len() >= found.len() {
            return None;
        }
        found = left;
        if found.is_empty() {
            break;
        }
    }
    (found.is_empty() && self_intersecting_pairs(&mesh).len() <= intersections).then_some(mesh.positions)
}

fn protrusions(body: &Body, mesh: &TriMesh) -> Vec<Protrusion> {
    let mut triangles: Vec<u32> = body.crossing_pairs(mesh).into_iter().map(|[t, _]| t).collect();
    triangles.dedup();
    triangles.into_iter().filter_map(|t| protrusion(body, mesh, t as usize)).collect()
}

fn protrusion(body: &Body, mesh: &TriMesh, t: usize) -> Option<Protrusion> {
    let corners = mesh.corners(t);
    let [a, b, c] = corners;
    let direction = (b - a).cross(c - a).normalize_or_zero();
    let weights: Vec<[f64; 3]> = lattice(longest_side(corners)).collect();
    let samples: Vec<DVec3> = weights.iter().map(|weights| place(corners, *weights)).collect();
    let near = body.nearest_all(&samples);
    if !near.iter().any(|p| p.signed_distance < -MIN_PROTRUSION_DEPTH && p.normal.dot(direction) < OUTWARD) {
        return None;
    }
    let inside = samples.iter().zip(near).zip(weights).filter(|((_, near), _)| near.signed_distance < 0.0);
    let exits = inside.filter_map(|((x, _), weights)| Some((distance_to_outside(body, *x, direction)?, weights)));
    let (distance, weights) = exits.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Protrusion { corners: mesh.triangles[t], weights, direction, distance: distance + PULLED_CLEARANCE })
}

/// Distance from `x` along `direction` to the outside of the body, m; `None` beyond [`MAX_PROTRUSION`].
fn distance_to_outside(body: &Body, x: DVec3, direction: DVec3) -> Option<f64> {
    let mut marched = 0.0;
    while marched < MAX_PROTRUSION {
        let q = body.nearest(x + direction * marched).signed_distance;
        if q >= 0.0 {
            return Some(marched);
        }
        marched += (-q).clamp(STRIDE[0], STRIDE[1]);
    }
    None
}

/// One attempt: displaces the protrusions' triangles and smooths over the region around them, in turn.
fn pull_attempt(body: &Body, mesh: &TriMesh, topology: &Topology, held: &[bool], found: &[Protrusion]) -> TriMesh {
    let farthest = found.iter().map(|protrusion| protrusion.distance).fold(0.0, f64::max);
    let area: f64 = mesh.triangle_areas().iter().sum();
    // The edge of equilateral triangles with the mesh's mean area.
    let edge = (4.0 * area / (3.0_f64.sqrt() * mesh.triangles.len() as f64)).sqrt();
    let count = (REGION_WIDTH * farthest / edge).ceil().clamp(REGION_RINGS[0], REGION_RINGS[1]) as usize;
    let seeds: Vec<u32> = found.iter().flat_map(|protrusion| protrusion.corners).collect();
    let region = rings(topology, &seeds, count, held.to_vec());
    let x = &mesh.positions;
    let mut displacement = vec![DVec3::ZERO; x.len()];
    // Moves each protrusion far enough, and keeps the vertices that move out of the body.
    let restore = |displacement: &mut [DVec3]| {
        for Protrusion { corners, weights, direction, distance } in found {
            let moved = place(corners.map(|v| displacement[v as usize]), *weights);
            let missing = (distance - moved.dot(*direction)).max(0.0);
            for v in corners.iter().map(|v| *v as usize).filter(|v| !held[*v]) {
                displacement[v] += *direction * missing;
            }
        }
        let moved: Vec<DVec3> = region.iter().map(|&v| x[v as usize] + displacement[v as usize]).collect();
        for (&v, near) in region.iter().zip(body.nearest_all(&moved)) {
            if near.signed_distance < NEIGHBOUR_CLEARANCE && displacement[v as usize] != DVec3::ZERO {
                displacement[v as usize] += near.normal * (NEIGHBOUR_CLEARANCE - near.signed_distance);
            }
        }
    };
    restore(&mut displacement);
    for _ in 0..SMOOTHING_ROUNDS {
        smooth(topology, &region, &mut displacement);
        restore(&mut displacement);
    }
    mesh.with_positions(x.iter().zip(displacement).map(|(x, moved)| *x + moved).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::{cuboid, tube};

    #[test]
    fn a_foot_through_a_trouser_leg_is_inside_it_afterwards() {
        // As thick as an edge is long, so that it may contain no vertex; it reaches 6 cm out of the leg.
        let leg = tube(36, 28, |a, row| DVec3::new(0.08 * a.cos(), 0.08 * a.sin(), 0.4 * row / 28.0));
        let toes =
            |length: f64| Body::new(&cuboid(DVec3::new(-0.05, -0.03, 0.02), DVec3::new(length, 0.03, 0.032))).unwrap();
        let foot = toes(0.14);
        let held = vec![false; leg.positions.len()];
        assert!(protrusions(&foot, &leg).len() > 8);
        let pulled = leg.with_positions(pull_off_protrusions(&foot, &leg, &held).unwrap());
        assert!(protrusions(&foot, &pulled).is_empty());
        assert!(self_intersecting_pairs(&pulled).is_empty());
        assert!(pulled.positions.iter().any(|x| x.x > 0.14) && pulled.positions.iter().all(|x| x.x < 0.16));
        // The upper end keeps its place.
        assert!(
            leg.positions.iter().zip(&pulled.positions).filter(|(x, _)| x.z > 0.35).all(|(a, b)| a.distance(*b) < 1e-3)
        );
        // A protrusion that is too long is left, and without one nothing moves.
        assert!(pull_off_protrusions(&toes(0.4), &leg, &held).is_none());
        assert!(pull_off_protrusions(&toes(0.07), &leg, &held).is_none());
        // A held leg does not move either.
        assert!(pull_off_protrusions(&foot, &leg, &vec![true; held.len()]).is_none());
    }
}
