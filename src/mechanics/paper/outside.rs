//! Keeping displaced vertices outside the body: what would be inside goes back to the surface plus thickness, and is counted.

use glam::DVec3;
use rayon::prelude::*;

use crate::body::distance::Body;

/// In a fold narrower than the thickness, a vertex put off one side can land behind the other; it is put out again at most
/// this often.
const ROUNDS: usize = 4;

/// Vertices moved, and how many of them are inside even so.
pub(super) struct Projected {
    pub(super) moved: usize,
    pub(super) left_inside: usize,
}

/// Moves every position inside the body to its nearest surface point plus its thickness (m) along the outward normal.
pub(super) fn put_outside(body: &Body, positions: &mut [DVec3], thickness_m: &[f64]) -> Projected {
    let put = |(x, thickness_m): (&mut DVec3, &f64)| {
        let mut near = body.nearest(*x);
        let moved = near.signed_distance < 0.0;
        for _ in 0..ROUNDS {
            if near.signed_distance >= 0.0 {
                break;
            }
            *x = near.point + *thickness_m * near.normal;
            near = body.nearest(*x);
        }
        (moved, near.signed_distance < 0.0)
    };
    let found: Vec<(bool, bool)> = positions.par_iter_mut().with_min_len(256).zip(thickness_m).map(put).collect();
    Projected { moved: found.iter().filter(|f| f.0).count(), left_inside: found.iter().filter(|f| f.1).count() }
}
