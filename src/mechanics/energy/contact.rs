//! Contact: the body pushes the cloth off its surface.
//!
//! E = Σ ½ κ A_i (h − q(x_i))² over the vertices with q < h: a pressure κ (h − q) along the body's normal ∇q, so that the
//! cloth's middle surface rests a fraction of its thickness nearer than h. q is the body's distance without its creases,
//! [`field`](super::field). The Hessian keeps κ A_i ∇q ∇qᵀ and drops the body's curvature times the pressure, which is
//! negative on a convex body and second order in the penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body, creases rounded | m |
//! | h | offset: the distance the cloth keeps, its thickness and what a triangle sags | m |
//! | κ | contact stiffness: pressure over penetration | N/m³ |
//! | A_i | rest area of vertex i | m² |
//!
//! A distance costs as much as ten triangles' energies, so each vertex remembers its last one: q has slope at most one,
//! hence q(x) ≥ q(x') − |x − x'|, and a vertex whose bound stays above h is not asked again.
//!
//! Limits: vertices are tested, not edges or triangles; where the body pokes through a triangle all the same, places within it are
//! kept off as well (`cover.rs`).

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::face_contacts::Cover;
use super::field::{Field, SIDE};
use super::friction::Friction;
use super::membrane::outer;
use super::proximity::Proximity;
use crate::body::distance::Body;

/// A vertex nearer to the body than the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The vertex.
    pub vertex: u32,
    /// h − q, m: positive.
    pub depth: f64,
    /// ∇q, outward; of unit length but where a crease is rounded.
    pub normal: DVec3,
    /// κ A_i, N/m.
    pub stiffness: f64,
}

impl Touch {
    /// The normal force κ A_i (h − q), N.
    #[must_use]
    pub fn force(&self) -> f64 {
        self.stiffness * self.depth
    }
}

/// A plane stands for the body this far about the point it was taken at, m: over a radius of 5 cm it is then off by 0.04 mm.
const PLANE: f64 = 2e-3;

/// Vertices that a thread passes over at least: what is near is a comparison.
const STRETCH: usize = 8192;

/// What there is to touch, and by which distance.
#[derive(Debug, Clone, Default)]
pub(super) enum Obstacle<'b> {
    #[default]
    Nothing,
    /// The exact distance's tangent plane where it was last asked.
    Planes(&'b Body),
    Rounded(Field<'b>),
}

/// What the cloth meets at its current positions, with the memory that makes asking again cheap.
#[derive(Debug, Clone, Default)]
pub struct Contacts<'b> {
    pub(super) met: Obstacle<'b>,
    /// h of each vertex, m.
    pub(super) offsets: Vec<f64>,
    areas: Vec<f64>,
    pub(super) held: Vec<bool>,
    pub(super) asked_at: Vec<DVec3>,
    pub(super) answer: Vec<f64>,
    /// Normals of the tangent planes, zero where never asked.
    normals: Vec<DVec3>,
    /// Square of how far each vertex may go from where it was asked before it can be near, m²; negative where it is near there.
    pub(super) leave: Vec<f64>,
    /// The vertices that may be near, of the last [`update`](Self::update).
    near: Vec<u32>,
    stiffness: f64,
    pub(super) touches: Vec<Touch>,
    /// Where the cloth holds on to the body.
    pub friction: Friction,
    /// Where the cloth meets itself; not asked where there is none.
    pub proximity: Option<Proximity>,
    /// Places between the vertices that keep off the body.
    pub(super) cover: Cover,
}

impl<'b> Contacts<'b> {
    /// Nothing to touch.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Contacts of the vertices with `areas` (m²; those not in `held`) against `body` at their `offsets` (m) with
    /// `stiffness` κ (N/m³). Ask [`update`](Self::update) before use.
    #[must_use]
    pub(crate) fn new(
        body: &'b Body,
        [areas, offsets]: [&[f64]; 2],
        held: &[bool],
        stiffness: f64,
        friction: Friction,
    ) -> Self {
        let n = areas.len();
        Self {
            met: Obstacle::Rounded(Field::new(body, n)),
            offsets: offsets.to_vec(),
            areas: areas.to_vec(),
            held: held.to_vec(),
            asked_at: vec![DVec3::ZERO; n],
            answer: vec![f64::NEG_INFINITY; n],
            normals: vec![DVec3::ZERO; n],
            // Who is held is never asked.
            leave: held.iter().map(|&held| if held { f64::INFINITY } else { f64::NEG_INFINITY }).collect(),
            stiffness,
            friction,
            ..Self::none()
        }
    }

