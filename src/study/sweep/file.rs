//! The keys of a sweep file (TOML), and the position of each value for messages.
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
//!
//! [sizes]                          # in place of bodies: every point on each of these bodies
//! list = [36, 38, 40, { name = "curvy", bust = 96, waist = 74, hip = 108 }]
//! ```
//!
//! | in `[base]`, `[[points]]` | in `[grid]` | values | default |
//! |---|---|---|---|
//! | `body` | `bodies` | `form`, a mesh file, TOML of measurements, or `{ bust = 92, ... }` in cm with `of`, `name` | `form` |
//! | `garment` | `garments` | `name@vertices` or file | `low-cut-dress` |
//! | `size` | `sizes` | vertices, or `larger`, `smaller` of Table 4; for a garment built in and named without | – |
//! | `fabric` | `fabrics` | built-in name, file, or all its constants as a table | `interlock` |
//! | `model` | `models` | `paper`, `coupled` | `coupled` |
//! | `table` | `tables` | see [`tables`](super::tables) | `table-3` |
//! | `extent_cm` | `extents_cm` | cm; 0 or `none` for not cut; a list for a cascade, coarse to fine | `none` |
//! | `motion` | `motions` | of a PART in `coupled`: `affine`, `translation` | `affine` |
//! | `min_part` | `min_parts` | vertices; PARTs of fewer are joined before any is cut | 1 |
//! | `refine` | `refine` | steps or `converged` | 0 |
//! | `seed` | `seeds` | 0 is the undisturbed start | 0 |
//! | `accuracy` | `accuracy` | reference of the errors: `none`, `canonical`, `own` | as `--accuracy` |
//! | `options` | `options` | `{ name = value, ... }`: `accuracy`, and the keys of a [`SceneSpec`](crate::SceneSpec) such as `rest` | none |

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::{Spanned, Value};

use super::error::PlanError;
use super::point::{Edit, one};
use crate::base::files::line_of;

/// A value and its position in the text.
pub(super) type At = Spanned<Value>;

/// `[base]` and `[[points]]`: one value per key.
pub(super) type Single = BTreeMap<String, At>;

/// `[grid]`: one list per key.
pub(super) type Grid = BTreeMap<String, Spanned<Vec<At>>>;

/// The keys of `[base]` and `[[points]]`, and those of `[grid]`, in the order in which a grid is nested.
const KEYS: [[&str; 2]; 13] = [
    ["body", "bodies"],
    ["garment", "garments"],
    ["size", "sizes"],
    ["fabric", "fabrics"],
    ["model", "models"],
    ["table", "tables"],
    ["extent_cm", "extents_cm"],
    ["motion", "motions"],
    ["min_part", "min_parts"],
    ["refine", "refine"],
    ["seed", "seeds"],
    ["accuracy", "accuracy"],
    ["options", "options"],
];

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepFile {
    pub(super) name: String,
    /// Description; it does not affect results.
    #[serde(default)]
    pub(super) about: String,
    pub(super) repeats: Option<At>,
    pub(super) warm_up: Option<At>,
    #[serde(default)]
    pub(super) base: Single,
    pub(super) grid: Option<Grid>,
    #[serde(default)]
    pub(super) points: Vec<Single>,
    pub(super) sizes: Option<Sizes>,
}

/// `[sizes]`: bodies by European size, or by measurements to which the others are graded.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sizes {
    pub(super) list: Vec<At>,
}

/// The text of a sweep file and its name, for messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) text: &'a str,
    pub(super) name: &'a str,
}

impl Source<'_> {
    /// Reads the keys.
    pub(super) fn parse(self) -> Result<SweepFile, PlanError> {
        let file: SweepFile = toml::from_str(self.text).map_err(|e| PlanError::Syntax {
            place: e.span().map_or_else(|| self.name.to_owned(), |span| self.line(span.start)),
            message: e.message().replace('\n', ", "),
        })?;
        for single in file.points.iter().chain([&file.base]) {
            self.check_keys(0, single.iter().map(|(key, value)| (key, value.span().start)))?;
        }
        if let Some(grid) = &file.grid {
            self.check_keys(1, grid.iter().map(|(key, list)| (key, list.span().start)))?;
        }
        Ok(file)
    }

    fn check_keys<'k>(self, which: usize, keys: impl Iterator<Item = (&'k String, usize)>) -> Result<(), PlanError> {
        for (key, offset) in keys {
            if !KEYS.iter().any(|names| names[which] == key) {
                let known = KEYS.map(|names| names[which]).join(", ");
                let message = format!("unknown key `{key}`, expected one of {known}");
                return Err(PlanError::Syntax { place: self.line(offset), message });
            }
        }
        Ok(())
    }

    /// `file:line` of a value.
    pub(super) fn place(self, value: &At) -> String {
        self.line(value.span().start)
    }

    /// `file:line` of a byte offset.
    pub(super) fn line(self, offset: usize) -> String {
        format!("{}:{}", self.name, line_of(self.text, offset))
    }

    /// The error for a value that is not allowed.
    pub(super) fn wrong(self, value: &At, key: &'static str, expected: impl Into<String>) -> PlanError {
        let found = value.get_ref().to_string();
        PlanError::Value { place: self.place(value), key, found, expected: expected.into() }
    }

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

/// Reads the values of one axis after the other.
#[derive(Clone, Copy)]
pub(super) struct Axis<'a> {
    pub(super) source: Source<'a>,
    pub(super) base: &'a Single,
    pub(super) grid: &'a Grid,
}

impl Axis<'_> {
    /// The edits of an axis, by its keys in `[base]` and in `[grid]`. An axis that the file leaves out has one edit without effect.
    pub(super) fn edits(
        self,
        keys: [&'static str; 2],
        mut read: impl FnMut(&At) -> Result<Vec<Edit>, PlanError>,
    ) -> Result<Vec<Edit>, PlanError> {
        let Some(values) = self.values(keys)? else { return Ok(one(|_| ())) };
        let edits: Vec<Vec<Edit>> = values.iter().map(|v| read(v)).collect::<Result<_, _>>()?;
        Ok(edits.into_iter().flatten().collect())
    }

    /// The values of an axis: the list in `[grid]`, or else the value in `[base]`.
    pub(super) fn values(self, [single, plural]: [&'static str; 2]) -> Result<Option<Vec<At>>, PlanError> {
        let Some(list) = self.grid.get(plural) else { return Ok(self.base.get(single).map(|v| vec![v.clone()])) };
        if list.get_ref().is_empty() {
            let (place, found) = (self.source.line(list.span().start), "an empty list".to_owned());
            let expected = "at least one value; leave the key out for the value of [base]".to_owned();
            return Err(PlanError::Value { place, key: plural, found, expected });
        }
        Ok(Some(list.get_ref().clone()))
    }
}

/// A number written with or without a point.
pub(super) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(x) => Some(*x),
        // Extents and factors are small; integers beyond 32 bits are refused.
        Value::Integer(n) => i32::try_from(*n).ok().map(f64::from),
        _ => None,
    }
}
