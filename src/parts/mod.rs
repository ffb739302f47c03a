//! Stage one: PARTs, the connected pieces of garment at one level of distance (equation 1).
//!
//! A vertex i with unsigned distance d_i belongs to level k of the range table where V_L ≤ d_i < V_H; a PART is a maximal
//! set of vertices of one level joined by garment edges. PARTs are numbered by level, then by smallest vertex index, so
//! that a table gives the same numbers on any machine. Two PARTs are adjacent where a garment edge joins them; the edges that
//! do are their seam.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d_i | distance of vertex i from the body, unsigned | m |
//! | S_k | vertices of PART k | – |
//!
//! Source: Luo, Jiang, Cong, section 2.1. Limits: connectivity is by garment edges alone, so two layers that touch without
//! sharing vertices stay apart; a table that meets distance noise yields many single-vertex PARTs, which are counted.

mod extent;
mod grain;
mod join;
pub mod range_table;
mod seams;
mod seeding;

pub use grain::Grain;
pub(crate) use grain::Ruler;
pub use seams::Seam;
pub(crate) use seeding::spread_seeds;

use rayon::prelude::*;

use crate::mesh::{Topology, pieces};
use crate::parts::range_table::RangeTable;

/// The PART number of a vertex outside every level.
pub const UNASSIGNED: u32 = u32::MAX;

/// One PART.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its level: index into the table's effective levels, from 0.
    pub level: u32,
    /// Its vertices S_k, ascending, never empty.
    pub vertices: Vec<u32>,
}

/// A garment cut into PARTs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// PART of each vertex, or [`UNASSIGNED`].
    pub part_of_vertex: Vec<u32>,
    /// The PARTs, by level, then by smallest vertex.
    pub parts: Vec<Part>,
    /// Where PARTs meet, by PART numbers.
    pub seams: Vec<Seam>,
    /// Vertices outside every level of the table.
    pub unassigned: usize,
    /// Vertices whose distance lies in a hole of the table as printed.
    pub hole_vertices: usize,
    /// PARTs of a single vertex.
    pub singletons: usize,
    /// Number of PARTs at each level, empty levels included.
    pub parts_per_level: Vec<usize>,
    /// Levels whose extent the range table itself says: [`Parts::cut_to_table`] cuts them, [`Parts::cut_to_extent`] does not.
    pub own_extent: Vec<bool>,
}

/// Cuts a garment by its vertices' distances to the body (m; a negative one, inside the body, counts by its magnitude).
/// O(n log n) in the number of edges.
#[must_use]
pub fn segment(topology: &Topology, distances_m: &[f64], table: &RangeTable) -> Parts {
    let unsigned: Vec<f64> = distances_m.iter().map(|d| d.abs()).collect();
    let assigned = table.assign(&unsigned);
    let label: Vec<u32> = assigned.level_of_vertex.iter().map(|l| l.map_or(UNASSIGNED, |l| l as u32)).collect();
    let own_extent = table.effective_levels().iter().map(|l| l.extent.is_some()).collect();
    Parts::from_labels(topology, &label, |label| label, own_extent, assigned.hole_vertices)
}

impl Parts {
    /// Number of PARTs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether there is no PART at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// PARTs as the connected pieces of equal label; `level_of` gives the level of a label.
    pub(crate) fn from_labels(
        topology: &Topology,
        label: &[u32],
        level_of: impl Fn(u32) -> u32,
        own_extent: Vec<bool>,
        hole_vertices: usize,
    ) -> Self {
        let n = label.len();
        let alike = |v: usize, w: usize| label[v] == label[w];
        let mut found = pieces(n, |v| topology.neighbours(v as u32), alike);
        found.retain(|piece| label[piece[0] as usize] != UNASSIGNED);
        let part = |mut vertices: Vec<u32>| {
            vertices.sort_unstable();
            Part { level: level_of(label[vertices[0] as usize]), vertices }
        };
        let mut parts: Vec<Part> = found.into_iter().map(part).collect();
        // Pieces are found by smallest vertex; the stable sort keeps that order within a level.
        parts.sort_by_key(|p| p.level);
        let mut part_of_vertex = vec![UNASSIGNED; n];
        for (p, part) in (0..).zip(&parts) {
            part.vertices.iter().for_each(|&v| part_of_vertex[v as usize] = p);
        }
        let mut parts_per_level = vec![0; own_extent.len()];
        for part in &parts {
            if let Some(count) = parts_per_level.get_mut(part.level as usize) {
                *count += 1;
            }
        }
        Self {
            seams: seams::find(topology, &part_of_vertex),
            unassigned: part_of_vertex.iter().filter(|&&p| p == UNASSIGNED).count(),
            hole_vertices,
            singletons: parts.iter().filter(|p| p.vertices.len() == 1).count(),
            parts_per_level,
            own_extent,
            part_of_vertex,
            parts,
        }
    }

    /// One value per PART from its number and itself, in parallel, in order.
    pub(crate) fn map<T: Send>(&self, f: impl Fn(usize, &Part) -> T + Sync) -> Vec<T> {
        self.parts.par_iter().with_min_len(16).enumerate().map(|(i, p)| f(i, p)).collect()
    }
}
