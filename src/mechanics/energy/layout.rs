//! The unknowns of a cloth in their order of elimination, and where the Hessian's blocks are.
//!
//! Made when first asked for: a preview by PARTs factors nothing of it.

use glam::{DMat3, DVec3};

use super::bending::Bending;
use super::membrane::Triangle;
use super::ordering::{Adjacency, nested_dissection};
use super::sparsity::{HELD, Pattern, Slot};

/// Order, pattern and slots of one cloth.
#[derive(Debug, Clone)]
pub struct HessianLayout {
    /// Vertex of each unknown, in elimination order.
    pub order: Vec<u32>,
    /// Unknown of each vertex, [`HELD`] where it is held.
    pub unknown: Vec<u32>,
    /// Where the Hessian's blocks are.
    pub pattern: Pattern,
    /// The blocks of each triangle: its corners' own, then (1,0), (2,0), (2,1).
    pub(super) triangle_slots: Vec<[Slot; 6]>,
    /// What bending adds to each block's diagonal, N/m.
    pub(super) bending_blocks: Vec<f64>,
}

impl HessianLayout {
    /// Of the vertices that are not `held`, with blocks for the pairs `more` beside the cloth's own; `placed` is where they are cut
    /// apart for the elimination.
    pub(super) fn new(
        placed: &[DVec3],
        triangles: &[Triangle],
        bending: &Bending,
        held: &[bool],
        more: impl Iterator<Item = [u32; 2]>,
    ) -> Self {
        let n = held.len();
        let sides = || {
            triangles.iter().flat_map(|t| {
                let [a, b, c] = t.vertices;
                [[a, b], [b, c], [c, a]]
            })
        };
        let more: Vec<[u32; 2]> = more.collect();
        let of_all = || sides().chain(bending.plate.pairs().map(|(pair, _)| pair)).chain(more.iter().copied());
        let neighbours = Adjacency::new(n, of_all);
        let free: Vec<u32> = (0..n as u32).filter(|&v| !held[v as usize]).collect();
        let order = nested_dissection(free, placed, &neighbours);
        let mut unknown = vec![HELD; n];
        for (i, &v) in order.iter().enumerate() {
            unknown[v as usize] = i as u32;
        }
        let pattern = Pattern::of(&order, &unknown, &neighbours);
        let slot = |a: u32, b: u32| pattern.slot(unknown[a as usize], unknown[b as usize]);
        let slots = |t: &Triangle| {
            let [a, b, c] = t.vertices;
            [slot(a, a), slot(b, b), slot(c, c), slot(b, a), slot(c, a), slot(c, b)]
        };
        let triangle_slots = triangles.iter().map(slots).collect();
        let mut bending_blocks = vec![0.0; pattern.rows.len()];
        let own = order.iter().map(|&v| ([v, v], bending.plate.own(v as usize)));
        for ([a, b], scalar) in bending.plate.pairs().chain(own) {
            if let Some(sum) = bending_blocks.get_mut(slot(a, b).block as usize) {
                *sum += scalar;
            }
        }
        Self { order, unknown, pattern, triangle_slots, bending_blocks }
    }

    /// Unknowns and shares of those vertices that are not held.
    pub(crate) fn free(&self, members: impl Iterator<Item = (u32, f64)>) -> Vec<(u32, f64)> {
        members.map(|(v, w)| (self.unknown[v as usize], w)).filter(|(i, _)| *i != HELD).collect()
    }

    /// Adds a symmetric `block` (N/m) between unknowns with these shares; what has no block of its own is left out.
    pub(crate) fn add(&self, members: &[(u32, f64)], block: DMat3, blocks: &mut [DMat3]) {
        for (k, &(i, w)) in members.iter().enumerate() {
            for &(j, other) in &members[..=k] {
                if let Some(sum) = blocks.get_mut(self.pattern.slot(i, j).block as usize) {
                    *sum += block * (w * other);
                }
            }
        }
    }

    /// Whether there is a block for each of these pairs of vertices, where none is held.
    pub(crate) fn has(&self, mut pairs: impl Iterator<Item = [u32; 2]>) -> bool {
        pairs.all(|[a, b]| {
            let (i, j) = (self.unknown[a as usize], self.unknown[b as usize]);
            i == HELD || j == HELD || self.pattern.slot(i, j).block != HELD
        })
    }
}
