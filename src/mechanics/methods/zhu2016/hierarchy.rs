//! The hybrid hierarchy: world box, units, quadrics, leaf triangles, with a count of the tests at each level.
//!
//! A vertex x touches where its signed distance q to the body is below the offset o. It is tested in turn against the body's
//! box; the box of each unit; in the unit's frame, (x/a)² + (y/b)² < (1 + ε)² of the slice at its
//! height; and then against the triangles of its sector for the closest point (by the region of the triangle's plane that the vertex
//! lies over, as in Ericson: "Real-time collision detection", 5.1.5). The sign of q is that of (x − c)·n with n the vertex normals
//! blended at the closest point c.
//!
//! The last query of a vertex is cached: within 2 mm of its position the tangent plane replaces the body,
//! and a vertex that cannot touch yet by its last q (q has slope at most one) is skipped. The cache is ours; the source mentions
//! none.
//!
//! Limits: deeper than `REACH` inside the body the nearest triangle may be in another sector, and the
//! depth is then overestimated.

use glam::DVec3;
use rayon::prelude::*;

use super::units::{BodyUnit, REACH};
use crate::mechanics::energy::Touch;
use crate::mechanics::methods::implicit_euler::Obstacle;
use crate::mechanics::methods::method::MethodInput;
use crate::mechanics::methods::segment::Segments;

/// Vertices of one parallel task. A heuristic.
const CHUNK: usize = 256;

/// Displacement up to which a vertex keeps its last tangent plane, m. Larger values save queries, and err by the body's curvature.
/// A heuristic.
const PLANE_RADIUS: f64 = 2e-3;

/// The last query of a vertex.
#[derive(Debug, Clone, Copy)]
struct CachedQuery {
    at: DVec3,
    /// Minus infinity before the first query.
    q: f64,
    normal: DVec3,
}

/// Number of tests at each level over a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TestCounts {
    /// Vertices tested against the world box.
    pub world: u64,
    /// Vertex and unit.
    pub units: u64,
    /// Vertex and quadric.
    pub quadrics: u64,
    /// Vertex and triangle.
    pub triangles: u64,
    /// Contacts found.
    pub touching: u64,
}

/// A triangle with the normals at its corners.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

/// The hierarchy over a body.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    pub(super) units: Vec<BodyUnit>,
    leaves: Vec<Leaf>,
    /// Centre and radius of a bounding ball of each leaf, which rejects most of them.
    balls: Vec<(DVec3, f64)>,
    world: (DVec3, DVec3),
    offset: f64,
    /// κ A of each vertex, N/m; zero where it is held.
    stiffness: Vec<f64>,
    cache: Vec<CachedQuery>,
    touches: Vec<Touch>,
    /// The tests so far.
    pub tests: TestCounts,
}

impl Hierarchy {
    /// Segments the body of a scene and fits its quadrics.
    ///
    /// # Errors
    /// A sentence about a body that is not closed, which has no inside.
    pub fn new(input: &MethodInput<'_>) -> Result<Self, String> {
        let MethodInput { scene, cloth, .. } = input;
        let mesh = scene.body.mesh();
        let segments = Segments::of_closed(mesh, "unit")?;
        let mut of_unit = vec![Vec::new(); segments.is_limb.len()];
        for (t, &unit) in (0u32..).zip(&segments.of_triangle) {
            of_unit[unit as usize].push(t);
        }
        let offset = cloth.offset;
        let units: Vec<BodyUnit> = (of_unit.par_iter().zip(&segments.is_limb))
            .filter_map(|(triangles, &is_limb)| BodyUnit::new(mesh, triangles, is_limb, offset))
            .collect();
        let normals = mesh.vertex_normals();
        let leaf =
            |t: usize| Leaf { corners: mesh.corners(t), normals: mesh.triangles[t].map(|v| normals[v as usize]) };
        let leaves: Vec<Leaf> = units.iter().flat_map(|u| &u.leaves).map(|&t| leaf(t as usize)).collect();
        let balls = leaves.iter().map(|leaf| ball(leaf.corners)).collect();
        let (low, high) = mesh.bounds().unwrap_or_default();
        let stiff = cloth.contact_stiffness();
        let stiffness =
            cloth.areas.iter().zip(&cloth.held).map(|(a, held)| if *held { 0.0 } else { stiff * a }).collect();
        Ok(Self {
            units,
            leaves,
            balls,
            world: (low - offset, high + offset),
            offset,
            stiffness,
            cache: vec![
                CachedQuery { at: DVec3::ZERO, q: f64::NEG_INFINITY, normal: DVec3::ZERO };
                cloth.vertex_count()
            ],
            touches: Vec::new(),
            tests: TestCounts::default(),
        })
    }

