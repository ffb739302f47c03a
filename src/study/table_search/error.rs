//! Searches that cannot be run, and the check of what they are given.

use glam::DVec3;

use super::Sample;

/// A search that cannot be run. Garments are numbered from 1, vertices from 0; limits are garment by garment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum SearchError {
    /// Nothing to search on.
    #[error("no garment to tune on, expected at least one")]
    NoGarment,
    /// A list that is not one entry per vertex.
    #[error("garment {garment}: {what} has {found} entries, expected {expected}, one per vertex")]
    Length { garment: usize, what: &'static str, found: usize, expected: usize },
    /// A weight that is no positive number.
    #[error("garment {garment} has the weight {found}, expected a positive, finite number")]
    Weight { garment: usize, found: f64 },
    /// A distance or displacement that is no number.
    #[error("garment {garment}: vertex {vertex} has no finite distance and displacement")]
    NotFinite { garment: usize, vertex: usize },
    /// Even the coarsest table has more PARTs.
    #[error(
        "no table tried is within {} PARTs, not even one single level; allow more PARTs or larger extents",
        max_parts.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
    )]
    TooFewParts { max_parts: Vec<usize> },
}

/// Refuses samples that do not fit together.
pub(super) fn check(samples: &[Sample<'_>]) -> Result<(), SearchError> {
    if samples.is_empty() {
        return Err(SearchError::NoGarment);
    }
    for (garment, s) in (1..).zip(samples) {
        let expected = s.mesh.vertex_count();
        for (what, found) in [("the distances", s.distances_m.len()), ("the displacement", s.displacement.len())] {
            if found != expected {
                return Err(SearchError::Length { garment, what, found, expected });
            }
        }
        if !(s.weight.is_finite() && s.weight > 0.0) {
            return Err(SearchError::Weight { garment, found: s.weight });
        }
        let finite = |(d, u): (&f64, &DVec3)| d.is_finite() && u.is_finite();
        if let Some(vertex) = s.distances_m.iter().zip(s.displacement).position(|pair| !finite(pair)) {
            return Err(SearchError::NotFinite { garment, vertex });
        }
    }
    Ok(())
}
