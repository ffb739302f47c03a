//! Points in the order of a curve that fills space, so that each is near the one before.
//!
//! The bits of a point's three coordinates, in 1024 steps of the longest side of the box about all points, are put in turn into one number,
//! and points sorted by it (G. M. Morton: "A computer oriented geodetic data base", IBM, 1966). A search that begins where the one
//! before ended then reads what that one has read.

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::box_about;

/// Steps along the longest side.
const STEPS: f64 = 1023.0;

/// Fewer are no work for another thread.
const ALONE: usize = 4096;

/// The numbers of `points` in their order along the curve; of those in one place the first comes first.
pub(super) fn along_a_curve(points: &[DVec3]) -> Vec<u32> {
    let (low, high) = box_about(points.iter().copied());
    let side = (high - low).max_element();
    let scale = if side > 0.0 { STEPS / side } else { 0.0 };
    let key = |p: &DVec3| {
        let [x, y, z] = ((*p - low) * scale).to_array().map(|step| spread(step as u64));
        x | y << 1 | z << 2
    };
    let keyed = points.par_iter().enumerate().with_min_len(ALONE).map(|(i, p)| key(p) << 32 | i as u64);
    let mut order: Vec<u64> = keyed.collect();
    order.par_sort_unstable();
    order.into_iter().map(|keyed| keyed as u32).collect()
}

/// Two zeros before each of the lowest ten bits.
fn spread(bits: u64) -> u64 {
    let mut x = bits & 0x3ff;
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_is_gone_through_by_halves_and_every_point_comes_once() {
        let at = |i: u32| DVec3::new(f64::from(i / 16), f64::from(i / 4 % 4), f64::from(i % 4));
        let points: Vec<DVec3> = (0..64).map(at).collect();
        let order = along_a_curve(&points);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..64));
        // Each eighth of the cube in one go.
        for eighth in order.chunks(8) {
            let octant = |i: &u32| (points[*i as usize] / 2.0).floor();
            assert!(eighth.iter().all(|i| octant(i) == octant(&eighth[0])));
        }
        assert!(along_a_curve(&[]).is_empty());
        assert_eq!(along_a_curve(&[DVec3::ONE; 3]), [0, 1, 2]);
    }
}