    /// Number of quadrics.
    pub(super) fn slices(&self) -> usize {
        self.units.iter().flat_map(|u| &u.slices).flatten().count()
    }

    /// The quadrics as closed lines, m, each with the index of its unit.
    pub(super) fn outlines(&self) -> Vec<(usize, Vec<DVec3>)> {
        let of = |(i, unit): (usize, &BodyUnit)| unit.outlines().into_iter().map(move |line| (i, line));
        self.units.iter().enumerate().flat_map(of).collect()
    }

    /// A note about the fit for the user.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let slices = self.units.iter().flat_map(|u| &u.slices).flatten();
        let by_moments = slices.filter(|s| s.quadric.by_moments).count();
        let limbs = self.units.iter().filter(|u| u.is_limb).count();
        vec![format!(
            "the body is cut into {} units, {limbs} of them limbs, with {} quadrics, {by_moments} by moments because least squares gave no ellipse",
            self.units.len(),
            self.slices()
        )]
    }

    /// Signed distance and outward normal at `x`; `None` outside every quadric, where the distance exceeds the offset.
    fn query(&self, x: DVec3, counts: &mut TestCounts) -> Option<(f64, DVec3)> {
        counts.world += 1;
        if !inside(x, self.world) {
            return None;
        }
        let mut best: Option<(f64, DVec3, DVec3)> = None;
        let mut base = 0;
        for unit in &self.units {
            counts.units += 1;
            let first = base;
            base += unit.leaves.len();
            if !inside(x, unit.bounds) {
                continue;
            }
            let local = unit.local(x);
            let Some(slice) = unit.slice(local.z) else { continue };
            counts.quadrics += 1;
            let flat = local.truncate();
            if slice.quadric.level(flat) >= slice.quadric.bound {
                continue;
            }
            let range = slice.leaves(flat);
            let range = first + range.start..first + range.end;
            for (leaf, &(centre, radius)) in self.leaves[range.clone()].iter().zip(&self.balls[range]) {
                let least = best.map_or(f64::INFINITY, |b| b.0);
                let bound = least.sqrt() + radius;
                if x.distance_squared(centre) > bound * bound {
                    continue;
                }
                counts.triangles += 1;
                let (c, weights) = closest(leaf.corners, x);
                let squared = c.distance_squared(x);
                if squared < least {
                    let normal =
                        leaf.normals[0] * weights[0] + leaf.normals[1] * weights[1] + leaf.normals[2] * weights[2];
                    best = Some((squared, c, normal));
                }
            }
        }
        let (squared, c, normal) = best?;
        let (distance, normal) = (squared.sqrt(), normal.normalize_or_zero());
        let sign = if (x - c).dot(normal) < 0.0 { -1.0 } else { 1.0 };
        let q = sign * distance;
        // On the surface the direction to the closest point is dominated by rounding.
        let away = if distance > 1e-6 { (x - c) / q } else { normal };
        Some((q, away))
    }

    /// The contact of a vertex at `x`, from its last query if that suffices.
    fn touch(&self, vertex: usize, x: DVec3, last: &mut CachedQuery, counts: &mut TestCounts) -> Option<Touch> {
        let moved = x - last.at;
        let squared = moved.length_squared();
        // Distances beyond the triangles' reach are lower bounds.
        let free = last.q.min(REACH) - self.offset;
        if free > 0.0 && squared < free * free {
            return None;
        }
        if last.q == f64::NEG_INFINITY || squared > PLANE_RADIUS * PLANE_RADIUS {
            let Some((q, normal)) = self.query(x, counts) else {
                last.q = f64::NEG_INFINITY;
                return None;
            };
            *last = CachedQuery { at: x, q, normal };
        }
        let depth = self.offset - (last.q + last.normal.dot(x - last.at));
        let touch = Touch { vertex: vertex as u32, depth, normal: last.normal, stiffness: self.stiffness[vertex] };
        counts.touching += u64::from(depth > 0.0);
        (depth > 0.0).then_some(touch)
    }
}

