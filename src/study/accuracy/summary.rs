//! Vertex errors and their summary: mean, root mean square, 95th percentile, maximum.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::quantiles::nearest_rank;

/// Millimetres in a metre.
pub(super) const MM_PER_M: f64 = 1e3;

/// Distances between matching vertices of two drapes; `p95` is the 95th percentile, by nearest rank.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct ErrorSummary {
    pub vertices: usize,
    pub mean_mm: f64,
    pub rms_mm: f64,
    pub p95_mm: f64,
    pub max_mm: f64,
}

impl ErrorSummary {
    /// Summary of errors in metres; all zero for an empty list.
    pub(crate) fn of(errors_m: &[f64]) -> Self {
        if errors_m.is_empty() {
            return Self::default();
        }
        let n = errors_m.len() as f64;
        Self {
            vertices: errors_m.len(),
            mean_mm: MM_PER_M * errors_m.iter().sum::<f64>() / n,
            rms_mm: MM_PER_M * rms(errors_m),
            p95_mm: MM_PER_M * nearest_rank(errors_m, 0.95),
            max_mm: MM_PER_M * errors_m.iter().copied().fold(0.0, f64::max),
        }
    }
}

/// Root mean square; NaN for an empty list.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Distance of each vertex of `a` to the same vertex of `b`, m.
pub(crate) fn vertex_errors(a: &[DVec3], b: &[DVec3]) -> Vec<f64> {
    a.iter().zip(b).map(|(x, y)| x.distance(*y)).collect()
}

/// Distance of each vertex of `a` to the same vertex of `b`, mm.
pub(crate) fn vertex_errors_mm(a: &[DVec3], b: &[DVec3]) -> Vec<f64> {
    vertex_errors(a, b).iter().map(|e| MM_PER_M * e).collect()
}

/// RMS vertex distance, mm.
#[must_use]
pub fn rms_mm(a: &[DVec3], b: &[DVec3]) -> f64 {
    ErrorSummary::of(&vertex_errors(a, b)).rms_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_of_one_to_twenty_is_the_closed_form() {
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
