//! The coarse cloth's nodes and triangles: one node a PART, a triangle where three PARTs meet.
//!
//! A garment triangle whose corners lie in three PARTs becomes a triangle of the coarse cloth; one with two corners in the
//! same PART collapses. On a manifold garment cut into pieces without holes this is the contraction of its pieces, so the
//! coarse cloth has the garment's openings and no others. A PART's node is one of its own vertices, not its
//! centroid: a centroid lies off a curved cloth and short of its edge, and would lose the outer half of every hem.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | node of p | the vertex of PART p nearest its centroid, held before free, edge before inner | – |
//! | junction | the garment triangle a coarse triangle comes from | – |
//!
//! Limits: a PART that meets fewer than two others in a triangle (a whole ring, what of a strip one PART wide `bridges.rs`
//! could not cut) is in no coarse triangle. Such a node is *loose*: it has no stiffness, so it takes the mean displacement of
//! its neighbours.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::mesh::{Topology, TriMesh};
use crate::parts::{Parts, UNASSIGNED};

/// The PARTs as a coarse triangle mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseMesh {
    /// The garment vertex that stands for each PART.
    pub node_vertex: Vec<u32>,
    /// PART numbers of each coarse triangle, wound as the garment.
    pub triangles: Vec<[u32; 3]>,
    /// The garment triangle each comes from.
    pub junctions: Vec<u32>,
    /// Nodes in no triangle.
    pub loose: Vec<u32>,
}

impl CoarseMesh {
    /// Contracts each PART to its node; O(n log n).
    #[must_use]
    pub fn new(mesh: &TriMesh, topology: &Topology, parts: &Parts, held: &[bool]) -> Self {
        let edge = topology.boundary_vertices();
        let node_vertex = parts.map(|_, part| {
            let count = part.vertices.len() as f64;
            let centroid = part.vertices.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / count;
            // Held before edge before inner; of those the nearest to the centroid; of equals the first.
            let rank = |v: u32| if held[v as usize] { 0 } else { 2 - u8::from(edge[v as usize]) };
            let key = |v: u32| (rank(v), mesh.positions[v as usize].distance_squared(centroid));
            let better = |best: u32, v: u32| if key(v) < key(best) { v } else { best };
            part.vertices.iter().copied().fold(part.vertices[0], better)
        });
        let mut triangles = Vec::new();
        let mut junctions = Vec::new();
        let mut seen = BTreeSet::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [p, q, r] = triangle.map(|v| parts.part_of_vertex[v as usize]);
            if p == q || q == r || r == p || [p, q, r].contains(&UNASSIGNED) {
                continue;
            }
            let mut key = [p, q, r];
            key.sort_unstable();
            // Three PARTs can meet twice, around a hole in the cloth: their triangle must not count its stiffness twice.
            if seen.insert(key) {
                triangles.push([p, q, r]);
                junctions.push(t as u32);
            }
        }
        let mut used = vec![false; parts.len()];
        for &p in triangles.iter().flatten() {
            used[p as usize] = true;
        }
        let loose = (0..parts.len() as u32).filter(|&p| !used[p as usize]).collect();
        Self { node_vertex, triangles, junctions, loose }
    }

    /// The nodes at the positions their vertices have in `x`.
    #[must_use]
    pub fn nodes_of(&self, x: &[DVec3]) -> Vec<DVec3> {
        self.node_vertex.iter().map(|&v| x[v as usize]).collect()
    }
}
