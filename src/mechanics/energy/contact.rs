//! Contact: the body pushes the cloth off its surface.
//!
//! E = Σ ½ κ A_i (h − q(x_i))² over the vertices with q < h: a pressure κ (h − q) along the normal ∇q of the body. At rest the
//! middle surface of the cloth lies nearer to the body than h by a fraction of the thickness. q is the distance to the body without
//! its creases, [`field`](super::field). The Hessian keeps κ A_i ∇q ∇qᵀ and drops the curvature of the body times the pressure, which
//! is negative on a convex body and of second order in the penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body, creases rounded | m |
//! | s | exact signed distance to the body | m |
//! | h | offset: distance the cloth keeps, its thickness plus the sag of a triangle | m |
//! | κ | contact stiffness: pressure over penetration | N/m³ |
//! | A_i | rest area of vertex i | m² |
//!
//! **Queries are skipped where a bound excludes contact.** A distance costs as much as the energies of ten triangles. q is
//! Lipschitz with constant one, so q(x) ≥ q(x') − |x − x'| with x' the position of the last query. A vertex whose bound exceeds h
//! is not queried. Distances that the caller already has serve as the first query.
//!
//! **Penetration in narrow places.** At a concave edge q exceeds s by as much as a thin cloth is thick: a vertex may keep its offset
//! h and still be inside the body. No stiffness changes that. Replacing h by h + q − s does, since κ A (h + q − s − q) = κ A (h − s).
//! κ itself is too small only where q is negative. q − s is taken at the present position and changes as the vertex
//! slides: where the check of a rest fails, it is computed again at vertices farther from the body than their original h. Limits: vertices that do not touch by q are not examined; the contact pressure reported later (`mechanics::fit`) uses the
//! original h and is too small at such a vertex.
//!
//! Limits: contact is evaluated at vertices. Triangles that intersect the body between their vertices receive contact places
//! ([`face_contacts`](super::face_contacts)).

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::face_contacts::FaceContacts;
use super::field::{Field, SIDE};
use super::friction::{Friction, Touch};
use super::membrane::outer;
use super::passage::passages;
use super::proximity::{Proximity, StepCheck};
use crate::base::pool::VERTICES_PER_TASK;
use crate::body::distance::{Body, pull_off_protrusions};
use crate::mechanics::solver_options::BodyContactOptions;
use crate::mesh::TriMesh;

/// Distance from its foot up to which a tangent plane replaces the body, m. On a radius of 5 cm its error is then 0.04 mm.
const PLANE_RADIUS_M: f64 = 2e-3;

/// Distance beyond its offset up to which a vertex touches, m: a strain of a few percent changes the offset by a tenth of a millimetre.
pub(crate) const TOUCH_MARGIN_M: f64 = 2e-4;

/// The body, and the distance that contact takes from it.
#[derive(Debug, Clone, Default)]
enum Obstacle<'b> {
    #[default]
    Nothing,
    /// The tangent plane of the exact distance at the last query.
    Planes(&'b Body),
    /// The distance with rounded creases.
    Rounded(Field<'b>),
}

/// Result of [`Contacts::update_face_contacts`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FaceUpdate {
    /// The body does not intersect the cloth, or no place helps.
    Unchanged,
    /// Places were added, raised or released.
    Places,
    /// The cloth was moved off a protrusion of the body, and is far from equilibrium.
    Moved,
}

/// A vertex inside the body.
struct Penetration {
    vertex: u32,
    /// q, m.
    rounded: f64,
    /// s, m.
    exact: f64,
}

/// The contacts of a cloth at its current positions, and the queries they were found by.
#[derive(Debug, Clone, Default)]
pub struct Contacts<'b> {
    obstacle: Obstacle<'b>,
    /// h of each vertex, m.
    offsets: Vec<f64>,
    /// The original h (m) of each vertex whose h was raised.
    raised: BTreeMap<u32, f64>,
    areas: Vec<f64>,
    held: Vec<bool>,
    /// Position (m) and distance (m) of each vertex at its last query.
    queried_at: Vec<DVec3>,
    queried_distance: Vec<f64>,
    /// Whether every free vertex was queried.
    queried: bool,
    /// Normals of the tangent planes; zero before the first query.
    normals: Vec<DVec3>,
    /// Square of the move from the last query below which a vertex cannot touch, m²; negative where it touched there.
    free_squared: Vec<f64>,
    /// Vertices whose bound did not exclude contact in the last [`update`](Self::update).
    candidates: Vec<u32>,
    stiffness: f64,
    touches: Vec<Touch>,
    /// Friction on the body.
    pub friction: Friction,
    /// Contact of the cloth with itself, if it is to be considered.
    pub proximity: Option<Proximity>,
    face_contacts: FaceContacts,
    options: BodyContactOptions,
}

