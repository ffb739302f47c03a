//! Sine waves k sin t by their largest slope k, tabulated: arc length over chord, and mean square curvature along the arc.
//!
//! ℓ(k) = 1/2π ∫ √(1 + k² cos² t) dt,  κ²(k) = ∫ k² sin² t / (1 + k² cos² t)^{5/2} dt / ∫ √(1 + k² cos² t) dt, over a period.
//!
//! Limits: slopes up to 12; between rows of the table both are linear.

use std::f64::consts::TAU;

use crate::base::math;

/// The table.
#[derive(Debug)]
pub(super) struct SineWaves {
    lengths: Vec<f64>,
    square_curvatures: Vec<f64>,
}

impl SineWaves {
    /// Largest slope, and interval of the table.
    const MAX_SLOPE: f64 = 12.0;
    const INTERVAL: f64 = 0.05;
    /// Points of the midpoint rule over a period.
    const POINTS: usize = 64;

    pub(super) fn new() -> Self {
        let squares: Vec<f64> = (0..Self::POINTS)
            .map(|i| {
                let cos = math::cos((i as f64 + 0.5) * TAU / Self::POINTS as f64);
                cos * cos
            })
            .collect();
        let row = |i: usize| {
            let k = i as f64 * Self::INTERVAL;
            let (mut length, mut curvature) = (0.0, 0.0);
            for cos2 in &squares {
                let arc2 = 1.0 + k * k * cos2;
                length += arc2.sqrt();
                // κ² = k² sin² / arc⁶ over an arc of that length.
                curvature += k * k * (1.0 - cos2) / (arc2 * arc2 * arc2.sqrt());
            }
            (length / Self::POINTS as f64, curvature / length)
        };
        let (lengths, square_curvatures) = (0..=(Self::MAX_SLOPE / Self::INTERVAL) as usize).map(row).unzip();
        Self { lengths, square_curvatures }
    }

    /// The slope at which the arc is `ratio` times its chord.
    pub(super) fn slope(&self, ratio: f64) -> f64 {
        let above = self.lengths.partition_point(|&length| length < ratio).clamp(1, self.lengths.len() - 1);
        let (low, high) = (self.lengths[above - 1], self.lengths[above]);
        Self::INTERVAL * ((above - 1) as f64 + ((ratio - low) / (high - low)).clamp(0.0, 1.0))
    }

    /// Mean square curvature along the arc at a wave number of 1/m, 1/m².
    pub(super) fn square_curvature(&self, slope: f64) -> f64 {
        let at = (slope / Self::INTERVAL).clamp(0.0, (self.lengths.len() - 2) as f64);
        let (below, share) = (at as usize, at.fract());
        self.square_curvatures[below] * (1.0 - share) + self.square_curvatures[below + 1] * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_a_wave_gives_its_length() {
        let wave = SineWaves::new();
        assert!(wave.slope(1.0) < 1e-12);
        // ∫ √(1 + cos² t) dt over a period is 7.640396 (1.2160067 of it).
        assert!((wave.slope(1.216_006_7) - 1.0).abs() < 1e-3);
    }
}
