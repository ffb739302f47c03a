//! Waves by which a closed curve becomes longer: the folds of a flared skirt before its seams are closed.
//!
//! A curve of girth G gets N waves outwards,
//!
//! y(u) = a (1 − cos(2πu/λ)),  λ = (G + 2πa)/N,
//!
//! with a such that the waves together have the length C:
//!
//! C = (G + 2πa) ∫₀¹ √(1 + (p sin πt)²) dt,  p = 2πa/λ.
//!
//! The mean of y is a, so the curve in the middle of the waves has the girth G + 2πa if the first one is convex. A curve that is long enough
//! gets none. Waves over a convex curve do not intersect, as each direction outwards has one point.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u, y | place along the curve, and distance from it | m |
//! | a | half the height of a wave | m |
//! | λ | width of a wave | m |
//! | p | largest slope | – |
//!
//! Source: own. Limits: widths are taken in the middle of the waves, so a crest is longer than a trough.

use std::f64::consts::{PI, TAU};

use crate::base::math;

/// Samples of half a wave: its length is exact to 1e-5 of it up to a slope of 40.
const SAMPLES: usize = 64;

/// Bisections of a: to a millionth of the length.
const BISECTIONS: usize = 20;

/// Waves of a curve of one girth.
#[derive(Debug, Clone)]
pub(super) struct Waves {
    count: f64,
    /// a, m.
    half_height: f64,
    /// Length of half a wave up to each sample, over half its width.
    ends: Vec<f64>,
}

impl Waves {
    /// As many as `count`, with which a curve of `girth` (m) becomes `length` (m) long.
    pub(super) fn new(count: f64, girth: f64, length: f64) -> Self {
        let ends = |a: f64| half_wave(a * count * TAU / (girth + TAU * a));
        let (mut low, mut high) = (0.0, length);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (girth + TAU * middle) * ends(middle)[SAMPLES] < length {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self { count, half_height: low, ends: ends(low) }
    }

    /// For a share of the waved curve's length: the share of the way around, and the distance y from the curve, m.
    pub(super) fn at(&self, share: f64) -> (f64, f64) {
        let waves = share * self.count;
        let whole = waves.floor();
        let half = 2.0 * (waves - whole);
        // The second half of a wave mirrors the first.
        let (falls, along) = if half > 1.0 { (true, 2.0 - half) } else { (false, half) };
        let length = along * self.ends[SAMPLES];
        let k = self.ends.partition_point(|end| *end <= length).clamp(1, SAMPLES) - 1;
        let within = (length - self.ends[k]) / (self.ends[k + 1] - self.ends[k]);
        let t = (k as f64 + within) / SAMPLES as f64;
        let around = whole + 0.5 * if falls { 2.0 - t } else { t };
        (around / self.count, self.half_height * (1.0 - math::unit(PI * t).x))
    }
}

/// Length of half a wave of this largest slope up to each sample, over half its width.
fn half_wave(slope: f64) -> Vec<f64> {
    let rise = |k: usize| slope * math::unit(PI * (k as f64 + 0.5) / SAMPLES as f64).y;
    let lengths = (0..SAMPLES).map(|k| (1.0 + rise(k) * rise(k)).sqrt() / SAMPLES as f64);
    let mut ends = vec![0.0];
    for length in lengths {
        ends.push(ends[ends.len() - 1] + length);
    }
    ends
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    #[test]
    fn a_circle_gets_the_length_asked_for_at_an_even_pace() {
        let radius = 0.2;
        for ratio in [1.2, 2.0, 5.0] {
            let length = ratio * TAU * radius;
            let waves = Waves::new(12.0, TAU * radius, length);
            let at = |k: usize| {
                let (around, out) = waves.at(k as f64 / 6000.0);
                (radius + out) * math::unit(TAU * around)
            };
            let sides: Vec<f64> = (0..6000).map(|k| DVec2::distance(at(k), at(k + 1))).collect();
            let sum = sides.iter().sum::<f64>();
            // Crests are longer than troughs, flanks are not.
            assert!((sum / length - 1.0).abs() < 0.03, "{ratio}: {}", sum / length);
            let pace = |f: fn(f64, f64) -> f64, from: f64| sides.iter().copied().fold(from, f) * 6000.0 / length;
            assert!(pace(f64::min, f64::INFINITY) > 0.5 && pace(f64::max, 0.0) < 1.6, "{ratio}");
        }
    }

    #[test]
    fn a_curve_that_is_long_enough_gets_no_waves() {
        let waves = Waves::new(12.0, 1.0, 0.9);
        for share in [-0.3, 0.0, 0.1, 0.77] {
            let (around, out) = waves.at(share);
            assert!((around - share).abs() < 1e-9 && out < 1e-5, "{share}: {around}, {out}");
        }
    }
}
