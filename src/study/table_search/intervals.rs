//! PARTs and squared error of every level [a, b) between candidate bounds, uncut and cut to each extent.
//!
//! For each lower bound, the upper bound advances candidate by candidate and adds vertices. A union-find keeps the connected pieces,
//! and [`Moments`] their errors. A changed piece is cut as in stage one. The seeds do not depend on the extent, so one sequence of
//! seeds serves all extents, and a new seed updates the moments of the reassigned vertices only.

use super::extent_grid::ExtentGrid;
use super::options::SearchOptions;
use super::sample::Sample;
use crate::mechanics::coupled::Motion;
use crate::parts::{Ruler, spread_seeds};
use crate::study::accuracy::moments::Moments;

/// PARTs and error of a level.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Cost {
    pub(super) parts: u32,
    /// Squared error that remains after the PARTs' best motions, summed over the vertices, m².
    pub(super) error: f64,
}

/// More PARTs than any table may have.
pub(super) const TOO_MANY: Cost = Cost { parts: u32::MAX, error: 0.0 };

/// Excludes levels from all tables: the first `too_thin` levels, and uncut levels if the options require a cut.
pub(super) fn forbid(row: &mut [Cost], too_thin: usize, extents: &ExtentGrid, options: &SearchOptions) {
    for (i, level) in row.chunks_mut(extents.len()).enumerate() {
        if i < too_thin {
            level.fill(TOO_MANY);
        } else if !options.uncut && extents.cuts() {
            level[0] = TOO_MANY;
        }
    }
}

impl Cost {
    fn plus(self, other: Self) -> Self {
        Self { parts: self.parts.saturating_add(other.parts), error: self.error + other.error }
    }
}

/// Evaluates the levels of a garment, a row for each lower bound.
pub(super) struct Intervals<'a> {
    sample: &'a Sample<'a>,
    /// Moments of each single vertex.
    each: Vec<Moments>,
    extents: &'a ExtentGrid,
    motion: Motion,
}

impl<'a> Intervals<'a> {
    pub(super) fn new(sample: &'a Sample<'a>, extents: &'a ExtentGrid, motion: Motion) -> Self {
        let all: Vec<u32> = (0..sample.displacement.len() as u32).collect();
        Self { sample, each: Moments::of_each(&all, &sample.mesh.positions, sample.displacement), extents, motion }
    }

    /// The costs of the levels [a, a + 1), [a, a + 2), ..., each with every extent of the grid. `members` are the vertices of the
    /// smallest levels from a on.
    pub(super) fn row(&self, members: &[Vec<u32>]) -> Vec<Cost> {
        let mut pieces = Pieces::new(self);
        let mut row = Vec::with_capacity(members.len() * self.extents.len());
        for vertices in members {
            pieces.grow(vertices);
            pieces.costs(&mut row);
        }
        row
    }
}

/// The connected pieces of the vertices added so far.
struct Pieces<'a> {
    of: &'a Intervals<'a>,
    /// Union-find; `ABSENT` for vertices that are not added yet.
    parent: Vec<u32>,
    /// Number of pieces and their squared errors, uncut.
    whole: Cost,
    /// By root: number of vertices, their moments, and their squared error, 0 until it is computed.
    size: Vec<u32>,
    sum: Vec<Moments>,
    error: Vec<f64>,
    /// Roots that have grown.
    grown: Vec<u32>,
    /// By root, only if the grid has extents: the vertices, and the cost with each extent, empty until it is computed.
    vertices: Vec<Vec<u32>>,
    cut: Vec<Vec<Cost>>,
    roots: Vec<u32>,
    /// Scratch: the index of a vertex in its piece.
    place: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

impl<'a> Pieces<'a> {
    fn new(of: &'a Intervals<'a>) -> Self {
        let n = of.each.len();
        let cuts = if of.extents.cuts() { n } else { 0 };
        Self {
            of,
            parent: vec![ABSENT; n],
            whole: Cost::default(),
            size: vec![0; n],
            sum: vec![Moments::default(); n],
            error: vec![0.0; n],
            grown: Vec::new(),
            vertices: vec![Vec::new(); cuts],
            cut: vec![Vec::new(); cuts],
            roots: Vec::new(),
            place: vec![0; cuts],
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
            (self.parent[i], self.size[i], self.sum[i]) = (v, 1, self.of.each[i]);
            self.whole.parts += 1;
            if self.of.extents.cuts() {
                self.vertices[i] = vec![v];
                self.roots.push(v);
            }
            for &w in self.of.sample.topology.neighbours(v) {
                if self.parent[w as usize] != ABSENT {
                    self.join(v, w);
                }
            }
        }
        for r in std::mem::take(&mut self.grown) {
            let i = r as usize;
            if self.parent[i] == r && self.error[i] == 0.0 {
                let error = self.sum[i].error(self.of.motion);
                self.error[i] = error;
                self.whole.error += error;
            }
        }
        let parent = &self.parent;
        self.roots.retain(|&r| parent[r as usize] == r);
        for &r in &self.roots {
            if self.cut[r as usize].is_empty() {
                self.cut[r as usize] = cut_costs(self.of, &mut self.vertices[r as usize], &mut self.place);
            }
        }
    }

