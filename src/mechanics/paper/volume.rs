//! ΔV of equations (2) and (7): the volume that a garment vertex stands for, m³, under either [`Volume`] reading.

use glam::DVec3;

use super::Volume;
use crate::mesh::{Topology, TriMesh};

/// ΔV of every vertex, m³; `areas` are the barycentric vertex areas in m².
pub(super) fn volumes(
    garment: &TriMesh,
    topology: &Topology,
    areas: &[f64],
    thickness_m: &[f64],
    reading: Volume,
) -> Vec<f64> {
    match reading {
        Volume::AreaTimesThickness => areas.iter().zip(thickness_m).map(|(a, t)| a * t).collect(),
        Volume::Cuboid => (0..garment.vertex_count() as u32).map(|v| cuboid(garment, topology, v)).collect(),
    }
}

/// Mean |Δx| times mean |Δy| times mean |Δz| to the neighbours; zero for a vertex without any.
fn cuboid(garment: &TriMesh, topology: &Topology, v: u32) -> f64 {
    let neighbours = topology.neighbours(v);
    let x = garment.positions[v as usize];
    let sum: DVec3 = neighbours.iter().map(|&w| (garment.positions[w as usize] - x).abs()).sum();
    let mean = sum / neighbours.len().max(1) as f64;
    mean.x * mean.y * mean.z
}
