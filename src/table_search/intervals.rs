//! PARTs and squared error of every level [a, b) between candidate bounds.
//!
//! For each lower bound the upper one grows step by step: vertices come in, a union-find keeps the connected pieces, and the
//! squared error about a piece's mean follows the merge, e = e₁ + e₂ + n₁ n₂/(n₁ + n₂) |ū₁ − ū₂|². With an extent each piece that
//! changed is cut as stage one would cut it.

use glam::DVec3;
use rayon::prelude::*;

use super::{Sample, SearchOptions};
use crate::parts::nearest_seeds;

/// What a level costs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Cost {
    /// PARTs.
    pub(super) parts: u32,
    /// Σ |u_i − ū_k|² over its vertices, m².
    pub(super) error: f64,
}

/// Row a holds the costs of [a, a + 1), [a, a + 2), ... `step` is called once a row.
pub(super) fn costs(
    sample: &Sample<'_>,
    bin_of_vertex: &[u32],
    bins: usize,
    options: &SearchOptions,
    step: &(dyn Fn() + Sync),
) -> Vec<Vec<Cost>> {
    let mut members = vec![Vec::new(); bins];
    for (v, &bin) in bin_of_vertex.iter().enumerate() {
        members[bin as usize].push(v as u32);
    }
    let row = |lower: usize| {
        let mut pieces = Pieces::new(sample, options);
        let grow = |vertices: &Vec<u32>| {
            pieces.grow(vertices);
            pieces.cost()
        };
        let row: Vec<Cost> = members[lower..].iter().map(grow).collect();
        step();
        row
    };
    (0..bins).into_par_iter().with_max_len(1).map(row).collect()
}

/// The connected pieces of the vertices so far.
struct Pieces<'a> {
    sample: &'a Sample<'a>,
    extent_m: Option<f64>,
    /// A level with more PARTs is in no table, so cuts stop there.
    max_parts: usize,
    /// Union-find; `ABSENT` for vertices not in yet.
    parent: Vec<u32>,
    /// By root: vertices (only their number matters without an extent), sum of displacements, cost.
    vertices: Vec<Vec<u32>>,
    size: Vec<u32>,
    sum: Vec<DVec3>,
    error: Vec<f64>,
    cut: Vec<Cost>,
    /// Scratch: the place of a vertex in its piece.
    place: Vec<u32>,
    roots: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

/// More PARTs than any table may have.
const TOO_MANY: Cost = Cost { parts: u32::MAX, error: 0.0 };

impl<'a> Pieces<'a> {
    fn new(sample: &'a Sample<'a>, options: &SearchOptions) -> Self {
        let (extent_m, max_parts) = (options.extent_m, options.max_parts);
        let n = sample.displacement.len();
        let cuts = if extent_m.is_some() { n } else { 0 };
        Self {
            sample,
            extent_m,
            max_parts,
            parent: vec![ABSENT; n],
            vertices: vec![Vec::new(); cuts],
            size: vec![0; n],
            sum: vec![DVec3::ZERO; n],
            error: vec![0.0; n],
            cut: vec![Cost::default(); cuts],
            place: vec![0; cuts],
            roots: Vec::new(),
        }
    }

    fn root(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            let up = self.parent[self.parent[v as usize] as usize];
            self.parent[v as usize] = up;
            v = up;
        }
        v
    }

    fn grow(&mut self, vertices: &[u32]) {
        for &v in vertices {
            let i = v as usize;
            (self.parent[i], self.size[i], self.sum[i]) = (v, 1, self.sample.displacement[i]);
            if self.extent_m.is_some() {
                self.vertices[i] = vec![v];
            }
            self.roots.push(v);
            for &w in self.sample.topology.neighbours(v) {
                if self.parent[w as usize] != ABSENT {
                    self.join(v, w);
                }
            }
        }
        let roots = std::mem::take(&mut self.roots);
        self.roots = roots.into_iter().filter(|&r| self.parent[r as usize] == r).collect();
        if let Some(extent_m) = self.extent_m {
            for &r in &self.roots {
                // No cost yet: new or changed.
                if self.cut[r as usize].parts == 0 {
                    self.cut[r as usize] = cut_cost(
                        self.sample,
                        &mut self.vertices[r as usize],
                        &mut self.place,
                        extent_m,
                        self.max_parts,
                    );
                }
            }
        }
    }

    fn join(&mut self, v: u32, w: u32) {
        let (p, q) = (self.root(v), self.root(w));
        if p == q {
            return;
        }
        // The larger stays root; of equals the lower number, so that sums do not depend on anything but the input.
        let (p, q) = if (self.size[q as usize], p) > (self.size[p as usize], q) { (q, p) } else { (p, q) };
        let (i, j) = (p as usize, q as usize);
        let (ni, nj) = (f64::from(self.size[i]), f64::from(self.size[j]));
        let apart = (self.sum[i] / ni).distance_squared(self.sum[j] / nj);
        self.error[i] += self.error[j] + ni * nj / (ni + nj) * apart;
        self.parent[j] = p;
        self.size[i] += self.size[j];
        let sum = self.sum[j];
        self.sum[i] += sum;
        if self.extent_m.is_some() {
            let moved = std::mem::take(&mut self.vertices[j]);
            self.vertices[i].extend(moved);
            self.cut[i] = Cost::default();
        }
    }

    fn cost(&self) -> Cost {
        let add = |a: Cost, b: Cost| Cost { parts: a.parts.saturating_add(b.parts), error: a.error + b.error };
        let of = |&r: &u32| match self.extent_m {
            None => Cost { parts: 1, error: self.error[r as usize] },
            Some(_) => self.cut[r as usize],
        };
        self.roots.iter().map(of).fold(Cost::default(), add)
    }
}

/// The cost of one connected piece, cut to an extent, or [`TOO_MANY`].
fn cut_cost(sample: &Sample<'_>, vertices: &mut [u32], place: &mut [u32], extent_m: f64, max_parts: usize) -> Cost {
    vertices.sort_unstable();
    // `place` keeps entries of other pieces, so an entry counts only if it points back.
    for (&v, i) in vertices.iter().zip(0..) {
        place[v as usize] = i;
    }
    let local = |w: u32| {
        let i = place[w as usize] as usize;
        (vertices.get(i) == Some(&w)).then_some(i)
    };
    let found = nearest_seeds(vertices, local, sample.mesh, sample.topology, (extent_m, max_parts));
    let Some((seed_of_vertex, seeds)) = found else { return TOO_MANY };
    let mut count = vec![0u32; seeds];
    let mut mean = vec![DVec3::ZERO; seeds];
    for (&v, &s) in vertices.iter().zip(&seed_of_vertex) {
        count[s as usize] += 1;
        mean[s as usize] += sample.displacement[v as usize];
    }
    for (mean, &count) in mean.iter_mut().zip(&count) {
        *mean /= f64::from(count.max(1));
    }
    let squared = |(&v, &s): (&u32, &u32)| sample.displacement[v as usize].distance_squared(mean[s as usize]);
    Cost { parts: seeds as u32, error: vertices.iter().zip(&seed_of_vertex).map(squared).sum() }
}
