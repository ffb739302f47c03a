//! The garments of a search, and the check that their data fit together.

use glam::DVec3;

use crate::mesh::{Topology, TriMesh};
use crate::parts::Grain;

/// A garment of a search and its reference drape.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a> {
    /// The garment, undraped.
    pub mesh: &'a TriMesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// The grain of its cloth.
    pub grain: &'a Grain,
    /// Distance of each vertex from the body, m; its sign does not matter.
    pub distances_m: &'a [f64],
    /// Reference displacement of each vertex, undraped to draped, m.
    pub displacement: &'a [DVec3],
    /// Weight of its squared error beside that of the other garments; only the ratios matter.
    pub weight: f64,
    /// Largest number of PARTs of the garment; clamped to its number of vertices.
    pub max_parts: usize,
}

/// Weight of a vertex of each garment in the squared error.
pub(super) fn vertex_weights(samples: &[Sample<'_>]) -> Vec<f64> {
    let total_weight: f64 = samples.iter().map(|s| s.weight).sum();
    samples.iter().map(|s| s.weight / (total_weight * s.distances_m.len() as f64)).collect()
}

/// Why a search cannot run. Garments are numbered from 1, vertices from 0; there is one limit of PARTs per garment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum SearchError {
    /// The list of garments is empty.
    #[error("no garment to tune on, expected at least one")]
    NoGarment,
    /// A list does not have one entry per vertex.
    #[error("garment {garment}: {what} has {found} entries, expected {expected}, one per vertex")]
    Length { garment: usize, what: &'static str, found: usize, expected: usize },
    /// A weight is not positive and finite.
    #[error("garment {garment} has the weight {found}, expected a positive, finite number")]
    Weight { garment: usize, found: f64 },
    /// A distance or displacement is not finite.
    #[error("garment {garment}: vertex {vertex} has no finite distance and displacement")]
    NotFinite { garment: usize, vertex: usize },
    /// The coarsest table has more PARTs than allowed.
    #[error(
        "no table tried is within {} PARTs, not even one single level; allow more PARTs or larger extents",
        max_parts.iter().map(usize::to_string).collect::<Vec<_>>().join(" and ")
    )]
    TooFewParts { max_parts: Vec<usize> },
}

/// Checks that the data of each garment fit together.
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
