//! Specimens and what they are laid on.

use glam::{DQuat, DVec3};
use partwise::body::distance::Body;
use partwise::garment::fabric::Fabric;
use partwise::mesh::TriMesh;

/// A rectangle of nu × nv cells in the plane of `u` and `v` (m), split in alternating diagonals.
pub(crate) fn rectangle(u: DVec3, v: DVec3, nu: usize, nv: usize) -> TriMesh {
    let at = |i: usize, j: usize| (j * (nu + 1) + i) as u32;
    let mut positions = Vec::new();
    for j in 0..=nv {
        for i in 0..=nu {
            positions.push(u * (i as f64 / nu as f64) + v * (j as f64 / nv as f64));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..nv {
        for i in 0..nu {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::new(positions, triangles)
}

/// A block of the given size about the origin, its top face at z = 0, turned about y by `tilt` (radians).
pub(crate) fn block(size: DVec3, tilt: f64) -> Body {
    let turn = DQuat::from_rotation_y(tilt);
    let corner =
        |i: usize| turn * (DVec3::new((i & 1) as f64 - 0.5, (i >> 1 & 1) as f64 - 0.5, (i >> 2) as f64 - 1.0) * size);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Body::new(&TriMesh::new((0..8).map(corner).collect(), triangles)).unwrap()
}

/// A table 40 cm deep, its top at z = 0, its edges at x = ±`half` rounded with `radius`: a cloth of 1 cm cells on a sharp
/// edge would catch on its own corners.
pub(crate) fn table(half: f64, radius: f64) -> Body {
    let arc = |k: usize| {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / 24.0).sin_cos();
        DVec3::new(half - radius + radius * sin, 0.0, radius * (cos - 1.0))
    };
    let right: Vec<DVec3> = (0..=24).map(arc).collect();
    let left = right.iter().rev().map(|p| DVec3::new(-p.x, p.y, p.z));
    let profile: Vec<DVec3> = right.iter().copied().chain(left).collect();
    let n = profile.len() as u32;
    let mut positions: Vec<DVec3> = Vec::new();
    for y in [-0.2, 0.2] {
        positions.extend(profile.iter().map(|p| *p + DVec3::Y * y));
    }
    positions.extend([DVec3::new(0.0, -0.2, -radius), DVec3::new(0.0, 0.2, -radius)]);
    let mut triangles = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        triangles.extend([[i, n + j, n + i], [i, j, n + j], [2 * n, j, i], [2 * n + 1, n + i, n + j]]);
    }
    Body::new(&TriMesh::new(positions, triangles)).unwrap()
}

/// A sphere about the origin.
pub(crate) fn sphere(radius: f64) -> Body {
    let (nt, np) = (32, 16);
    let mut positions = vec![DVec3::Z * radius];
    for j in 1..np {
        let (sin, z) = (std::f64::consts::PI * j as f64 / np as f64).sin_cos();
        for i in 0..nt {
            let (y, x) = (std::f64::consts::TAU * i as f64 / nt as f64).sin_cos();
            positions.push(DVec3::new(sin * x, sin * y, z) * radius);
        }
    }
    positions.push(-DVec3::Z * radius);
    let at = |i: usize, j: usize| (1 + (j - 1) * nt + i % nt) as u32;
    let last = positions.len() as u32 - 1;
    let mut triangles = Vec::new();
    for i in 0..nt {
        triangles.push([0, at(i, 1), at(i + 1, 1)]);
        triangles.push([last, at(i + 1, np - 1), at(i, np - 1)]);
        for j in 1..np - 1 {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Body::new(&TriMesh::new(positions, triangles)).unwrap()
}

/// An isotropic fabric.
pub(crate) fn fabric(density: f64, stretch: f64, poisson: f64, bending: f64, friction: f64) -> Fabric {
    Fabric {
        name: "test".into(),
        source: "chosen for a closed form".into(),
        density_kg_per_m2: density,
        thickness_m: 1e-3,
        stretch_weft_n_per_m: stretch,
        stretch_warp_n_per_m: stretch,
        shear_n_per_m: stretch / (2.0 * (1.0 + poisson)),
        poisson,
        bending_nm: [bending; 3],
        bending_friction_n: [0.0; 2],
        friction,
    }
}
