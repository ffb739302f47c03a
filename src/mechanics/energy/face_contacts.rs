//! Contact inside triangles: keeps the body from showing through a triangle whose corners are all outside.
//!
//! Contact is evaluated at the vertices. Where the body is more curved than the mesh of the cloth resolves, it passes through the
//! interior of a triangle. Each triangle of the cloth that intersects the body, and each one that shares an edge with it, receives
//! contact places: the points of a lattice in the triangle that are deepest in the body. A place is Σ w x over the corners. It
//! acts as a gap between the cloth and a plane of the body ([`Gap`]), with friction, and releases as a vertex does. If the
//! places of a triangle are all outside and the triangle still intersects the body, their offset is raised. [`Contacts`](super::Contacts)
//! repeats this each time the solve has converged; near rest it adds places before, where no triangle is deep in the body.
//!
//! A place inside the body whose shortest way out leads back through the cloth, or along it, is ignored: pushing it out would pull
//! a limb farther through.
//!
//! Limits: places that cannot be kept outside are released, and the intersections that remain are counted by the caller.

use std::sync::Arc;

use glam::DVec3;

use super::membrane::Triangle;
use super::proximity::gap::{Gap, Key, Kind};
use crate::body::distance::{Body, OUTWARD, SurfacePoint};
use crate::mechanics::solver_options::FaceContactOptions;
use crate::mesh::{NONE, TriMesh, lattice};

/// Pressure that compresses half the offset, Pa: the value used for contact at vertices.
const HALF_OFFSET_PRESSURE: f64 = 2000.0;

/// A contact place within a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    corners: [u32; 3],
    /// w of each corner.
    shares: [f64; 3],
    /// Distance kept from the body, m.
    offset: f64,
    /// κ A, N/m; zero for a place that was released.
    stiffness: f64,
}

impl Place {
    /// Position, m.
    fn at(&self, x: &[DVec3]) -> DVec3 {
        lattice::place(self.corners.map(|v| x[v as usize]), self.shares)
    }

    /// The gap to the body with this number; `None` where the way out of the body does not lead out of the cloth.
    fn gap(&self, number: u32, body: &Body, x: &[DVec3]) -> Option<Gap> {
        let ([a, b, c], [s, t, u]) = (self.corners, self.shares);
        let nearest = body.nearest(self.at(x));
        if !self.leads_out(&nearest, x) {
            return None;
        }
        let key = Key { kind: Kind::Body, vertices: [a, b, c, NONE, NONE], place: number };
        let mut gap = Gap::new(key, [s, t, u, 0.0, 0.0], self.offset, self.stiffness);
        (gap.body, gap.normal) = (nearest.point, nearest.normal);
        Some(gap)
    }

    /// Whether the way to the nearest point of the body leads to the outer side of the cloth, which is wound outward.
    fn leads_out(&self, nearest: &SurfacePoint, x: &[DVec3]) -> bool {
        let [a, b, c] = self.corners.map(|v| x[v as usize]);
        let out = (b - a).cross(c - a).normalize_or_zero();
        nearest.signed_distance >= 0.0 || nearest.normal.dot(out) > OUTWARD
    }
}

/// Distance that places of a triangle keep from the body, m: the thickness of the cloth (m) there.
fn place_offset(thickness: &[f64], triangle: &Triangle, options: &FaceContactOptions) -> f64 {
    let mean = triangle.vertices.iter().map(|&v| thickness[v as usize]).sum::<f64>() / 3.0;
    mean.max(options.min_offset_m)
}

/// A point inside a triangle that touches the body.
pub(crate) struct TouchingPlace {
    pub(crate) corners: [u32; 3],
    /// Barycentric coordinates.
    pub(crate) shares: [f64; 3],
    /// Outward normal of the body.
    pub(crate) normal: DVec3,
}

/// Which triangles cross the body, or would if they were moved to it by their `reach` (m) from the deepest of these places.
fn near_triangles(
    triangles: &[Triangle],
    body: &Body,
    x: &[DVec3],
    places: &[((usize, [f64; 3]), SurfacePoint)],
    reach: impl Fn(&Triangle) -> f64,
) -> Vec<bool> {
    let mut moved = TriMesh::default();
    let mut numbers = Vec::new();
    for of_one in places.chunk_by(|((t, _), _), ((u, _), _)| t == u) {
        let Some(((t, _), deepest)) =
            of_one.iter().min_by(|(_, a), (_, b)| a.signed_distance.total_cmp(&b.signed_distance))
        else {
            continue;
        };
        let corners = triangles[*t].vertices.map(|v| x[v as usize]);
        for by in [0.0, reach(&triangles[*t])] {
            let first = moved.positions.len() as u32;
            moved.positions.extend(corners.map(|corner| corner - deepest.normal * by));
            moved.triangles.push([first, first + 1, first + 2]);
            numbers.push(*t);
        }
    }
    let mut near = vec![false; triangles.len()];
    body.crossing_pairs(&moved).iter().for_each(|[copy, _]| near[numbers[*copy as usize]] = true);
    near
}

