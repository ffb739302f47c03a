//! Samples of the elements of each PART.
//!
//! An element belongs to every PART that moves one of its vertices. A PART of n elements takes a share r/√n of them, spread evenly by a
//! low-discrepancy sequence (multiples of the golden section); a sampled element stands for as many as the inverse of its share.

use super::weights::Weights;
use crate::mechanics::energy::membrane::Triangle;

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Index of each sampled triangle and the number of triangles that it stands for, r times the root of their number for each of `parts`. A
/// vertex counts as as many triangles as there are to a vertex.
pub(super) fn sampled_triangles(parts: usize, weights: &Weights, triangles: &[Triangle], r: f64) -> Vec<(u32, f64)> {
    let vertices = weights.len();
    let each = triangles.len() as f64 / vertices as f64;
    let mut size = vec![0.0; parts];
    for list in (0..vertices).map(|v| weights.of(v)) {
        for &(p, _) in list {
            size[p as usize] += each / list.len() as f64;
        }
    }
    let share: Vec<f64> = size.into_iter().map(|size| r / size.sqrt()).collect();
    let largest = |v: usize| weights.of(v).iter().map(|w| share[w.0 as usize]).fold(0.0, f64::max);
    let of_vertex: Vec<f64> = (0..vertices).map(largest).collect();
    sampled(triangles.iter().map(|t| t.vertices.iter().map(|&v| of_vertex[v as usize]).fold(0.0, f64::max)))
}

/// Index of each sampled vertex and the number of vertices that it stands for, r times the root of their number for each of `parts`.
/// `part_of` is the PART of each vertex; one without a PART is not sampled.
pub(super) fn sampled_vertices(parts: usize, part_of: &[Option<u32>], r: f64) -> Vec<(u32, f64)> {
    let mut size = vec![0.0; parts];
    part_of.iter().flatten().for_each(|&p| size[p as usize] += 1.0);
    sampled(part_of.iter().map(|p| p.map_or(0.0, |p| r / f64::sqrt(size[p as usize]))))
}

/// The elements that are sampled by these shares, each with the inverse of its share.
fn sampled(shares: impl Iterator<Item = f64>) -> Vec<(u32, f64)> {
    let sequence = (0u32..).map(|i| (f64::from(i) * GOLDEN).fract());
    let taken = sequence.zip(shares).zip(0..).filter(|((at, share), _)| at < share);
    taken.map(|((_, share), i)| (i, share.min(1.0).recip())).collect()
}
