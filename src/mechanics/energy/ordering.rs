//! Elimination order: nested dissection by planes.
//!
//! A direct factorisation of the matrix of a surface costs O(n^1.5) if the unknowns are numbered so that both halves come
//! before their separator (George: "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10(2),
//! 1973). A garment has positions in space, so a plane through the median of one axis is a good cut; the axis with the smallest
//! separator is taken. A tube is cut along rings first, then along generators.
//!
//! A separator is bisected recursively, too, so that neighbours have close numbers: the updates from both sides then consist
//! of a few long runs.
//!
//! The halves run in parallel. Each half reads only the marks of its cuts.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use crate::mesh::{Csr, box_about};

/// Largest set that is not dissected, in vertices: a separator of fewer costs as much as it saves.
const MAX_LEAF: usize = 24;

/// Least number of vertices that are worth another thread. Heuristic.
const MIN_PARALLEL: usize = 1000;

/// The neighbours of each vertex.
#[derive(Debug, Clone, Default)]
pub(crate) struct Adjacency(Csr<u32>);

impl Adjacency {
    /// The adjacency of `count` vertices by these pairs, in any order, repeated or not; pairs of a vertex with itself are ignored.
    #[must_use]
    pub(crate) fn new<P: Iterator<Item = [u32; 2]>>(count: usize, pairs: impl Fn() -> P) -> Self {
        let both_ways = || pairs().filter(|[a, b]| a != b).flat_map(|[a, b]| [(a, b), (b, a)]);
        let mut all = Csr::gathered(count, both_ways);
        let mut kept = Csr::default();
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

/// The vertices of `members` in elimination order; `neighbours` share a block of the Hessian.
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
    /// Mark of the last cut that had each vertex in its upper half.
    side: &'a [AtomicU32],
}

impl Cut<'_> {
    /// Orders `members`; `number` identifies this cut.
    fn dissect(self, members: &mut [u32], number: u32) {
        if members.len() <= MAX_LEAF {
            return self.bisect(members);
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
        self.bisect(separator);
        let mut one = || self.dissect(below, 2 * number);
        if low < MIN_PARALLEL {
            one();
            self.dissect(above, 2 * number + 1);
        } else {
            rayon::join(one, || self.dissect(above, 2 * number + 1));
        }
    }

    /// Moves the lower half of `members` along an axis to the front and marks the upper half; returns the size of the separator: vertices of
    /// the lower half with a neighbour in the upper one.
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

    /// Moves the lowest `middle` members along an axis to the front. Ties (a ring at one height) are broken by index, so the cut is
    /// deterministic.
    fn select(self, members: &mut [u32], middle: usize, axis: usize) {
        let along = |v: u32| self.positions[v as usize][axis];
        members.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    }

    /// Orders by recursive bisection, each across the longest side.
    fn bisect(self, members: &mut [u32]) {
        if members.len() <= 2 {
            return members.sort_unstable();
        }
        let (low, high) = box_about(members.iter().map(|&v| self.positions[v as usize]));
        let middle = members.len() / 2;
        self.select(members, middle, (high - low).max_position());
        let (one, other) = members.split_at_mut(middle);
        self.bisect(one);
        self.bisect(other);
    }
}

/// The mark of a cut along an axis, unique among all cuts. The number doubles at each level and half of the vertices go on, so it stays small.
fn mark(number: u32, axis: usize) -> u32 {
    4 * number + axis as u32
}
