//! One level of a range table: its bounds, its extent, and the errors of a table.

use crate::base::error_text::did_you_mean;
use crate::base::files::Unreadable;

/// Metres in a centimetre: tables are written in centimetres, all other lengths are metres.
pub(crate) const METRES_PER_CM: f64 = 0.01;

/// The expectation of an error about a table without rows.
pub(super) const EXPECTED_ROWS: &str = "at least one row [lower, upper]; [[0, inf]] makes the garment one level";

/// One row of a range table, in centimetres as printed: `lower ≤ d < upper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Lower value V_L, cm.
    pub lower_cm: f64,
    /// Upper value V_H, cm; infinite in an open last row.
    pub upper_cm: f64,
    /// The extent to which PARTs of this level are cut. With `None`, as in the paper, the extent of the run (`--max-extent`)
    /// applies.
    pub extent: Option<Extent>,
}

impl Level {
    /// A level without an extent.
    pub(crate) fn new(lower_cm: f64, upper_cm: f64) -> Self {
        Self { lower_cm, upper_cm, extent: None }
    }

    /// A row as written: lower and upper value, and optionally an extent, or its width and height.
    pub(super) fn from_numbers(row: &[f64]) -> Result<Self, BoundProblem> {
        let (lower_cm, upper_cm, extent) = match *row {
            [lower, upper] => (lower, upper, None),
            [lower, upper, extent] => (lower, upper, Some(Extent::even(extent))),
            [lower, upper, width_cm, height_cm] => (lower, upper, Some(Extent { width_cm, height_cm })),
            _ => return Err(BoundProblem::Length(row.len())),
        };
        Ok(Self { lower_cm, upper_cm, extent })
    }

    /// The row as [`from_numbers`](Self::from_numbers) reads it, cm.
    pub(super) fn numbers_cm(&self) -> impl Iterator<Item = f64> {
        [self.lower_cm, self.upper_cm].into_iter().chain(self.extent.iter().flat_map(Extent::numbers_cm))
    }
}

/// The largest width and height of a PART along the cloth, cm; infinite for a direction that is never cut.
///
/// Width is measured along the weft, height along the warp, which runs up the garment and along a sleeve. Cloth that hangs folds
/// around the body and the arm far more than along them (its displacement varies four times as fast on the flared skirt, six
/// times on the sleeve of pullover-1), so a PART may be taller than wide. Not in the paper, whose PARTs are as large as their level.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Extent {
    /// Along the weft, around the body or the arm, cm.
    pub width_cm: f64,
    /// Along the warp, cm.
    pub height_cm: f64,
}

impl Extent {
    /// The extent of a level that is never cut.
    pub const UNCUT: Self = Self { width_cm: f64::INFINITY, height_cm: f64::INFINITY };

    /// The same width and height.
    #[must_use]
    pub fn even(cm: f64) -> Self {
        Self { width_cm: cm, height_cm: cm }
    }

    /// Whether a level with this extent is cut.
    pub(crate) fn cuts(&self) -> bool {
        *self != Self::UNCUT
    }

    /// Factors for lengths along weft and warp after which the extent is the same along both, and that extent, m.
    pub(crate) fn evened(&self) -> ([f64; 2], f64) {
        let Self { width_cm, height_cm } = *self;
        if width_cm == height_cm {
            ([1.0, 1.0], width_cm * METRES_PER_CM)
        } else if width_cm.is_finite() {
            ([1.0, width_cm / height_cm], width_cm * METRES_PER_CM)
        } else {
            ([0.0, 1.0], height_cm * METRES_PER_CM)
        }
    }

    /// The smaller width and the smaller height of two extents.
    pub(super) fn min(self, other: Self) -> Self {
        Self { width_cm: self.width_cm.min(other.width_cm), height_cm: self.height_cm.min(other.height_cm) }
    }

    /// The extent as a row of a table lists it: one number where width and height are equal.
    pub(super) fn numbers_cm(&self) -> Vec<f64> {
        if self.width_cm == self.height_cm { vec![self.width_cm] } else { vec![self.width_cm, self.height_cm] }
    }

