//! Meshes that tests are made with.

use std::f64::consts::TAU;

use glam::DVec3;

use super::TriMesh;

/// A closed box, wound outward; its top are triangles 2 and 3.
pub(crate) fn cuboid(low: DVec3, high: DVec3) -> TriMesh {
    let corner = |i: usize| {
        let of = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 1 { high } else { low };
        DVec3::new(of(0, low.x, high.x), of(1, low.y, high.y), of(2, low.z, high.z))
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh::new((0..8).map(corner).collect(), triangles)
}

/// So many squares side by side in so many rows, two triangles each; the vertices, row by row, are where `at` has the corners.
pub(crate) fn sheet(columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    squares(columns + 1, columns, rows, at)
}

/// A [`sheet`] whose sides are joined, open at both ends; `at` is told angle and row, and is outside where rows go up.
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
