//! The linear system of an implicit step: a symmetric matrix in 3×3 blocks by rows, and preconditioned conjugate gradients.
//!
//! A d = b, A symmetric and positive definite, preconditioned by the inverses of its diagonal blocks (block Jacobi).
//! Iterates until ‖b − A d‖ ≤ τ ‖b‖ in the norm of the preconditioner. Source: Hestenes, Stiefel 1952; for cloth
//! Baraff, Witkin: "Large steps in cloth simulation", SIGGRAPH 1998.
//!
//! Blocks and vectors are single precision in SIMD registers, sums are double: a step of a simulation in time needs
//! three or four digits of its solution, and reading the matrix from memory takes most of the time. Rows are shared among the
//! threads, and sums are taken in the order of the rows, so the bits do not depend on the number of threads.

use glam::{Mat3A, Vec3A};
use rayon::prelude::*;

use crate::mesh::Csr;

/// Rows of one parallel task. A heuristic.
const CHUNK: usize = 512;

/// A symmetric matrix of 3×3 blocks, both triangles stored, by rows with ascending columns.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockRows {
    /// Columns of the blocks of each row.
    pub(super) columns: Csr<u32>,
    /// Index of each row's diagonal block.
    pub diagonal: Vec<u32>,
    /// The blocks.
    pub blocks: Vec<Mat3A>,
}

impl BlockRows {
    /// A zero matrix with blocks at `pairs` (in any order, repetitions allowed), their transposes and the diagonal.
    pub(crate) fn new(rows: usize, pairs: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut all: Vec<u64> = (0..rows as u64).map(|i| i << 32 | i).collect();
        all.extend(pairs.flat_map(|(i, j)| [u64::from(i) << 32 | u64::from(j), u64::from(j) << 32 | u64::from(i)]));
        all.par_sort_unstable();
        all.dedup();
        let columns = Csr::gathered(rows, || all.iter().map(|&pair| ((pair >> 32) as u32, pair as u32)));
        let mut matrix = Self { columns, diagonal: Vec::new(), blocks: vec![Mat3A::ZERO; all.len()] };
        matrix.diagonal = (0..rows as u32).filter_map(|i| matrix.at(i, i)).collect();
        matrix
    }

    /// Index of the block in row `i`, column `j`.
    pub(crate) fn at(&self, i: u32, j: u32) -> Option<u32> {
        let found = self.columns.of(i as usize).binary_search(&j).ok();
        found.map(|k| (self.columns.range(i as usize).start + k) as u32)
    }

    /// Row `i` times `d`.
    #[inline]
    fn row_times(&self, i: usize, d: &[Vec3A]) -> Vec3A {
        let mut sums = [Vec3A::ZERO; 2];
        for (k, (block, &j)) in self.blocks[self.columns.range(i)].iter().zip(self.columns.of(i)).enumerate() {
            sums[k & 1] += *block * d[j as usize];
        }
        sums[0] + sums[1]
    }
}

/// A symmetric positive definite matrix as a product with a vector.
pub trait Operator: Sync {
    /// out = A d.
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]);
}

impl Operator for BlockRows {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) {
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
            for (k, out) in out.iter_mut().enumerate() {
                *out = self.row_times(chunk * CHUNK + k, d);
            }
        });
    }
}

/// A linear system (A + B) d = b with block diagonal B.
pub(crate) struct System<'a> {
    /// A.
    pub matrix: &'a mut dyn Operator,
    /// B.
    pub added: &'a [Mat3A],
    /// The diagonal blocks of A + B.
    pub diagonal: &'a [Mat3A],
    /// b.
    pub right_side: &'a [Vec3A],
    /// Rows whose d is fixed.
    pub fixed: &'a [bool],
}

impl System<'_> {
    fn times(&mut self, d: &[Vec3A], out: &mut [Vec3A]) -> f64 {
        self.matrix.times(d, out);
        let mut sum = 0.0;
        for ((out, d), added) in out.iter_mut().zip(d).zip(self.added) {
            *out += *added * *d;
            sum += f64::from(out.dot(*d));
        }
        sum
    }
}

/// Conjugate gradients with their buffers, which are allocated once.
#[derive(Debug, Clone, Default)]
pub(crate) struct ConjugateGradients {
    inverse: Vec<Mat3A>,
    residual: Vec<Vec3A>,
    direction: Vec<Vec3A>,
    image: Vec<Vec3A>,
}

