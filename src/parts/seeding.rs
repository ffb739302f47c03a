//! Seeds spread over one connected piece of cloth by farthest points, distances by Dijkstra along its edges.
//!
//! Ties go to the lowest vertex throughout. What it is for, and its source, stands in `extent`. Moving the seeds to the middle of
//! their pieces (Lloyd's relaxation) was tried on five garments at five extents: it often broke the extent, and where it did not
//! it took 0 to 6 % off the representable error for up to three times the time, so it was left out.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ordered_float::OrderedFloat;

use super::grain::Ruler;
use crate::mesh::Lists;

/// The nearest seed of each of these connected vertices, and how many seeds it takes for none to be farther than half of
/// `extent_m`. `local` is the place of a vertex in the list, `None` for others.
pub(crate) fn nearest_seeds(
    vertices: &[u32],
    local: impl Fn(u32) -> Option<usize>,
    ruler: Ruler<'_>,
    extent_m: f64,
) -> (Vec<u32>, usize) {
    let mut found = (Vec::new(), 0);
    spread_seeds(vertices, local, ruler, |radius_m, seeds, seed_of_vertex| {
        let enough = radius_m <= 0.5 * extent_m || radius_m == 0.0 || extent_m.is_nan();
        if enough {
            found = (seed_of_vertex.to_vec(), seeds);
        }
        enough
    });
    found
}

/// Puts seed after seed, each on the vertex farthest from those before, until `enough` says so. After each it hears how far the
/// farthest vertex is from its seed, m, how many seeds there are, and the nearest seed of every vertex. Where seeds lie
/// does not depend on where it ends, so one run serves every extent.
pub(crate) fn spread_seeds(
    vertices: &[u32],
    local: impl Fn(u32) -> Option<usize>,
    ruler: Ruler<'_>,
    mut enough: impl FnMut(f64, usize, &[u32]) -> bool,
) {
    // The edges inside the piece, by place in its list: neighbour and length, m.
    let mut graph = Lists::default();
    for &v in vertices {
        graph.push(ruler.neighbours(v).filter_map(|(w, length)| Some((local(w)?, length))));
    }
    let mut spread = Spread::new(vertices.len());
    let (mut next, mut radius_m) = (0, f64::INFINITY);
    for seed in 0..vertices.len() {
        spread.start(seed, next);
        spread.flow(&graph);
        (next, radius_m) = spread.farthest();
        if enough(radius_m, seed + 1, &spread.seed_of_vertex) {
            return;
        }
    }
    // Every vertex is a seed, and no caller asks for less than a distance of 0.
    debug_assert!(vertices.is_empty() || radius_m == 0.0);
}

/// How far every vertex is from its nearest seed, and which that is.
struct Spread {
    distance: Vec<f64>,
    seed_of_vertex: Vec<u32>,
    /// The vertex before each on its way from the seed.
    before: Vec<usize>,
    heap: BinaryHeap<Reverse<(OrderedFloat<f64>, usize)>>,
}

impl Spread {
    fn new(vertices: usize) -> Self {
        Self {
            distance: vec![f64::INFINITY; vertices],
            seed_of_vertex: vec![0; vertices],
            before: vec![usize::MAX; vertices],
            heap: BinaryHeap::new(),
        }
    }

    /// Puts a seed at a vertex.
    fn start(&mut self, seed: usize, at: usize) {
        self.distance[at] = 0.0;
        self.seed_of_vertex[at] = seed as u32;
        self.before[at] = usize::MAX;
        self.heap.push(Reverse((OrderedFloat(0.0), at)));
    }

    /// Dijkstra's algorithm from the seeds put since the last time, over what they are nearer to.
    fn flow(&mut self, graph: &Lists<(usize, f64)>) {
        while let Some(Reverse((OrderedFloat(d), i))) = self.heap.pop() {
            if d > self.distance[i] {
                continue;
            }
            for &(j, length) in graph.of(i) {
                // Whoever lies behind a vertex goes where it goes, even where the way is shorter by less than a rounding: so
                // pieces are connected.
                let follows = self.before[j] == i && self.seed_of_vertex[j] != self.seed_of_vertex[i];
                if d + length < self.distance[j] || follows {
                    self.distance[j] = d + length;
                    self.seed_of_vertex[j] = self.seed_of_vertex[i];
                    self.before[j] = i;
                    self.heap.push(Reverse((OrderedFloat(d + length), j)));
                }
            }
        }
    }

    /// The vertex farthest from all seeds, and how far, m.
    fn farthest(&self) -> (usize, f64) {
        let farther = |best: (usize, f64), (i, &d): (usize, &f64)| if d > best.1 { (i, d) } else { best };
        self.distance.iter().enumerate().fold((0, 0.0), farther)
    }
}
