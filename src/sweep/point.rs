//! One point of a sweep: everything that determines one run, and its name by content.
//!
//! A point's id is the blake3 hash of the canonical JSON of all that determines its result: version of the program, body,
//! garment, fabric, model, range table, extents, smallest PART, refinement, seed and options. A file counts by its contents, not by its
//! name or place, so that a moved folder or a shard on another machine has the same ids; a range table counts by its
//! bounds and its gap rule, a fabric by its constants. What changes nothing but timings (repeats, jobs, threads) is no part of it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::fabric::Fabric;
use crate::range_table::{RangeTable, TableError};
use crate::shapes::BodySpec;

/// The version that computes; rows of different versions are never mixed.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A body or garment: built in by name, or a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// As written in the sweep file: a built-in name (a garment's with `@vertices`) or a path.
    pub label: String,
    /// The file, from the folder of the sweep file; `None` for what is built in.
    pub file: Option<PathBuf>,
    /// blake3 of the file's contents.
    pub digest: Option<String>,
}

impl Input {
    /// Something built in.
    #[must_use]
    pub fn built_in(label: impl Into<String>) -> Self {
        Self { label: label.into(), file: None, digest: None }
    }

    /// A built-in garment with so many vertices; as it comes without a number.
    pub(super) fn at(&self, vertices: Option<usize>) -> Self {
        vertices.map_or_else(|| self.clone(), |n| Self::built_in(format!("{}@{n}", self.label)))
    }

    fn key(&self) -> InputKey<'_> {
        match &self.digest {
            Some(digest) => InputKey::Contents(digest),
            None => InputKey::Name(&self.label),
        }
    }
}

/// A fabric under the name it has in the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct FabricChoice {
    /// As written in the sweep file: a built-in name or a path.
    pub label: String,
    /// Its constants.
    pub fabric: Fabric,
}

impl FabricChoice {
    /// What determines a result: the constants, not what they are called and where they come from.
    fn key(&self) -> Fabric {
        Fabric { name: String::new(), source: String::new(), ..self.fabric.clone() }
    }
}

/// A body: the built-in form with its measurements, or a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyChoice {
    /// What the reports call it.
    pub label: String,
    /// The built-in form, or the file of a mesh.
    pub input: Input,
    /// The form's measurements; built-in garments are made to them, on a mesh too.
    pub measurements: BodySpec,
}

/// The models of stage two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelChoice {
    /// Equations (2) to (9).
    Paper,
    /// The coupled model.
    Coupled,
}

/// How far the full resolution is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refine {
    /// This many steps; 0 is the two-stage scheme alone.
    Steps(usize),
    /// Until the residual is under its tolerance.
    Converged,
}

impl fmt::Display for ModelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Paper => "paper",
            Self::Coupled => "coupled",
        })
    }
}

impl fmt::Display for Refine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Steps(n) => write!(f, "{n}"),
            Self::Converged => f.write_str("converged"),
        }
    }
}

/// A range table, or the rule that makes one from the garment's distances.
#[derive(Debug, Clone, PartialEq)]
pub enum TableRule {
    /// The same rows for every garment.
    Rows(RangeTable),
    /// So many levels of equally many vertices, which depend on the garment.
    Quantile {
        /// Number of levels.
        levels: usize,
    },
}

/// A range table under the name it has in the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct TableChoice {
    /// Its name in reports.
    pub label: String,
    /// The table or its rule.
    pub rule: TableRule,
}

impl TableChoice {
    /// The table for a garment whose vertices have these distances to the body (m).
    ///
    /// # Errors
    /// [`TableError`] where the distances make no table (no vertices, not finite).
    pub fn resolve(&self, distances_m: &[f64]) -> Result<RangeTable, TableError> {
        let mut table = match &self.rule {
            TableRule::Rows(table) => table.clone(),
            TableRule::Quantile { levels } => RangeTable::quantiles(distances_m, *levels)?,
        };
        table.name.clone_from(&self.label);
        Ok(table)
    }

