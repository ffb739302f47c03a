//! A lattice of sample points over a triangle, for contacts that vertices and edges miss.

use glam::DVec3;

/// Least and largest number of intervals of a side.
const INTERVALS: [u32; 2] = [3, 12];
/// Length of an interval, m: half the width of a fingertip.
const INTERVAL: f64 = 4e-3;

/// Barycentric coordinates of the sample points of a triangle with this longest side (m), without the corners.
pub(crate) fn lattice(longest_side: f64) -> impl Iterator<Item = [f64; 3]> {
    let n = ((longest_side / INTERVAL).ceil() as u32).clamp(INTERVALS[0], INTERVALS[1]);
    let all = (0..=n).flat_map(move |i| (0..=n - i).map(move |j| [i, j, n - i - j]));
    all.filter(move |at| !at.contains(&n)).map(move |at| at.map(|k| f64::from(k) / f64::from(n)))
}

/// The point of a triangle with these barycentric coordinates, m.
pub(crate) fn place([a, b, c]: [DVec3; 3], [s, t, u]: [f64; 3]) -> DVec3 {
    a * s + b * t + c * u
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_points_cover_a_triangle_except_its_corners() {
        for (longest, count) in [(0.001, 7), (0.016, 12), (1.0, 88)] {
            let all: Vec<[f64; 3]> = lattice(longest).collect();
            assert_eq!(all.len(), count);
            let inside =
                |w: &[f64; 3]| (w.iter().sum::<f64>() - 1.0).abs() < 1e-15 && w.iter().all(|w| (0.0..1.0).contains(w));
            assert!(all.iter().all(inside), "{all:?}");
        }
        assert_eq!(place([DVec3::X, DVec3::Y, DVec3::Z], [0.5, 0.25, 0.25]), DVec3::new(0.5, 0.25, 0.25));
    }
}
