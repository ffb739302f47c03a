//! A garment that starts inside the body, pushed out before anything is measured.
//!
//! Vertices with q < 0 go out along ∇q until q reaches the cloth's thickness. Done vertex by vertex this creases and turns triangles
//! over, so the displacement field is smoothed over rings of neighbours around them (umbrella averages) and the
//! bound restored, in turn, until nothing is inside; if a triangle is turned over, again with more rings. Vertices
//! beyond the rings stay where they are, to the bit.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body | m |
//! | floor | what q must reach: the thickness for vertices found inside, else the lesser of thickness and the q found | m |
//!
//! Limits: it repairs what was placed a few centimetres wrong. A vertex deeper than [`DEEPEST`] may come out on the
//! wrong side of a limb; those are counted and said.

use std::fmt;

use glam::DVec3;
use serde::Serialize;

use crate::body::distance::Body;
use crate::mesh::{Topology, TriMesh};

/// Deeper than this (m) the nearest surface may be that of the far side: half the thickness of a slender forearm.
const DEEPEST: f64 = 0.03;
/// Rings smoothed at the first try, and how often they are doubled after that.
const RINGS: u32 = 3;
/// Tries with doubled rings: up to 3 · 2⁴ = 48 rings, half a garment.
const TRIES: u32 = 5;
/// Rounds of smoothing and restoring the bound in one try.
const ROUNDS: usize = 24;
/// Averages taken in one round.
const SWEEPS: usize = 4;
/// The bound is at least this (m), whatever the thickness: a micrometre is far above the rounding of distances at body
/// size, so that "outside" is unmistakable.
const LEAST: f64 = 1e-6;
/// Share of the thickness by which the bound may be missed: rounding of the last step.
const SLACK: f64 = 1e-6;

/// What was pushed out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PushOutReport {
    /// Vertices found inside the body.
    pub found_inside: usize,
    /// The deepest of them, m below the surface.
    pub deepest_m: f64,
    /// Those deeper than can be trusted to come out on the right side.
    pub too_deep: usize,
    /// Vertices moved, neighbours that were smoothed included.
    pub moved: usize,
    /// The longest way one went, m.
    pub farthest_m: f64,
    /// Vertices still inside.
    pub left_inside: usize,
    /// Triangles turned by more than a right angle.
    pub turned_over: usize,
    /// The longest way that a vertex went to be off an end of the body (toes, a thumb) that stuck through the garment, m; zero where none did.
    pub off_ends_m: f64,
}

impl PushOutReport {
    /// Whether all is outside and nothing turned over.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.left_inside == 0 && self.turned_over == 0 && self.too_deep == 0
    }
}

