//! Meshes as Rerun's archetypes: single precision, always with normals, without which a mesh is drawn unlit.

use glam::DVec3;
use rerun::{Color, Mesh3D, Rgba32};

use super::colour_map::Rgb;
use crate::mesh::TriMesh;

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
pub(super) fn plain(mesh: &TriMesh, [r, g, b]: Rgb) -> Mesh3D {
    whole(mesh).with_albedo_factor(Rgba32::from_rgb(r, g, b))
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

/// A garment divided into one cell per vertex, so that each vertex has its own colour up to a sharp border.
///
/// Every triangle is split through its centroid and the midpoints of its sides into three quadrilaterals, one for each
/// corner (the barycentric dual). A PART is a set of vertices; with colours per triangle, a PART of one vertex would be
/// invisible.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CellMesh {
    /// The garment's vertex of each vertex of the cells, ascending.
    owner: Vec<u32>,
    /// Positions and triangles of the cells.
    mesh: TriMesh,
    normals: Vec<DVec3>,
}

impl CellMesh {
    /// Divides `garment` into cells.
    pub(super) fn new(garment: &TriMesh) -> Self {
        // The key of a cell's vertex: the owner, and the owner itself (0), the midpoint towards another vertex, or a centroid.
        const MIDPOINT: u64 = 1;
        const CENTROID: u64 = 1 << 33;
        let mut keys: Vec<(u32, u64)> = (0..garment.positions.len() as u32).map(|v| (v, 0)).collect();
        for (t, &[a, b, c]) in garment.triangles.iter().enumerate() {
            for (v, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
                keys.push((v, MIDPOINT + u64::from(next)));
                keys.push((v, MIDPOINT + u64::from(previous)));
                keys.push((v, CENTROID + t as u64));
            }
        }
        keys.sort_unstable();
        keys.dedup();
        let find = |key: (u32, u64)| keys.binary_search(&key).unwrap_or_default() as u32;
        let mut triangles = Vec::with_capacity(6 * garment.triangles.len());
        for (t, &[a, b, c]) in garment.triangles.iter().enumerate() {
            for (v, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
                let (corner, centre) = (find((v, 0)), find((v, CENTROID + t as u64)));
                let ahead = find((v, MIDPOINT + u64::from(next)));
                let behind = find((v, MIDPOINT + u64::from(previous)));
                triangles.push([corner, ahead, centre]);
                triangles.push([corner, centre, behind]);
            }
        }
        let place = |values: &[DVec3]| -> Vec<DVec3> {
            keys.iter()
                .map(|&(v, kind)| {
                    let own = values[v as usize];
                    if kind == 0 {
                        own
                    } else if kind < CENTROID {
                        0.5 * (own + values[(kind - MIDPOINT) as usize])
                    } else {
                        let corners = garment.triangles[(kind - CENTROID) as usize];
                        corners.iter().map(|&c| values[c as usize]).sum::<DVec3>() / 3.0
                    }
                })
                .collect()
        };
        let normals = place(&garment.vertex_normals()).into_iter().map(DVec3::normalize_or_zero).collect();
        let mesh = TriMesh::new(place(&garment.positions), triangles);
        Self { owner: keys.into_iter().map(|(v, _)| v).collect(), mesh, normals }
    }

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

    /// The colour of each vertex of the cells, from one per vertex of the garment.
    pub(super) fn of_vertices(&self, of_garment: &[Rgb]) -> Vec<Rgb> {
        self.owner.iter().map(|&v| of_garment[v as usize]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tile_the_mesh_and_each_has_its_vertex_area() {
        let mesh =
            TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::new(1.2, 0.9, 0.3), DVec3::Y], vec![[0, 1, 2], [0, 2, 3]]);
        let cells = CellMesh::new(&mesh);
        let mut area = [0.0; 4];
        for (t, a) in cells.mesh.triangle_areas().into_iter().enumerate() {
            let owners = cells.mesh.triangles[t].map(|v| cells.owner[v as usize]);
            assert!(owners.iter().all(|&o| o == owners[0]));
            area[owners[0] as usize] += a;
        }
        for (found, expected) in area.iter().zip(mesh.vertex_areas()) {
            assert!((found - expected).abs() < 1e-15);
        }
        // Vertex 0: itself, three midpoints, two centroids.
        assert_eq!(cells.owner.iter().filter(|&&o| o == 0).count(), 6);
        // The winding is the same.
        let flat = |t: usize| cells.mesh.double_area_vector(t).normalize_or_zero();
        assert!(flat(0).dot(mesh.double_area_vector(0)) > 0.0);
    }
}
