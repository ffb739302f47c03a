//! Which PARTs move each triangle, each bending ring and each vertex, and where their blocks of the reduced Hessian are.
//!
//! An element couples every pair of PARTs that have weight at one of its vertices: such pairs are numbered, and contributions of elements are
//! summed by pair. The pattern is built by PART: the column of an unknown holds the lower triangle of its PART's block, then the
//! blocks of neighbours that are eliminated later.

use crate::mechanics::energy::Cloth;
use crate::mechanics::energy::ordering::{Adjacency, nested_dissection};
use crate::mechanics::energy::sparsity::Pattern;
use crate::mesh::Csr;

use super::motions::Motions;
use super::weights::Weights;

/// Elements of this many for each PART are sampled for the Hessian: a PART has twelve unknowns, a triangle says three things. The
/// energy and its gradient take them all. Where a PART has more than [`MANY_ELEMENTS`], one in [`SAMPLING_INTERVAL`] of those as well: they cost little beside a gradient over all
/// elements, and twelve of 6,000 depend on chance. (No cure: a skirt of 62,500 vertices in 22 PARTs has crept for 40 steps with either.)
const SAMPLES_PER_PART: f64 = 12.0;
const MANY_ELEMENTS: f64 = 4000.0;
const SAMPLING_INTERVAL: f64 = 50.0;

/// The PARTs of those elements of one kind that the Hessian is summed over.
#[derive(Debug, Clone, Default)]
pub(super) struct Elements {
    /// Which of all they are, and how many each stands for.
    pub(super) sampled: Vec<(u32, f64)>,
    /// PARTs of each, ascending.
    pub(super) parts: Csr<u32>,
    /// Their weights at its vertices, PART after PART.
    pub(super) weights: Csr<f64>,
    /// The pairs of its PARTs.
    pub(super) pairs: Csr<Pair>,
}

/// Two PARTs of an element, by their places in its list: rows of the later, columns of the earlier.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) row: u8,
    pub(super) column: u8,
    /// Its number in [`Layout::places`].
    pub(super) number: u32,
}

/// Where the blocks of a pair of PARTs are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) row: u32,
    pub(super) column: u32,
    /// Blocks between the column's own and the row's.
    pub(super) skip: u32,
}

impl Elements {
    /// Of all elements, whose PARTs are given, those that are sampled; `vertices` are an element's.
    fn sampled<'a>(weights: &Weights, count: usize, parts: &Csr<u32>, vertices: impl Fn(usize) -> &'a [u32]) -> Self {
        let mut e = Self { sampled: sample(count, parts, sampling_rate), ..Self::default() };
        let weight = |p: u32, v: u32| weights.of(v as usize).iter().find(|w| w.0 == p).map_or(0.0, |w| w.1);
        for &(i, _) in &e.sampled {
            let (own, vertices) = (parts.of(i as usize), vertices(i as usize));
            e.weights.push(own.iter().flat_map(|&p| vertices.iter().map(move |&v| weight(p, v))));
            e.parts.push(own.iter().copied());
        }
        e
    }

    /// The vertices, every one.
    fn vertices(weights: &Weights, count: usize) -> Self {
        let mut e = Self::default();
        for v in 0..count {
            e.sampled.push((v as u32, 1.0));
            e.parts.push(weights.of(v).iter().map(|w| w.0));
            e.weights.push(weights.of(v).iter().map(|w| w.1));
        }
        e
    }

    fn lay_out(&mut self, motions: &Motions, columns: &[Vec<(u32, u32)>]) {
        for i in 0..self.parts.len() {
            let list = self.parts.of(i);
            let pair = |k: usize, l: usize| {
                let [p, q] = [k, l].map(|place| motions.first[list[place] as usize]);
                let (row, column) = if p >= q { (k, l) } else { (l, k) };
                let of = &columns[list[column] as usize];
                // PARTs that do not move have no pair: they add to one that nobody reads.
                let number = of.binary_search_by_key(&p.max(q), |e| e.0).map_or(0, |at| of[at].1);
                Pair { row: row as u8, column: column as u8, number }
            };
            self.pairs.push((0..list.len()).flat_map(|k| (0..=k).map(move |l| pair(k, l))));
        }
    }
}

/// PARTs of each element, ascending, from the vertices of each.
pub(super) fn parts_of<'a>(weights: &Weights, all: impl Iterator<Item = &'a [u32]>) -> Csr<u32> {
    let (mut parts, mut own) = (Csr::default(), Vec::new());
    for vertices in all {
        own.extend(vertices.iter().flat_map(|&v| weights.of(v as usize)).map(|w| w.0));
        own.sort_unstable();
        own.dedup();
        parts.push(own.drain(..));
    }
    parts
}

