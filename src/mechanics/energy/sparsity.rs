//! The unknowns of a cloth in elimination order, and the sparse symmetric pattern of its Hessian in 3×3 blocks.
//!
//! Two free vertices share a block if a triangle or a bending element contains both. Unknowns are numbered in elimination order
//! (`ordering`). A pattern stores the lower half by columns, rows ascending: block (i, j) with i ≥ j.

use glam::{DMat3, DVec3};

use super::bending::Bending;
use super::membrane::Triangle;
use super::ordering::{Adjacency, nested_dissection};

/// Marks a held vertex, and a block that does not exist because of one.
pub(crate) const HELD: u32 = u32::MAX;

/// The lower half of a symmetric block pattern, by columns.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pattern {
    /// First block of each column, and one past the last: unknowns + 1.
    pub starts: Vec<u32>,
    /// Row of each block; the first of a column is its diagonal.
    pub rows: Vec<u32>,
}

/// A block, and whether the pair of unknowns addresses its transpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Index of the block; [`HELD`] for none.
    pub block: u32,
    /// Whether the pair is (column, row).
    pub transposed: bool,
}

impl Pattern {
    /// The pattern of neighbouring vertices; `order` has the vertex of each unknown, `unknown` the unknown of each vertex.
    #[must_use]
    fn of_neighbours(order: &[u32], unknown: &[u32], neighbours: &Adjacency) -> Self {
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

    /// Range of the blocks of a column.
    #[must_use]
    pub(crate) fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.starts[j] as usize..self.starts[j + 1] as usize
    }

    /// A d for a matrix A in the `blocks` of this pattern.
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

/// Elimination order, block pattern and element slots of one cloth. Computed at the first use, since a preview by PARTs factors no
/// Hessian of the whole cloth.
#[derive(Debug, Clone)]
pub struct HessianLayout {
    /// Vertex of each unknown, in elimination order.
    pub order: Vec<u32>,
    /// Unknown of each vertex; `HELD` where it is held.
    pub unknown: Vec<u32>,
    /// The blocks of the Hessian.
    pub pattern: Pattern,
    /// The blocks of each triangle: (0,0), (1,1), (2,2), (1,0), (2,0), (2,1).
    pub(super) triangle_slots: Vec<[Slot; 6]>,
    /// Bending's contribution to the diagonal of each block, N/m.
    pub(super) bending_blocks: Vec<f64>,
}

impl HessianLayout {
    /// The layout of the vertices that are not `held`, with blocks for the `extra` pairs beside those of the elements. Nested dissection takes
    /// the vertices at `placed`.
    pub(super) fn new(
        placed: &[DVec3],
        triangles: &[Triangle],
        bending: &Bending,
        held: &[bool],
        extra: impl Iterator<Item = [u32; 2]>,
    ) -> Self {
        let n = held.len();
        let sides = || {
            triangles.iter().flat_map(|t| {
                let [a, b, c] = t.vertices;
                [[a, b], [b, c], [c, a]]
            })
        };
        let extra: Vec<[u32; 2]> = extra.collect();
        let all_pairs = || sides().chain(bending.matrix.pairs().map(|(pair, _)| pair)).chain(extra.iter().copied());
        let neighbours = Adjacency::new(n, all_pairs);
        let free: Vec<u32> = (0..n as u32).filter(|&v| !held[v as usize]).collect();
        let order = nested_dissection(free, placed, &neighbours);
        let mut unknown = vec![HELD; n];
        for (i, &v) in order.iter().enumerate() {
            unknown[v as usize] = i as u32;
        }
        let pattern = Pattern::of_neighbours(&order, &unknown, &neighbours);
        let slot = |a: u32, b: u32| pattern.slot(unknown[a as usize], unknown[b as usize]);
        let slots = |t: &Triangle| {
            let [a, b, c] = t.vertices;
            [slot(a, a), slot(b, b), slot(c, c), slot(b, a), slot(c, a), slot(c, b)]
        };
        let triangle_slots = triangles.iter().map(slots).collect();
        let mut bending_blocks = vec![0.0; pattern.rows.len()];
        let diagonal = order.iter().map(|&v| ([v, v], bending.matrix.diagonal(v as usize)));
        for ([a, b], scalar) in bending.matrix.pairs().chain(diagonal) {
            if let Some(sum) = bending_blocks.get_mut(slot(a, b).block as usize) {
                *sum += scalar;
            }
        }
        Self { order, unknown, pattern, triangle_slots, bending_blocks }
    }

    /// Unknowns and shares of those `members` (vertices with shares) that are free.
    pub(crate) fn free(&self, members: impl Iterator<Item = (u32, f64)>) -> Vec<(u32, f64)> {
        members.map(|(v, w)| (self.unknown[v as usize], w)).filter(|(i, _)| *i != HELD).collect()
    }

    /// Values of all `vertices` from those of the unknowns; zero where held.
    pub(crate) fn scatter(&self, unknowns: &[DVec3], vertices: usize) -> Vec<DVec3> {
        let mut all = vec![DVec3::ZERO; vertices];
        self.order.iter().zip(unknowns).for_each(|(&v, d)| all[v as usize] = *d);
        all
    }

    /// Adds a symmetric `block` (N/m) between unknowns with these shares; pairs without a block in the pattern are skipped.
    pub(crate) fn add(&self, members: &[(u32, f64)], block: DMat3, blocks: &mut [DMat3]) {
        for (k, &(i, w)) in members.iter().enumerate() {
            for &(j, other) in &members[..=k] {
                if let Some(sum) = blocks.get_mut(self.pattern.slot(i, j).block as usize) {
                    *sum += block * (w * other);
                }
            }
        }
    }

    /// Adds the symmetric matrix whose block (N/m) between members i and j of `vertices` is `block(i, j)`.
    pub(crate) fn add_element(&self, vertices: &[u32], block: impl Fn(usize, usize) -> DMat3, blocks: &mut [DMat3]) {
        for (i, &v) in vertices.iter().enumerate() {
            for (j, &w) in vertices[..=i].iter().enumerate() {
                let slot = self.pattern.slot(self.unknown[v as usize], self.unknown[w as usize]);
                if let Some(sum) = blocks.get_mut(slot.block as usize) {
                    *sum += if slot.transposed { block(i, j).transpose() } else { block(i, j) };
                }
            }
        }
    }

    /// Whether the pattern has a block for each of these pairs of vertices; pairs with a held vertex need none.
    pub(crate) fn has(&self, mut pairs: impl Iterator<Item = [u32; 2]>) -> bool {
        pairs.all(|[a, b]| {
            let (i, j) = (self.unknown[a as usize], self.unknown[b as usize]);
            i == HELD || j == HELD || self.pattern.slot(i, j).block != HELD
        })
    }
}