/// The contact places of a cloth, and the state of the updates so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct FaceContacts {
    pub(super) triangles: Arc<Vec<Triangle>>,
    /// Thickness of the cloth at each vertex, m.
    thickness: Arc<Vec<f64>>,
    options: FaceContactOptions,
    pub(super) places: Vec<Place>,
    fewest: Option<usize>,
    idle: usize,
    /// Updates that moved the cloth off a protrusion of the body.
    pub(super) protrusions: usize,
    /// Whether no place is added any more.
    pub(super) closed: bool,
}

impl FaceContacts {
    pub(super) fn new(triangles: Arc<Vec<Triangle>>, thickness: Arc<Vec<f64>>, options: FaceContactOptions) -> Self {
        Self { triangles, thickness, options, ..Self::default() }
    }

    /// Lattice points of the triangles that lie within `margin` (m) of their offset from the body, for vertices at `x` (m) and at these signed
    /// distances (m). Where the body rises between the points, the solver raises their offset until it no longer crosses the triangle: the
    /// points of a triangle that itself is within `margin` of its offset therefore touch from up to `max_offset_raise_m` farther. The distance
    /// to the body is Lipschitz with constant one, so the distances of the corners exclude most points without a query.
    pub(crate) fn touching_places(
        &self,
        body: &Body,
        x: &[DVec3],
        distances: &[f64],
        margin: f64,
    ) -> Vec<TouchingPlace> {
        let (triangles, options) = (&*self.triangles, &self.options);
        let reach = |t: &Triangle| place_offset(&self.thickness, t, options) + margin;
        let mut candidates: Vec<(usize, [f64; 3], DVec3)> = Vec::new();
        for (number, t) in triangles.iter().enumerate() {
            let farthest = reach(t) + options.max_offset_raise_m;
            let corners = t.vertices.map(|v| x[v as usize]);
            let clear = |at: DVec3| {
                t.vertices
                    .iter()
                    .zip(corners)
                    .any(|(&v, corner)| distances[v as usize] - corner.distance(at) > farthest)
            };
            let all =
                lattice::lattice(t.longest_side_m()).map(|shares| (number, shares, lattice::place(corners, shares)));
            candidates.extend(all.filter(|(_, _, at)| !clear(*at)));
        }
        let found = body.nearest_all(&candidates.iter().map(|(_, _, at)| *at).collect::<Vec<_>>());
        let all: Vec<_> = candidates.iter().map(|(t, shares, _)| (*t, *shares)).zip(found).collect();
        let near = near_triangles(triangles, body, x, &all, reach);
        let touches = |((t, _), nearest): &((usize, _), SurfacePoint)| {
            let raise = if near[*t] { options.max_offset_raise_m } else { 0.0 };
            nearest.signed_distance < reach(&triangles[*t]) + raise
        };
        let place = |((t, shares), nearest): ((usize, _), SurfacePoint)| TouchingPlace {
            corners: triangles[t].vertices,
            shares,
            normal: nearest.normal,
        };
        all.into_iter().filter(touches).map(place).collect()
    }

    /// The gaps to `body` at `x` (m).
    pub(super) fn gaps(&self, body: Option<&Body>, x: &[DVec3]) -> Vec<Gap> {
        let Some(body) = body else { return Vec::new() };
        let active = (0..).zip(&self.places).filter(|(_, place)| place.stiffness > 0.0);
        active.filter_map(|(number, place)| place.gap(number, body, x)).collect()
    }

    /// Updates the places about these `pairs` of triangles of cloth and body that intersect. Returns how many places were added, raised or
    /// released.
    pub(super) fn update(&mut self, body: &Body, x: &[DVec3], pairs: &[[u32; 2]]) -> usize {
        let fewer = self.fewest.is_none_or(|fewest| pairs.len() < fewest);
        self.idle = if fewer { 0 } else { self.idle + 1 };
        self.fewest = Some(self.fewest.map_or(pairs.len(), |fewest| fewest.min(pairs.len())));
        if pairs.is_empty() {
            return 0;
        }
        let triangles = Arc::clone(&self.triangles);
        let mut intersects = vec![false; triangles.len()];
        pairs.iter().for_each(|[t, _]| intersects[*t as usize] = true);
        let intersecting = || triangles.iter().zip(&intersects).filter(|(_, intersects)| **intersects).map(|(t, _)| t);
        if self.idle >= self.options.max_idle_updates {
            self.closed = true;
            let tight: Vec<[u32; 3]> = intersecting().map(|t| t.vertices).collect();
            let released = self.places.iter_mut().filter(|place| tight.contains(&place.corners));
            return released.map(|place| place.stiffness = 0.0).count();
        }
        let mut at_corner = vec![false; x.len()];
        intersecting().flat_map(|t| t.vertices).for_each(|v| at_corner[v as usize] = true);
        let beside = |t: &Triangle| t.vertices.iter().filter(|v| at_corner[**v as usize]).count() > 1;
        let mut changed = 0;
        for (t, &intersects) in triangles.iter().zip(&intersects).filter(|(t, _)| beside(t)) {
            let new = self.add(t, body, x, if intersects { 0.0 } else { f64::NEG_INFINITY });
            changed += if new == 0 && intersects { self.raise(t) } else { new };
        }
        changed
    }

