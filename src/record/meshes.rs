//! Meshes as Rerun's archetypes: single precision, always with normals, without which a mesh is drawn unlit.

use glam::DVec3;
use rerun::{Color, Mesh3D, Rgba32};

use crate::mesh::TriMesh;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::Rgb;

/// A point or direction in single precision.
pub(super) fn single(p: DVec3) -> [f32; 3] {
    p.as_vec3().to_array()
}

/// Points or directions in single precision.
pub(super) fn singles(points: &[DVec3]) -> Vec<[f32; 3]> {
    points.iter().copied().map(single).collect()
}

/// An sRGB colour as Rerun's.
pub(super) fn colour([r, g, b]: Rgb) -> Color {
    Color::from_rgb(r, g, b)
}

/// sRGB colours as Rerun's.
pub(super) fn rerun_colours(colours: impl IntoIterator<Item = Rgb>) -> Vec<Color> {
    colours.into_iter().map(colour).collect()
}

/// A mesh with its triangles.
pub(super) fn whole(mesh: &TriMesh) -> Mesh3D {
    shape(mesh).with_triangle_indices(mesh.triangles.iter().copied())
}

/// A mesh in one colour.
pub(super) fn plain(mesh: &TriMesh, colour: Rgb) -> Mesh3D {
    coloured(whole(mesh), colour)
}

/// The same mesh in one colour.
pub(super) fn coloured(mesh: Mesh3D, [r, g, b]: Rgb) -> Mesh3D {
    mesh.with_albedo_factor(Rgba32::from_rgb(r, g, b))
}

/// Positions and normals alone, for a mesh whose triangles are logged already.
pub(super) fn shape(mesh: &TriMesh) -> Mesh3D {
    Mesh3D::update_fields()
        .with_vertex_positions(singles(&mesh.positions))
        .with_vertex_normals(singles(&mesh.vertex_normals()))
}

/// Colours alone.
pub(super) fn colours(colours: impl IntoIterator<Item = Rgb>) -> Mesh3D {
    Mesh3D::update_fields().with_vertex_colors(rerun_colours(colours))
}

impl CellMesh {
    /// Triangles, positions and normals, which are logged once.
    pub(super) fn shape(&self) -> Mesh3D {
        Mesh3D::new(singles(&self.mesh.positions))
            .with_triangle_indices(self.mesh.triangles.iter().copied())
            .with_vertex_normals(singles(&self.normals))
    }

    /// The colours alone, from one per vertex of the garment.
    pub(super) fn colours(&self, of_garment: &[Rgb]) -> Mesh3D {
        colours(self.of_vertices(of_garment))
    }
}
