//! Elimination order: nested dissection.
//!
//! A direct factorisation of the matrix of a surface costs O(n^1.5) if the unknowns are numbered so that both halves come
//! before their separator (George: "Nested dissection of a regular finite element mesh", SIAM J. Numer. Anal. 10(2),
//! 1973). A garment has positions in space, so a plane through the median along some direction is a good cut; of a few directions that with the
//! smallest separator is taken. The separator of folded cloth, whose folds a plane crosses and whose contacts couple them, is then improved
//! ([`separator`](super::separator)).
//!
//! A separator is bisected recursively, too, so that neighbours have close numbers: the updates from both sides then consist
//! of a few long runs.
//!
//! The halves run in parallel. The number of a vertex names it in its own set alone, so what another half writes meanwhile has no effect.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::DVec3;

use super::separator::{Side, refine};
use crate::mesh::{Csr, box_about};

/// Largest set that is not dissected, in vertices: a separator of fewer costs as much as it saves.
const MAX_LEAF: usize = 24;

/// Least set whose separator is improved, and least half that goes to another thread, in vertices; the second is a heuristic. Operations of a
/// factor of a folded skirt of 26,000 vertices cut across three directions, and time of its order on one thread: without a bound on the first
/// 24.1 Gflop and 173 ms, with 100 24.1 and 106, with 500 25.1 and 74, never 33.4 and 38.
const MIN_REFINED: usize = 100;

/// Directions across which sets are cut. The horizontal diagonals take a tenth off the operations of a skirt before it is draped; four more and
/// steeper ones under a percent.
const DIRECTIONS: [DVec3; 5] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, -1.0, 0.0)];

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
    let numbers: Vec<AtomicU32> = positions.iter().map(|_| AtomicU32::new(0)).collect();
    Dissection { positions, neighbours, numbers: &numbers }.dissect(&mut members);
    members
}

#[derive(Clone, Copy)]
struct Dissection<'a> {
    positions: &'a [DVec3],
    neighbours: &'a Adjacency,
    /// Number of each vertex in the set that is cut.
    numbers: &'a [AtomicU32],
}

impl Dissection<'_> {
    /// Orders `members`.
    fn dissect(self, members: &mut [u32]) {
        if members.len() <= MAX_LEAF {
            return self.bisect(members);
        }
        for (number, &v) in (0u32..).zip(&*members) {
            self.numbers[v as usize].store(number, Ordering::Relaxed);
        }
        let cuts = DIRECTIONS.map(|direction| self.cut(members, direction));
        let size = |sides: &Vec<Side>| sides.iter().filter(|side| **side == Side::Separator).count();
        let Some(mut sides) = cuts.into_iter().min_by_key(size) else { return };
        if members.len() >= MIN_REFINED {
            refine(&mut sides, |number| self.neighbours_in(members, number));
        }
        let of = |wanted: Side| members.iter().zip(&sides).filter(move |(_, side)| **side == wanted).map(|(v, _)| *v);
        let [low, high] = [Side::Low, Side::High].map(|side| of(side).count());
        let ordered: Vec<u32> = [Side::Low, Side::High, Side::Separator].into_iter().flat_map(of).collect();
        members.copy_from_slice(&ordered);
        let (below, rest) = members.split_at_mut(low);
        let (above, separator) = rest.split_at_mut(high);
        self.bisect(separator);
        if low < MIN_REFINED {
            self.dissect(below);
            self.dissect(above);
        } else {
            rayon::join(|| self.dissect(below), || self.dissect(above));
        }
    }

    /// Numbers of the neighbours in the set of the member of this number.
    fn neighbours_in(self, members: &[u32], number: usize) -> impl Iterator<Item = usize> {
        let of = self.neighbours.of(members[number]).iter();
        of.filter_map(move |&w| {
            // Vertices of other sets have a number there.
            let number = self.numbers[w as usize].load(Ordering::Relaxed) as usize;
            (members.get(number) == Some(&w)).then_some(number)
        })
    }

    /// Cuts the set across `direction` at its median. The separator is what has neighbours beyond it, in the half where that is less.
    fn cut(self, members: &[u32], direction: DVec3) -> Vec<Side> {
        let along: Vec<f64> = members.iter().map(|&v| self.positions[v as usize].dot(direction)).collect();
        let mut numbers: Vec<usize> = (0..members.len()).collect();
        let middle = members.len() / 2;
        // Ties (a ring at one height) are broken by index, so the cut is deterministic.
        numbers
            .select_nth_unstable_by(middle, |&a, &b| along[a].total_cmp(&along[b]).then(members[a].cmp(&members[b])));
        let mut sides = vec![Side::Low; members.len()];
        numbers[middle..].iter().for_each(|&i| sides[i] = Side::High);
        let touching = |half: &[usize]| -> Vec<usize> {
            let touches = |&i: &usize| self.neighbours_in(members, i).any(|j| sides[j] != sides[i]);
            half.iter().copied().filter(touches).collect()
        };
        let [low, high] = [touching(&numbers[..middle]), touching(&numbers[middle..])];
        let separator = if low.len() <= high.len() { low } else { high };
        separator.into_iter().for_each(|i| sides[i] = Side::Separator);
        sides
    }

    /// Orders by recursive bisection, each across the longest side.
    fn bisect(self, members: &mut [u32]) {
        if members.len() <= 2 {
            return members.sort_unstable();
        }
        let (low, high) = box_about(members.iter().map(|&v| self.positions[v as usize]));
        let (middle, axis) = (members.len() / 2, (high - low).max_position());
        let along = |v: u32| self.positions[v as usize][axis];
        members.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        let (one, other) = members.split_at_mut(middle);
        self.bisect(one);
        self.bisect(other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::tube;

    /// Vertices that each column of the factor has below its diagonal, in this order of elimination.
    fn fill(order: &[u32], neighbours: &Adjacency) -> usize {
        let mut place = vec![usize::MAX; order.len()];
        order.iter().enumerate().for_each(|(i, &v)| place[v as usize] = i);
        let mut rows: Vec<std::collections::BTreeSet<usize>> =
            order.iter().map(|&v| neighbours.of(v).iter().map(|&w| place[w as usize]).collect()).collect();
        let mut sum = 0;
        for i in 0..rows.len() {
            let below: Vec<usize> = rows[i].range(i + 1..).copied().collect();
            sum += below.len();
            if let Some(&parent) = below.first() {
                rows[parent].extend(&below[1..]);
            }
        }
        sum
    }

    /// The fill of a tube of this radius (m) by the angle, ordered by nested dissection, and row by row.
    fn fill_of_tube(radius: impl Fn(f64) -> f64) -> [usize; 2] {
        let mesh = tube(120, 40, |a, j| DVec3::new(radius(a) * a.cos(), radius(a) * a.sin(), 0.02 * j));
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let neighbours = Adjacency::new(mesh.vertex_count(), sides);
        let members: Vec<u32> = (0..mesh.vertex_count() as u32).collect();
        let order = nested_dissection(members.clone(), &mesh.positions, &neighbours);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, members);
        [fill(&order, &neighbours), fill(&members, &neighbours)]
    }

    #[test]
    fn every_vertex_is_ordered_once_and_pleats_cost_little_fill() {
        let [plain, by_rows] = fill_of_tube(|_| 0.2);
        assert!(plain < by_rows / 4, "{plain} against {by_rows} row by row");
        // A plane along the axis crosses several of twelve pleats.
        let [pleated, _] = fill_of_tube(|a| 0.2 + 0.08 * (12.0 * a).cos());
        assert!(pleated < plain + plain / 5, "{pleated} with pleats, {plain} without");
    }
}