    fn join(&mut self, v: u32, w: u32) {
        let (p, q) = (self.root(v), self.root(w));
        if p == q {
            return;
        }
        // The larger piece keeps its root; of two equal pieces, the lower index does, so that sums depend on the input alone.
        let (p, q) = if (self.size[q as usize], p) > (self.size[p as usize], q) { (q, p) } else { (p, q) };
        let (i, j) = (p as usize, q as usize);
        self.whole.error -= std::mem::take(&mut self.error[i]) + std::mem::take(&mut self.error[j]);
        self.whole.parts -= 1;
        self.parent[j] = p;
        self.size[i] += self.size[j];
        let sum = self.sum[j];
        self.sum[i] += &sum;
        self.grown.push(p);
        if self.of.extents.cuts() {
            let moved = std::mem::take(&mut self.vertices[j]);
            self.vertices[i].extend(moved);
            self.cut[i].clear();
            self.cut[j].clear();
        }
    }

    /// Appends the costs of all vertices added so far, uncut and with each extent.
    fn costs(&self, out: &mut Vec<Cost>) {
        // Rounding of added and subtracted errors may leave a negative sum.
        out.push(Cost { error: self.whole.error.max(0.0), ..self.whole });
        let at =
            |extent: usize| self.roots.iter().map(|&r| self.cut[r as usize][extent]).fold(Cost::default(), Cost::plus);
        out.extend((0..self.of.extents.len() - 1).map(at));
    }
}

/// The costs of one connected piece cut to each extent; [`TOO_MANY`] if it has more PARTs than the garment may have.
fn cut_costs(of: &Intervals<'_>, vertices: &mut [u32], place: &mut [u32]) -> Vec<Cost> {
    let Intervals { sample, extents, motion, .. } = of;
    vertices.sort_unstable();
    if vertices.len() == 1 {
        return vec![Cost { parts: 1, error: 0.0 }; extents.len() - 1];
    }
    // `place` keeps entries of other pieces, so an entry counts only if it points back.
    for (&v, i) in vertices.iter().zip(0..) {
        place[v as usize] = i;
    }
    let local = |w: u32| {
        let i = place[w as usize] as usize;
        (vertices.get(i) == Some(&w)).then_some(i)
    };
    // Moments about the centroid of the piece keep cancellation small when vertices are subtracted.
    let each = Moments::of_each(vertices, &sample.mesh.positions, sample.displacement);
    let mut all = Vec::with_capacity(extents.len() - 1);
    for shape in &extents.shapes {
        let mut left = &shape.extents_m[..];
        let ruler =
            Ruler { mesh: sample.mesh, topology: sample.topology, grain: shape.factors.map(|f| (sample.grain, f)) };
        let mut seeded = Seeded::new(&each);
        spread_seeds(vertices, local, ruler, |radius_m, seeds, seed_of_vertex| {
            let reached = left.iter().take_while(|&&e| radius_m <= 0.5 * e).count();
            if reached > 0 {
                left = &left[reached..];
                let cost = Cost { parts: seeds as u32, error: seeded.error(seeds, seed_of_vertex, *motion) };
                all.extend(std::iter::repeat_n(cost, reached));
            }
            left.is_empty() || seeds >= sample.max_parts
        });
        all.extend(std::iter::repeat_n(TOO_MANY, left.len()));
    }
    all
}

/// Moments and errors by seed, updated from one number of seeds to the next.
struct Seeded<'a> {
    each: &'a [Moments],
    seed_of_vertex: Vec<u32>,
    sums: Vec<Moments>,
    /// Negative if the vertices of the seed have changed.
    errors: Vec<f64>,
}

impl<'a> Seeded<'a> {
    fn new(each: &'a [Moments]) -> Self {
        Self { each, seed_of_vertex: vec![u32::MAX; each.len()], sums: Vec::new(), errors: Vec::new() }
    }

    /// The squared error of all seeds' vertices, m².
    fn error(&mut self, seeds: usize, seed_of_vertex: &[u32], motion: Motion) -> f64 {
        self.sums.resize(seeds, Moments::default());
        self.errors.resize(seeds, -1.0);
        for ((before, &now), own) in self.seed_of_vertex.iter_mut().zip(seed_of_vertex).zip(self.each) {
            if *before != now {
                if let Some(sum) = self.sums.get_mut(*before as usize) {
                    *sum -= own;
                    self.errors[*before as usize] = -1.0;
                }
                self.sums[now as usize] += own;
                self.errors[now as usize] = -1.0;
                *before = now;
            }
        }
        for (error, sum) in self.errors.iter_mut().zip(&self.sums).filter(|(error, _)| **error < 0.0) {
            *error = sum.error(motion);
        }
        self.errors.iter().sum()
    }
}
