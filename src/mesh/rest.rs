//! Rest shape: the flat metric of every triangle, from which strain is measured.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u | coordinate along the weft, x of a corner | m |
//! | v | coordinate along the warp, y of a corner | m |
//!
//! Each triangle is laid flat by itself, so a rest shape needs no global pattern. Warp is the projection of −z into the
//! triangle: cloth is cut so that the warp hangs. A horizontal triangle has no such projection and takes −y instead.

use glam::{DVec2, DVec3};

use super::TriMesh;

/// Each triangle's corners in its own flat frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RestShape {
    /// Corners of each triangle, m: x along the weft, y along the warp, counter-clockwise as the mesh.
    pub corners: Vec<[DVec2; 3]>,
}

impl RestShape {
    /// The mesh as it stands is the rest shape: its own edge lengths.
    #[must_use]
    pub fn from_mesh(mesh: &TriMesh) -> Self {
        let corners = (0..mesh.triangles.len())
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                let normal = mesh.double_area_vector(t).normalize_or_zero();
                let project = |axis: DVec3| axis - normal * normal.dot(axis);
                // Under a sine of 1e-3 the projected direction is rounding and meshing noise.
                let down = project(-DVec3::Z);
                let warp = if down.length() > 1e-3 { down } else { project(-DVec3::Y) }.normalize_or(DVec3::X);
                let weft = warp.cross(normal);
                [
                    DVec2::ZERO,
                    DVec2::new((b - a).dot(weft), (b - a).dot(warp)),
                    DVec2::new((c - a).dot(weft), (c - a).dot(warp)),
                ]
            })
            .collect();
        Self { corners }
    }
}