    /// Adds places to the triangles of these `pairs` after the cloth was moved off the body at them, where otherwise it would slide back.
    pub(super) fn add_off_body(&mut self, body: &Body, x: &[DVec3], pairs: &[[u32; 2]]) {
        self.add_to(body, x, pairs, self.options.max_offset_raise_m);
    }

    /// [`add`](Self::add) for each triangle of these `pairs` of triangles of cloth and body; returns how many.
    pub(super) fn add_to(&mut self, body: &Body, x: &[DVec3], pairs: &[[u32; 2]], within: f64) -> usize {
        let triangles = Arc::clone(&self.triangles);
        let each = pairs.chunk_by(|a, b| a[0] == b[0]).map(|pairs| &triangles[pairs[0][0] as usize]);
        each.map(|triangle| self.add(triangle, body, x, within)).sum()
    }

    /// Adds the points of a triangle that are in the body, and its nearest one if that is less than `within` (m) beyond its offset; returns
    /// how many.
    fn add(&mut self, triangle: &Triangle, body: &Body, x: &[DVec3], within: f64) -> usize {
        let corners = triangle.vertices;
        let offset = place_offset(&self.thickness, triangle, &self.options);
        let present: Vec<Place> = self.places.iter().filter(|p| p.corners == corners).copied().collect();
        let mut added = 0;
        for (distance, place) in self.lattice_of(triangle, body, x) {
            let is_nearest = added == 0 && distance < offset + within;
            if distance >= 0.0 && !is_nearest {
                break;
            }
            if present.iter().all(|p| p.shares != place.shares) {
                added += 1;
                self.places.push(place);
            }
        }
        added
    }

    /// The points of a triangle's lattice as places, each with its signed distance (m), the deepest first, but for those whose way out of the body
    /// does not lead out of the cloth.
    fn lattice_of(&self, triangle: &Triangle, body: &Body, x: &[DVec3]) -> Vec<(f64, Place)> {
        let offset = place_offset(&self.thickness, triangle, &self.options);
        let stiffness = 2.0 * HALF_OFFSET_PRESSURE / offset * triangle.area / 3.0;
        let place = |shares| Place { corners: triangle.vertices, shares, offset, stiffness };
        let all: Vec<Place> = lattice::lattice(triangle.longest_side_m()).map(place).collect();
        let found = body.nearest_all(&all.iter().map(|place| place.at(x)).collect::<Vec<_>>());
        let out = all.into_iter().zip(&found).filter(|(place, nearest)| place.leads_out(nearest, x));
        let mut deepest: Vec<(f64, Place)> = out.map(|(place, nearest)| (nearest.signed_distance, place)).collect();
        deepest.sort_by(|a, b| a.0.total_cmp(&b.0));
        deepest
    }

    /// Whether no triangle of these `pairs` is deeper in the body than the offset of a place is raised at most.
    pub(super) fn is_shallow(&self, body: &Body, x: &[DVec3], pairs: &[[u32; 2]]) -> bool {
        pairs.chunk_by(|a, b| a[0] == b[0]).all(|of_one| {
            let places = self.lattice_of(&self.triangles[of_one[0][0] as usize], body, x);
            places.first().is_none_or(|(distance, _)| *distance > -self.options.max_offset_raise_m)
        })
    }

