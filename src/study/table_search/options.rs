//! Options of a search: bounds, extents, rounds.

use crate::mechanics::coupled::Motion;
use crate::parts::range_table::RangeTable;

/// Options of a search.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SearchOptions {
    /// Motion of a PART: an affine map as in the coupled model, or a translation as in the paper.
    pub motion: Motion,
    /// Candidate bounds per round. Default 400, with extents 120, because every level between two candidates is evaluated and, with
    /// extents, cut.
    pub candidates: usize,
    /// Largest number of distinct distances of a single garment at which every bound is a candidate, so that one round is exact.
    /// Default 12,000 for levels alone, 0 with extents.
    pub exact_up_to: usize,
    /// Widths to which a level may be cut, cm; a level may also stay uncut. Empty for levels alone.
    pub widths_cm: Vec<f64>,
    /// Ratios of height to width of the pieces. Default 1/2, 1, 2 and 4: powers of two are exact, so that one sequence of seeds serves
    /// all widths.
    pub shapes: Vec<f64>,
    /// Candidate bounds in each round after the first. Default 400, with extents 40.
    pub candidates_around: usize,
    /// Rounds: the first over quantiles, the others around the best table so far and, with extents, over a finer grid of widths and
    /// shapes. The search ends early if two rounds reduce the error by less than a thousandth. Default 3, with extents 12.
    pub rounds: usize,
    /// Least thickness of a level, cm. A thinner level isolates single vertices of these garments and does not carry over to others.
    /// Default 0 for levels alone, 0.1 with extents.
    pub thinnest_cm: f64,
    /// Whether a level may stay uncut. Default yes.
    pub uncut: bool,
    /// Tables whose bounds are candidates too, so that the front is never worse than these tables without extents.
    pub include: Vec<RangeTable>,
}

impl Default for SearchOptions {
    /// For levels alone.
    fn default() -> Self {
        let include = vec![RangeTable::table_3()];
        Self {
            motion: Motion::Affine,
            candidates: 400,
            candidates_around: 400,
            exact_up_to: 12_000,
            widths_cm: Vec::new(),
            shapes: vec![0.5, 1.0, 2.0, 4.0],
            rounds: 3,
            thinnest_cm: 0.0,
            uncut: true,
            include,
        }
    }
}

impl SearchOptions {
    /// Defaults for levels that may each be cut to one of these widths (cm).
    pub(crate) fn with_extents(widths_cm: &[f64]) -> Self {
        Self {
            candidates: 120,
            candidates_around: 40,
            exact_up_to: 0,
            rounds: 12,
            thinnest_cm: 0.1,
            widths_cm: widths_cm.to_vec(),
            ..Self::default()
        }
    }
}
