//! The specimen: a circle meshed in rings of nearly equilateral triangles, without the part on the disc.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;

use super::standards::DrapeTest;
use crate::base::math;
use crate::mesh::TriMesh;

/// The flat specimen.
#[derive(Debug, Clone)]
pub(crate) struct Specimen {
    /// Its mesh, at z = 0.
    pub mesh: TriMesh,
    /// The vertices on the disc.
    pub held: Vec<u32>,
}

/// The specimen of a test.
///
/// The last held ring lies half a cell outside the disc's edge. A ring of vertices bends over half a cell to either side, so the
/// discrete cloth is clamped at the disc's edge.
pub(crate) fn specimen(test: &DrapeTest) -> Specimen {
    let rows = test.rows;
    let cell = (test.specimen_m - test.disc_m) / (rows as f64 + 0.5);
    let mut mesh = TriMesh::default();
    let mut rings: Vec<Range<usize>> = Vec::new();
    for k in 0..rows + 2 {
        let radius = test.specimen_m - cell * (rows + 1 - k) as f64;
        // Equilateral triangles are 2/√3 of their height wide.
        let count = (TAU * radius / (cell * 2.0 / 3f64.sqrt())).round().max(6.0) as usize;
        let start = mesh.positions.len();
        let offset = 0.5 * (k % 2) as f64;
        mesh.positions.extend((0..count).map(|i| {
            let (sin, cos) = math::sin_cos(TAU * (i as f64 + offset) / count as f64);
            DVec3::new(radius * cos, radius * sin, 0.0)
        }));
        if let Some(inner) = rings.last() {
            triangulate(inner.clone(), start..start + count, [0.5 * ((k + 1) % 2) as f64, offset], &mut mesh.triangles);
        }
        rings.push(start..start + count);
    }
    Specimen { mesh, held: (0..rings[1].end as u32).collect() }
}

/// Triangles between two rings, counter-clockwise from above; each step advances the ring that lags behind.
fn triangulate(inner: Range<usize>, outer: Range<usize>, offsets: [f64; 2], triangles: &mut Vec<[u32; 3]>) {
    let (n, m) = (inner.len(), outer.len());
    let (mut i, mut j) = (0, 0);
    while i < n || j < m {
        let a = (inner.start + i % n) as u32;
        let b = (outer.start + j % m) as u32;
        let next = |k: usize, offset: f64, count: usize| (k as f64 + 1.0 + offset) / count as f64;
        if i == n || (j < m && next(j, offsets[1], m) <= next(i, offsets[0], n)) {
            j += 1;
            triangles.push([a, b, (outer.start + j % m) as u32]);
        } else {
            i += 1;
            triangles.push([a, b, (inner.start + i % n) as u32]);
        }
    }
}

/// Start positions: waves of two to nine nodes with an amplitude of half a millimetre each at the rim, because a flat cloth is an unstable
/// equilibrium. Phases differ by golden angles, so that no number of nodes is favoured, and differ from start to start. The waves turn
/// with the weft, so that the mesh alone distinguishes turned tests.
pub(super) fn waved(flat: &Specimen, test: &DrapeTest) -> Vec<DVec3> {
    let golden = TAU * (1.0 - 1.0 / 1.618_033_988_749_895);
    let wave = |p: &DVec3| {
        let r = (p.truncate().length() - test.disc_m).max(0.0) / (test.specimen_m - test.disc_m);
        let theta = math::atan2(p.y, p.x) - test.turned;
        let sum: f64 = (2..10)
            .map(|n| {
                let phase = golden * f64::from(n + 8 * test.start);
                math::cos(f64::from(n) * (theta + phase))
            })
            .sum();
        *p + DVec3::Z * (5e-4 * r * r * sum)
    };
    let (held, free) = flat.mesh.positions.split_at(flat.held.len());
    held.iter().copied().chain(free.iter().map(wave)).collect()
}
