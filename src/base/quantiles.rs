//! Quantiles of a list of numbers.
//!
//! Nearest rank returns a value of the list; interpolation (type 7 of Hyndman and Fan 1996) is linear between two of them.

use serde::Serialize;

/// The smallest value such that at least `share` of all values do not exceed it (nearest rank); 0 for an empty list.
pub(crate) fn nearest_rank(values: &[f64], share: f64) -> f64 {
    let rank = (share * values.len() as f64).ceil() as usize;
    sorted(values).get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// The quantile at `share` by linear interpolation; 0 for an empty list.
pub(crate) fn interpolated(values: &[f64], share: f64) -> f64 {
    let sorted = sorted(values);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = share * last as f64;
    let low = at.floor() as usize;
    let high = (low + 1).min(last);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

/// Minimum and maximum; (∞, −∞) for no values.
pub(crate) fn extremes(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    values.into_iter().fold(none, |(low, high), value| (low.min(value), high.max(value)))
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Minimum, percentiles and maximum of a list; `p01` is the first percentile. Each is a value of the list, at the rounded rank.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the fields are percentiles, named by their number")]
pub struct Percentiles {
    pub min: f64,
    pub p01: f64,
    pub p05: f64,
    pub p50: f64,
    pub p95: f64,
    pub max: f64,
}

impl Percentiles {
    /// The percentiles of `values`; zeros for an empty list.
    pub(crate) fn of(values: &[f64]) -> Self {
        let sorted = sorted(values);
        let last = sorted.len().saturating_sub(1);
        let at = |share: f64| sorted.get((share * last as f64).round() as usize).copied().unwrap_or_default();
        Self { min: at(0.0), p01: at(0.01), p05: at(0.05), p50: at(0.5), p95: at(0.95), max: at(1.0) }
    }

    /// A phrase for a report, each value times `scale` with `digits` decimals.
    pub(crate) fn text(&self, scale: f64, digits: usize) -> String {
        let [min, p01, p05, p50, p95, max] =
            [self.min, self.p01, self.p05, self.p50, self.p95, self.max].map(|v| format!("{:.digits$}", v * scale));
        format!("{min} smallest, {p01} (1 %), {p05} (5 %), {p50} median, {p95} (95 %), {max} largest")
    }
}
