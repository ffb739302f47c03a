//! The values an axis of a sweep can take, and what of each determines a result.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use crate::fabric::Fabric;
use crate::range_table::{RangeTable, TableError};
use crate::shapes::BodySpec;

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

    pub(super) fn key(&self) -> InputKey<'_> {
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
    pub(super) fn key(&self) -> Fabric {
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

    pub(super) fn key(&self) -> TableKey {
        match &self.rule {
            TableRule::Rows(table) => TableKey::Rows {
                gap: table.gap.as_str(),
                // JSON has no infinity, hence text; `{:?}` is the shortest that reads back to the same bits.
                levels: table
                    .levels
                    .iter()
                    .map(|l| (l.lower_cm, l.upper_cm, l.extent.map(|e| e.numbers_cm()).unwrap_or_default()))
                    .map(|(lower, upper, extent)| [vec![lower, upper], extent].concat())
                    .map(|row| row.iter().map(|cm| format!("{cm:?}")).collect())
                    .collect(),
            },
            TableRule::Quantile { levels } => TableKey::Quantile { levels: *levels },
        }
    }
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum InputKey<'a> {
    Name(&'a str),
    Contents(&'a str),
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum TableKey {
    Rows { gap: &'static str, levels: Vec<Vec<String>> },
    Quantile { levels: usize },
}
