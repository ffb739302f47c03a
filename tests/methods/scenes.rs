//! Small scenes for the methods.

use std::ops::ControlFlow;

use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mesh::{RestShape, TriMesh};
use partwise::methods::{Dressing, MethodDrape, MethodError, ReferenceMethod, RestRule};
use partwise::{DVec3, Scene};

/// A grid of right triangles over `u` × `v` from the origin, the diagonals alternating.
pub(crate) fn rectangle(u: DVec3, v: DVec3, nu: usize, nv: usize) -> TriMesh {
    let at = |i: usize, j: usize| u * (i as f64 / nu as f64) + v * (j as f64 / nv as f64);
    let positions = (0..=nv).flat_map(|j| (0..=nu).map(move |i| at(i, j))).collect();
    let id = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let cell = |i: usize, j: usize| {
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        if (i + j).is_multiple_of(2) { [[a, c, b], [a, d, c]] } else { [[a, d, b], [b, d, c]] }
    };
    TriMesh::new(positions, (0..nv).flat_map(|j| (0..nu).flat_map(move |i| cell(i, j))).collect())
}

/// A closed box far below, which nothing touches.
fn elsewhere() -> TriMesh {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64) - DVec3::Z * 9.0;
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh::new((0..8).map(corner).collect(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// Cloth that hangs free, held at `held`.
pub(crate) fn hanging(garment: TriMesh, held: Vec<u32>) -> Scene {
    let rest = RestShape::from_edges(&garment).unwrap();
    let body = partwise::body::distance::Body::new(&elsewhere()).unwrap();
    Scene { held, ..Scene::new(body, garment, rest) }
}

/// A fabric alike in all directions.
pub(crate) fn fabric(density: f64, stretch: f64, poisson: f64, bending: f64) -> Fabric {
    Fabric {
        density_kg_per_m2: density,
        stretch_weft_n_per_m: stretch,
        stretch_warp_n_per_m: stretch,
        shear_n_per_m: stretch / (2.0 * (1.0 + poisson)),
        poisson,
        bending_nm: [bending; 3],
        ..Fabric::default()
    }
}

/// Drapes a scene by a method.
pub(crate) fn drape(
    method: &dyn ReferenceMethod,
    scene: &Scene,
    fabric: &Fabric,
    rule: &RestRule,
) -> Result<MethodDrape, MethodError> {
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, fabric, &scene.held)?;
    method.drape(&Dressing { scene, fabric, cloth: &cloth }, rule, &mut |_| ControlFlow::Continue(()))
}

/// A rule that leaves nothing moving.
pub(crate) const STILL: RestRule = RestRule { speed_m_per_s: 1e-5, over_s: 0.5, limit_s: 60.0 };