impl<'b> Contacts<'b> {
    /// Contacts without a body.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Contacts of vertices with these `areas` (m²) and `offsets` (m), except those in `held`, against `body` with `stiffness` κ
    /// (N/m³). Call [`update`](Self::update) before use.
    #[must_use]
    pub(super) fn new(
        body: &'b Body,
        [areas, offsets]: [&[f64]; 2],
        held: &[bool],
        stiffness: f64,
        friction: Friction,
        face_contacts: FaceContacts,
        options: BodyContactOptions,
    ) -> Self {
        let n = areas.len();
        Self {
            obstacle: Obstacle::Rounded(Field::new(body, n)),
            offsets: offsets.to_vec(),
            areas: areas.to_vec(),
            held: held.to_vec(),
            queried_at: vec![DVec3::ZERO; n],
            queried_distance: vec![f64::NEG_INFINITY; n],
            normals: vec![DVec3::ZERO; n],
            // Held vertices are never queried.
            free_squared: held.iter().map(|&held| if held { f64::INFINITY } else { f64::NEG_INFINITY }).collect(),
            stiffness,
            friction,
            face_contacts,
            options,
            ..Self::none()
        }
    }

    /// The same by tangent planes of the exact distance, queried again after a move of 2 mm: cheaper, for cloth that moves far and needs
    /// no accuracy of a tenth of a millimetre. Call before the first [`update`](Self::update).
    #[must_use]
    pub(crate) fn by_planes(self) -> Self {
        Self { obstacle: self.body().map_or(Obstacle::Nothing, Obstacle::Planes), ..self }
    }

    /// The same with signed distances (m) of the vertices at `at` as the first query.
    pub(crate) fn with_distances(mut self, at: &[DVec3], distance_m: impl Iterator<Item = f64>) -> Self {
        // The rounded distance is smaller than the exact one by at most the side of the lattice.
        let rounding = if matches!(self.obstacle, Obstacle::Rounded(_)) { SIDE } else { 0.0 };
        for (v, (x, distance)) in at.iter().zip(distance_m).enumerate() {
            if self.held.get(v) == Some(&false) {
                self.store_query(v, *x, distance - rounding);
            }
        }
        self
    }

    /// The same with every offset larger by `margin` (m).
    pub(crate) fn with_margin(mut self, margin: f64) -> Self {
        self.offsets.iter_mut().for_each(|offset| *offset += margin);
        self
    }

    /// κ, N/m³.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// Multiplies κ; takes effect with the next [`update`](Self::update).
    pub fn stiffen(&mut self, factor: f64) {
        self.stiffness *= factor;
    }