impl ConjugateGradients {
    /// Improves `d` until the residual is below `tolerance` times the right side, both in the preconditioner's norm, or for
    /// `max_iterations`. Returns the number of iterations.
    pub(crate) fn solve(
        &mut self,
        mut system: System<'_>,
        tolerance: f64,
        max_iterations: usize,
        d: &mut [Vec3A],
    ) -> usize {
        let n = d.len();
        let Self { inverse, residual, direction, image } = self;
        for list in [&mut *residual, &mut *direction, &mut *image] {
            list.resize(n, Vec3A::ZERO);
        }
        // The inverse of a fixed row is zero: its residual is ignored and its direction stays zero.
        inverse.clear();
        let inverse_of = |(block, fixed): (&Mat3A, &bool)| if *fixed { Mat3A::ZERO } else { block.inverse() };
        inverse.extend(system.diagonal.iter().zip(system.fixed).map(inverse_of));
        system.times(d, image);
        let (mut gamma, mut norm_of_right_side) = (0.0, 0.0);
        for i in 0..n {
            residual[i] = system.right_side[i] - image[i];
            direction[i] = inverse[i] * residual[i];
            gamma += f64::from(residual[i].dot(direction[i]));
            norm_of_right_side += f64::from(system.right_side[i].dot(inverse[i] * system.right_side[i]));
        }
        let target = tolerance * tolerance * norm_of_right_side;
        let mut iterations = 0;
        while iterations < max_iterations && gamma > target {
            let curvature = system.times(direction, image);
            if curvature.is_nan() || curvature <= 0.0 {
                break;
            }
            let step = (gamma / curvature) as f32;
            let mut next = 0.0;
            for i in 0..n {
                d[i] += step * direction[i];
                residual[i] -= step * image[i];
                image[i] = inverse[i] * residual[i];
                next += f64::from(residual[i].dot(image[i]));
            }
            let beta = (next / gamma) as f32;
            for i in 0..n {
                direction[i] = image[i] + beta * direction[i];
            }
            gamma = next;
            iterations += 1;
        }
        iterations
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of springs with its first point fixed: −d_{i−1} + 2 d_i − d_{i+1} = b_i.
    fn chain(n: u32) -> BlockRows {
        let mut a = BlockRows::new(n as usize, (1..n).map(|i| (i - 1, i)));
        for i in 0..n {
            let own = a.diagonal[i as usize] as usize;
            a.blocks[own] = Mat3A::IDENTITY * if i + 1 < n { 2.0 } else { 1.0 };
            for j in [i.wrapping_sub(1), i + 1] {
                if let Some(k) = (j < n).then(|| a.at(i, j)).flatten() {
                    a.blocks[k as usize] = -Mat3A::IDENTITY;
                }
            }
        }
        a
    }

    #[test]
    fn a_hanging_chain_has_its_closed_form() {
        let n = 40;
        let mut a = chain(n);
        let mut fixed = vec![false; n as usize];
        fixed[0] = true;
        let side = vec![Vec3A::new(0.0, 1.0, -1.0); n as usize];
        let mut d = vec![Vec3A::ZERO; n as usize];
        let own: Vec<Mat3A> = a.diagonal.iter().map(|&k| a.blocks[k as usize]).collect();
        let added = vec![Mat3A::ZERO; n as usize];
        let system = System { matrix: &mut a, added: &added, diagonal: &own, right_side: &side, fixed: &fixed };
        let iterations = ConjugateGradients::default().solve(system, 1e-6, 200, &mut d);
        assert!(iterations < 60, "{iterations}");
        for i in 0..n {
            // Each spring carries the weight below it: d_i = Σ_{k ≤ i} (n − k).
            let exact: u32 = (1..=i).map(|k| n - k).sum();
            let off = (d[i as usize] - Vec3A::new(0.0, 1.0, -1.0) * exact as f32).length();
            assert!(off <= 2e-4 * 800.0, "{i}: {} expected {exact}", d[i as usize]);
        }
    }

    #[test]
    fn blocks_are_found_at_their_row_and_column() {
        let a = chain(5);
        assert_eq!(a.columns.len(), 5);
        assert_eq!(a.blocks.len(), 5 + 2 * 4);
        assert!(a.at(2, 3).is_some() && a.at(0, 2).is_none());
        assert_eq!(a.columns.entries()[a.diagonal[3] as usize], 3);
    }
}
