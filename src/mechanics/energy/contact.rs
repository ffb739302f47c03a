//! Contact: the body pushes the cloth off its surface.
//!
//! E = Σ ½ κ A_i (h − q(x_i))² over the vertices with q < h: a pressure κ (h − q) along the body's normal ∇q, so that the
//! cloth's middle surface rests a fraction of its thickness nearer than h. The Hessian keeps κ A_i ∇q ∇qᵀ and drops the
//! body's curvature times the pressure, which is negative on a convex body and second order in the penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | q | signed distance to the body | m |
//! | h | offset: the distance the cloth keeps, its thickness and what a triangle sags | m |
//! | κ | contact stiffness: pressure over penetration | N/m³ |
//! | A_i | rest area of vertex i | m² |
//!
//! A closest point costs as much as ten triangles' energies, so each vertex remembers its last query: q has slope at most
//! one, hence q(x) ≥ q(x') − |x − x'|, and a vertex whose bound stays above h is not asked again.
//!
//! Limits: vertices are tested, not edges or triangles; a sharp body corner can poke through a triangle.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::friction::Friction;
use super::membrane::outer;
use crate::distance::Body;

/// A vertex nearer to the body than the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The vertex.
    pub vertex: u32,
    /// h − q, m: positive.
    pub depth: f64,
    /// ∇q, outward.
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

/// What the cloth meets at its current positions, with the memory that makes asking again cheap.
#[derive(Debug, Clone)]
pub struct Contacts<'b> {
    body: Option<&'b Body>,
    offset: f64,
    areas: Vec<f64>,
    asks: Vec<bool>,
    asked_at: Vec<DVec3>,
    answer: Vec<f64>,
    stiffness: f64,
    touches: Vec<Touch>,
    /// Where the cloth holds on to the body.
    pub friction: Friction,
}

impl<'b> Contacts<'b> {
    /// Nothing to touch.
    #[must_use]
    pub fn none() -> Self {
        Self {
            body: None,
            offset: 0.0,
            areas: Vec::new(),
            asks: Vec::new(),
            asked_at: Vec::new(),
            answer: Vec::new(),
            stiffness: 0.0,
            touches: Vec::new(),
            friction: Friction::none(),
        }
    }

    /// Contacts of the vertices with `areas` (m²; those not in `held`) against `body` at distance `offset` (m) with
    /// `stiffness` κ (N/m³). Ask [`update`](Self::update) before use.
    #[must_use]
    pub fn new(body: &'b Body, areas: &[f64], held: &[bool], offset: f64, stiffness: f64, friction: Friction) -> Self {
        let n = areas.len();
        Self {
            body: Some(body),
            offset,
            areas: areas.to_vec(),
            asks: held.iter().map(|h| !h).collect(),
            asked_at: vec![DVec3::ZERO; n],
            answer: vec![f64::NEG_INFINITY; n],
            stiffness,
            touches: Vec::new(),
            friction,
        }
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
        let Some(body) = self.body else { return };
        let near: Vec<u32> = (0..x.len())
            .filter(|&v| self.asks[v] && self.answer[v] - x[v].distance(self.asked_at[v]) < self.offset)
            .map(|v| v as u32)
            .collect();
        let points: Vec<_> = near.par_iter().with_min_len(128).map(|&v| body.nearest(x[v as usize])).collect();
        for (&vertex, point) in near.iter().zip(&points) {
            let v = vertex as usize;
            self.asked_at[v] = x[v];
            self.answer[v] = point.signed_distance;
            let depth = self.offset - point.signed_distance;
            if depth > 0.0 {
                let stiffness = self.stiffness * self.areas[v];
                self.touches.push(Touch { vertex, depth, normal: point.normal, stiffness });
            }
        }
    }

    /// Refreshes the friction from the contacts found last, at their positions `x`.
    pub fn friction_refresh(&mut self, x: &[DVec3]) {
        self.friction.refresh(&self.touches, x);
    }

    /// The vertices in contact, ascending.
    #[must_use]
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Vertices inside the body at the positions last updated, and the deepest's depth (m).
    #[must_use]
    pub fn penetration(&self) -> (usize, f64) {
        let inside = self.touches.iter().map(|t| t.depth - self.offset).filter(|&d| d > 0.0);
        inside.fold((0, 0.0), |(n, deepest), d| (n + 1, d.max(deepest)))
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
    pub fn hessian(&self) -> impl Iterator<Item = (u32, DMat3)> + '_ {
        self.touches.iter().map(|t| (t.vertex, outer(t.normal, t.normal) * t.stiffness))
    }
}
