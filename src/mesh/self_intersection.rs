//! Which triangles of a mesh cross each other, or those of another mesh: all pairs, exactly.
//!
//! Candidates come from parry3d's bounding volume hierarchy, box against box, one triangle a task; each is decided by the exact
//! test of `triangle_crossing`. Pairs are sorted, so the list is the same on any number of threads.

use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;

use super::TriMesh;
use super::triangle_crossing::cross;

/// Pairs of triangles of the mesh that cross, smaller number first, sorted. Neighbours that only share an edge or a
/// corner do not.
#[must_use]
pub fn self_intersecting_pairs(mesh: &TriMesh) -> Vec<[u32; 2]> {
    pairs(mesh, mesh, |t, u| t < u)
}

/// Pairs of a triangle of `a` and one of `b` that cross, sorted.
#[must_use]
pub fn crossing_pairs(a: &TriMesh, b: &TriMesh) -> Vec<[u32; 2]> {
    pairs(a, b, |_, _| true)
}

fn pairs(a: &TriMesh, b: &TriMesh, wanted: impl Fn(u32, u32) -> bool + Sync) -> Vec<[u32; 2]> {
    if a.triangles.is_empty() || b.triangles.is_empty() {
        return Vec::new();
    }
    let boxes: Vec<Aabb> = (0..b.triangles.len()).map(|u| bounds(b, u)).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    (0..a.triangles.len())
        .into_par_iter()
        .with_min_len(128)
        .flat_map_iter(|t| {
            let (corners, near) = (a.corners(t), bounds(a, t));
            let t = t as u32;
            let mut found: Vec<u32> =
                tree.intersect_aabb(&near).filter(|&u| wanted(t, u) && cross(corners, b.corners(u as usize))).collect();
            found.sort_unstable();
            found.into_iter().map(move |u| [t, u])
        })
        .collect()
}

fn bounds(mesh: &TriMesh, t: usize) -> Aabb {
    let [a, b, c] = mesh.corners(t);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;
    use glam::DVec3;

    /// A sheet of n × n squares in the plane through `origin` spanned by `u` and `v`.
    fn plane(n: u32, origin: DVec3, u: DVec3, v: DVec3) -> TriMesh {
        sheet(n, n, |i, j| origin + u * i + v * j)
    }

    #[test]
    fn a_flat_sheet_does_not_cross_itself_and_a_folded_one_does() {
        let mut mesh = plane(12, DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1);
        assert!(self_intersecting_pairs(&mesh).is_empty());
        // One corner of the sheet is bent through the rest of it.
        mesh.positions[0] = DVec3::new(0.55, 0.55, -0.2);
        let positions = mesh.positions.clone();
        mesh.positions[1] = DVec3::new(0.62, 0.57, 0.2);
        assert!(!self_intersecting_pairs(&mesh).is_empty());
        assert_eq!(self_intersecting_pairs(&mesh.with_positions(positions)).len(), 0);
    }

    #[test]
    fn pairs_are_those_of_brute_force() {
        let a = plane(9, DVec3::ZERO, DVec3::new(0.1, 0.01, 0.0), DVec3::new(0.0, 0.1, 0.02));
        let b = plane(7, DVec3::new(0.4, 0.1, -0.3), DVec3::new(0.01, 0.1, 0.02), DVec3::new(0.02, 0.0, 0.11));
        let all = (0..a.triangles.len()).flat_map(|t| (0..b.triangles.len()).map(move |u| (t, u)));
        let brute: Vec<[u32; 2]> =
            all.filter(|&(t, u)| cross(a.corners(t), b.corners(u))).map(|(t, u)| [t as u32, u as u32]).collect();
        assert!(brute.len() > 10);
        assert_eq!(crossing_pairs(&a, &b), brute);
        assert!(crossing_pairs(&a, &TriMesh::default()).is_empty());
    }
}
