//! A unit of the body: its frame, its slices with their quadrics, and the leaf triangles of each slice by sectors.
//!
//! The frame's z runs along the unit: for a limb the principal axis of its triangles; for trunk and hip, which
//! may be wider than high, the vertical. Slices are 4 cm high. A slice lists every triangle of the unit within `REACH`, so that a
//! point up to that deep inside the body still finds the nearest one; a sector of a slice lists those of them within the same reach
//! of the sector.

use glam::{DMat3, DVec2, DVec3};

use super::quadric::Quadric;
use crate::base::math;
use crate::base::quantiles::extremes;
use crate::mechanics::methods::segment::principal_axis;
use crate::mesh::{TriMesh, box_about};

/// Height of a slice h, m. Lower slices fit the body more closely, and are more. A heuristic.
const HEIGHT: f64 = 0.04;
/// Distance within which a triangle belongs to a slice and a sector, m. It bounds the depth at which the nearest triangle is exact.
pub(crate) const REACH: f64 = 0.02;
/// Sectors of a slice. More sectors hold fewer triangles each. A heuristic.
pub(crate) const SECTORS: usize = 24;

/// A slice: its quadric, and for each sector its triangles.
#[derive(Debug, Clone)]
pub(crate) struct Slice {
    /// The fitted (elliptic) cylinder.
    pub quadric: Quadric,
    /// First triangle of each sector in the unit's list, and one past the last.
    pub sectors: [u32; SECTORS + 1],
}

/// A unit.
#[derive(Debug, Clone)]
pub(crate) struct BodyUnit {
    /// Whether it is a limb or the head, which are fitted with cylinders.
    pub is_limb: bool,
    /// Its bounding box in the world, enlarged by the offset, m.
    pub bounds: (DVec3, DVec3),
    /// Its origin, m.
    origin: DVec3,
    /// Rotation from the world to the unit.
    turn: DMat3,
    /// Lower end of the first slice along z, m.
    low: f64,
    /// Height of a slice, m.
    height: f64,
    /// Its slices from low to high; `None` for a slice without triangles.
    pub slices: Vec<Option<Slice>>,
    /// Triangles of the sectors, concatenated.
    pub leaves: Vec<u32>,
}

impl BodyUnit {
    /// The unit of these triangles of `mesh`, for cloth that touches within `offset` (m); `None` without triangles.
    pub(crate) fn new(mesh: &TriMesh, triangles: &[u32], is_limb: bool, offset: f64) -> Option<Self> {
        let corners = |t: u32| mesh.corners(t as usize);
        let weighted: Vec<(DVec3, f64)> = triangles
            .iter()
            .map(|&t| (corners(t).into_iter().sum::<DVec3>() / 3.0, mesh.double_area_vector(t as usize).length()))
            .collect();
        let weight: f64 = weighted.iter().map(|w| w.1).sum();
        if triangles.is_empty() || weight <= 0.0 {
            return None;
        }
        let origin = weighted.iter().map(|(p, w)| *p * *w).sum::<DVec3>() / weight;
        let axis =
            if is_limb { principal_axis(weighted.iter().map(|(p, w)| (*p - origin, *w / weight))) } else { DVec3::Z };
        let turn = frame(axis);
        let local: Vec<[DVec3; 3]> = triangles.iter().map(|&t| corners(t).map(|p| turn * (p - origin))).collect();
        let z = |c: &[DVec3; 3]| extremes(c.map(|p| p.z));
        let ends = extremes(local.as_flattened().iter().map(|p| p.z));
        let (low, high) = (ends.0 - offset, ends.1 + offset);
        let around = box_about(triangles.iter().flat_map(|&t| corners(t)));
        let count = ((high - low) / HEIGHT).ceil().max(1.0);
        let height = (high - low) / count;
        let mut unit = Self {
            is_limb,
            bounds: (around.0 - offset, around.1 + offset),
            origin,
            turn,
            low,
            height,
            slices: Vec::new(),
            leaves: Vec::new(),
        };
        for k in 0..count as usize {
            let (from, to) = (low + height * k as f64, low + height * (k + 1) as f64);
            let near = |c: &&[DVec3; 3], by: f64| z(c).0 <= to + by && z(c).1 >= from - by;
            let within: Vec<usize> = (0..local.len()).filter(|&i| near(&&local[i], REACH.max(offset))).collect();
            unit.push_slice(triangles, &local, &within, |c| near(&c, offset), offset);
        }
        Some(unit)
    }

