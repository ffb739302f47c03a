//! The hybrid hierarchy: world box, units, quadrics, leaf triangles, with a count of the tests at each level.
//!
//! A vertex x touches where its signed distance q to the body is less than the offset o. It is asked in turn: is it in
//! the body's box; in the box of a unit; in the unit's frame, within (x/a)² + (y/b)² < (1 + ε)² of the slice at its
//! height; and only then for the nearest of the triangles about it (closest point as in Ericson: "Real-time collision
//! detection", 5.1.5). The sign of q is that of (x − c)·n with n the vertex normals blended at the closest point c.
//!
//! A vertex remembers its last answer: within 2 mm of where it was asked the tangent plane there stands for the body,
//! and where q was so large that it cannot touch yet (q has slope at most one) it is not asked again. Ours; the source
//! tells of no memory.
//!
//! Limits: beyond [`REACH`] under the skin the nearest triangle may be in another sector, and the
//! depth is then overestimated.

use glam::DVec3;
use rayon::prelude::*;

use super::closest::closest;
use super::units::{BodyUnit, REACH};
use crate::mechanics::energy::contact::Touch;
use crate::methods::implicit_euler::Obstacle;
use crate::methods::segment::Segments;
use crate::methods::{MethodInput, MethodError};

/// Vertices of one task.
const CHUNK: usize = 256;

/// A tangent plane stands for the body this far about the point it was taken at, m.
const PLANE: f64 = 2e-3;

/// What a vertex was told last.
#[derive(Debug, Clone, Copy)]
struct Answer {
    at: DVec3,
    /// Minus infinity before it is asked.
    q: f64,
    normal: DVec3,
}

/// Tests at each level, over a run.
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
    /// Vertices found to touch.
    pub touching: u64,
}

/// A triangle as it is searched.
#[derive(Debug, Clone, Copy)]
struct Leaf {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

/// The hierarchy over a body.
#[derive(Debug, Clone)]
pub struct Hierarchy {
    units: Vec<BodyUnit>,
    leaves: Vec<Leaf>,
    /// Centre and radius of a ball about each leaf: most are told too far by it.
    balls: Vec<(DVec3, f64)>,
    world: (DVec3, DVec3),
    offset: f64,
    /// κ A of each vertex, N/m; zero where it is held.
    stiffness: Vec<f64>,
    answers: Vec<Answer>,
    touches: Vec<Touch>,
    counts: TestCounts,
}

impl Hierarchy {
    /// Segments the body of a scene and fits its quadrics.
    ///
    /// # Errors
    /// [`MethodError::Unfit`] for a body that is not closed, which has no inside.
    pub fn new(dressing: &MethodInput<'_>) -> Result<Self, MethodError> {
        let MethodInput { scene, cloth, .. } = dressing;
        let mesh = scene.body.mesh();
        let segments = Segments::of_closed(mesh, "unit").map_err(|reason| MethodError::unfit(super::NAME, reason))?;
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
            answers: vec![Answer { at: DVec3::ZERO, q: f64::NEG_INFINITY, normal: DVec3::ZERO }; cloth.vertex_count()],
            touches: Vec::new(),
            counts: TestCounts::default(),
        })
    }

    /// The tests so far.
    #[must_use]
    pub fn counts(&self) -> TestCounts {
        self.counts
    }

    /// Number of units.
    #[must_use]
    pub fn units(&self) -> usize {
        self.units.len()
    }

    /// Number of quadrics.
    #[must_use]
    pub(crate) fn slices(&self) -> usize {
        self.units.iter().flat_map(|u| &u.slices).flatten().count()
    }

    /// The quadrics as closed lines, m, each with the index of its unit.
    #[must_use]
    pub(crate) fn outlines(&self) -> Vec<(usize, Vec<DVec3>)> {
        let of = |(i, unit): (usize, &BodyUnit)| unit.outlines().into_iter().map(move |line| (i, line));
        self.units.iter().enumerate().flat_map(of).collect()
    }

    /// What the user should know of the fit.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let slices = self.units.iter().flat_map(|u| &u.slices).flatten();
        let stand_ins = slices.filter(|s| s.quadric.by_moments).count();
        let limbs = self.units.iter().filter(|u| u.is_limb).count();
        vec![format!(
            "the body is cut into {} units, {limbs} of them limbs, with {} quadrics, {stand_ins} by moments where least squares made no ellipse",
            self.units.len(),
            self.slices()
        )]
    }

    /// Signed distance and outward normal at `x`; `None` where it is outside every quadric, and so farther than the offset.
    fn ask(&self, x: DVec3, counts: &mut TestCounts) -> Option<(f64, DVec3)> {
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
                let most = least.sqrt() + radius;
                if x.distance_squared(centre) > most * most {
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
        // On the surface the direction to the closest point is noise.
        let away = if distance > 1e-6 { (x - c) / q } else { normal };
        Some((q, away))
    }

    /// The touch of a vertex at `x`, from its last answer where that does.
    fn touch(&self, vertex: usize, x: DVec3, last: &mut Answer, counts: &mut TestCounts) -> Option<Touch> {
        let moved = x - last.at;
        let squared = moved.length_squared();
        // What is farther than the triangles' reach is known to be at least that far.
        let free = last.q.min(REACH) - self.offset;
        if free > 0.0 && squared < free * free {
            return None;
        }
        if last.q == f64::NEG_INFINITY || squared > PLANE * PLANE {
            let Some((q, normal)) = self.ask(x, counts) else {
                last.q = f64::NEG_INFINITY;
                return None;
            };
            *last = Answer { at: x, q, normal };
        }
        let depth = self.offset - (last.q + last.normal.dot(x - last.at));
        let touch = Touch { vertex: vertex as u32, depth, normal: last.normal, stiffness: self.stiffness[vertex] };
        counts.touching += u64::from(depth > 0.0);
        (depth > 0.0).then_some(touch)
    }
}

impl Obstacle for Hierarchy {
    fn touches(&mut self, x: &[DVec3]) -> &[Touch] {
        let mut answers = std::mem::take(&mut self.answers);
        let found: Vec<(Vec<Touch>, TestCounts)> = (x.par_chunks(CHUNK).zip(answers.par_chunks_mut(CHUNK)).enumerate())
            .map(|(chunk, (points, answers))| {
                let mut counts = TestCounts::default();
                let all = points.iter().zip(answers).enumerate().map(|(k, (&x, last))| (chunk * CHUNK + k, x, last));
                let free = all.filter(|(v, ..)| self.stiffness[*v] > 0.0);
                let touches = free.filter_map(|(v, x, last)| self.touch(v, x, last, &mut counts)).collect();
                (touches, counts)
            })
            .collect();
        self.answers = answers;
        self.touches.clear();
        for (touches, counts) in found {
            self.touches.extend(touches);
            self.counts += counts;
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

/// The ball about the middle of the corners.
fn ball(corners: [DVec3; 3]) -> (DVec3, f64) {
    let centre = corners.into_iter().sum::<DVec3>() / 3.0;
    (centre, corners.iter().map(|p| p.distance(centre)).fold(0.0, f64::max))
}

#[inline]
fn inside(x: DVec3, (low, high): (DVec3, DVec3)) -> bool {
    x.cmpge(low).all() && x.cmple(high).all()
}