/// Samples the elements of `count` PARTs by a low-discrepancy sequence (multiples of the golden section). Returns the index of each sampled
/// element and the number of elements that it represents. `rate` gives the share that is sampled of a PART of this size.
pub(super) fn sample(count: usize, parts: &Csr<u32>, rate: impl Fn(f64) -> f64) -> Vec<(u32, f64)> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let mut size = vec![0.0; count];
    for i in 0..parts.len() {
        let list = parts.of(i);
        for &p in list {
            size[p as usize] += 1.0 / list.len() as f64;
        }
    }
    let mut sampled = Vec::new();
    for i in 0..parts.len() {
        let rate = parts.of(i).iter().map(|&p| rate(size[p as usize])).fold(0.0, f64::max).min(1.0);
        if (i as f64 * GOLDEN).fract() < rate {
            sampled.push((i as u32, rate.recip()));
        }
    }
    sampled
}

/// Share of the elements of a PART of this size that is sampled.
fn sampling_rate(size: f64) -> f64 {
    (SAMPLES_PER_PART + (size - MANY_ELEMENTS).max(0.0) / SAMPLING_INTERVAL) / size
}

/// Elements of all kinds.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    /// The reduced Hessian's pattern.
    pub(super) pattern: Pattern,
    /// The pairs of PARTs that share an element, by number; nothing is at 0.
    pub(super) places: Vec<Place>,
    pub(super) triangles: Elements,
    pub(super) rings: Elements,
    pub(super) vertices: Elements,
}

impl Layout {
    /// Finds the elements, numbers the motions for elimination and lays out the pattern.
    pub(super) fn new(cloth: &Cloth, motions: &mut Motions) -> Self {
        let parts = motions.first.len();
        let weights = &motions.weights;
        let triangle = |i: usize| &cloth.triangles[i].vertices[..];
        let ring = |i: usize| cloth.bending.element(i).0;
        let ((mut triangles, mut pairs), (mut rings, of_rings)) = rayon::join(
            || {
                let of = parts_of(weights, (0..cloth.triangles.len()).map(triangle));
                (Elements::sampled(weights, parts, &of, triangle), pairs_of(&of))
            },
            || {
                let of = parts_of(weights, (0..cloth.bending.len()).map(ring));
                (Elements::sampled(weights, parts, &of, ring), pairs_of(&of))
            },
        );
        let mut vertices = Elements::vertices(weights, cloth.vertex_count());
        pairs.extend(of_rings);
        let neighbours = Adjacency::new(parts, || pairs.iter().copied());
        let free: Vec<u32> = (0..parts as u32).filter(|&p| motions.count[p as usize] > 0).collect();
        let order = nested_dissection(free, &motions.centre, &neighbours);
        motions.number(order.iter().copied());
        // Of each PART itself and its later neighbours, by first unknown, with the pair's number.
        let mut columns: Vec<Vec<(u32, u32)>> = vec![Vec::new(); parts];
        let mut places = vec![Place { row: u32::MAX, column: u32::MAX, skip: 0 }];
        let mut pattern = Pattern { starts: vec![0], rows: Vec::new() };
        for &q in &order {
            let own = motions.first[q as usize];
            let count = |p: u32| u32::from(motions.count[p as usize]);
            let later = neighbours.of(q).iter().copied().filter(|&p| motions.first[p as usize] > own);
            let mut later: Vec<u32> = later.filter(|&p| count(p) > 0).collect();
            later.sort_unstable_by_key(|&p| motions.first[p as usize]);
            let mut skip = 0;
            for &p in std::iter::once(&q).chain(&later) {
                columns[q as usize].push((motions.first[p as usize], places.len() as u32));
                places.push(Place { row: p, column: q, skip });
                skip += if p == q { 0 } else { count(p) };
            }
            for b in 0..count(q) {
                pattern.rows.extend(own + b..own + count(q));
                for &p in &later {
                    pattern.rows.extend(motions.first[p as usize]..motions.first[p as usize] + count(p));
                }
                pattern.starts.push(pattern.rows.len() as u32);
            }
        }
        for elements in [&mut triangles, &mut rings, &mut vertices] {
            elements.lay_out(motions, &columns);
        }
        Self { pattern, places, triangles, rings, vertices }
    }
}

/// Pairs of PARTs that share an element.
fn pairs_of(parts: &Csr<u32>) -> Vec<[u32; 2]> {
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    let mut last: &[u32] = &[];
    for i in 0..parts.len() {
        let list = parts.of(i);
        // Inside a PART one element is like the one before.
        if list != last {
            for (k, &p) in list.iter().enumerate() {
                pairs.extend(list[..k].iter().map(|&q| [p, q]));
            }
        }
        last = list;
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
