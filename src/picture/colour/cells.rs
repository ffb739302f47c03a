//! A garment divided into one cell for each vertex, which gives PARTs crisp borders. It is independent of Rerun.

use glam::DVec3;

use super::map::Rgb;
use crate::mesh::{Csr, TriMesh};

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
        // The key of a vertex of a cell: the owner itself (0), the midpoint towards another vertex, or a centroid.
        const MIDPOINT: u64 = 1;
        const CENTROID: u64 = 1 << 33;
        let around = |v: u32, next: u32, previous: u32, t: u64| {
            [MIDPOINT + u64::from(next), MIDPOINT + u64::from(previous), CENTROID + t].map(|key| (v, key))
        };
        let of_triangles = Csr::gathered(garment.positions.len(), || {
            (0..).zip(&garment.triangles).flat_map(move |(t, &[a, b, c])| {
                [around(a, b, c, t), around(b, c, a, t), around(c, a, b, t)].into_iter().flatten()
            })
        });
        let mut keys = Csr::default();
        let mut own = Vec::new();
        for v in 0..of_triangles.len() {
            own.clear();
            own.push(0);
            own.extend(of_triangles.of(v));
            own.sort_unstable();
            own.dedup();
            keys.push(own.iter().copied());
        }
        let find = |(v, key): (u32, u64)| {
            (keys.range(v as usize).start + keys.of(v as usize).binary_search(&key).unwrap_or_default()) as u32
        };
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
            let owners = (0..keys.len()).flat_map(|v| keys.of(v).iter().map(move |&kind| (v, kind)));
            owners
                .map(|(v, kind)| {
                    let own = values[v];
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
        let owner = (0..keys.len()).flat_map(|v| keys.of(v).iter().map(move |_| v as u32)).collect();
        Self { owner, mesh, normals }
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
