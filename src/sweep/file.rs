//! The sweep file as TOML: its keys, and where each value stands, for the messages.
//!
//! ```toml
//! name = "extents of a skirt"
//! repeats = 3                      # timed passes of each point; the rows hold median and spread
//! warm_up = 1                      # passes before them
//!
//! [base]                           # what all points share, one value a key
//! garment = "flared-skirt@3920"
//!
//! [grid]                           # lists: every combination is a point
//! tables = ["table-3", { quantile = [10, 20] }]
//! extents_cm = ["none", 8, 5, [12, 6, 3]]
//!
//! [[points]]                       # single points beside the grid, or instead of it
//! table = { scale = 0.5 }
//! refine = "converged"
//! ```
//!
//! | in `[base]`, `[[points]]` | in `[grid]` | values | default |
//! |---|---|---|---|
//! | `body` | `bodies` | `form`, OBJ, TOML of measurements, or `{ bust = 92, ... }` in cm with `of`, `name` | `form` |
//! | `garment` | `garments` | `name@vertices` or file | `low-cut-dress` |
//! | `size` | `sizes` | vertices, or `larger`, `smaller` of Table 4; for a garment built in and named without | – |
//! | `fabric` | `fabrics` | built-in name or file | `interlock` |
//! | `model` | `models` | `paper`, `coupled` | `coupled` |
//! | `table` | `tables` | see [`tables`](super::tables) | `table-3` |
//! | `extent_cm` | `extents_cm` | cm; 0 or `none` for not cut; a list for a cascade, coarse to fine | `none` |
//! | `min_part` | `min_parts` | vertices; `coupled` joins PARTs smaller than its finest extent in any case | 1 |
//! | `refine` | `refine` | steps or `converged` | 0 |
//! | `seed` | `seeds` | 0 is the undisturbed start | 0 |
//! | `options` | `options` | `{ name = value, ... }`: whatever else the solver understands | none |

use serde::Deserialize;
use toml::{Spanned, Value};

use super::error::PlanError;

/// A value and where it stands.
pub(super) type At = Spanned<Value>;

/// The file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepFile {
    pub(super) name: String,
    /// What it is for; part of the file, not of any result.
    #[serde(default)]
    pub(super) about: String,
    pub(super) repeats: Option<At>,
    pub(super) warm_up: Option<At>,
    #[serde(default)]
    pub(super) base: Single,
    pub(super) grid: Option<Grid>,
    #[serde(default)]
    pub(super) points: Vec<Single>,
}

/// `[base]` and `[[points]]`.
#[derive(Debug, Default, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Single {
    pub(super) body: Option<At>,
    pub(super) garment: Option<At>,
    pub(super) size: Option<At>,
    pub(super) fabric: Option<At>,
    pub(super) model: Option<At>,
    pub(super) table: Option<At>,
    pub(super) extent_cm: Option<At>,
    pub(super) min_part: Option<At>,
    pub(super) refine: Option<At>,
    pub(super) seed: Option<At>,
    pub(super) options: Option<At>,
}

impl Single {
    /// What is not given here is taken from `base`.
    pub(super) fn or(self, base: &Self) -> Self {
        let or = |own: Option<At>, base: &Option<At>| own.or_else(|| base.clone());
        Self {
            body: or(self.body, &base.body),
            garment: or(self.garment, &base.garment),
            size: or(self.size, &base.size),
            fabric: or(self.fabric, &base.fabric),
            model: or(self.model, &base.model),
            table: or(self.table, &base.table),
            extent_cm: or(self.extent_cm, &base.extent_cm),
            min_part: or(self.min_part, &base.min_part),
            refine: or(self.refine, &base.refine),
            seed: or(self.seed, &base.seed),
            options: or(self.options, &base.options),
        }
    }
}

/// `[grid]`.
#[derive(Debug, Default, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Grid {
    pub(super) bodies: Option<Spanned<Vec<At>>>,
    pub(super) garments: Option<Spanned<Vec<At>>>,
    pub(super) sizes: Option<Spanned<Vec<At>>>,
    pub(super) fabrics: Option<Spanned<Vec<At>>>,
    pub(super) models: Option<Spanned<Vec<At>>>,
    pub(super) tables: Option<Spanned<Vec<At>>>,
    pub(super) extents_cm: Option<Spanned<Vec<At>>>,
    pub(super) min_parts: Option<Spanned<Vec<At>>>,
    pub(super) refine: Option<Spanned<Vec<At>>>,
    pub(super) seeds: Option<Spanned<Vec<At>>>,
    pub(super) options: Option<Spanned<Vec<At>>>,
}

/// The text of a sweep file and its name, for the messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) text: &'a str,
    pub(super) name: &'a str,
}

impl Source<'_> {
    /// Reads the keys.
    pub(super) fn parse(self) -> Result<SweepFile, PlanError> {
        toml::from_str(self.text).map_err(|e| PlanError::Syntax {
            place: e.span().map_or_else(|| self.name.to_owned(), |span| self.line(span.start)),
            message: e.message().replace('\n', ", "),
        })
    }

    /// `file:line` of a value.
    pub(super) fn place(self, value: &At) -> String {
        self.line(value.span().start)
    }

    /// `file:line` of a byte offset.
    pub(super) fn line(self, offset: usize) -> String {
        let line = 1 + self.text.bytes().take(offset).filter(|&b| b == b'\n').count();
        format!("{}:{line}", self.name)
    }

    /// The error for a value that will not do.
    pub(super) fn wrong(self, value: &At, key: &'static str, expected: impl Into<String>) -> PlanError {
        let found = value.get_ref().to_string();
        PlanError::Value { place: self.place(value), key, found, expected: expected.into() }
    }

    /// A string.
    pub(super) fn text(self, value: &At, key: &'static str, expected: &str) -> Result<String, PlanError> {
        match value.get_ref() {
            Value::String(text) if !text.is_empty() => Ok(text.clone()),
            _ => Err(self.wrong(value, key, expected)),
        }
    }

    /// A whole number of at least `least`.
    pub(super) fn count<T: TryFrom<i64> + PartialOrd>(
        self,
        value: &At,
        key: &'static str,
        least: T,
        expected: &str,
    ) -> Result<T, PlanError> {
        let number = value.get_ref().as_integer().and_then(|n| T::try_from(n).ok()).filter(|n| *n >= least);
        number.ok_or_else(|| self.wrong(value, key, expected))
    }
}

/// A number written with or without a point.
pub(super) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(x) => Some(*x),
        // Integers in a sweep file are small; those that a float cannot hold are no extent and no factor.
        Value::Integer(n) => i32::try_from(*n).ok().map(f64::from),
        _ => None,
    }
}
