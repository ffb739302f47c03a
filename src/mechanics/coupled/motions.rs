//! The PARTs' motions as coordinates of the cloth.
//!
//! u(v) = Σ_p w_p(v) [D_p + A_p (x_v − c_p)],
//!
//! with blending weights w_p and, for each PART, a displacement D_p and a displacement gradient A_p. About positions x it is linear in
//! the unknowns, four vectors a PART: D_p and the columns of A_p along the PART's own axes, each divided by the PART's spread along
//! it. Every Newton step takes x, c_p and axes as they are by then, so turns add up as turns do, and a PART can be turned
//! by any angle without being stretched. A PART of three vertices or fewer has its displacement alone, as every PART does with one
//! [`Motion::Translation`] each: the paper's.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | w_p | blending weight | – |
//! | D_p, A_p | displacement and its gradient | m, – |
//! | c_p | middle of the PART, by its weights | m |
//!
//! Limits: within a PART nothing bends; what the blend strains at the seams is relaxed vertex by vertex.

use glam::{DMat3, DVec3};

use super::options::Motion;
use super::weights::Weights;
use crate::base::simd::{Four, Lanes, Pack, Vectors};
use crate::mechanics::energy::sparsity::Pattern;
use crate::mechanics::linear_algebra::eigen;
use crate::mechanics::newton::{SolveError, Solver};
use crate::mesh::{Csr, each_once, outer};
use crate::parts::Parts;

/// Numbers of the functions that a PART moves by: its weight, and that times its coordinates.
pub(super) type Values = [f64; 4];

/// The functions of a PART in one register: its weight, and that times its coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Functions {
    centre: DVec3,
    /// x, y and z of the axes, after a zero.
    axes: [Four; 3],
}

impl Functions {
    /// Their values at x, where the PART's weight is w.
    #[inline(always)]
    pub(super) fn at<L: Lanes>(&self, l: L, w: f64, x: DVec3) -> Pack<L> {
        let y = x - self.centre;
        let Vectors { x: ax, y: ay, z: az } = Vectors::load(l, &self.axes);
        let one = Pack::load(l, &Four([1.0, 0.0, 0.0, 0.0]));
        (one + ax * y.x + ay * y.y + az * y.z) * w
    }
}

/// Vertices of a PART that has its displacement alone.
const MAX_TRANSLATED: usize = 3;

/// Least spread along an axis, relative to the largest: a flat PART is not turned by what it is thick.
const MIN_SPREAD_RATIO: f64 = 0.05;

/// No PART is smaller than this, m.
const MIN_SPREAD_M: f64 = 1e-4;

/// Share of a diagonal block's trace that is added to it: flat PARTs leave some of their functions nearly alike.
pub(super) const RIDGE: f64 = 1e-6;

/// Blended motions of PARTs about the positions they were last centred at.
#[derive(Debug, Clone)]
pub struct Motions {
    pub(super) weights: Weights,
    /// First unknown of each PART, in elimination order.
    pub(super) first: Vec<u32>,
    /// Unknowns of each PART: 0, 1 or 4.
    pub(super) count: Vec<u8>,
    /// The middles c_p, m.
    pub(super) centre: Vec<DVec3>,
    axes: Vec<[DVec3; 3]>,
    unknowns: usize,
}

impl Motions {
    /// Motions of `parts` about `x`, blended by `weights` (none at vertices that do not move).
    #[must_use]
    pub fn new(parts: &Parts, weights: Weights, x: &[DVec3], motion: Motion) -> Self {
        let affine = |vertices: usize| motion == Motion::Affine && vertices > MAX_TRANSLATED;
        let mut count: Vec<u8> = parts.parts.iter().map(|p| if affine(p.vertices.len()) { 4 } else { 1 }).collect();
        let mut moves = vec![false; parts.len()];
        for v in 0..x.len() {
            for &(p, _) in weights.of(v) {
                moves[p as usize] = true;
            }
        }
        for (count, moves) in count.iter_mut().zip(&moves) {
            *count *= u8::from(*moves);
        }
        let n = parts.len();
        let (centre, axes) = (vec![DVec3::ZERO; n], vec![[DVec3::ZERO; 3]; n]);
        let mut motions = Self { weights, first: vec![0; n], count, centre, axes, unknowns: 0 };
        motions.number(0..n as u32);
        motions.centre_at(x);
        motions
    }

    /// Numbers the unknowns PART by PART in this order.
    pub(super) fn number(&mut self, order: impl IntoIterator<Item = u32>) {
        let mut next = 0;
        for p in order {
            self.first[p as usize] = next;
            next += u32::from(self.count[p as usize]);
        }
        self.unknowns = next as usize;
    }

    /// Unknown vectors.
    #[must_use]
    pub(crate) fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Takes middles and axes from `x`.
    pub(crate) fn centre_at(&mut self, x: &[DVec3]) {
        let n = self.first.len();
        let mut sum = vec![0.0; n];
        self.centre = vec![DVec3::ZERO; n];
        for (v, x) in x.iter().enumerate() {
            for &(p, w) in self.weights.of(v) {
                sum[p as usize] += w;
                self.centre[p as usize] += *x * w;
            }
        }
        for (centre, sum) in self.centre.iter_mut().zip(&sum) {
            *centre /= sum.max(f64::MIN_POSITIVE);
        }
        let mut spread = vec![DMat3::ZERO; n];
        for (v, x) in x.iter().enumerate() {
            for &(p, w) in self.weights.of(v) {
                let d = *x - self.centre[p as usize];
                spread[p as usize] += outer(d, d) * w;
            }
        }
        for (((axes, spread), sum), _) in
            self.axes.iter_mut().zip(spread).zip(sum).zip(&self.count).filter(|(_, count)| **count == 4)
        {
            let (squares, directions) = eigen(spread * sum.max(f64::MIN_POSITIVE).recip());
            let lengths = squares.map(|s| s.max(0.0).sqrt());
            let least = (MIN_SPREAD_RATIO * lengths.iter().copied().fold(0.0, f64::max)).max(MIN_SPREAD_M);
            for ((axis, direction), length) in axes.iter_mut().zip(directions).zip(lengths) {
                *axis = direction / length.max(least);
            }
        }
    }

