//! Small linear algebra of the solvers: products of vectors, a dense basis, and the eigenvalues of small symmetric matrices.
//!
//! A [`Basis`] stores the vectors of a method with full orthogonalisation. Its products Vᵀ w and w − V s pass over memory once: a chunk of w
//! stays in the nearest cache, and chunks are divided among the threads. The chunks do not depend on the number of threads, and sums are
//! taken in their order, hence the same bits.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::base::math;

/// Most sweeps of Jacobi rotations: twice the most observed for 40 rows.
const MAX_JACOBI_SWEEPS: usize = 20;

/// Ratio of the squares off the diagonal to those on it at which they are rounding.
const JACOBI_TOLERANCE: f64 = 1e-28;

/// Numbers in a chunk: 24 kB of w.
const CHUNK: usize = 3072;

/// ‖a‖₂.
pub(crate) fn norm(a: &[DVec3]) -> f64 {
    a.iter().map(|a| a.length_squared()).sum::<f64>().sqrt()
}

/// a · b.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// a · b of scalars, in eight independent sums.
pub(super) fn dot_flat(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// The columns of a matrix V.
#[derive(Debug, Default)]
pub(super) struct Basis(Vec<Vec<f64>>);

impl Basis {
    pub(super) fn push(&mut self, column: Vec<f64>) {
        self.0.push(column);
    }

    /// Vᵀ w for the columns from `first` on.
    pub(super) fn transposed_times(&self, first: usize, w: &[f64]) -> Vec<f64> {
        let columns = &self.0[first..];
        let of_chunk = |(chunk, w): (usize, &[f64])| -> Vec<f64> {
            columns.iter().map(|column| dot_flat(&column[chunk * CHUNK..][..w.len()], w)).collect()
        };
        let chunks: Vec<Vec<f64>> = w.par_chunks(CHUNK).enumerate().map(of_chunk).collect();
        (0..columns.len()).map(|j| chunks.iter().map(|sums| sums[j]).sum()).collect()
    }

    /// w ← w − V s for the columns from `first` on.
    pub(super) fn subtract(&self, first: usize, shares: &[f64], w: &mut [f64]) {
        w.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, w)| {
            for (column, share) in self.0[first..].iter().zip(shares) {
                for (w, v) in w.iter_mut().zip(&column[chunk * CHUNK..]) {
                    *w -= share * v;
                }
            }
        });
    }

    /// V s.
    pub(super) fn times(&self, shares: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.0.first().map_or(0, Vec::len)];
        let negative: Vec<f64> = shares.iter().map(|s| -s).collect();
        self.subtract(0, &negative, &mut sum);
        sum
    }
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix by Jacobi rotations (Golub, Van Loan: "Matrix Computations", 8.5). Eight sweeps are
/// three more than ever observed.
pub(crate) fn eigen(m: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut m = m.to_cols_array_2d();
    let mut v = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..8 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let t = theta.signum() / (theta.abs() + math::hypot(theta, 1.0));
            let c = math::hypot(t, 1.0).recip();
            let s = t * c;
            for row in &mut m {
                (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
            }
            let (a, b) = (m[p], m[q]);
            m[p] = std::array::from_fn(|k| c * a[k] - s * b[k]);
            m[q] = std::array::from_fn(|k| s * a[k] + c * b[k]);
            (v[p], v[q]) = (v[p] * c - v[q] * s, v[p] * s + v[q] * c);
        }
    }
    ([m[0][0], m[1][1], m[2][2]], v)
}

