//! A small cloth in general position: uneven, curved, stretched and sheared by known amounts.

use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mesh::{RestShape, Topology, TriMesh};
use glam::DVec3;

/// A pseudorandom number in [-1, 1], the same on every machine.
pub(crate) fn jitter(i: usize) -> f64 {
    let h = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let h = (h ^ (h >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let h = h ^ (h >> 32);
    ((h >> 11) as f64 / (1u64 << 53) as f64) * 2.0 - 1.0
}

pub(crate) fn jitters(i: usize) -> DVec3 {
    DVec3::new(jitter(3 * i + 1), jitter(3 * i + 2), jitter(3 * i + 3))
}

/// An upright 6 × 6 sheet of 5 cm with jittered vertices.
pub(crate) fn sheet() -> TriMesh {
    let n = 6;
    let mut positions = Vec::new();
    for j in 0..n {
        for i in 0..n {
            positions.push(
                DVec3::new(0.01 * i as f64, 0.0, 0.01 * j as f64) + jitters(j * n + i) * DVec3::new(1e-3, 0.0, 1e-3),
            );
        }
    }
    let at = |i: usize, j: usize| (j * n + i) as u32;
    let mut triangles = Vec::new();
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::new(positions, triangles)
}

/// Different constants in every direction, so that a swapped index is detected.
pub(crate) fn fabric() -> Fabric {
    Fabric {
        name: "test".into(),
        source: "made up: different in every direction".into(),
        density_kg_per_m2: 0.2,
        thickness_m: 1e-3,
        stretch_weft_n_per_m: 90.0,
        stretch_warp_n_per_m: 300.0,
        shear_n_per_m: 40.0,
        poisson: 0.25,
        bending_nm: [2e-5, 5e-5, 9e-5],
        bending_friction_n: [0.0; 2],
        friction: 0.3,
    }
}

pub(crate) fn cloth(mesh: &TriMesh, held: &[u32]) -> Cloth {
    cloth_of(mesh, &fabric(), held)
}

pub(crate) fn cloth_of(mesh: &TriMesh, fabric: &Fabric, held: &[u32]) -> Cloth {
    Cloth::new(mesh, &Topology::new(mesh), &RestShape::from_edges(mesh).unwrap(), fabric, held).unwrap()
}

/// The positions of the sheet stretched, sheared and bent: every triangle is in tension.
pub(crate) fn deformed(mesh: &TriMesh) -> Vec<DVec3> {
    let bend = |p: DVec3| DVec3::new(1.08 * p.x + 0.03 * p.z, 4.0 * p.x * p.x - 2.0 * p.z * p.x, 1.06 * p.z);
    mesh.positions.iter().enumerate().map(|(i, &p)| bend(p) + jitters(i + 100) * 1e-4).collect()
}