    /// Raises the offset of the places of a triangle; returns how many.
    fn raise(&mut self, triangle: &Triangle) -> usize {
        let max = place_offset(&self.thickness, triangle, &self.options) + self.options.max_offset_raise_m;
        let raised = self.places.iter_mut().filter(|p| p.corners == triangle.vertices && p.offset < max);
        raised.map(|place| place.offset += self.options.offset_step_m).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::{Cloth, Contacts, FaceUpdate};
    use crate::mesh::samples::cuboid;

    /// A box below z = 0 with this half width and half depth.
    fn post(half: f64) -> Body {
        let (at, half) = (DVec3::new(0.014, 0.01, 0.0), DVec3::new(half, half, 0.0));
        Body::new(&cuboid(at - half - DVec3::Z * 0.3, at + half)).unwrap()
    }

    /// Two triangles of 3 cm that the post pierces by 1.5 mm.
    fn pierced() -> (Cloth, Vec<DVec3>) {
        let at = |x: f64, y: f64| DVec3::new(x, y, -1.5e-3);
        let x = vec![at(0.0, 0.0), at(0.03, 0.0), at(0.0, 0.03), at(0.03, 0.03)];
        let mesh = TriMesh::new(x.clone(), vec![[0, 1, 2], [2, 1, 3]]);
        (Cloth::sample(&mesh, "jersey", &[3]), x)
    }

    /// Contacts with places on the post, and positions that have slipped since.
    fn slipped<'b>(cloth: &Cloth, body: &'b Body, mut x: Vec<DVec3>) -> (Contacts<'b>, Vec<DVec3>) {
        let mut contacts = cloth.contacts(body, &x);
        contacts.proximity = Some(cloth.proximity());
        assert!(contacts.touches().is_empty(), "no corner touches");
        assert_eq!(contacts.update_face_contacts(&mut x), FaceUpdate::Places);
        contacts.refresh(&x);
        // Friction takes its normal force from the refresh before.
        contacts.refresh(&x);
        let slipped = x.iter().enumerate().map(|(i, p)| *p + DVec3::new(2e-4, 1e-4 * i as f64, 5e-5)).collect();
        (contacts, slipped)
    }

    fn contact_gradient(cloth: &Cloth, contacts: &Contacts<'_>, x: &[DVec3]) -> Vec<DVec3> {
        let (mut with, mut without) = (Vec::new(), Vec::new());
        cloth.gradient(x, contacts, &mut with);
        cloth.gradient(x, &Contacts::none(), &mut without);
        with.iter().zip(&without).map(|(a, b)| *a - *b).collect()
    }

    #[test]
    fn gradient_and_hessian_of_face_contacts_match_differences() {
        let (body, (cloth, x)) = (post(0.005), pierced());
        let (contacts, x) = slipped(&cloth, &body, x);
        let pressing = contacts.proximity.as_ref().unwrap().pressing(&x);
        assert!(pressing > 1, "{pressing}");
        let energy = |x: &[DVec3]| cloth.energy(x, &contacts) - cloth.energy(x, &Contacts::none());
        let gradient = contact_gradient(&cloth, &contacts, &x);
        assert_eq!(gradient[3], DVec3::ZERO, "the vertex is held");
        let largest = gradient.iter().map(|f| f.length()).fold(0.0, f64::max);
        let (mut blocks, mut without) = (Vec::new(), Vec::new());
        cloth.hessian(&x, &contacts, &mut blocks);
        cloth.hessian(&x, &Contacts::none(), &mut without);
        blocks.iter_mut().zip(without).for_each(|(a, b)| *a -= b);
        let step = 1e-8;
        for (i, &v) in cloth.order().iter().enumerate() {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let moved = |s: f64| {
                    let mut x = x.clone();
                    x[v as usize] += axis * s;
                    x
                };
                let slope = (energy(&moved(step)) - energy(&moved(-step))) / (2.0 * step);
                assert!((slope - gradient[v as usize].dot(axis)).abs() < 1e-5 * largest, "vertex {v}: {slope}");
                let [ahead, behind] = [step, -step].map(|s| contact_gradient(&cloth, &contacts, &moved(s)));
                let mut d = vec![DVec3::ZERO; cloth.order().len()];
                d[i] = axis;
                let mut computed = Vec::new();
                cloth.pattern().multiply(&blocks, &d, &mut computed);
                let scale = computed.iter().map(|f| f.length()).fold(1.0, f64::max);
                for (&w, computed) in cloth.order().iter().zip(&computed) {
                    let measured = (ahead[w as usize] - behind[w as usize]) / (2.0 * step);
                    assert!(measured.distance(*computed) < 1e-4 * scale, "{v} {w}: {measured} and {computed}");
                }
            }
        }
    }

    #[test]
    fn places_that_cannot_be_kept_outside_are_released() {
        let (body, (cloth, mut x)) = (post(0.005), pierced());
        let (mut contacts, _) = slipped(&cloth, &body, x.clone());
        // The cloth does not move, so no update reduces the intersections.
        let updates = (0..200).take_while(|_| contacts.update_face_contacts(&mut x) != FaceUpdate::Unchanged).count();
        let least = FaceContactOptions::default().max_idle_updates - 1;
        assert!((least..200).contains(&updates), "{updates}");
        contacts.refresh(&x);
        assert_eq!(contacts.proximity.as_ref().unwrap().pressing(&x), 0);
    }
}
