//! Median and spread of the stage times over the repeats of a point.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | median | middle value, mean of the two middle ones for an even number | ms |
//! | spread | interquartile range, quartiles by linear interpolation (type 7 of Hyndman and Fan 1996) | ms |
//!
//! Limits: one repeat has no spread; the column is empty then, not zero.

use std::time::Duration;

/// Stage times of one pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Times {
    /// Closest points on the body.
    pub distance: Duration,
    /// Equation (1).
    pub segment: Duration,
    /// Stage two.
    pub mechanics: Duration,
    /// Full-resolution refinement.
    pub refine: Duration,
    /// All of it, start to end; more than the sum by what lies between.
    pub total: Duration,
}

/// Median and spread of one stage.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Median, ms.
    pub median_ms: f64,
    /// Interquartile range, ms; none for a single repeat.
    pub spread_ms: Option<f64>,
}

/// Median and spread of each stage: distance, segment, mechanics, refine, total.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timing {
    /// In that order.
    pub stages: [Spread; 5],
}

impl Timing {
    /// Of the repeats, warm-up passes left out.
    #[must_use]
    pub fn of(passes: &[Times]) -> Self {
        let stage = |pick: fn(&Times) -> Duration| {
            let mut ms: Vec<f64> = passes.iter().map(|t| 1e3 * pick(t).as_secs_f64()).collect();
            ms.sort_by(f64::total_cmp);
            let spread_ms = (ms.len() > 1).then(|| quantile(&ms, 0.75) - quantile(&ms, 0.25));
            Spread { median_ms: quantile(&ms, 0.5), spread_ms }
        };
        Self {
            stages: [
                stage(|t| t.distance),
                stage(|t| t.segment),
                stage(|t| t.mechanics),
                stage(|t| t.refine),
                stage(|t| t.total),
            ],
        }
    }
}

/// Quantile of sorted values by linear interpolation; 0 of none.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = p * last as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(last);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_interquartile_range_by_hand() {
        let pass = |ms| Times { total: Duration::from_millis(ms), ..Times::default() };
        let total = |passes: &[u64]| Timing::of(&passes.iter().copied().map(pass).collect::<Vec<_>>()).stages[4];
        assert_eq!(total(&[7]), Spread { median_ms: 7.0, spread_ms: None });
        assert_eq!(total(&[9, 1, 5]), Spread { median_ms: 5.0, spread_ms: Some(4.0) });
        let four = total(&[1, 2, 3, 100]);
        assert!((four.median_ms - 2.5).abs() < 1e-9);
        assert!((four.spread_ms.unwrap() - (27.25 - 1.75)).abs() < 1e-9);
    }
}
