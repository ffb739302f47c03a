//! Seams: the garment edges between two PARTs, and the length of the line between them.
//!
//! The line between PARTs runs through the triangles that have corners in more than one: from midpoint to midpoint of the
//! two cut edges, which is half the third edge; where three PARTs meet in a triangle, from each midpoint to the centroid.

use crate::mesh::{Topology, TriMesh};

use super::{Parts, UNASSIGNED};

/// Where two PARTs meet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seam {
    /// The two PARTs, smaller number first.
    pub parts: [u32; 2],
    /// The garment edges that join them (indices into [`Topology::edges`]), ascending, never empty.
    pub edges: Vec<u32>,
}

/// The seams of a labelling, sorted by their pair of PARTs.
pub(super) fn find(topology: &Topology, part_of_vertex: &[u32]) -> Vec<Seam> {
    let mut crossing: Vec<([u32; 2], u32)> = Vec::new();
    for (e, &[a, b]) in topology.edges.iter().enumerate() {
        let (p, q) = (part_of_vertex[a as usize], part_of_vertex[b as usize]);
        if p != q && p != UNASSIGNED && q != UNASSIGNED {
            crossing.push(([p.min(q), p.max(q)], e as u32));
        }
    }
    crossing.sort_unstable();
    let group = |g: &[([u32; 2], u32)]| Seam { parts: g[0].0, edges: g.iter().map(|&(_, e)| e).collect() };
    crossing.chunk_by(|a, b| a.0 == b.0).map(group).collect()
}

impl Parts {
    /// Index of the seam between two PARTs.
    #[must_use]
    pub fn seam_between(&self, p: u32, q: u32) -> Option<usize> {
        self.seams.binary_search_by_key(&[p.min(q), p.max(q)], |s| s.parts).ok()
    }

    /// Length of each seam on the garment, m, in the order of [`Parts::seams`].
    #[must_use]
    pub fn seam_lengths_m(&self, mesh: &TriMesh) -> Vec<f64> {
        let mut lengths = vec![0.0; self.seams.len()];
        let mut add = |p: u32, q: u32, length: f64| {
            if let Some(seam) = self.seam_between(p, q) {
                lengths[seam] += length;
            }
        };
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let part = triangle.map(|v| self.part_of_vertex[v as usize]);
            if part[0] == part[1] && part[1] == part[2] {
                continue;
            }
            let corner = mesh.corners(t);
            let centroid = (corner[0] + corner[1] + corner[2]) / 3.0;
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                if part[i] == part[j] {
                    // Edges j–k and k–i are cut; the line between them is half of edge i–j.
                    add(part[k], part[i], 0.5 * corner[i].distance(corner[j]));
                } else if part[j] != part[k] && part[k] != part[i] {
                    add(part[i], part[j], centroid.distance(0.5 * (corner[i] + corner[j])));
                }
            }
        }
        lengths
    }
}