impl fmt::Display for PushOutReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found_inside, too_deep, moved, left_inside, turned_over, .. } = self;
        let [deepest, farthest, ends] = [self.deepest_m, self.farthest_m, self.off_ends_m].map(|m| 1e3 * m);
        if ends > 0.0 {
            f.write_str("the body stuck through the garment (a foot, a hand?); taken off over its end, ")?;
            write!(f, "by up to {ends:.0} mm; ")?;
        }
        if *found_inside == 0 {
            return f.write_str("no vertex of the garment starts inside the body");
        }
        write!(f, "{found_inside} vertices of the garment started up to {deepest:.1} mm inside the body; ")?;
        write!(f, "pushed out and smoothed, {moved} moved by up to {farthest:.1} mm")?;
        if *too_deep > 0 {
            write!(f, "; {too_deep} were deeper than {:.0} mm and may be on the wrong side now: ", 1e3 * DEEPEST)?;
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

/// The garment with no vertex inside the body: those that were are at least `thickness` (m) away from it now.
/// Vertices that start outside, however near, are only moved along with a neighbour, and never nearer than they were or
/// than `thickness`.
#[must_use]
pub fn push_out(garment: &TriMesh, body: &Body, thickness: f64) -> (TriMesh, PushOutReport) {
    let thickness = thickness.max(LEAST);
    let q: Vec<f64> = body.nearest_all(&garment.positions).iter().map(|near| near.signed_distance).collect();
    let inside: Vec<u32> = (0..q.len() as u32).filter(|&v| q[v as usize] < 0.0).collect();
    let mut report = PushOutReport {
        found_inside: inside.len(),
        deepest_m: q.iter().fold(0.0, |deepest, &q| f64::max(deepest, -q)),
        too_deep: q.iter().filter(|&&q| q < -DEEPEST).count(),
        ..PushOutReport::default()
    };
    if inside.is_empty() {
        return (garment.clone(), report);
    }
    let floor: Vec<f64> = q.iter().map(|&q| if q < 0.0 { thickness } else { q.min(thickness) }).collect();
    let topology = Topology::new(garment);
    let mut best: Option<(usize, usize, TriMesh)> = None;
    for attempt in 0..TRIES {
        let region = rings(&topology, &inside, garment.vertex_count(), RINGS << attempt);
        let moved = displace(garment, body, &topology, &region, &floor, thickness);
        let left = body.nearest_all(&moved.positions).iter().filter(|near| near.signed_distance < 0.0).count();
        let over = (0..garment.triangles.len())
            .filter(|&t| garment.double_area_vector(t).dot(moved.double_area_vector(t)) < 0.0)
            .count();
        if best.as_ref().is_none_or(|&(l, o, _)| (left, over) < (l, o)) {
            best = Some((left, over, moved));
        }
        if (left, over) == (0, 0) {
            break;
        }
    }
    let Some((left_inside, turned_over, moved)) = best else { return (garment.clone(), report) };
    let way = garment.positions.iter().zip(&moved.positions).map(|(p, q)| p.distance(*q));
    report.moved = way.clone().filter(|&d| d > 0.0).count();
    report.farthest_m = way.fold(0.0, f64::max);
    report.left_inside = left_inside;
    report.turned_over = turned_over;
    (moved, report)
}

/// Vertices within so many edges of the seeds, ascending.
fn rings(topology: &Topology, seeds: &[u32], vertices: usize, rings: u32) -> Vec<u32> {
    let mut reached = vec![false; vertices];
    seeds.iter().for_each(|&v| reached[v as usize] = true);
    let mut front = seeds.to_vec();
    for _ in 0..rings {
        let mut next = Vec::new();
        for &w in front.iter().flat_map(|&v| topology.neighbours(v)) {
            if !std::mem::replace(&mut reached[w as usize], true) {
                next.push(w);
            }
        }
        front = next;
    }
    (0..vertices as u32).filter(|&v| reached[v as usize]).collect()
}

/// One try: smooth and restore in turn, restoring last.
fn displace(
    garment: &TriMesh,
    body: &Body,
    topology: &Topology,
    region: &[u32],
    floor: &[f64],
    thickness: f64,
) -> TriMesh {
    let mut displacement = vec![DVec3::ZERO; garment.vertex_count()];
    let place = |displacement: &[DVec3]| -> Vec<DVec3> {
        region.iter().map(|&v| garment.positions[v as usize] + displacement[v as usize]).collect()
    };
    let restore = |displacement: &mut Vec<DVec3>| -> bool {
        let near = body.nearest_all(&place(displacement));
        let mut held = true;
        for (&v, near) in region.iter().zip(&near) {
            let missing = floor[v as usize] - near.signed_distance;
            if missing > SLACK * thickness {
                displacement[v as usize] += missing * near.normal;
                held = false;
            }
        }
        held
    };
    restore(&mut displacement);
    for _ in 0..ROUNDS {
        for _ in 0..SWEEPS {
            let mean = |&v: &u32| {
                let around = topology.neighbours(v);
                let sum: DVec3 = around.iter().map(|&w| displacement[w as usize]).sum();
                sum / around.len().max(1) as f64
            };
            let means: Vec<DVec3> = region.iter().map(mean).collect();
            region.iter().zip(means).for_each(|(&v, mean)| displacement[v as usize] = mean);
        }
        restore(&mut displacement);
    }
    // Where two surfaces are near, out of one may be into the other: until all hold, or for as long as smoothing took.
    for _ in 0..ROUNDS {
        if restore(&mut displacement) {
            break;
        }
    }
    let positions = garment.positions.iter().zip(&displacement).map(|(p, d)| p + d).collect();
    garment.with_positions(positions)
}
