//! A garment divided into one cell for each vertex, which gives PARTs crisp borders. It is independent of Rerun.

use glam::DVec3;

use super::map::Rgb;
use crate::mesh::TriMesh;

/// A garment divided into one cell per vertex, so that each vertex has its own colour up to a sharp border.
///
/// Every triangle is split through its centroid and the midpoints of its sides into three quadrilaterals, one for each
/// corner (the barycentric dual). A PART is a set of vertices; with colours per triangle, a PART of one vertex would be
/// invisible.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CellMesh {
    /// The garment's vertex of each vertex of the cells, ascending.
    pub(crate) owner: Vec<u32>,
    /// Positions and triangles of the cells.
    pub(crate) mesh: TriMesh,
    /// Normals of the garment.
    pub(crate) normals: Vec<DVec3>,
}

impl CellMesh {
    /// Divides `garment` into cells.
    pub(crate) fn new(garment: &TriMesh) -> Self {
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

    /// The colour of each vertex of the cells, from one per vertex of the garment.
    pub(crate) fn of_vertices(&self, of_garment: &[Rgb]) -> Vec<Rgb> {
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