    /// The vertices in contact, ascending.
    #[must_use]
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// The body.
    pub(crate) fn body(&self) -> Option<&'b Body> {
        match &self.obstacle {
            Obstacle::Nothing => None,
            Obstacle::Planes(body) => Some(body),
            Obstacle::Rounded(field) => Some(field.body()),
        }
    }

    /// Finds the vertices in contact at `x`. Same bits on any number of threads.
    pub fn update(&mut self, x: &[DVec3]) {
        self.touches.clear();
        if let Obstacle::Planes(body) = self.obstacle {
            return self.update_planes(body, x);
        }
        self.query_new(x);
        self.find_candidates(x);
        let Obstacle::Rounded(field) = &mut self.obstacle else { return };
        let candidates = std::mem::take(&mut self.candidates);
        let found = field.at(&candidates, x);
        for (&vertex, &(distance, normal)) in candidates.iter().zip(&found) {
            let v = vertex as usize;
            self.store_query(v, x[v], distance);
            self.push_touch(vertex, distance, normal);
        }
        self.candidates = candidates;
    }

    /// [`update`](Self::update) by planes.
    fn update_planes(&mut self, body: &Body, x: &[DVec3]) {
        self.find_candidates(x);
        let candidates = std::mem::take(&mut self.candidates);
        let stale = |&v: &usize| {
            self.normals[v] == DVec3::ZERO
                || x[v].distance_squared(self.queried_at[v]) > PLANE_RADIUS_M * PLANE_RADIUS_M
        };
        let stale: Vec<usize> = candidates.iter().map(|&v| v as usize).filter(stale).collect();
        let found = body.nearest_all(&stale.iter().map(|&v| x[v]).collect::<Vec<_>>());
        for (v, found) in stale.into_iter().zip(found) {
            self.store_query(v, x[v], found.signed_distance);
            self.normals[v] = found.normal;
        }
        for &vertex in &candidates {
            let v = vertex as usize;
            let (normal, moved) = (self.normals[v], x[v] - self.queried_at[v]);
            self.push_touch(vertex, self.queried_distance[v] + normal.dot(moved), normal);
        }
        self.candidates = candidates;
    }

    fn push_touch(&mut self, vertex: u32, distance: f64, normal: DVec3) {
        let v = vertex as usize;
        let depth = self.offsets[v] - distance;
        if depth > 0.0 {
            self.touches.push(Touch { vertex, depth, normal, stiffness: self.stiffness * self.areas[v] });
        }
    }

    fn store_query(&mut self, v: usize, x: DVec3, distance: f64) {
        let free = distance - self.offsets[v];
        (self.queried_at[v], self.queried_distance[v], self.free_squared[v]) = (x, distance, free * free.abs());
    }

    /// Finds the vertices whose bound is below the offset. This loop runs over all vertices at every evaluation, so it takes no roots.
    fn find_candidates(&mut self, x: &[DVec3]) {
        let Self { candidates, queried_at, free_squared, .. } = self;
        let may_touch = |((x, queried), free): &((&DVec3, &DVec3), &f64)| x.distance_squared(**queried) > **free;
        candidates.clear();
        if x.len() < VERTICES_PER_TASK {
            let vertices = (0..).zip(x.iter().zip(&*queried_at).zip(&*free_squared));
            candidates.extend(vertices.filter(|(_, vertex)| may_touch(vertex)).map(|(v, _)| v));
        } else {
            let vertices = x.par_iter().zip(&*queried_at).zip(&*free_squared).enumerate();
            let candidate = vertices.with_min_len(VERTICES_PER_TASK / 2).filter(|(_, vertex)| may_touch(vertex));
            candidates.par_extend(candidate.map(|(v, _)| v as u32));
        }
    }

    /// Bounds every vertex without a query by the exact distance: most are far, and a lattice about each would cost twenty times as
    /// much. The rounded distance is smaller by at most the side of the lattice.
    fn query_new(&mut self, x: &[DVec3]) {
        let Obstacle::Rounded(field) = &self.obstacle else { return };
        if std::mem::replace(&mut self.queried, true) {
            return;
        }
        let body = field.body();
        let is_new = |&v: &usize| !self.held[v] && self.queried_distance[v] == f64::NEG_INFINITY;
        let new: Vec<usize> = (0..x.len()).filter(is_new).collect();
        let found = body.nearest_all(&new.iter().map(|&v| x[v]).collect::<Vec<_>>());
        for (v, found) in new.into_iter().zip(found) {
            self.store_query(v, x[v], found.signed_distance - SIDE);
        }
    }

    /// Renews, at the positions `x` of the last update, the lagged quantities: friction anchors, gaps of the cloth with itself, and gaps of
    /// contact places to the body.
    pub fn refresh(&mut self, x: &[DVec3]) {
        self.friction.refresh(&self.touches, x);
        let to_body = self.face_contacts.gaps(self.body(), x);
        if let Some(proximity) = &mut self.proximity {
            proximity.refresh_with(x, to_body);
        }
    }

    /// Number of vertices inside the body at the positions `x` of the last update, and the depth of the deepest (m), by the exact distance.
    #[must_use]
    pub(crate) fn penetration(&self, x: &[DVec3]) -> (usize, f64) {
        self.penetrations(x).fold((0, 0.0), |(n, deepest), found| (n + 1, deepest.max(-found.exact)))
    }

    /// Raises offsets, and κ where needed, for the vertices inside the body at the positions `x` of the last update. Returns whether there
    /// was one; takes effect with the next [`update`](Self::update).
    pub(crate) fn resolve_penetrations(&mut self, x: &[DVec3]) -> bool {
        let found: Vec<Penetration> = self.penetrations(x).collect();
        for &Penetration { vertex, rounded, exact } in &found {
            let v = vertex as usize;
            self.raised.entry(vertex).or_insert(self.offsets[v]);
            self.offsets[v] += (rounded - exact).max(0.0);
            self.store_query(v, x[v], rounded);
        }
        if found.iter().any(|penetration| penetration.rounded <= 0.0) {
            self.stiffen(self.options.stiffening);
        }
        !found.is_empty()
    }

    /// Computes raised offsets again from the distances at `x` (m), the positions of the last update, for vertices that have slid away from the
    /// narrow place: those farther from the body than their original offset. Takes effect with the next [`update`](Self::update).
    pub(crate) fn lower_offsets(&mut self, x: &[DVec3]) {
        let Some(body) = self.body() else { return };
        let Self { raised, offsets, touches, .. } = self;
        for Touch { vertex, depth, .. } in touches {
            let (v, Some(own)) = (*vertex as usize, raised.get(vertex)) else { continue };
            let (rounded, exact) = (offsets[v] - *depth, body.nearest(x[v]).signed_distance);
            if exact > own + TOUCH_MARGIN_M {
                offsets[v] = own + (rounded - exact).max(0.0);
            }
        }
    }

    fn penetrations(&self, x: &[DVec3]) -> impl Iterator<Item = Penetration> {
        let of_touch = move |&Touch { vertex, depth, .. }: &Touch| {
            let rounded = self.offsets[vertex as usize] - depth;
            // The rounded distance exceeds the exact one by less than the side of the lattice: see `field`.
            let body = self.body().filter(|_| rounded < SIDE)?;
            let exact = body.nearest(x[vertex as usize]).signed_distance;
            (exact < 0.0).then_some(Penetration { vertex, rounded, exact })
        };
        self.touches.iter().filter_map(of_touch)
    }

    fn garment(&self, x: Vec<DVec3>) -> TriMesh {
        TriMesh::new(x, self.face_contacts.triangles.iter().map(|t| t.vertices).collect())
    }

    /// Updates the contact places for the cloth at rest at `x` (m). Where a protrusion of the body sticks through a triangle, the cloth is
    /// first moved off it. Takes effect with the next [`update`](Self::update) and [`refresh`](Self::refresh).
    pub(crate) fn update_face_contacts(&mut self, x: &mut Vec<DVec3>) -> FaceUpdate {
        let Some(body) = self.body().filter(|_| !self.face_contacts.closed) else { return FaceUpdate::Unchanged };
        let garment = self.garment(std::mem::take(x));
        let pairs = body.crossing_pairs(&garment);
        if !pairs.is_empty() && self.face_contacts.protrusions < self.options.max_protrusion_fixes {
            self.face_contacts.protrusions += 1;
            let moved = pull_off_protrusions(body, &garment, &self.held);
            let proximity = self.proximity.as_mut();
            if let Some(moved) = moved.filter(|to| proximity.is_none_or(|p| p.move_to(&garment.positions, to))) {
                *x = moved;
                self.face_contacts.add_off_body(body, x, &pairs);
                return FaceUpdate::Moved;
            }
        }
        *x = garment.positions;
        let changed = self.face_contacts.update(body, x, &pairs);
        if changed > 0 { FaceUpdate::Places } else { FaceUpdate::Unchanged }
    }

    /// Checks the step from `from`, where the last one ended, to `to`: see [`StepCheck`]. Nothing is checked
    /// without contact of the cloth with itself.
    pub(crate) fn check_step(&mut self, from: &[DVec3], to: &mut [DVec3]) -> Option<StepCheck> {
        self.proximity.as_ref()?;
        // A vertex that stays farther from the body than its move is long cannot have come through it.
        let may_pass = |&v: &usize| {
            let bound = self.queried_distance[v] - to[v].distance(self.queried_at[v]);
            !self.held[v] && bound < from[v].distance(to[v])
        };
        let shares = self.body().map_or_else(Vec::new, |body| {
            let near: Vec<u32> = (0..to.len()).filter(may_pass).map(|v| v as u32).collect();
            passages(body, &near, from, to)
        });
        self.proximity.as_mut().map(|proximity| proximity.check_step(from, to, &shares))
    }

    /// Removes all contact places permanently, because the solve does not converge with them.
    pub(crate) fn remove_face_contacts(&mut self) {
        self.face_contacts.places.clear();
        self.face_contacts.closed = true;
    }

    /// Adds contact places near rest; returns how many. The `first` ones are added only where no triangle is deep in the body: such cloth is
    /// brought to rest without places first, and then moved off the body.
    pub(crate) fn extend_face_contacts(&mut self, x: &[DVec3], first: bool) -> usize {
        let Some(body) = self.body().filter(|_| !self.face_contacts.closed) else { return 0 };
        let pairs = body.crossing_pairs(&self.garment(x.to_vec()));
        if first && !self.face_contacts.is_shallow(body, x, &pairs) {
            return 0;
        }
        self.face_contacts.add_to(body, x, &pairs, 0.0)
    }

    /// Contact energy, J, without friction.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.touches.iter().map(|t| 0.5 * t.stiffness * t.depth * t.depth).sum()
    }

    /// Adds the gradient, N, without friction.
    pub fn add_gradient(&self, gradient: &mut [DVec3]) {
        for t in &self.touches {
            gradient[t.vertex as usize] -= t.normal * t.force();
        }
    }

    /// Each touching vertex's Hessian block, N/m, without friction.
    pub(crate) fn hessian(&self) -> impl Iterator<Item = (u32, DMat3)> + '_ {
        self.touches.iter().map(|t| (t.vertex, outer(t.normal, t.normal) * t.stiffness))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::energy::Cloth;
    use crate::mesh::samples::{cuboid, sheet, tube};

    #[test]
    fn a_raised_offset_is_lowered_where_the_vertex_does_not_touch_by_its_own() {
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let mesh = sheet(1, 1, |i, j| DVec3::new(0.1 * i, 0.1 * j, 0.0));
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        // Two corners are a millimetre beyond their own offset, two a tenth of one. Over a flat face both distances agree.
        let x: Vec<DVec3> =
            (0..4).map(|v| mesh.positions[v].with_z(cloth.offsets[v] + if v < 2 { 1e-3 } else { 1e-4 })).collect();
        let mut contacts = cloth.new_contacts(&body);
        for v in 0..4 {
            contacts.raised.insert(v, contacts.offsets[v as usize]);
            contacts.offsets[v as usize] += 2e-3;
        }
        contacts.update(&x);
        assert_eq!(contacts.touches().len(), 4);
        contacts.lower_offsets(&x);
        contacts.update(&x);
        let touching: Vec<u32> = contacts.touches().iter().map(|t| t.vertex).collect();
        assert_eq!(touching, [2, 3]);
        for v in 0..2 {
            assert!(
                (contacts.offsets[v] - cloth.offsets[v]).abs() < 1e-9,
                "{} {}",
                contacts.offsets[v],
                cloth.offsets[v]
            );
        }
    }

    #[test]
    fn contacts_from_known_distances_are_those_of_queries() {
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let placed = vec![at(0.0, 0.0, 0.001), at(0.1, 0.0, 0.05), at(0.1, 0.1, 0.2), at(0.0, 0.1, 0.0005)];
        let mesh = TriMesh::new(placed.clone(), vec![[0, 1, 2], [0, 2, 3]]);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        let distances: Vec<f64> = placed.iter().map(|x| body.nearest(*x).signed_distance).collect();
        // The second vertex moves down to the body, the third stays off, the last moves into it.
        let mut x = placed.clone();
        (x[1].z, x[2].z, x[3].z) = (0.0004, 0.19, -0.001);
        for planes in [false, true] {
            let queried = cloth.contacts_from_distances(&body, &x, planes, &placed, std::iter::empty());
            let bounded = cloth.contacts_from_distances(&body, &x, planes, &placed, distances.iter().copied());
            assert!(queried.touches().len() >= 2, "{:?}", queried.touches());
            assert_eq!(queried.touches(), bounded.touches());
        }
    }

    /// A foot in a trouser leg: the leg is moved off it, and would slide back if nothing kept it there.
    #[test]
    fn cloth_that_is_moved_off_a_protrusion_is_kept_there_by_places() {
        let leg = tube(36, 28, |a, row| DVec3::new(0.08 * a.cos(), 0.08 * a.sin(), 0.4 * row / 28.0));
        let foot = cuboid(DVec3::new(-0.05, -0.03, 0.02), DVec3::new(0.14, 0.03, 0.032));
        let foot = Body::new(&foot).unwrap();
        let cloth = Cloth::sample(&leg, "jersey", &[]);
        let mut x = leg.positions.clone();
        let mut contacts = cloth.contacts(&foot, &x);
        contacts.proximity = Some(cloth.proximity());
        let mut pierced: Vec<u32> = foot.crossing_pairs(&leg).iter().map(|[t, _]| *t).collect();
        pierced.dedup();
        assert_eq!(contacts.update_face_contacts(&mut x), FaceUpdate::Moved);
        assert!(x.iter().any(|x| x.x > 0.14), "the leg goes about the foot");
        contacts.update(&x);
        contacts.refresh(&x);
        let places = contacts.face_contacts.gaps(Some(&foot), &x);
        let was_pierced = |corners: &[u32]| pierced.iter().any(|&t| leg.triangles[t as usize] == *corners);
        assert!(places.iter().all(|place| was_pierced(&place.key.vertices[..3])));
        // Half of the triangles that were pierced lie on the foot now; the others are beside it.
        assert!(2 * places.len() > pierced.len(), "{} places for {} triangles", places.len(), pierced.len());
        let a_millimetre_back: Vec<DVec3> =
            x.iter().zip(&leg.positions).map(|(x, from)| *x + (*from - *x).clamp_length_max(1e-3)).collect();
        assert!(contacts.proximity.as_ref().unwrap().pressing(&a_millimetre_back) > 0);
    }
}