    /// The extent in a column of a table: `12`, `6x24`, `inf`.
    pub(crate) fn in_a_column(&self) -> String {
        self.numbers_cm().iter().map(f64::to_string).collect::<Vec<_>>().join("x")
    }
}

/// For messages: `12`, `6 × 24`, `not cut`.
impl std::fmt::Display for Extent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Rounded, since centimetres converted from metres are off by an ulp.
        let short = |cm: f64| if cm.is_finite() { ((cm * 1e4).round() / 1e4).to_string() } else { "∞".to_owned() };
        if *self == Self::UNCUT {
            f.write_str("not cut")
        } else if self.width_cm == self.height_cm {
            f.write_str(&short(self.width_cm))
        } else {
            write!(f, "{} × {}", short(self.width_cm), short(self.height_cm))
        }
    }
}

impl From<Extent> for String {
    fn from(extent: Extent) -> Self {
        extent.in_a_column()
    }
}

impl TryFrom<String> for Extent {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split('x').map(str::parse).collect();
        match numbers.as_deref() {
            Ok([cm]) => Ok(Self::even(*cm)),
            Ok(&[width_cm, height_cm]) => Ok(Self { width_cm, height_cm }),
            _ => Err(format!("found \"{text}\", expected an extent in centimetres such as 12, 6x24 or inf")),
        }
    }
}

/// The level of the distances between two rows that do not meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GapRule {
    /// The level below extends up to the next one.
    #[default]
    ExtendLower,
    /// The level above extends down to the one before.
    ExtendUpper,
    /// The hole becomes a level between the two.
    OwnLevel,
    /// A table with a hole is an error.
    Error,
}

impl std::fmt::Display for GapRule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        serde::Serialize::serialize(self, f)
    }
}

/// An invalid range table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum TableError {
    /// No such name.
    #[error("no range table is called `{found}`{}; expected `table-3` or a file ending in .toml", did_you_mean(found, ["table-3"]))]
    Unknown { found: String },
    /// An unreadable file.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// Invalid TOML, or a key that is missing, unknown or of another type.
    #[error(
        "{place}: {message}; a range table has name = \"...\", unit = \"cm\", gap = \"extend-lower\" | \"extend-upper\" | \
         \"own-level\" | \"error\" and levels = [[lower, upper], ...]; a third number in a row is the extent, a third and fourth are its width and height"
    )]
    Syntax { place: String, message: String },
    /// A row with invalid bounds, alone or after the row before.
    #[error("{place}: row {row} {problem}")]
    Row { place: String, row: usize, problem: BoundProblem },
    /// An invalid value of a key or a parameter.
    #[error("{what}: found {found}, expected {expected}")]
    Value { what: String, found: String, expected: &'static str },
}

impl TableError {
    pub(super) fn value(what: impl Into<String>, found: impl ToString, expected: &'static str) -> Self {
        Self::Value { what: what.into(), found: found.to_string(), expected }
    }
}

/// The mistake in the bounds of one row (cm).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages name the fields")]
pub enum BoundProblem {
    /// A row without two to four numbers.
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
    /// A hole, which [`GapRule::Error`] forbids.
    #[error(
        "starts at {lower}, but the row before ends at {before} and gap = \"error\" allows no hole; close it, or choose \
         \"extend-lower\", \"extend-upper\" or \"own-level\""
    )]
    Hole { lower: f64, before: f64 },
    /// An extent of at most 0, or NaN.
    #[error(
        "has the extent {0:?}, expected centimetres above 0; inf never cuts the level, and without a third number --max-extent \
         applies"
    )]
    Extent(Vec<f64>),
    /// No rows at all.
    #[error("is missing, expected at least one level [lower, upper]; [[0, inf]] makes the garment one level")]
    Missing,
}

/// The first invalid row (from 1), and its mistake.
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
        } else if let Some(wrong) = extent.filter(|e| !(e.width_cm > 0.0 && e.height_cm > 0.0)) {
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