/// Eigenvalues, ascending, and unit eigenvectors of a symmetric matrix of `n` rows by cyclic Jacobi rotations (Golub, Van Loan: "Matrix
/// Computations", 8.5).
pub(super) fn symmetric_eigen(mut m: Vec<f64>, n: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    // Row k of `v` is the k-th eigenvector.
    let mut v: Vec<f64> = (0..n * n).map(|at| if at / n == at % n { 1.0 } else { 0.0 }).collect();
    for _ in 0..MAX_JACOBI_SWEEPS {
        let squares = |on: bool| (0..n * n).filter(|at| (at / n == at % n) == on).map(|at| m[at] * m[at]).sum::<f64>();
        if squares(false) <= JACOBI_TOLERANCE * squares(true) {
            break;
        }
        for (p, q) in (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))) {
            let off = m[p * n + q];
            if off == 0.0 {
                continue;
            }
            let theta = (m[q * n + q] - m[p * n + p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + math::hypot(theta, 1.0));
            let c = math::hypot(t, 1.0).recip();
            let s = t * c;
            for k in 0..n {
                let (a, b) = (m[k * n + p], m[k * n + q]);
                (m[k * n + p], m[k * n + q]) = (c * a - s * b, s * a + c * b);
            }
            for of in [&mut m, &mut v] {
                for k in 0..n {
                    let (a, b) = (of[p * n + k], of[q * n + k]);
                    (of[p * n + k], of[q * n + k]) = (c * a - s * b, s * a + c * b);
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| m[a * n + a].total_cmp(&m[b * n + b]));
    (order.iter().map(|k| m[k * n + k]).collect(), order.iter().map(|k| v[k * n..][..n].to_vec()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::outer;

    #[test]
    fn subtracting_the_projections_leaves_an_orthogonal_vector() {
        let n = 3 * CHUNK + 5;
        // Sine waves of 1/2, 1, ... periods: orthogonal, each of norm √(n/2).
        let wave = |k: usize| {
            let turns = (k as f64 + 1.0) * std::f64::consts::PI / n as f64;
            (0..n).map(move |i| ((i as f64 + 0.5) * turns).sin())
        };
        let length = (n as f64 / 2.0).sqrt();
        let mut basis = Basis::default();
        (0..4).for_each(|k| basis.push(wave(k).map(|x| x / length).collect()));
        let w: Vec<f64> = (0..n).map(|i| (0.37 * i as f64).cos() + 1e-3 * i as f64).collect();
        for first in [0, 2] {
            let shares = basis.transposed_times(first, &w);
            let plain: f64 = wave(first).zip(&w).map(|(a, b)| a / length * b).sum();
            assert!((shares[0] - plain).abs() < 1e-9 * plain.abs());
            let mut left = w.clone();
            basis.subtract(first, &shares, &mut left);
            let after = basis.transposed_times(0, &left);
            assert!(after[first..].iter().all(|s| s.abs() < 1e-9), "{after:?}");
            assert!(first == 0 || after[0].abs() > 0.1, "{after:?}");
        }
        let sum = basis.times(&[0.0, 2.0, 0.0, 0.0]);
        assert!(sum.iter().zip(wave(1)).all(|(s, x)| (s - 2.0 * x / length).abs() < 1e-15));
    }

    #[test]
    fn eigenvalues_and_eigenvectors_rebuild_the_matrix() {
        let m = DMat3::from_cols(DVec3::new(2.0, -1.0, 0.3), DVec3::new(-1.0, 1.5, 0.7), DVec3::new(0.3, 0.7, -0.4));
        let (values, vectors) = eigen(m);
        let rebuilt = (0..3).fold(DMat3::ZERO, |sum, k| {
            let v = vectors[k];
            sum + outer(v, v) * values[k]
        });
        assert!((rebuilt - m).to_cols_array().iter().all(|d| d.abs() < 1e-12), "{rebuilt}");
    }

    #[test]
    fn eigenvalues_of_a_chain_are_those_of_the_closed_form() {
        // 2 on the diagonal, −1 beside it: 2 − 2 cos(k π / (n + 1)).
        let n = 40;
        let at = |i: usize, j: usize| {
            if i == j {
                2.0
            } else if i.abs_diff(j) == 1 {
                -1.0
            } else {
                0.0
            }
        };
        let m: Vec<f64> = (0..n * n).map(|k| at(k / n, k % n)).collect();
        let (values, vectors) = symmetric_eigen(m, n);
        for (k, (value, vector)) in values.iter().zip(&vectors).enumerate() {
            let exact = 2.0 - 2.0 * ((k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64).cos();
            assert!((value - exact).abs() < 1e-12, "{k}: {value} and {exact}");
            let product = |i: usize| (0..n).map(|j| at(i, j) * vector[j]).sum::<f64>();
            assert!((0..n).all(|i| (product(i) - value * vector[i]).abs() < 1e-12));
        }
        assert_eq!(symmetric_eigen(Vec::new(), 0), (Vec::new(), Vec::new()));
    }
}
