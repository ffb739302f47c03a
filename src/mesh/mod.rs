//! Triangle meshes, of which the body and the garment consist.
//!
//! Positions are metres, z up. Winding is counter-clockwise seen from outside (for a garment: from the side away from the
//! body). Area of a triangle is half the norm of the cross product of two edges; a vertex owns a third of each of its
//! triangles (barycentric area).

pub mod bridges;
pub mod coarse;
mod csr;
mod duplicates;
mod error;
pub mod export;
mod exported;
pub mod flat_pattern;
mod frame;
mod glb;
pub(crate) mod half_edge;
pub mod health;
pub mod import;
pub(crate) mod lattice;
pub(crate) mod morton;
mod ply;
pub(crate) mod polygon;
mod read;
pub(crate) mod remesh;
pub mod report;
pub mod rest;
pub mod self_intersection;
mod source;
mod topology;
mod usda;
pub(crate) mod winding;

use glam::{DMat3, DVec3};

pub(crate) use csr::Csr;
pub use error::MeshError;
pub(crate) use exported::Export;
pub use frame::{Axis, Frame, Front, Unit};
pub use remesh::Density;
pub use rest::RestShape;
pub use source::{Corner, Face, MeshSource};
pub(crate) use topology::Dijkstra;
pub use topology::{NONE, Topology};

/// An indexed triangle mesh with optional named groups of triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions in metres, z up.
    pub positions: Vec<DVec3>,
    /// Vertex indices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Names of the groups (`hem`, `neckline`, ...); empty without groups.
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

    /// Unit vertex normals, weighted by area; zero at a vertex without a triangle of positive area.
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
        (!self.positions.is_empty()).then(|| box_about(self.positions.iter().copied()))
    }

    /// The same triangles and groups at other positions.
    #[must_use]
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        debug_assert_eq!(positions.len(), self.positions.len());
        Self { positions, ..self.clone() }
    }
}

/// Lengths of the sides of a triangle, m: opposite the first corner, the second, the third.
pub(crate) fn sides([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    [b.distance(c), c.distance(a), a.distance(b)]
}

/// Length of the longest side of a triangle, m.
pub(crate) fn longest_side(corners: [DVec3; 3]) -> f64 {
    sides(corners).into_iter().fold(0.0, f64::max)
}

/// Lower and upper corner of the box around some points, m; for none, infinite with lower above upper.
pub(crate) fn box_about(points: impl IntoIterator<Item = DVec3>) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.into_iter().fold(none, |(low, high), p| (low.min(p), high.max(p)))
}

/// The connected components of `count` items, where neighbours are connected if `alike`. Components are in the order of their first
/// item, and each lists its items depth first from there.
pub(crate) fn pieces<'a>(
    count: usize,
    neighbours: impl Fn(usize) -> &'a [u32],
    alike: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<u32>> {
    let mut visited = vec![false; count];
    let mut all = Vec::new();
    for seed in 0..count {
        if std::mem::replace(&mut visited[seed], true) {
            continue;
        }
        let (mut piece, mut open) = (Vec::new(), vec![seed as u32]);
        while let Some(one) = open.pop() {
            piece.push(one);
            let beside = neighbours(one as usize).iter().filter(|&&other| alike(seed, other as usize));
            open.extend(beside.filter(|&&other| !std::mem::replace(&mut visited[other as usize], true)));
        }
        all.push(piece);
    }
    all
}

/// a bᵀ.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The items without duplicates, ascending.
pub(crate) fn each_once<T: Ord>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = all.into_iter().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The new index of each of `count` items after those that are not kept are removed; [`NONE`] for these.
pub(crate) fn renumbered(count: usize, keep: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut next = 0..;
    (0..count).map(|i| if keep(i) { next.next().unwrap_or(NONE) } else { NONE }).collect()
}

/// Keeps the elements of a list at the indices that `keep` accepts.
pub(crate) fn retain<T>(list: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut place = 0..;
    list.retain(|_| place.next().is_some_and(&keep));
}

/// Meshes for tests.
#[cfg(test)]
pub(crate) mod samples {
    use std::f64::consts::TAU;

    use super::{DVec3, TriMesh};

    /// A closed box, wound outward; triangles 2 and 3 are its top.
    pub(crate) fn cuboid(low: DVec3, high: DVec3) -> TriMesh {
        let corner = |i: usize| {
            let of = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 1 { high } else { low };
            DVec3::new(of(0, low.x, high.x), of(1, low.y, high.y), of(2, low.z, high.z))
        };
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriMesh::new((0..8).map(corner).collect(), triangles)
    }

    /// A grid of squares, two triangles each. Vertices are numbered row by row; `at` places them by column and row.
    pub(crate) fn sheet(columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
        squares(columns + 1, columns, rows, at)
    }

    /// A folded sheet whose upper layer lies under the lower one in some rows: the layers intersect where the order changes.
    pub(crate) fn folded(under: impl Fn(u32) -> bool) -> TriMesh {
        sheet(14, 14, |i, j| {
            let upper = if under(j as u32) { -0.4 } else { 0.6 };
            let height = upper * ((i - 6.0) / 2.0).clamp(0.0, 1.0);
            DVec3::new(i.min(14.0 - i) + 0.3 * height, j, height) * 0.01
        })
    }

    /// A [`sheet`] whose sides are joined, open at both ends. `at` places vertices by angle and row; the outside is outward where
    /// rows go up.
    pub(crate) fn tube(around: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
        squares(around, around, rows, |i, j| at(TAU * i / f64::from(around), j))
    }

    fn squares(row: u32, columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
        let corners = (0..=rows).flat_map(|j| (0..row).map(move |i| (f64::from(i), f64::from(j))));
        let square = |i: u32, j: u32| {
            let [[a, b], [c, d]] = [j, j + 1].map(|j| [i, i + 1].map(|i| j * row + i % row));
            [[a, b, d], [a, d, c]]
        };
        let triangles = (0..rows).flat_map(|j| (0..columns).flat_map(move |i| square(i, j))).collect();
        TriMesh::new(corners.map(|(i, j)| at(i, j)).collect(), triangles)
    }
}
