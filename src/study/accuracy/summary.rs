//! Summaries of a list of errors: mean, root mean square, 95th percentile, maximum.

use serde::{Deserialize, Serialize};

use crate::base::quantiles::nearest_rank;

/// Millimetres in a metre.
pub(crate) const MM_PER_M: f64 = 1e3;

/// Distances between matching vertices of two drapes; `p95` is the 95th percentile, by nearest rank.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[allow(missing_docs, reason = "named as they are; what is not plain is said")]
pub(crate) struct ErrorSummary {
    pub vertices: usize,
    pub mean_mm: f64,
    pub rms_mm: f64,
    pub p95_mm: f64,
    pub max_mm: f64,
}

impl ErrorSummary {
    /// Summary of errors in metres; all zero for an empty list.
    #[must_use]
    pub(crate) fn of(errors_m: &[f64]) -> Self {
        if errors_m.is_empty() {
            return Self::default();
        }
        let n = errors_m.len() as f64;
        Self {
            vertices: errors_m.len(),
            mean_mm: MM_PER_M * errors_m.iter().sum::<f64>() / n,
            rms_mm: MM_PER_M * (errors_m.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            p95_mm: MM_PER_M * nearest_rank(errors_m, 0.95),
            max_mm: MM_PER_M * errors_m.iter().copied().fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_twenty_by_hand() {
        let errors: Vec<f64> = (1..=20).rev().map(|i| f64::from(i) * 1e-3).collect();
        let s = ErrorSummary::of(&errors);
        assert_eq!(s.vertices, 20);
        assert!((s.mean_mm - 10.5).abs() < 1e-12);
        // Σ i² for 1..20 is 2870.
        assert!((s.rms_mm - (2870.0f64 / 20.0).sqrt()).abs() < 1e-12);
        // 19 of 20 values are at most 19: 95 %.
        assert!((s.p95_mm - 19.0).abs() < 1e-12);
        assert!((s.max_mm - 20.0).abs() < 1e-12);
        assert_eq!(ErrorSummary::of(&[]), ErrorSummary::default());
    }
}