    /// The functions of PART p at x, where its weight is w.
    #[inline]
    pub(super) fn values(&self, p: u32, w: f64, x: DVec3) -> Values {
        let y = (x - self.centre[p as usize]) * w;
        let [a, b, c] = &self.axes[p as usize];
        [w, y.dot(*a), y.dot(*b), y.dot(*c)]
    }

    /// The unknowns that move each vertex, PART by PART, with their values at `x`.
    pub(super) fn functions_at(&self, x: &[DVec3]) -> Csr<(u32, f64)> {
        let mut functions = Csr::default();
        for (v, x) in x.iter().enumerate() {
            functions.push(self.weights.of(v).iter().flat_map(|&(p, w)| {
                let count = self.count[p as usize] as usize;
                (self.first[p as usize]..).zip(self.values(p, w, *x)).take(count)
            }));
        }
        functions
    }

    /// The functions of all PARTs, by fours.
    pub(super) fn functions(&self) -> Vec<Functions> {
        let of = |(centre, [a, b, c]): (&DVec3, &[DVec3; 3])| Functions {
            centre: *centre,
            axes: [Four([0.0, a.x, b.x, c.x]), Four([0.0, a.y, b.y, c.y]), Four([0.0, a.z, b.z, c.z])],
        };
        self.centre.iter().zip(&self.axes).map(of).collect()
    }

    /// From a force (or any covector) at each vertex to that of each unknown.
    pub(crate) fn restrict(&self, x: &[DVec3], force: &[DVec3], out: &mut Vec<DVec3>) {
        out.clear();
        out.resize(self.unknowns, DVec3::ZERO);
        for (v, (x, force)) in x.iter().zip(force).enumerate() {
            for &(p, w) in self.weights.of(v) {
                let first = self.first[p as usize] as usize;
                let slots = &mut out[first..first + self.count[p as usize] as usize];
                for (slot, value) in slots.iter_mut().zip(self.values(p, w, *x)) {
                    *slot += *force * value;
                }
            }
        }
    }

    /// From the unknowns to the displacement of each vertex, m.
    pub(crate) fn prolong(&self, x: &[DVec3], unknowns: &[DVec3], out: &mut Vec<DVec3>) {
        out.clear();
        out.extend(x.iter().enumerate().map(|(v, x)| {
            let mut d = DVec3::ZERO;
            for &(p, w) in self.weights.of(v) {
                let first = self.first[p as usize] as usize;
                let slots = &unknowns[first..first + self.count[p as usize] as usize];
                for (slot, value) in slots.iter().zip(self.values(p, w, *x)) {
                    d += *slot * value;
                }
            }
            d
        }));
    }

    /// The displacement that comes nearest to `u` (m, from `x`, where the motions must be centred), by least squares over
    /// the vertices: no mechanics can bring these PARTs nearer.
    ///
    /// # Errors
    /// [`SolveError`] where positions are not finite.
    pub fn nearest(&self, x: &[DVec3], u: &[DVec3]) -> Result<Vec<DVec3>, SolveError> {
        let of = |v: usize| self.weights.of(v).iter().map(|&(p, _)| p);
        let pairs = each_once((0..x.len()).flat_map(|v| of(v).flat_map(move |p| of(v).map(move |q| (p, q)))));
        let span = |p: u32| (self.first[p as usize]..).take(self.count[p as usize] as usize);
        let all = pairs.iter().flat_map(|&(p, q)| span(p).flat_map(move |i| span(q).map(move |j| (i, j))));
        let pattern = Pattern::new(self.unknowns, all);
        let mut blocks = vec![0.0; pattern.rows.len()];
        for (v, x) in x.iter().enumerate() {
            let functions: Vec<(u32, f64)> =
                self.weights.of(v).iter().flat_map(|&(p, w)| span(p).zip(self.values(p, w, *x))).collect();
            for (k, &(i, a)) in functions.iter().enumerate() {
                for &(j, b) in &functions[..=k] {
                    blocks[pattern.slot(i, j).block as usize] += a * b;
                }
            }
        }
        let mut blocks: Vec<DMat3> = blocks.into_iter().map(|b| DMat3::from_diagonal(DVec3::splat(b))).collect();
        for &diagonal in &pattern.starts[..self.unknowns] {
            let block = &mut blocks[diagonal as usize];
            *block += *block * RIDGE + DMat3::from_diagonal(DVec3::splat(f64::MIN_POSITIVE.sqrt()));
        }
        let mut unknowns = Vec::new();
        self.restrict(x, u, &mut unknowns);
        let none = vec![0.0; self.unknowns];
        Solver::new(&pattern).solve(&pattern, &blocks, &none, true, &mut unknowns)?;
        let mut out = Vec::new();
        self.prolong(x, &unknowns, &mut out);
        Ok(out)
    }
}