    fn key(&self) -> TableKey {
        match &self.rule {
            TableRule::Rows(table) => TableKey::Rows {
                gap: table.gap.as_str(),
                // JSON has no infinity, hence text; `{:?}` is the shortest that reads back to the same bits.
                levels: table
                    .levels
                    .iter()
                    .map(|l| [format!("{:?}", l.lower_cm), format!("{:?}", l.upper_cm)])
                    .collect(),
            },
            TableRule::Quantile { levels } => TableKey::Quantile { levels: *levels },
        }
    }
}

/// One point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Content hash of all that determines the result, hexadecimal.
    pub id: String,
    /// Place in the plan, from 0; the same in every shard.
    pub index: usize,
    /// The body.
    pub body: BodyChoice,
    /// The garment.
    pub garment: Input,
    /// The fabric.
    pub fabric: FabricChoice,
    /// Stage two's model.
    pub model: ModelChoice,
    /// Stage one's range table.
    pub table: TableChoice,
    /// Largest extents of a PART along the cloth, cm: none for PARTs as equation (1) gives them, one, or several for a
    /// cascade from coarse to fine.
    pub extents_cm: Vec<f64>,
    /// PARTs of fewer vertices join a neighbour; 1 keeps the paper's definition.
    pub min_part: usize,
    /// Full-resolution steps.
    pub refine: Refine,
    /// Seed of the perturbed start; 0 is the undisturbed one.
    pub seed: u64,
    /// Whatever else the solver understands, by name.
    pub options: BTreeMap<String, String>,
}

impl Point {
    /// The extents as the rows have them: `none`, `5`, or `12>6>3` for a cascade.
    #[must_use]
    pub fn extent_text(&self) -> String {
        if self.extents_cm.is_empty() {
            return "none".to_owned();
        }
        self.extents_cm.iter().map(f64::to_string).collect::<Vec<_>>().join(">")
    }

    /// The options as the rows have them: `a=1 b=2`, empty for none.
    #[must_use]
    pub fn options_text(&self) -> String {
        self.options.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
    }

    /// All that tells this point from others, in one line.
    #[must_use]
    pub fn label(&self) -> String {
        let Self { body, garment, fabric, model, table, min_part, refine, seed, .. } = self;
        let extent = self.extent_text();
        let options = self.options.iter().map(|(key, value)| format!(", {key} {value}")).collect::<String>();
        format!(
            "body {}, garment {}, fabric {}, {model}, table {}, extent {extent}, min-part {min_part}, refine {refine}, \
             seed {seed}{options}",
            body.label, garment.label, fabric.label, table.label
        )
    }

    /// The point with its id set from everything else.
    pub(super) fn named(mut self) -> Self {
        let key = Key {
            partwise: VERSION,
            body: self.body.input.key(),
            measurements: &self.body.measurements,
            garment: self.garment.key(),
            fabric: self.fabric.key(),
            model: self.model,
            table: self.table.key(),
            extents_cm: &self.extents_cm,
            min_part: self.min_part,
            refine: self.refine,
            seed: self.seed,
            options: &self.options,
        };
        self.id = content_id(&key);
        self
    }
}

/// Hash of a value's JSON, 128 bits in hexadecimal: enough that no two points of any sweep meet, and short in a CSV.
pub(super) fn content_id(value: &impl Serialize) -> String {
    // Structs keep their order of fields whatever features serde_json is built with; a map might not. Writing plain data
    // to memory does not fail; if it did, the ids would collide and the plan would drop points, which it reports.
    let json = serde_json::to_vec(value).unwrap_or_default();
    blake3::hash(&json).to_hex()[..32].to_owned()
}

#[derive(Serialize)]
struct Key<'a> {
    partwise: &'a str,
    body: InputKey<'a>,
    measurements: &'a BodySpec,
    garment: InputKey<'a>,
    fabric: Fabric,
    model: ModelChoice,
    table: TableKey,
    extents_cm: &'a [f64],
    min_part: usize,
    refine: Refine,
    seed: u64,
    options: &'a BTreeMap<String, String>,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
enum InputKey<'a> {
    Name(&'a str),
    Contents(&'a str),
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
enum TableKey {
    Rows { gap: &'static str, levels: Vec<[String; 2]> },
    Quantile { levels: usize },
}
