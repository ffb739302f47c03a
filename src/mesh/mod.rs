//! Triangle meshes: what the body and the garment are made of.
//!
//! Positions are metres, z up. Winding is counter-clockwise seen from outside (for a garment: from the side away from the
//! body). Area of a triangle is half the norm of the cross product of two edges; a vertex owns a third of each of its
//! triangles (barycentric area).

pub mod bridges;
mod cleanup;
pub mod coarse;
mod collapse;
mod csr;
mod decimate;
mod dijkstra;
mod duplicates;
mod error;
pub mod export;
pub mod flat_pattern;
pub(crate) mod flip;
mod frame;
mod frame_guess;
pub mod glb;
pub(crate) mod half_edge;
pub mod health;
pub mod import;
pub(crate) mod lattice;
pub(crate) mod morton;
mod obj_lines;
mod obj_source;
mod orientation;
pub(crate) mod polygon;
pub(crate) mod remesh;
pub mod report;
pub mod rest;
#[cfg(test)]
pub(crate) mod samples;
pub mod self_intersection;
mod topology;
pub(crate) mod triangle_crossing;
pub(crate) mod winding;

use glam::{DMat3, DVec3};

pub(crate) use csr::Lists;
pub(crate) use dijkstra::Flow;
pub use error::{Keyword, LineProblem, MeshError};
pub use frame::{Axis, Frame, Unit};
pub use obj_lines::{Corner, Face};
pub use obj_source::ObjSource;
pub use remesh::Density;
pub use rest::RestShape;
pub use topology::{NONE, Topology};

/// An indexed triangle mesh with optional named groups of triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions in metres, z up.
    pub positions: Vec<DVec3>,
    /// Vertex indices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Names of the groups (`hem`, `neckline`, ...); empty where there are none.
    pub groups: Vec<String>,
    /// Index into [`groups`](Self::groups) of each triangle; empty exactly where `groups` is.
    pub triangle_group: Vec<u32>,
}

impl TriMesh {
    /// A mesh without groups.
    #[must_use]
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, groups: Vec::new(), triangle_group: Vec::new() }
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// The three corners of triangle `t`, m.
    #[must_use]
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }

    /// Twice the area of triangle `t` along its normal, m².
    #[must_use]
    pub fn double_area_vector(&self, t: usize) -> DVec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a)
    }

    /// Area of each triangle, m².
    #[must_use]
    pub fn triangle_areas(&self) -> Vec<f64> {
        (0..self.triangles.len()).map(|t| 0.5 * self.double_area_vector(t).length()).collect()
    }

    /// Barycentric area of each vertex, m²: a third of every triangle that touches it.
    #[must_use]
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let third = self.double_area_vector(t).length() / 6.0;
            for &v in triangle {
                areas[v as usize] += third;
            }
        }
        areas
    }

    /// Unit vertex normals, weighted by area; zero where every triangle at the vertex is degenerate or there is none.
    #[must_use]
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let n = self.double_area_vector(t);
            for &v in triangle {
                normals[v as usize] += n;
            }
        }
        normals.into_iter().map(DVec3::normalize_or_zero).collect()
    }

    /// Smallest and largest coordinate along each axis, m; `None` for a mesh without vertices.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        bounds(&self.positions)
    }

    /// The same triangles and groups at other positions.
    #[must_use]
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        debug_assert_eq!(positions.len(), self.positions.len());
        Self { positions, ..self.clone() }
    }
}

/// Smallest and largest coordinate of some points along each axis; `None` for no points.
fn bounds(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let first = *points.first()?;
    Some(points.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p))))
}

/// Lengths of the sides of a triangle, m: opposite the first corner, the second, the third.
pub(crate) fn sides([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    [b.distance(c), c.distance(a), a.distance(b)]
}

/// The greatest of them, m.
pub(crate) fn longest_side(corners: [DVec3; 3]) -> f64 {
    sides(corners).into_iter().fold(0.0, f64::max)
}

/// Lower and upper corner of the box about some points, m; infinite and inside out for none.
pub(crate) fn box_about(points: impl IntoIterator<Item = DVec3>) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.into_iter().fold(none, |(low, high), p| (low.min(p), high.max(p)))
}

/// The connected pieces of what is alike among `count` things with these neighbours, by their first; each from there on, depth first.
pub(crate) fn pieces<'a>(
    count: usize,
    neighbours: impl Fn(usize) -> &'a [u32],
    alike: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<u32>> {
    let mut met = vec![false; count];
    let mut all = Vec::new();
    for seed in 0..count {
        if std::mem::replace(&mut met[seed], true) {
            continue;
        }
        let (mut piece, mut open) = (Vec::new(), vec![seed as u32]);
        while let Some(one) = open.pop() {
            piece.push(one);
            let beside = neighbours(one as usize).iter().filter(|&&other| alike(seed, other as usize));
            open.extend(beside.filter(|&&other| !std::mem::replace(&mut met[other as usize], true)));
        }
        all.push(piece);
    }
    all
}

/// a bᵀ.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Each of these once, ascending.
pub(crate) fn each_once<T: Ord>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = all.into_iter().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The new number of each of so many things when those that are not kept go; [`NONE`] for these.
pub(crate) fn renumbered(count: usize, keep: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut next = 0..;
    (0..count).map(|i| if keep(i) { next.next().unwrap_or(NONE) } else { NONE }).collect()
}

/// Keeps the elements of a list whose places `keep` names.
pub(crate) fn retain<T>(list: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut place = 0..;
    list.retain(|_| place.next().is_some_and(&keep));
}
