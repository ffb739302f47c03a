//! Which PARTs move each triangle, each bending ring and each vertex, and where their blocks of the reduced Hessian are.
//!
//! An element couples every pair of PARTs that have weight at one of its vertices: such pairs are numbered, and what elements add is summed
//! pair by pair. The pattern is built PART by PART: the column of a PART's unknown holds what is left of its own block, then its
//! neighbours that come later in the order of elimination.

use crate::mechanics::energy::ordering::{Adjacency, nested_dissection};
use crate::mechanics::energy::pattern::Pattern;
use crate::mechanics::energy::{Cloth, bending::Bending};
use crate::mesh::Lists;

use super::motions::Motions;
use super::weights::Weights;

/// Elements of this many for each PART are sampled for the Hessian: a PART has twelve unknowns, a triangle says three things. The
/// energy and its gradient take them all. Where a PART has more than [`MANY`], one in [`BEYOND`] of those as well: beside a gradient of so many
/// they cost nothing, and twelve of 6,000 are luck. (No cure: a skirt of 62,500 vertices in 22 PARTs has crept for 40 steps with either.)
const ENOUGH: f64 = 12.0;
const MANY: f64 = 4000.0;
const BEYOND: f64 = 50.0;

/// The PARTs of elements of one kind.
#[derive(Debug, Clone, Default)]
pub(super) struct Elements {
    /// PARTs of each element, ascending.
    pub(super) parts: Lists<u32>,
    /// Their weights at its vertices, PART after PART.
    pub(super) weights: Lists<f64>,
    /// The pairs of its PARTs.
    pub(super) pairs: Lists<Pair>,
    /// The elements that are sampled, and how many each stands for.
    pub(super) sampled: Vec<(u32, f64)>,
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
    /// From the vertices of each element.
    fn new<'a>(weights: &Weights, parts: usize, all: impl Iterator<Item = &'a [u32]>) -> Self {
        let (mut e, mut own) = (Self::default(), Vec::new());
        let of = |v: u32| weights.of(v as usize);
        let weight = |p: u32, v: u32| of(v).iter().find(|w| w.0 == p).map_or(0.0, |w| w.1);
        for vertices in all {
            own.extend(vertices.iter().flat_map(|&v| of(v)).map(|&(p, _)| p));
            own.sort_unstable();
            own.dedup();
            e.weights.push(own.iter().flat_map(|&p| vertices.iter().map(move |&v| weight(p, v))));
            e.parts.push(own.drain(..));
        }
        e.sample(parts);
        e
    }

    /// Chooses elements by a sequence that leaves no gaps (multiples of the golden section), so many of each PART.
    fn sample(&mut self, parts: usize) {
        const GOLDEN: f64 = 0.618_033_988_749_895;
        let mut size = vec![0.0; parts];
        for i in 0..self.parts.len() {
            let list = self.parts.of(i);
            for &p in list {
                size[p as usize] += 1.0 / list.len() as f64;
            }
        }
        for i in 0..self.parts.len() {
            let rate = self.parts.of(i).iter().map(|&p| enough(size[p as usize])).fold(0.0, f64::max).min(1.0);
            if (i as f64 * GOLDEN).fract() < rate {
                self.sampled.push((i as u32, rate.recip()));
            }
        }
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

/// Share of the elements of a PART of this size that is sampled.
fn enough(size: f64) -> f64 {
    (ENOUGH + (size - MANY).max(0.0) / BEYOND) / size
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
        let of = |all: Vec<&[u32]>| Elements::new(weights, parts, all.into_iter());
        let (mut triangles, (mut rings, mut vertices)) = rayon::join(
            || of(cloth.triangles.iter().map(|t| &t.vertices[..]).collect()),
            || {
                let numbers: Vec<u32> = (0..cloth.vertex_count() as u32).collect();
                (of(Bending::elements(&cloth.bending).map(|e| e.0).collect()), of(numbers.chunks(1).collect()))
            },
        );
        let neighbours = neighbours(parts, &[&triangles, &rings]);
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

/// PARTs that share an element with each.
fn neighbours(parts: usize, all: &[&Elements]) -> Adjacency {
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for elements in all {
        let mut last: &[u32] = &[];
        for i in 0..elements.parts.len() {
            let list = elements.parts.of(i);
            // Inside a PART one element is like the one before.
            if list != last {
                for (k, &p) in list.iter().enumerate() {
                    pairs.extend(list[..k].iter().map(|&q| [p, q]));
                }
            }
            last = list;
        }
    }
    Adjacency::new(parts, || pairs.iter().copied())
}