    /// The same by tangent planes of the exact distance, asked anew where a vertex has moved by 2 mm: cheap for a cloth that
    /// moves far and need not be told to a tenth of a millimetre. Not for contacts that were updated already.
    #[must_use]
    pub(crate) fn by_planes(self) -> Self {
        Self { met: self.body().map_or(Obstacle::Nothing, Obstacle::Planes), ..self }
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

    /// Finds what touches at `x`. Same bits on any number of threads.
    pub fn update(&mut self, x: &[DVec3]) {
        self.touches.clear();
        if let Obstacle::Planes(body) = self.met {
            return self.update_planes(body, x);
        }
        self.bound(x);
        self.find_near(x);
        let Obstacle::Rounded(field) = &mut self.met else { return };
        let near = std::mem::take(&mut self.near);
        let found = field.at(&near, x);
        for (&vertex, &(distance, normal)) in near.iter().zip(&found) {
            let v = vertex as usize;
            self.keep(v, x[v], distance);
            self.touch(vertex, distance, normal);
        }
        self.near = near;
    }

    /// A vertex touches where its distance is less than its offset.
    fn touch(&mut self, vertex: u32, distance: f64, normal: DVec3) {
        let v = vertex as usize;
        let depth = self.offsets[v] - distance;
        if depth > 0.0 {
            self.touches.push(Touch { vertex, depth, normal, stiffness: self.stiffness * self.areas[v] });
        }
    }

    /// Finds the vertices whose bound is less than the offset: a loop over all of them at every evaluation, so without roots.
    fn find_near(&mut self, x: &[DVec3]) {
        let Self { near, asked_at, leave, .. } = self;
        let is_near = |((x, asked_at), leave): &((&DVec3, &DVec3), &f64)| x.distance_squared(**asked_at) > **leave;
        near.clear();
        if x.len() < 2 * STRETCH {
            let vertices = (0..).zip(x.iter().zip(&*asked_at).zip(&*leave));
            near.extend(vertices.filter(|(_, vertex)| is_near(vertex)).map(|(v, _)| v));
        } else {
            let vertices = x.par_iter().zip(&*asked_at).zip(&*leave).enumerate().with_min_len(STRETCH);
            near.par_extend(vertices.filter(|(_, vertex)| is_near(vertex)).map(|(v, _)| v as u32));
        }
    }

    /// Remembers a vertex's distance and where it was asked.
    pub(super) fn keep(&mut self, v: usize, x: DVec3, distance: f64) {
        let free = distance - self.offsets[v];
        (self.asked_at[v], self.answer[v], self.leave[v]) = (x, distance, free * free.abs());
    }

    /// [`update`](Self::update) by planes.
    fn update_planes(&mut self, body: &Body, x: &[DVec3]) {
        self.find_near(x);
        let near = std::mem::take(&mut self.near);
        let stale =
            |&v: &usize| self.normals[v] == DVec3::ZERO || x[v].distance_squared(self.asked_at[v]) > PLANE * PLANE;
        let stale: Vec<usize> = near.iter().map(|&v| v as usize).filter(stale).collect();
        let found = body.nearest_all(&stale.iter().map(|&v| x[v]).collect::<Vec<_>>());
        for (v, found) in stale.into_iter().zip(found) {
            self.keep(v, x[v], found.signed_distance);
            self.normals[v] = found.normal;
        }
        for &vertex in &near {
            let v = vertex as usize;
            let (normal, moved) = (self.normals[v], x[v] - self.asked_at[v]);
            self.touch(vertex, self.answer[v] + normal.dot(moved), normal);
        }
        self.near = near;
    }

    /// Gives every vertex that was never asked a bound by the exact distance: most are far, and a lattice about each would
    /// cost twenty times as much. The rounded distance is less by no more than the lattice's side.
    fn bound(&mut self, x: &[DVec3]) {
        let Obstacle::Rounded(field) = &self.met else { return };
        let body = field.body();
        let fresh = |&v: &usize| !self.held[v] && self.answer[v] == f64::NEG_INFINITY;
        let new: Vec<usize> = (0..x.len()).filter(fresh).collect();
        let found = body.nearest_all(&new.iter().map(|&v| x[v]).collect::<Vec<_>>());
        for (v, found) in new.into_iter().zip(found) {
            self.keep(v, x[v], found.signed_distance - SIDE);
        }
    }

    /// Refreshes at the positions `x` last updated what stays as it is between two steps: friction, gaps of the cloth, and places kept off.
    pub fn refresh(&mut self, x: &[DVec3]) {
        self.friction.refresh(&self.touches, x);
        let to_body = self.cover.gaps(self.body(), x);
        if let Some(proximity) = &mut self.proximity {
            proximity.refresh_with(x, to_body);
        }
    }

    /// The vertices in contact, ascending.
    #[must_use]
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// The body, if there is one.
    pub(super) fn body(&self) -> Option<&'b Body> {
        match &self.met {
            Obstacle::Nothing => None,
            Obstacle::Planes(body) => Some(body),
            Obstacle::Rounded(field) => Some(field.body()),
        }
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
