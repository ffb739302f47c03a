//! PARTs and squared error of every level [a, b) between candidate bounds, uncut and cut to each extent.
//!
//! For each lower bound the upper one grows step by step: vertices come in, a union-find keeps the connected pieces, and the
//! squared error about a piece's mean follows the merge, e = e₁ + e₂ + n₁ n₂/(n₁ + n₂) |ū₁ − ū₂|². A piece that changed is
//! cut as stage one would cut it: its seeds lie where they lie for every extent, so one run of them gives all.

use glam::DVec3;

use super::Sample;
use super::ladder::Ladder;
use crate::parts::{Ruler, spread_seeds};

/// What a level costs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Cost {
    /// PARTs.
    pub(super) parts: u32,
    /// Σ |u_i − ū_k|² over its vertices, m².
    pub(super) error: f64,
}

/// More PARTs than any table may have.
pub(super) const TOO_MANY: Cost = Cost { parts: u32::MAX, error: 0.0 };

impl Cost {
    fn plus(self, other: Self) -> Self {
        Self { parts: self.parts.saturating_add(other.parts), error: self.error + other.error }
    }
}

/// The costs of [a, a + 1), [a, a + 2), ... at each step of the ladder, for the vertices of the smallest levels from a on.
pub(super) fn row(sample: &Sample<'_>, members: &[Vec<u32>], ladder: &Ladder, max_parts: usize) -> Vec<Cost> {
    let mut pieces = Pieces::new(sample, ladder, max_parts);
    let mut row = Vec::with_capacity(members.len() * ladder.len());
    for vertices in members {
        pieces.grow(vertices);
        pieces.costs(&mut row);
    }
    row
}

/// The connected pieces of the vertices so far.
struct Pieces<'a> {
    sample: &'a Sample<'a>,
    ladder: &'a Ladder,
    /// A level with more PARTs is in no table, so cuts stop there.
    max_parts: usize,
    /// Union-find; `ABSENT` for vertices not in yet.
    parent: Vec<u32>,
    /// Number of pieces and their squared errors, uncut.
    whole: Cost,
    /// By root: number of vertices and sum of displacements.
    size: Vec<u32>,
    sum: Vec<DVec3>,
    /// By root, only where PARTs are cut: the vertices, and the costs at each step, empty where not known.
    vertices: Vec<Vec<u32>>,
    cut: Vec<Vec<Cost>>,
    roots: Vec<u32>,
    /// Scratch: the place of a vertex in its piece.
    place: Vec<u32>,
}

const ABSENT: u32 = u32::MAX;

impl<'a> Pieces<'a> {
    fn new(sample: &'a Sample<'a>, ladder: &'a Ladder, max_parts: usize) -> Self {
        let n = sample.displacement.len();
        let cuts = if ladder.cuts() { n } else { 0 };
        Self {
            sample,
            ladder,
            max_parts,
            parent: vec![ABSENT; n],
            whole: Cost::default(),
            size: vec![0; n],
            sum: vec![DVec3::ZERO; n],
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
            (self.parent[i], self.size[i], self.sum[i]) = (v, 1, self.sample.displacement[i]);
            self.whole.parts += 1;
            if self.ladder.cuts() {
                self.vertices[i] = vec![v];
                self.roots.push(v);
            }
            for &w in self.sample.topology.neighbours(v) {
                if self.parent[w as usize] != ABSENT {
                    self.join(v, w);
                }
            }
        }
        let parent = &self.parent;
        self.roots.retain(|&r| parent[r as usize] == r);
        for &r in &self.roots {
            if self.cut[r as usize].is_empty() {
                self.cut[r as usize] = cut_costs(
                    self.sample,
                    &mut self.vertices[r as usize],
                    &mut self.place,
                    self.ladder,
                    self.max_parts,
                );
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
        self.whole.error += ni * nj / (ni + nj) * apart;
        self.whole.parts -= 1;
        self.parent[j] = p;
        self.size[i] += self.size[j];
        let sum = self.sum[j];
        self.sum[i] += sum;
        if self.ladder.cuts() {
            let moved = std::mem::take(&mut self.vertices[j]);
            self.vertices[i].extend(moved);
            self.cut[i].clear();
            self.cut[j].clear();
        }
    }

    /// Appends the costs of all vertices so far, uncut and at each further step.
    fn costs(&self, out: &mut Vec<Cost>) {
        out.push(self.whole);
        let at = |step: usize| self.roots.iter().map(|&r| self.cut[r as usize][step]).fold(Cost::default(), Cost::plus);
        out.extend((0..self.ladder.len() - 1).map(at));
    }
}

/// The costs of one connected piece cut to each extent, or [`TOO_MANY`].
fn cut_costs(
    sample: &Sample<'_>,
    vertices: &mut [u32],
    place: &mut [u32],
    ladder: &Ladder,
    max_parts: usize,
) -> Vec<Cost> {
    vertices.sort_unstable();
    if vertices.len() == 1 {
        return vec![Cost { parts: 1, error: 0.0 }; ladder.len() - 1];
    }
    // `place` keeps entries of other pieces, so an entry counts only if it points back.
    for (&v, i) in vertices.iter().zip(0..) {
        place[v as usize] = i;
    }
    let local = |w: u32| {
        let i = place[w as usize] as usize;
        (vertices.get(i) == Some(&w)).then_some(i)
    };
    // About the mean of the whole piece, so that little is lost in the difference below.
    let mean = vertices.iter().map(|&v| sample.displacement[v as usize]).sum::<DVec3>() / vertices.len() as f64;
    let moved: Vec<DVec3> = vertices.iter().map(|&v| sample.displacement[v as usize] - mean).collect();
    let squares: f64 = moved.iter().map(|u| u.length_squared()).sum();
    let mut sums: Vec<(DVec3, u32)> = Vec::new();
    let mut all = Vec::with_capacity(ladder.len() - 1);
    for shape in ladder.shapes() {
        let mut left = &shape.extents_m[..];
        let ruler =
            Ruler { mesh: sample.mesh, topology: sample.topology, grain: shape.factors.map(|f| (sample.grain, f)) };
        spread_seeds(vertices, local, ruler, |radius_m, seeds, seed_of_vertex| {
            let reached = left.iter().take_while(|&&e| radius_m <= 0.5 * e).count();
            if reached > 0 {
                left = &left[reached..];
                // Σ |u − ū_s|² = Σ |u|² − Σ_s |Σ u|²/n_s
                sums.clear();
                sums.resize(seeds, (DVec3::ZERO, 0));
                for (&u, &s) in moved.iter().zip(seed_of_vertex) {
                    let (sum, count) = &mut sums[s as usize];
                    *sum += u;
                    *count += 1;
                }
                let held: f64 = sums.iter().map(|(sum, count)| sum.length_squared() / f64::from((*count).max(1))).sum();
                let cost = Cost { parts: seeds as u32, error: (squares - held).max(0.0) };
                all.extend(std::iter::repeat_n(cost, reached));
            }
            left.is_empty() || seeds >= max_parts
        });
        all.extend(std::iter::repeat_n(TOO_MANY, left.len()));
    }
    all
}
