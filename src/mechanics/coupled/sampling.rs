//! Samples of the elements of each PART.
//!
//! An element belongs to every PART that moves one of its vertices. A PART of n elements takes a share r(n) of them, spread evenly by a
//! low-discrepancy sequence; a sampled element stands for 1/r elements.

use rayon::prelude::*;

use super::weights::Weights;
use crate::mechanics::energy::membrane::Triangle;
use crate::mesh::Csr;

/// Triangles in a parallel task.
const CHUNK: usize = 2048;

/// PARTs of each triangle, ascending: those of its vertices.
pub(super) fn parts_of(weights: &Weights, triangles: &[Triangle]) -> Csr<u32> {
    let of_chunk = |chunk: &[Triangle]| {
        let (mut parts, mut own) = (Csr::default(), Vec::new());
        for t in chunk {
            own.extend(t.vertices.iter().flat_map(|&v| weights.of(v as usize)).map(|w| w.0));
            own.sort_unstable();
            own.dedup();
            parts.push(own.drain(..));
        }
        parts
    };
    Csr::joined(triangles.par_chunks(CHUNK).map(of_chunk).collect())
}

/// Samples the elements of `count` PARTs by a low-discrepancy sequence (multiples of the golden section). Returns the index of each sampled
/// element and the number of elements that it represents. `rate` gives the share that is sampled of a PART of this size.
pub(super) fn sample(count: usize, parts: &Csr<u32>, rate: impl Fn(f64) -> f64) -> Vec<(u32, f64)> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let mut size = vec![0.0; count];
    for i in 0..parts.len() {
        let list = parts.of(i);
        for &p in list {
            size[p as usize] += 1.0 / list.len() as f64;
        }
    }
    let rates: Vec<f64> = size.into_iter().map(rate).collect();
    let mut sampled = Vec::new();
    for i in 0..parts.len() {
        let rate = parts.of(i).iter().map(|&p| rates[p as usize]).fold(0.0, f64::max).min(1.0);
        if (i as f64 * GOLDEN).fract() < rate {
            sampled.push((i as u32, rate.recip()));
        }
    }
    sampled
}
