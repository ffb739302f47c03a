//! The PARTs' motions as coordinates of the cloth.
//!
//! u(v) = Σ_p w_p(v) [D_p + A_p (x_v − c_p)],
//!
//! with blending weights w_p and, for each PART, a displacement D_p and a displacement gradient A_p. About positions x it is linear in
//! the unknowns, four vectors a PART: D_p and the columns of A_p along the PART's own axes, each divided by the PART's spread along
//! it. A PART of three vertices or fewer has its displacement alone, as every PART does with [`Motion::Translation`]: the paper's.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | w_p | blending weight | – |
//! | D_p, A_p | displacement and its gradient | m, – |
//! | c_p | middle of the PART, by its weights | m |
//!
//! Limits: within a PART nothing bends, and the blend strains the cloth at the seams.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::options::Motion;
use super::part_matrix::PartMatrix;
use super::weights::Weights;
use crate::mechanics::linear_algebra::eigen;
use crate::mechanics::newton::SolveError;
use crate::mesh::{Csr, outer};
use crate::parts::Parts;

/// Numbers of the functions that a PART moves by: its weight, and that times its coordinates.
pub(super) type Values = [f64; 4];

/// Vertices of a PART that has its displacement alone.
const MAX_TRANSLATED: usize = 3;

/// Least spread along an axis, relative to the largest: a flat PART is not turned by what it is thick.
const MIN_SPREAD_RATIO: f64 = 0.05;

/// Vertices in a parallel task.
const CHUNK: usize = 1024;

/// No PART is smaller than this, m.
const MIN_SPREAD_M: f64 = 1e-4;

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
        let of_chunk = |(number, chunk): (usize, &[DVec3])| {
            let mut functions = Csr::default();
            for (v, x) in (number * CHUNK..).zip(chunk) {
                functions.push(self.weights.of(v).iter().flat_map(|&(p, w)| {
                    let count = self.count[p as usize] as usize;
                    (self.first[p as usize]..).zip(self.values(p, w, *x)).take(count)
                }));
            }
            functions
        };
        Csr::joined(x.par_chunks(CHUNK).enumerate().map(of_chunk).collect())
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
        let functions = self.functions_at(x);
        let mut matrix = PartMatrix::new(&self.first, &self.count);
        let mut own = Vec::new();
        for v in 0..x.len() {
            let terms = functions.of(v);
            own.clear();
            own.extend(terms.iter().map(|term| term.0));
            matrix.add(&own, |i, j| terms[i].1 * terms[j].1);
        }
        let mut unknowns = Vec::new();
        self.restrict(x, u, &mut unknowns);
        matrix.factor(&vec![0.0; self.unknowns])?.solve(&mut unknowns);
        let mut out = Vec::new();
        self.prolong(x, &unknowns, &mut out);
        Ok(out)
    }
}
