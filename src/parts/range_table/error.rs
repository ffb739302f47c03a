//! What can be wrong with a range table, row by row.

use super::{GapRule, Level};
use crate::base::files::Unreadable;

/// What a table without rows lacks.
pub(super) const EXPECTED_ROWS: &str = "at least one row [lower, upper]; [[0, inf]] makes the garment one level";

/// A range table that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum TableError {
    /// No such name.
    #[error("no range table is called `{found}`; expected `table-3` or a file ending in .toml")]
    Unknown { found: String },
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// Not TOML, or a key that is missing, unknown or of another type.
    #[error(
        "{place}: {message}; a range table has name = \"...\", unit = \"cm\", gap = \"extend-lower\" | \"extend-upper\" | \
         \"own-level\" | \"error\" and levels = [[lower, upper], ...], with an extent as a third number where wanted, or its width and height as a third and fourth"
    )]
    Syntax { place: String, message: String },
    /// A row whose bounds make no sense, alone or after the row before.
    #[error("{place}: row {row} {problem}")]
    Row { place: String, row: usize, problem: BoundProblem },
    /// A key's value, or a parameter, that makes no table.
    #[error("{what}: found {found}, expected {expected}")]
    Value { what: String, found: String, expected: &'static str },
}

impl TableError {
    pub(super) fn value(what: impl Into<String>, found: impl ToString, expected: &'static str) -> Self {
        Self::Value { what: what.into(), found: found.to_string(), expected }
    }
}

/// What is wrong with the bounds of one row (cm).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum BoundProblem {
    /// A row that is not two to four numbers.
    #[error(
        "has {0} numbers, expected [lower, upper], [lower, upper, extent] or [lower, upper, width, height]; an open last \
         row is [lower, inf]"
    )]
    Length(usize),
    /// NaN.
    #[error("is [{0}, {1}], expected two numbers; write the bounds in centimetres")]
    NotANumber(f64, f64),
    /// A negative bound.
    #[error("is [{0}, {1}], expected bounds of at least 0; distances are unsigned, so start at 0")]
    Negative(f64, f64),
    /// Upper not above lower.
    #[error("is [{0}, {1}], expected the upper value above the lower one; swap them or remove the row")]
    Unordered(f64, f64),
    /// An infinite bound before the end.
    #[error("is [{0}, {1}], expected a finite upper value because rows follow; only the last row may end at inf")]
    OpenBeforeTheEnd(f64, f64),
    /// Starts below the start of the row before.
    #[error(
        "starts at {lower}, expected at least {before}, the upper value of the row before; sort the rows by distance"
    )]
    OutOfOrder { lower: f64, before: f64 },
    /// Starts inside the row before.
    #[error("starts at {lower}, inside the row before, which ends at {before}; let it start at {before}")]
    Overlap { lower: f64, before: f64 },
    /// A hole where none is allowed.
    #[error(
        "starts at {lower}, but the row before ends at {before} and gap = \"error\" allows no hole; close it, or choose \
         \"extend-lower\", \"extend-upper\" or \"own-level\""
    )]
    Hole { lower: f64, before: f64 },
    /// An extent that is not above 0.
    #[error(
        "has the extent {0:?}, expected centimetres above 0; inf never cuts the level, and without a third number it is cut as \
         the run asks"
    )]
    Extent(Vec<f64>),
    /// No rows at all.
    #[error("is missing, expected at least one level [lower, upper]; [[0, inf]] makes the garment one level")]
    Missing,
}

/// The first row (from 1) that cannot stand, and why.
pub(super) fn first_problem(rows: &[Level], gap: GapRule) -> Option<(usize, BoundProblem)> {
    if rows.is_empty() {
        return Some((1, BoundProblem::Missing));
    }
    let mut before: Option<(f64, f64)> = None;
    for (i, &Level { lower_cm: lower, upper_cm: upper, extent }) in rows.iter().enumerate() {
        let problem = if lower.is_nan() || upper.is_nan() {
            Some(BoundProblem::NotANumber(lower, upper))
        } else if lower < 0.0 || upper < 0.0 {
            Some(BoundProblem::Negative(lower, upper))
        } else if lower >= upper {
            Some(BoundProblem::Unordered(lower, upper))
        } else if upper == f64::INFINITY && i + 1 < rows.len() {
            Some(BoundProblem::OpenBeforeTheEnd(lower, upper))
        } else if let Some(wrong) = extent.filter(|e| !e.is_valid()) {
            Some(BoundProblem::Extent(wrong.numbers_cm()))
        } else {
            before.and_then(|(start, end)| match lower {
                l if l < start => Some(BoundProblem::OutOfOrder { lower, before: end }),
                l if l < end => Some(BoundProblem::Overlap { lower, before: end }),
                l if l > end && gap == GapRule::Error => Some(BoundProblem::Hole { lower, before: end }),
                _ => None,
            })
        };
        if let Some(problem) = problem {
            return Some((i + 1, problem));
        }
        before = Some((lower, upper));
    }
    None
}
