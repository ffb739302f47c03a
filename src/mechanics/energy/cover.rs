//! Skin through cloth: where the body reaches through a triangle whose corners are all outside, places within it are kept off as well.
//!
//! Contact is felt at the vertices. Where the body is rounder than the cloth's mesh is fine, it reaches through the middle of a triangle. What
//! crosses is found exactly (`mesh::self_intersection`). In each such triangle and those beside it the places of a lattice that are deepest
//! in the body become contacts of their own (`proximity::place`): they push the three corners by their shares, with friction, and let go as a
//! vertex does. Where a triangle's places all are outside and it crosses still, they keep farther off. Each time follows when the cloth has
//! come to rest again. An end of the body that sticks through is taken inside first (`distance::ends`).
//!
//! Limits: what is too tight to be covered is let go again, and counted by whoever asks.

use glam::DVec3;

use super::membrane::Triangle;
use super::proximity::{Gap, Place};
use super::{Cloth, Contacts};
use crate::distance::Body;
use crate::mesh::TriMesh;
use crate::mesh::lattice::{lattice, place};
use crate::mesh::self_intersection::crossing_pairs;

/// The distance that a place keeps is the cloth's thickness, but at least this, m: what the body rises between two places of a lattice.
const LEAST_OFFSET: f64 = 6e-4;

/// It is raised by so much at a time, and in all, m.
const RAISE: f64 = 3e-4;
const FARTHEST: f64 = 4e-3;

/// Pressure that takes up half of it, Pa: that of the contact at vertices.
const HALF_OFFSET_PRESSURE: f64 = 2000.0;

/// New places in a triangle at a time, and how far apart they are at least, in its longest side.
const AT_A_TIME: usize = 6;
const APART: f64 = 0.2;

/// Share of what it keeps under which a place is near.
const NEAR: f64 = 0.5;

/// Rounds that brought nothing after which it ends.
const IDLE: usize = 3;

/// Times that an end of the body is taken inside, at most.
const ENDS: usize = 3;

/// The places that keep off the body, and what covering has done so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cover {
    places: Vec<Place>,
    fewest: Option<usize>,
    idle: usize,
    ends: usize,
    given_up: bool,
}

/// What covering asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Covered {
    /// Nothing: no skin is through the cloth, or nothing helps.
    Done,
    /// Places are kept off that were not before, or farther, or are let go.
    Places,
    /// The cloth was taken off an end of the body, and is far from rest.
    Moved,
}

impl Contacts<'_> {
    /// Covers the skin that is through the cloth at `x` (m). Takes effect with the next [`update`](Self::update) and
    /// [`refresh`](Self::refresh).
    pub(crate) fn cover(&mut self, cloth: &Cloth, x: &mut Vec<DVec3>) -> Covered {
        let Some(body) = self.body() else { return Covered::Done };
        if self.cover.given_up {
            return Covered::Done;
        }
        let triangles = cloth.triangles.iter().map(|t| t.vertices).collect();
        let garment = TriMesh::new(std::mem::take(x), triangles);
        let pairs = crossing_pairs(&garment, body.mesh());
        if !pairs.is_empty() && self.cover.ends < ENDS {
            self.cover.ends += 1;
            let taken = body.taken_off_ends(&garment, &cloth.held);
            let itself = self.proximity.as_mut();
            if let Some(taken) = taken.filter(|taken| itself.is_none_or(|p| p.put(&garment.positions, taken))) {
                *x = taken;
                return Covered::Moved;
            }
        }
        *x = garment.positions;
        let changed = self.cover.around(cloth, body, x, &pairs);
        if changed > 0 { Covered::Places } else { Covered::Done }
    }
}

impl Cover {
    /// The gaps to `body` at `x` (m).
    pub(super) fn gaps(&self, body: Option<&Body>, x: &[DVec3]) -> Vec<Gap> {
        let Some(body) = body else { return Vec::new() };
        let kept = (0..).zip(&self.places).filter(|(_, place)| place.stiffness > 0.0);
        kept.map(|(number, place)| place.gap(number, body, x)).collect()
    }

