//! Order of elimination: nested dissection by planes.
//!
//! A direct factorisation of a surface's matrix costs O(n^1.5) where the unknowns are numbered so that each half comes
//! before what separates it (George: "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10(2),
//! 1973). A garment is placed in space, so a plane through the median is a good cut: of the three axes the one whose
//! separator is smallest. For a tube that is first a ring, then its generators.
//!
//! A separator is numbered in halves of halves too, so that what is near is numbered near: what the two sides add to it then comes
//! in a few long runs.
//!
//! The halves go to the threads there are; neither reads what the other writes but for marks that cannot be its own.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use crate::mesh::{Lists, box_about};

/// This many vertices are cut no further: below it a separator costs as much as it saves.
const LEAF: usize = 24;

/// Fewer are no work for another thread.
const ALONE: usize = 1000;

/// Neighbours of each vertex, one list after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Adjacency(Lists<u32>);

impl Adjacency {
    /// Of `count` vertices, from pairs, in any order, repeated or not; a vertex is no neighbour of itself.
    #[must_use]
    pub(crate) fn new<P: Iterator<Item = [u32; 2]>>(count: usize, pairs: impl Fn() -> P) -> Self {
        let both_ways = || pairs().filter(|[a, b]| a != b).flat_map(|[a, b]| [(a, b), (b, a)]);
        let mut all = Lists::gathered(count, both_ways);
        let mut kept = Lists::default();
        for v in 0..count {
            let list = all.of_mut(v);
            list.sort_unstable();
            kept.push(list.chunk_by(|a, b| a == b).map(|same| same[0]));
        }
        Self(kept)
    }

    /// Neighbours of a vertex, ascending.
    #[must_use]
    pub(crate) fn of(&self, v: u32) -> &[u32] {
        self.0.of(v as usize)
    }
}

/// The vertices of `members` in elimination order. Neighbours are those that share a Hessian block.
#[must_use]
pub(crate) fn nested_dissection(mut members: Vec<u32>, positions: &[DVec3], neighbours: &Adjacency) -> Vec<u32> {
    let side: Vec<AtomicU32> = positions.iter().map(|_| AtomicU32::new(0)).collect();
    let cut = Cut { positions, neighbours, side: &side };
    cut.dissect(&mut members, 1);
    members
}

#[derive(Clone, Copy)]
struct Cut<'a> {
    positions: &'a [DVec3],
    neighbours: &'a Adjacency,
    /// The last cut that had each vertex in its upper half.
    side: &'a [AtomicU32],
}

impl Cut<'_> {
    /// Puts `members` in order; `number` is this cut's own.
    fn dissect(self, members: &mut [u32], number: u32) {
        if members.len() <= LEAF {
            return self.lay_along(members);
        }
        let mut best = (usize::MAX, 0);
        for axis in 0..3 {
            best = best.min((self.halve(members, axis, number), axis));
        }
        self.halve(members, best.1, number);
        // The separator last: low, high, separator.
        let mark = mark(number, best.1);
        let middle = members.len() / 2;
        let mut low = 0;
        for i in 0..middle {
            if !self.touches(members[i], mark) {
                members.swap(low, i);
                low += 1;
            }
        }
        members[low..].rotate_left(middle - low);
        let (below, rest) = members.split_at_mut(low);
        let (above, separator) = rest.split_at_mut(rest.len() - (middle - low));
        self.lay_along(separator);
        let mut one = || self.dissect(below, 2 * number);
        if low < ALONE {
            one();
            self.dissect(above, 2 * number + 1);
        } else {
            rayon::join(one, || self.dissect(above, 2 * number + 1));
        }
    }

    /// The lower half of `members` along an axis first, the upper half marked; returns how many of the lower one touch it.
    fn halve(self, members: &mut [u32], axis: usize, number: u32) -> usize {
        let middle = members.len() / 2;
        self.select(members, middle, axis);
        let mark = mark(number, axis);
        for &v in &members[middle..] {
            self.side[v as usize].store(mark, Ordering::Relaxed);
        }
        members[..middle].iter().filter(|&&v| self.touches(v, mark)).count()
    }

    fn touches(self, v: u32, mark: u32) -> bool {
        self.neighbours.of(v).iter().any(|&w| self.side[w as usize].load(Ordering::Relaxed) == mark)
    }

    /// Those before `middle` along an axis first. Ties (a ring at one height) fall by index, so the cut is the same on every run.
    fn select(self, members: &mut [u32], middle: usize, axis: usize) {
        let along = |v: u32| self.positions[v as usize][axis];
        members.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    }

    /// In halves of halves, each across its longest side.
    fn lay_along(self, members: &mut [u32]) {
        if members.len() <= 2 {
            return members.sort_unstable();
        }
        let (low, high) = box_about(members.iter().map(|&v| self.positions[v as usize]));
        let middle = members.len() / 2;
        self.select(members, middle, (high - low).max_position());
        let (one, other) = members.split_at_mut(middle);
        self.lay_along(one);
        self.lay_along(other);
    }
}

/// No two cuts along no two axes have one mark: half of the vertices at most go on, so numbers stay small.
fn mark(number: u32, axis: usize) -> u32 {
    4 * number + axis as u32
}
