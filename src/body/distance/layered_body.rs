//! A body that wears something: what is put over it keeps off the cloth as off the skin.
//!
//! The surface that an outer garment feels is the outermost of body and cloth. With d the distance to the cloth, positive on its outer side, and
//! q to the body,
//!
//! q' = d  where x is behind the cloth by less than R, else the nearer of q and |d|:
//!
//! within R behind a cloth one is inside, however far the skin; past an edge of it, or deeper than R, there is only the body and an
//! obstacle without sides.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d | distance to the cloth, negative behind it | m |
//! | R | depth behind a cloth that is felt, [`FELT`] | m |
//!
//! Limits: the cloth's sides are told by its normals; where it lies in a pleat the way out is that of the nearest sheet.

use std::sync::Arc;

use glam::DVec3;
use parry3d_f64::shape::TrianglePointLocation;

use super::{Body, DistanceError, SurfacePoint};
use crate::mesh::{Topology, TriMesh};

/// R, m: some strides of a step; what is farther behind got there otherwise than by being pushed.
const FELT: f64 = 0.02;

/// Cloth on a body.
#[derive(Debug, Clone)]
pub(super) struct Worn {
    cloth: Box<Body>,
    on_edge: Vec<bool>,
}

impl Body {
    /// The same body with this cloth on it, its normals outward; there is nothing else it wears.
    ///
    /// # Errors
    /// [`DistanceError`] where the cloth has no triangles.
    pub(crate) fn wearing(&self, cloth: &TriMesh) -> Result<Self, DistanceError> {
        let on_edge = Topology::new(cloth).boundary_vertices();
        let worn = Worn { cloth: Box::new(Self::new_open(cloth)?), on_edge };
        Ok(Self { worn: Some(worn), lattice: Arc::default(), ..self.clone() })
    }
}

impl Worn {
    /// The nearest point of the outermost surface, where `bare` is that of the body.
    pub(super) fn outermost(&self, x: DVec3, bare: SurfacePoint) -> SurfacePoint {
        let (cloth, location) = self.cloth.bare(x, self.cloth.tree.nearest(&[x])[0]);
        let beyond = self.is_edge(cloth.triangle, location);
        let distance = cloth.signed_distance.abs();
        if !beyond && cloth.signed_distance < 0.0 && distance < FELT {
            return cloth;
        }
        if bare.signed_distance <= distance {
            return bare;
        }
        SurfacePoint { signed_distance: distance, normal: (x - cloth.point).normalize_or(cloth.normal), ..cloth }
    }

    /// Whether it is on an edge of the cloth, past which there is no behind.
    fn is_edge(&self, triangle: u32, location: TrianglePointLocation) -> bool {
        let Some(weights) = location.barycentric_coordinates() else { return false };
        let corners = self.cloth.mesh.triangles[triangle as usize];
        let mut met = corners.iter().zip(weights).filter(|(_, weight)| *weight > 0.0).map(|(v, _)| *v as usize);
        weights.contains(&0.0) && met.all(|v| self.on_edge[v])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles at height z, facing up.
    fn sheet(half: f64, z: f64) -> TriMesh {
        let at = |x: f64, y: f64| DVec3::new(half * x, half * y, z);
        let corners = vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn over_and_under_a_cloth_and_past_its_edge() {
        // Skin at 0, cloth 3 mm above its middle.
        let body = Body::new_open(&sheet(1.0, 0.0)).unwrap().wearing(&sheet(0.1, 3e-3)).unwrap();
        for (x, y, z, expected) in [
            (0.0, 0.01, 5e-3, 2e-3),
            // Between cloth and skin: inside, by the way to the cloth.
            (0.0, 0.01, 1e-3, -2e-3),
            // Inside the skin too.
            (0.0, 0.01, -4e-3, -7e-3),
            // So deep that the cloth is not felt: the skin's own distance.
            (0.0, 0.01, -0.03, -0.03),
            // Past its edge, below it: the skin is nearest, and one is outside.
            (0.15, 0.0, 1e-3, 1e-3),
            // Past its edge and high up.
            (0.13, 0.01, 0.043, 0.043),
        ] {
            let near = body.nearest(DVec3::new(x, y, z));
            assert!((near.signed_distance - expected).abs() < 1e-12, "{x} {z}: {near:?}");
            assert!((near.normal - DVec3::Z).length() < 1e-9, "{x} {z}: {near:?}");
        }
        // Beside the edge, nearer to it than to the skin: an obstacle without sides.
        let beside = body.nearest(DVec3::new(0.101, 0.0, 3e-3));
        assert!(
            (beside.signed_distance - 1e-3).abs() < 1e-12 && (beside.normal - DVec3::X).length() < 1e-9,
            "{beside:?}"
        );
        let all = [DVec3::new(0.0, 0.01, 5e-3), DVec3::new(0.0, 0.01, -0.03), DVec3::new(0.0, 0.01, 1e-3)];
        let one_by_one: Vec<_> = all.iter().map(|x| body.nearest(*x)).collect();
        assert_eq!(body.nearest_all(&all), one_by_one);
    }
}
