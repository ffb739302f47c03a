//! A lattice of places over a triangle, to ask what vertices and edges do not tell.

use glam::DVec3;

/// Pieces that a side is cut into, least and most, and how long one is at least, m: a fingertip is twice as wide.
const PIECES: [u32; 2] = [3, 12];
const PIECE: f64 = 4e-3;

/// The shares of the corners at each place, of a triangle whose longest side is so long (m); the corners themselves are left out.
pub(crate) fn lattice(longest_side: f64) -> impl Iterator<Item = [f64; 3]> {
    let n = ((longest_side / PIECE).ceil() as u32).clamp(PIECES[0], PIECES[1]);
    let all = (0..=n).flat_map(move |i| (0..=n - i).map(move |j| [i, j, n - i - j]));
    all.filter(move |at| !at.contains(&n)).map(move |at| at.map(|k| f64::from(k) / f64::from(n)))
}

/// The place of these corners with these shares, m.
pub(crate) fn place([a, b, c]: [DVec3; 3], [s, t, u]: [f64; 3]) -> DVec3 {
    a * s + b * t + c * u
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_all_of_a_triangle_but_its_corners() {
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