    /// Keeps places about these `pairs` of triangles that cross off the body; returns how many are new, farther off or let go.
    fn around(&mut self, cloth: &Cloth, body: &Body, x: &[DVec3], pairs: &[[u32; 2]]) -> usize {
        let fewer = self.fewest.is_none_or(|fewest| pairs.len() < fewest);
        self.idle = if fewer { 0 } else { self.idle + 1 };
        self.fewest = Some(self.fewest.map_or(pairs.len(), |fewest| fewest.min(pairs.len())));
        if pairs.is_empty() {
            return 0;
        }
        let mut crosses = vec![false; cloth.triangles.len()];
        pairs.iter().for_each(|[t, _]| crosses[*t as usize] = true);
        let crossing = || cloth.triangles.iter().zip(&crosses).filter(|(_, crosses)| **crosses).map(|(t, _)| t);
        if self.idle >= IDLE {
            self.given_up = true;
            return self.let_go(crossing());
        }
        let mut at_corner = vec![false; x.len()];
        crossing().flat_map(|t| t.vertices).for_each(|v| at_corner[v as usize] = true);
        let beside = |t: &Triangle| t.vertices.iter().filter(|v| at_corner[**v as usize]).count() > 1;
        let mut changed = 0;
        for (t, &crosses) in cloth.triangles.iter().zip(&crosses).filter(|(t, _)| beside(t)) {
            let new = self.add(cloth, t, body, x, crosses);
            changed += if new == 0 && crosses { self.raise(cloth, t) } else { new };
        }
        changed
    }

    /// Keeps the places of a triangle off that are deepest in the body; how many are new.
    fn add(&mut self, cloth: &Cloth, triangle: &Triangle, body: &Body, x: &[DVec3], crosses: bool) -> usize {
        let (corners, longest) = (triangle.vertices, triangle.longest_side_m());
        let offset = offset(cloth, triangle);
        let stiffness = 2.0 * HALF_OFFSET_PRESSURE / offset * triangle.area;
        let all: Vec<Place> = lattice(longest).map(|shares| Place { corners, shares, offset, stiffness }).collect();
        let at: Vec<DVec3> = all.iter().map(|place| place.at(x)).collect();
        let mut deepest: Vec<(f64, usize)> = body.nearest_all(&at).iter().map(|near| near.signed_distance).zip(0..).collect();
        deepest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let of_triangle: Vec<Place> = self.places.iter().filter(|p| p.corners == corners).copied().collect();
        let mut added: Vec<DVec3> = Vec::new();
        for (distance, i) in deepest {
            let first = crosses && added.is_empty() && distance < offset;
            let wanted = first || distance < NEAR * offset;
            let known = || of_triangle.iter().any(|p| p.shares == all[i].shares);
            if !wanted || added.len() == AT_A_TIME {
                break;
            }
            if added.iter().all(|p| p.distance(at[i]) > APART * longest) && !known() {
                added.push(at[i]);
                self.places.push(all[i]);
            }
        }
        added.len()
    }

    /// Keeps the places of a triangle farther off; how many.
    fn raise(&mut self, cloth: &Cloth, triangle: &Triangle) -> usize {
        let most = offset(cloth, triangle) + FARTHEST;
        let of_triangle = self.places.iter_mut().filter(|p| p.corners == triangle.vertices && p.offset < most);
        of_triangle.map(|place| place.offset += RAISE).count()
    }

    /// A place too tight to be covered is not stretched for it; how many are let go.
    fn let_go<'t>(&mut self, tight: impl Iterator<Item = &'t Triangle>) -> usize {
        let tight: Vec<[u32; 3]> = tight.map(|t| t.vertices).collect();
        let given_up = self.places.iter_mut().filter(|place| tight.contains(&place.corners));
        given_up.map(|place| place.stiffness = 0.0).count()
    }
}

/// The distance that a place within a triangle keeps, m.
fn offset(cloth: &Cloth, triangle: &Triangle) -> f64 {
    let thickness = triangle.vertices.iter().map(|&v| cloth.thickness[v as usize]).sum::<f64>() / 3.0;
    thickness.max(LEAST_OFFSET)
}

/// Places between the vertices of a cloth at `x` (m) that touch the body, within `margin` (m) of what they would keep: the corners with their
/// shares, and the body's normal. Asked of the triangles that have a corner which is `near`.
pub(in crate::mechanics) fn touching_between(
    cloth: &Cloth,
    body: &Body,
    x: &[DVec3],
    near: &[bool],
    margin: f64,
) -> Vec<([u32; 3], [f64; 3], DVec3)> {
    let close = cloth.triangles.iter().filter(|t| t.vertices.iter().any(|&v| near[v as usize]));
    let of_each = |t| lattice(Triangle::longest_side_m(t)).map(move |shares| (t, shares));
    let all: Vec<(&Triangle, [f64; 3])> = close.flat_map(of_each).collect();
    let at: Vec<DVec3> = all.iter().map(|(t, shares)| place(t.vertices.map(|v| x[v as usize]), *shares)).collect();
    let found = body.nearest_all(&at);
    let touches = all.into_iter().zip(found).filter(|((t, _), near)| near.signed_distance < offset(cloth, t) + margin);
    touches.map(|((t, shares), near)| (t.vertices, shares, near.normal)).collect()
}
