//! One row of a sweep: the point, its [`Metrics`], its times; the same columns in JSON lines and in CSV.
//!
//! Metrics are rounded to nine significant digits, and below 1e-12 to 0. This is finer than their accuracy, and with so few
//! digits every parser gives the same bits, so that rows do not change when they are read and written again.
//! `result_hash` identifies results bit for bit. A failed point has neither metrics nor times:
//! empty cells in the CSV, no keys in its line.
//!
//! The names of timing columns, and no others, start with `time_`; comparisons drop them.

use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Point, Timing};
use crate::study::metrics::Metrics;

/// Whether a point has a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It has a result.
    Ok,
    /// It failed; the column `error` has the cause.
    #[default]
    Error,
}

/// One point and its result. The fields, in order, are the columns.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are descriptive")]
pub struct Row {
    pub point: String,
    pub index: usize,
    pub body: String,
    /// Name of the garment with its size.
    pub garment: String,
    pub fabric: String,
    /// `paper` or `coupled`.
    pub model: String,
    pub table: String,
    /// `none`, one extent, or a cascade `12>6>3`, cm.
    pub extent_cm: String,
    /// How a PART moves: `affine` or `translation`.
    pub motion: String,
    /// PARTs of fewer vertices were joined.
    pub min_part: usize,
    /// Steps, or `converged`.
    pub refine: String,
    /// 0 is the undisturbed start.
    pub seed: u64,
    /// `name=value` of each.
    pub options: String,
    pub status: Status,
    /// Cause of a failure; empty for a result.
    pub error: String,
    #[serde(flatten)]
    pub metrics: Option<Metrics>,
    /// blake3 over the bits of the displaced positions.
    pub result_hash: String,
    #[serde(flatten)]
    pub timing: Option<Timing>,
}

impl Row {
    /// The row of a point that failed.
    #[must_use]
    pub fn failed(point: &Point, error: impl Into<String>) -> Self {
        let settings = &point.job.settings;
        Self {
            point: point.id.clone(),
            index: point.index,
            body: point.body.clone(),
            garment: point.garment.clone(),
            fabric: settings.fabric.name.clone(),
            model: settings.model.name().to_owned(),
            table: settings.table.name().to_owned(),
            extent_cm: point.extent_text(),
            motion: settings.model.motion().name().to_owned(),
            min_part: settings.min_part,
            refine: settings.refine.to_string(),
            seed: point.job.seed,
            options: point.options_text(),
            status: Status::Error,
            error: error.into(),
            ..Self::default()
        }
    }

    /// The row of a point with a result; a failed row if a metric is not finite.
    #[must_use]
    pub fn solved(point: &Point, metrics: &Metrics, result_hash: &str, timing: &Timing) -> Self {
        if let Some((name, value)) = not_finite(metrics) {
            return Self::failed(point, format!("{name} is {value}, expected a finite number: the drape diverged"));
        }
        Self {
            status: Status::Ok,
            metrics: rounded(metrics),
            result_hash: result_hash.to_owned(),
            timing: rounded(timing),
            ..Self::failed(point, "")
        }
    }

    /// The row without timings.
    pub(crate) fn without_times(&self) -> Self {
        Self { timing: None, ..self.clone() }
    }

    /// Names of the columns, timings aside, in which two rows differ.
    pub(crate) fn differences(&self, other: &Self) -> Vec<String> {
        let (mine, theirs) = (cells(&self.without_times()), cells(&other.without_times()));
        columns().into_iter().filter(|name| mine.get(name) != theirs.get(name)).collect()
    }
}

/// The columns, in order.
pub(crate) fn columns() -> Vec<String> {
    let full = Row { metrics: Some(Metrics::default()), timing: Some(Timing::default()), ..Row::default() };
    cells(&full).into_keys().collect()
}

/// Rows as CSV, the titles first.
#[must_use]
pub fn csv_text(rows: &[Row]) -> Vec<u8> {
    let columns = columns();
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing plain data to memory cannot fail.
    let _ = writer.write_record(&columns);
    for row in rows {
        let cells = cells(row);
        let _ = writer.write_record(columns.iter().map(|name| cell(cells.get(name))));
    }
    writer.into_inner().unwrap_or_default()
}

/// A JSON value as a CSV cell; empty for null.
pub(crate) fn cell(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(text)) => text.clone(),
        Some(number) => number.to_string(),
    }
}

/// The row as one line of JSON, line end included.
pub(super) fn json_line(row: &Row) -> Vec<u8> {
    // Serialising plain data to memory cannot fail; an empty line would be detected as damage on reading.
    let mut line = serde_json::to_vec(row).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Keys and values of a row, in the order of its fields.
fn cells(row: &Row) -> IndexMap<String, Value> {
    serde_json::from_slice(&json_line(row)).unwrap_or_default()
}

/// The first metric that is not finite, and its value. CSV can express such values, JSON cannot.
fn not_finite(metrics: &Metrics) -> Option<(String, String)> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.serialize(metrics).ok()?;
    let text = writer.into_inner().ok()?;
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let names = reader.headers().ok()?.clone();
    let record = reader.records().next()?.ok()?;
    let wrong = names.iter().zip(&record).find(|(_, cell)| cell.parse::<f64>().is_ok_and(|x| !x.is_finite()));
    wrong.map(|(name, cell)| (name.to_owned(), cell.to_owned()))
}

/// The same with every number rounded to nine significant digits, and to 0 below 1e-12.
fn rounded<T: Serialize + DeserializeOwned>(metrics: &T) -> Option<T> {
    let mut value = serde_json::to_value(metrics).ok()?;
    for number in value.as_object_mut()?.values_mut().filter(|v| v.is_f64()) {
        let x = number.as_f64()?;
        let digits = format!("{x:.8e}").parse().unwrap_or(x);
        *number = Value::from(if f64::abs(digits) < 1e-12 { 0.0 } else { digits });
    }
    serde_json::from_value(value).ok()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_column_is_in_the_dictionary_once() {
        let text = include_str!("../../../docs/columns.md");
        let rows = text.lines().filter(|line| line.starts_with("| `"));
        let names = rows.flat_map(|line| line.split('|').nth(1).unwrap_or_default().split(", "));
        let names: Vec<String> = names.map(|name| name.trim().trim_matches('`').to_owned()).collect();
        let once: BTreeSet<&String> = names.iter().collect();
        assert_eq!(once.len(), names.len(), "a column is defined twice");
        let columns = columns();
        assert!(columns.len() >= 60, "{}", columns.len());
        for column in &columns {
            assert!(once.contains(column), "docs/columns.md lacks {column}");
        }
        let of_levels = ["level", "lower_cm", "upper_cm", "parts", "kept", "split", "merged"];
        let unknown = names.iter().filter(|name| !columns.contains(name) && !of_levels.contains(&name.as_str()));
        assert_eq!(unknown.collect::<Vec<_>>(), [""; 0], "docs/columns.md defines columns that do not exist");
    }
}
