//! Median and spread of the stage times over the repeats of a point.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | median | middle value, mean of the two middle ones for an even number | ms |
//! | spread | interquartile range, quartiles by linear interpolation (type 7 of Hyndman and Fan 1996) | ms |
//!
//! Limits: one repeat has no spread; the column is empty then, not zero.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::base::quantiles::interpolated;
use crate::drape::StageTimes;

/// Median of each stage, and spread for more than one repeat. These columns differ from run to run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)] // Stages as in `StageTimes`.
pub struct Timing {
    pub time_distance_ms: f64,
    pub time_distance_spread_ms: Option<f64>,
    pub time_segment_ms: f64,
    pub time_segment_spread_ms: Option<f64>,
    #[serde(default)]
    pub time_cloth_ms: f64,
    #[serde(default)]
    pub time_cloth_spread_ms: Option<f64>,
    pub time_mechanics_ms: f64,
    pub time_mechanics_spread_ms: Option<f64>,
    pub time_refine_ms: f64,
    pub time_refine_spread_ms: Option<f64>,
    /// Time outside the stages: tables by rule, final penetration and intersections.
    #[serde(default)]
    pub time_other_ms: f64,
    #[serde(default)]
    pub time_other_spread_ms: Option<f64>,
    pub time_total_ms: f64,
    pub time_total_spread_ms: Option<f64>,
}

impl Timing {
    /// Median and spread over the timed passes.
    #[must_use]
    pub fn of(passes: &[StageTimes]) -> Self {
        type Stage = fn(StageTimes) -> Duration;
        let at = |of: Stage, share: f64| {
            interpolated(&passes.iter().map(|t| 1e3 * of(*t).as_secs_f64()).collect::<Vec<_>>(), share)
        };
        let median = |of: Stage| at(of, 0.5);
        let spread = |of: Stage| (passes.len() > 1).then(|| at(of, 0.75) - at(of, 0.25));
        Self {
            time_distance_ms: median(|t| t.distance),
            time_distance_spread_ms: spread(|t| t.distance),
            time_segment_ms: median(|t| t.segment),
            time_segment_spread_ms: spread(|t| t.segment),
            time_cloth_ms: median(|t| t.cloth),
            time_cloth_spread_ms: spread(|t| t.cloth),
            time_mechanics_ms: median(|t| t.mechanics),
            time_mechanics_spread_ms: spread(|t| t.mechanics),
            time_refine_ms: median(|t| t.refine),
            time_refine_spread_ms: spread(|t| t.refine),
            time_other_ms: median(StageTimes::other),
            time_other_spread_ms: spread(StageTimes::other),
            time_total_ms: median(|t| t.total),
            time_total_spread_ms: spread(|t| t.total),
        }
    }

    /// Medians of the stages, of the time between them, and of the total, ms.
    pub(crate) fn stages(&self) -> [(&'static str, f64); 7] {
        [
            ("distance", self.time_distance_ms),
            ("segment", self.time_segment_ms),
            ("cloth", self.time_cloth_ms),
            ("mechanics", self.time_mechanics_ms),
            ("refine", self.time_refine_ms),
            ("other", self.time_other_ms),
            ("total", self.time_total_ms),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_interquartile_range_by_hand() {
        let pass = |ms| StageTimes { total: Duration::from_millis(ms), ..StageTimes::default() };
        let total = |passes: &[u64]| {
            let timing = Timing::of(&passes.iter().copied().map(pass).collect::<Vec<_>>());
            (timing.time_total_ms, timing.time_total_spread_ms)
        };
        assert_eq!(total(&[7]), (7.0, None));
        assert_eq!(total(&[9, 1, 5]), (5.0, Some(4.0)));
        let (median, spread) = total(&[1, 2, 3, 100]);
        assert!((median - 2.5).abs() < 1e-9);
        assert!((spread.unwrap() - (27.25 - 1.75)).abs() < 1e-9);
    }
}
