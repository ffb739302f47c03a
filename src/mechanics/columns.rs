//! Vectors side by side: Vᵀ w and w − V s, as a method takes them that keeps all its vectors orthogonal.
//!
//! Each goes over memory once, a piece of w that stays in the processor's nearest cache at a time, and the pieces go over the threads. They
//! are cut the same way whatever their number, and sums are taken in their order, hence the same bits.

use rayon::prelude::*;

/// Numbers of a piece: 24 kB of w.
const PIECE: usize = 3072;

/// V.
#[derive(Debug, Default)]
pub(super) struct Columns(Vec<Vec<f64>>);

impl Columns {
    pub(super) fn push(&mut self, column: Vec<f64>) {
        self.0.push(column);
    }

    /// Vᵀ w, of the columns from `first` on.
    pub(super) fn times(&self, first: usize, w: &[f64]) -> Vec<f64> {
        let columns = &self.0[first..];
        let of_piece = |(piece, w): (usize, &[f64])| -> Vec<f64> {
            columns.iter().map(|column| dot(&column[piece * PIECE..][..w.len()], w)).collect()
        };
        let pieces: Vec<Vec<f64>> = w.par_chunks(PIECE).enumerate().map(of_piece).collect();
        (0..columns.len()).map(|j| pieces.iter().map(|sums| sums[j]).sum()).collect()
    }

    /// w ← w − V s, of the columns from `first` on.
    pub(super) fn less(&self, first: usize, shares: &[f64], w: &mut [f64]) {
        w.par_chunks_mut(PIECE).enumerate().for_each(|(piece, w)| {
            for (column, share) in self.0[first..].iter().zip(shares) {
                for (w, v) in w.iter_mut().zip(&column[piece * PIECE..]) {
                    *w -= share * v;
                }
            }
        });
    }

    /// V s.
    pub(super) fn sum(&self, shares: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.0.first().map_or(0, Vec::len)];
        let less: Vec<f64> = shares.iter().map(|s| -s).collect();
        self.less(0, &less, &mut sum);
        sum
    }
}

/// a·b, in eight sums that do not wait for each other.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_off_leaves_a_vector_orthogonal_to_all() {
        let n = 3 * PIECE + 5;
        // Half a wave, a whole one, ...: orthogonal as they are, each of length √(n/2).
        let wave = |k: usize| {
            let turns = (k as f64 + 1.0) * std::f64::consts::PI / n as f64;
            (0..n).map(move |i| ((i as f64 + 0.5) * turns).sin())
        };
        let length = (n as f64 / 2.0).sqrt();
        let mut columns = Columns::default();
        (0..4).for_each(|k| columns.push(wave(k).map(|x| x / length).collect()));
        let w: Vec<f64> = (0..n).map(|i| (0.37 * i as f64).cos() + 1e-3 * i as f64).collect();
        for first in [0, 2] {
            let shares = columns.times(first, &w);
            let plain: f64 = wave(first).zip(&w).map(|(a, b)| a / length * b).sum();
            assert!((shares[0] - plain).abs() < 1e-9 * plain.abs());
            let mut left = w.clone();
            columns.less(first, &shares, &mut left);
            let after = columns.times(0, &left);
            assert!(after[first..].iter().all(|s| s.abs() < 1e-9), "{after:?}");
            assert!(first == 0 || after[0].abs() > 0.1, "{after:?}");
        }
        let sum = columns.sum(&[0.0, 2.0, 0.0, 0.0]);
        assert!(sum.iter().zip(wave(1)).all(|(s, x)| (s - 2.0 * x / length).abs() < 1e-15));
    }
}