impl Obstacle for Hierarchy {
    fn touches(&mut self, x: &[DVec3]) -> &[Touch] {
        let mut cache = std::mem::take(&mut self.cache);
        let found: Vec<(Vec<Touch>, TestCounts)> = (x.par_chunks(CHUNK).zip(cache.par_chunks_mut(CHUNK)).enumerate())
            .map(|(chunk, (points, cache))| {
                let mut counts = TestCounts::default();
                let all = points.iter().zip(cache).enumerate().map(|(k, (&x, last))| (chunk * CHUNK + k, x, last));
                let free = all.filter(|(v, ..)| self.stiffness[*v] > 0.0);
                let touches = free.filter_map(|(v, x, last)| self.touch(v, x, last, &mut counts)).collect();
                (touches, counts)
            })
            .collect();
        self.cache = cache;
        self.touches.clear();
        for (touches, counts) in found {
            self.touches.extend(touches);
            self.tests += counts;
        }
        &self.touches
    }
}

impl std::ops::AddAssign for TestCounts {
    fn add_assign(&mut self, other: Self) {
        self.world += other.world;
        self.units += other.units;
        self.quadrics += other.quadrics;
        self.triangles += other.triangles;
        self.touching += other.touching;
    }
}

/// A ball about the centroid that contains the corners.
fn ball(corners: [DVec3; 3]) -> (DVec3, f64) {
    let centre = corners.into_iter().sum::<DVec3>() / 3.0;
    (centre, corners.iter().map(|p| p.distance(centre)).fold(0.0, f64::max))
}

#[inline]
fn inside(x: DVec3, (low, high): (DVec3, DVec3)) -> bool {
    x.cmpge(low).all() && x.cmple(high).all()
}

/// The point of a triangle nearest to `p`, and its barycentric weights.
#[inline]
fn closest([a, b, c]: [DVec3; 3], p: DVec3) -> (DVec3, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return (a + ab * t, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return (a + ac * t, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * t, [0.0, 1.0 - t, t]);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_region_has_its_closest_point() {
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let near = |p: DVec3| closest([a, b, c], p);
        let cases = [
            (DVec3::new(-1.0, -1.0, 2.0), a),
            (DVec3::new(2.0, -0.5, 1.0), b),
            (DVec3::new(-0.5, 3.0, 1.0), c),
            (DVec3::new(0.4, -1.0, 1.0), DVec3::new(0.4, 0.0, 0.0)),
            (DVec3::new(-1.0, 0.3, 1.0), DVec3::new(0.0, 0.3, 0.0)),
            (DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.5, 0.5, 0.0)),
            (DVec3::new(0.2, 0.3, -4.0), DVec3::new(0.2, 0.3, 0.0)),
        ];
        for (p, expected) in cases {
            let (found, weights) = near(p);
            assert!(found.distance(expected) < 1e-12, "{p}: {found}");
            let blended = a * weights[0] + b * weights[1] + c * weights[2];
            assert!(blended.distance(found) < 1e-12 && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
