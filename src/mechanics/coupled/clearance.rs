//! The push-out: no vertex of a preview is left inside the body.
//!
//! A vertex nearer than h to the body goes along ∇q to q = h, again where another part of the body is then too near.

use glam::DVec3;
use rayon::prelude::*;

use crate::body::distance::Body;

/// Times a vertex is moved at most: the second is for narrow places (an armpit), the rest for luck.
const ROUNDS: usize = 4;

/// Nearer than this share of the offset a vertex is moved: rounding may leave it a hair short, and an eighth of the way is near enough.
pub(super) const NEAR: f64 = 0.875;

/// Moves every vertex that is not held to at least its offset (m) from the body; returns how many moved.
pub fn push_out(body: &Body, held: &[bool], offsets_m: &[f64], positions: &mut [DVec3]) -> usize {
    let moved: Vec<bool> = positions
        .par_iter_mut()
        .with_min_len(128)
        .zip(held)
        .zip(offsets_m)
        .map(|((x, &held), &offset_m)| {
            let mut moved = false;
            for _ in 0..if held { 0 } else { ROUNDS } {
                let near = body.nearest(*x);
                if near.signed_distance >= NEAR * offset_m {
                    break;
                }
                *x += near.normal * (offset_m - near.signed_distance);
                moved = true;
            }
            moved
        })
        .collect();
    moved.iter().filter(|&&m| m).count()
}
