//! A garment divided into one cell for each vertex, which gives PARTs crisp borders. It is independent of Rerun.

use glam::DVec3;

use super::map::Rgb;
use crate::mesh::{Csr, TriMesh};

/// A garment divided into one cell per vertex, so that each vertex has its own colour up to a sharp border.
///
/// A triangle is split through its centroid and the midpoints of its sides into three quadrilaterals, one for each
/// corner (the barycentric dual). A PART is a set of vertices; with colours per triangle, a PART of one vertex would be
/// invisible. Where corners have the same value, nothing separates their cells.
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
    /// Divides `garment` into cells, for any values of its vertices.
    pub(crate) fn new(garment: &TriMesh) -> Self {
        Self::of_values(garment, &(0..garment.positions.len()).collect::<Vec<_>>())
    }

    /// Divides `garment` where these values of its vertices differ, for colours that differ there alone.
    pub(crate) fn of_values<T: PartialEq>(garment: &TriMesh, of_vertex: &[T]) -> Self {
        // The key of a vertex of a cell: the owner itself (0), the midpoint towards another vertex, or a centroid.
        const MIDPOINT: u64 = 1;
        const CENTROID: u64 = 1 << 33;
        let differ = |v: u32, w: u32| of_vertex[v as usize] != of_vertex[w as usize];
        let divided = |[a, b, c]: [u32; 3]| differ(a, b) || differ(b, c);
        let corners = |[a, b, c]: [u32; 3]| [(a, b, c), (b, c, a), (c, a, b)];
        let of_corner = |(v, next, previous): (u32, u32, u32), t: u64| {
            let towards = |w: u32| differ(v, w).then_some((v, MIDPOINT + u64::from(w)));
            [towards(next), towards(previous), Some((v, CENTROID + t))]
        };
        let of_triangles = Csr::gathered(garment.positions.len(), || {
            let to_divide = (0..).zip(&garment.triangles).filter(|(_, triangle)| divided(**triangle));
            to_divide
                .flat_map(|(t, triangle)| corners(*triangle).map(|corner| of_corner(corner, t)))
                .flatten()
                .flatten()
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
        let find = |v: u32, key: u64| {
            (keys.range(v as usize).start + keys.of(v as usize).binary_search(&key).unwrap_or_default()) as u32
        };
        let mut triangles = Vec::with_capacity(garment.triangles.len());
        for (t, &triangle) in garment.triangles.iter().enumerate() {
            if !divided(triangle) {
                triangles.push(triangle.map(|v| find(v, 0)));
                continue;
            }
            for (v, next, previous) in corners(triangle) {
                let (corner, centre) = (find(v, 0), find(v, CENTROID + t as u64));
                let midpoint = |w: u32| find(v, MIDPOINT + u64::from(w));
                // Without a border both halves of a side go to its first corner.
                triangles.push([corner, if differ(v, next) { midpoint(next) } else { find(next, 0) }, centre]);
                if differ(v, previous) {
                    triangles.push([corner, centre, midpoint(previous)]);
                }
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
    use crate::mesh::samples::sheet;

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

    #[test]
    fn cells_of_equal_values_tile_the_mesh_with_borders_between_different_values_alone() {
        let mesh = sheet(6, 6, |i, j| DVec3::new(i, 0.3 * j, j));
        let values: Vec<bool> = mesh.positions.iter().map(|p| p.x < 2.5).collect();
        let cells = CellMesh::of_values(&mesh, &values);
        let areas = cells.mesh.triangle_areas();
        assert!((areas.iter().sum::<f64>() - mesh.triangle_areas().iter().sum::<f64>()).abs() < 1e-12);
        let mut area = [0.0; 2];
        for (triangle, a) in cells.mesh.triangles.iter().zip(&areas) {
            let [first, others @ ..] = triangle.map(|v| values[cells.owner[v as usize] as usize]);
            assert_eq!(others, [first; 2]);
            area[usize::from(first)] += a;
        }
        // The border is half-way between x = 2 and x = 3, of 6.
        assert!((3.5 * area[1] - 2.5 * area[0]).abs() < 1e-12, "{area:?}");
        let all = CellMesh::new(&mesh);
        assert!(cells.owner.len() < all.owner.len() / 2, "{} of {}", cells.owner.len(), all.owner.len());
        // One value: the mesh itself.
        let plain = CellMesh::of_values(&mesh, &[0; 49]);
        assert_eq!((&plain.mesh.triangles, plain.mesh.positions), (&mesh.triangles, mesh.positions.clone()));
    }
}