    /// Adds a slice of the triangles `within` its reach; its quadric bounds those for which `touched` is true.
    fn push_slice(
        &mut self,
        triangles: &[u32],
        local: &[[DVec3; 3]],
        within: &[usize],
        touched: impl Fn(&[DVec3; 3]) -> bool,
        offset: f64,
    ) {
        let bounded: Vec<&[DVec3; 3]> = within.iter().map(|&i| &local[i]).filter(|c| touched(c)).collect();
        let points: Vec<(DVec2, f64)> = bounded
            .iter()
            .map(|[a, b, c]| (((*a + *b + *c) / 3.0).truncate(), 0.5 * (*b - *a).cross(*c - *a).length()))
            .collect();
        let Some(mut quadric) = Quadric::fit(&points, self.is_limb) else {
            self.slices.push(None);
            return;
        };
        quadric.enclose(bounded.iter().flat_map(|c| c.iter().map(|p| p.truncate())), offset);
        let mut sectors = [self.leaves.len() as u32; SECTORS + 1];
        let reach = REACH.max(offset);
        for s in 0..SECTORS {
            let middle = math::unit((s as f64 + 0.5) * std::f64::consts::TAU / SECTORS as f64);
            self.leaves.extend(
                within.iter().filter(|&&i| in_sector(&local[i], quadric.centre, middle, reach)).map(|&i| triangles[i]),
            );
            sectors[s + 1] = self.leaves.len() as u32;
        }
        self.slices.push(Some(Slice { quadric, sectors }));
    }

    /// A point of the world in the unit's frame, m.
    #[inline]
    pub(crate) fn local(&self, x: DVec3) -> DVec3 {
        self.turn * (x - self.origin)
    }

    /// The slice at this height of the unit's frame: |z| < h/2 in the frame of the slice.
    #[inline]
    pub(crate) fn slice(&self, z: f64) -> Option<&Slice> {
        let k = (z - self.low) / self.height;
        if k >= 0.0 { self.slices.get(k as usize)?.as_ref() } else { None }
    }

    /// Each slice's quadric at both its ends, as closed lines in the world, m.
    pub(crate) fn outlines(&self) -> Vec<Vec<DVec3>> {
        let back = self.turn.transpose();
        let mut lines = Vec::new();
        for (k, slice) in self.slices.iter().enumerate() {
            for end in 0..2 {
                let z = self.low + self.height * (k + end) as f64;
                lines.extend(
                    slice.as_ref().map(|s| s.quadric.outline().map(|p| self.origin + back * p.extend(z)).collect()),
                );
            }
        }
        lines
    }
}

impl Slice {
    /// The range of the unit's leaves to test for a point of the slice's plane.
    #[inline]
    pub(crate) fn leaves(&self, p: DVec2) -> std::ops::Range<usize> {
        let q = p - self.quadric.centre;
        let turns = math::angle(q) / std::f64::consts::TAU;
        let s = ((turns - turns.floor()) * SECTORS as f64) as usize % SECTORS;
        self.sectors[s] as usize..self.sectors[s + 1] as usize
    }
}

/// Whether a triangle comes within `reach` of a sector about `centre` whose middle has this direction, by a bounding circle about the
/// centroid.
fn in_sector(corners: &[DVec3; 3], centre: DVec2, middle: DVec2, reach: f64) -> bool {
    let flat = corners.map(DVec3::truncate);
    let at = (flat[0] + flat[1] + flat[2]) / 3.0;
    let radius = flat.iter().map(|p| p.distance(at)).fold(0.0, f64::max) + reach;
    let off = at - centre;
    // The sector is the intersection of two half planes; a point outside is no nearer to it than to the farther of them.
    let half = math::unit(std::f64::consts::PI / SECTORS as f64);
    let (left, right) = (middle.rotate(half), middle.rotate(DVec2::new(half.x, -half.y)));
    left.perp_dot(off) <= radius && right.perp_dot(off) >= -radius && middle.dot(off) >= -radius
}

/// A rotation whose third row is `axis`.
fn frame(axis: DVec3) -> DMat3 {
    let x = axis.any_orthonormal_vector();
    DMat3::from_cols(x, axis.cross(x), axis).transpose()
}
