//! Where the Hessian's 3×3 blocks are: a symmetric sparse pattern over the free vertices, built once a garment.
//!
//! Two free vertices share a block if a triangle or a bending element holds both. Unknowns are numbered in the order of
//! elimination ([`ordering`](super::ordering)), columns ascending, lower half only: block (i, j) with i ≥ j.

use glam::{DMat3, DVec3};

use super::ordering::Adjacency;
use crate::mesh::each_once;

/// Marks a vertex that is held, and a block that falls away with it.
pub(crate) const HELD: u32 = u32::MAX;

/// The lower half of a symmetric block pattern, by columns.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pattern {
    /// First block of each column, and one past the last: unknowns + 1.
    pub starts: Vec<u32>,
    /// Row of each block; the first of a column is its diagonal.
    pub rows: Vec<u32>,
}

/// A block and whether it is met transposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Index of the block, [`HELD`] for none.
    pub block: u32,
    /// Whether the pair comes as (column, row).
    pub transposed: bool,
}

impl Pattern {
    /// From pairs (row, column) of unknowns, in any order, repeated or not; every diagonal block is there.
    #[must_use]
    pub(crate) fn new(unknowns: usize, pairs: impl Iterator<Item = (u32, u32)>) -> Self {
        let own = (0..unknowns as u32).map(|i| (i, i));
        let all = each_once(pairs.map(|(i, j)| (i.min(j), i.max(j))).chain(own));
        let mut pattern = Self { starts: vec![0], rows: Vec::with_capacity(all.len()) };
        // Every column has its diagonal at least.
        for column in all.chunk_by(|a, b| a.0 == b.0) {
            pattern.rows.extend(column.iter().map(|(_, row)| row));
            pattern.starts.push(pattern.rows.len() as u32);
        }
        pattern
    }

    /// Of neighbours, with the vertex of each unknown in `order` and the unknown of each vertex.
    #[must_use]
    pub(crate) fn of(order: &[u32], unknown: &[u32], neighbours: &Adjacency) -> Self {
        let mut pattern = Self { starts: vec![0], rows: Vec::new() };
        for (j, &v) in (0u32..).zip(order) {
            let start = pattern.rows.len();
            pattern.rows.push(j);
            let others = neighbours.of(v).iter().map(|&w| unknown[w as usize]);
            pattern.rows.extend(others.filter(|&i| i != HELD && i > j));
            pattern.rows[start..].sort_unstable();
            pattern.starts.push(pattern.rows.len() as u32);
        }
        pattern
    }

    /// Number of unknown vertices.
    #[must_use]
    pub(crate) fn unknowns(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Blocks of a column.
    #[must_use]
    pub(crate) fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.starts[j] as usize..self.starts[j + 1] as usize
    }

    /// A d for a matrix in `blocks` of this pattern.
    pub(crate) fn multiply(&self, blocks: &[DMat3], d: &[DVec3], out: &mut Vec<DVec3>) {
        out.clear();
        out.resize(d.len(), DVec3::ZERO);
        for (j, &dj) in d.iter().enumerate() {
            let range = self.column(j);
            let column = blocks[range.clone()].iter().zip(&self.rows[range]);
            let mut sum = DVec3::ZERO;
            for (k, (block, &row)) in column.enumerate() {
                let i = row as usize;
                sum += block.transpose() * d[i];
                if k > 0 {
                    out[i] += *block * dj;
                }
            }
            out[j] += sum;
        }
    }

    /// The block of a pair of unknowns.
    #[must_use]
    pub(crate) fn slot(&self, i: u32, j: u32) -> Slot {
        if i == HELD || j == HELD {
            return Slot { block: HELD, transposed: false };
        }
        let range = self.column(i.min(j) as usize);
        let found = self.rows[range.clone()].binary_search(&i.max(j));
        let block = found.map_or(HELD, |k| (range.start + k) as u32);
        Slot { block, transposed: i < j }
    }
}
