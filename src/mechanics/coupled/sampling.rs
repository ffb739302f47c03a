//! Samples of the elements of each PART.
//!
//! An element belongs to every PART that moves one of its vertices. A PART of n elements takes a share r(n) of them, spread evenly by a
//! low-discrepancy sequence; a sampled element stands for 1/r elements.

use super::weights::Weights;
use crate::mesh::Csr;

/// PARTs of each element, ascending, from the vertices of each.
pub(super) fn parts_of<'a>(weights: &Weights, all: impl Iterator<Item = &'a [u32]>) -> Csr<u32> {
    let (mut parts, mut own) = (Csr::default(), Vec::new());
    for vertices in all {
        own.extend(vertices.iter().flat_map(|&v| weights.of(v as usize)).map(|w| w.0));
        own.sort_unstable();
        own.dedup();
        parts.push(own.drain(..));
    }
    parts
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
    let mut sampled = Vec::new();
    for i in 0..parts.len() {
        let rate = parts.of(i).iter().map(|&p| rate(size[p as usize])).fold(0.0, f64::max).min(1.0);
        if (i as f64 * GOLDEN).fract() < rate {
            sampled.push((i as u32, rate.recip()));
        }
    }
    sampled
}
