//! One row of a sweep: the same fixed columns in CSV and in JSON lines.
//!
//! Figures are kept to nine significant digits, and below 1e-12 as 0: far finer than any of them means, and with so few
//! digits every reader's parser gives back the same bits, so that rows that were read and written again do not drift.
//! The identity of results, bit for bit, is `result_hash`'s task.
//!
//! Columns that are timings, and nothing else, start with `time_`; comparisons drop them.

use serde::{Deserialize, Serialize};

use super::point::Point;
use super::timing::Timing;

/// Whether a point has a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It has.
    Ok,
    /// It failed; the column `error` says why.
    #[default]
    Error,
}

/// The figures of one drape, all deterministic.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measures {
    /// Vertices of the garment.
    pub vertices: usize,
    /// Levels that hold at least one vertex.
    pub levels: usize,
    /// PARTs.
    pub part_count: usize,
    /// PARTs of one vertex.
    pub singletons: usize,
    /// PARTs the body carries.
    pub contact_parts: usize,
    /// RMS displacement from undraped to draped, mm.
    pub displacement_rms_mm: f64,
    /// Vertices inside the body at the end.
    pub penetrating_vertices: usize,
    /// ‖∇E‖ over the garment's weight.
    pub residual_over_weight: Option<f64>,
    /// 95th percentile of strain.
    pub strain_p95: Option<f64>,
    /// RMS vertex error against the result's own continuation, mm.
    pub rms_mm: Option<f64>,
    /// RMS vertex error against the canonical drape, mm.
    pub canonical_rms_mm: Option<f64>,
    /// RMS that one displacement per PART cannot remove, mm.
    pub representable_rms_mm: Option<f64>,
}

/// One point and what came of it. The fields are the columns, in order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // The columns of a failed point are empty from `vertices` on; see `Measures` and `COLUMNS`.
pub struct Row {
    /// Content hash of the point.
    pub point: String,
    /// Place in the plan.
    pub index: usize,
    pub body: String,
    pub garment: String,
    pub fabric: String,
    pub model: String,
    pub table: String,
    /// `none`, one extent, or a cascade `12>6>3`, cm.
    pub extent_cm: String,
    pub min_part: usize,
    /// Steps, or `converged`.
    pub refine: String,
    pub seed: u64,
    /// `name=value` of each, empty for none.
    pub options: String,
    pub status: Status,
    /// Why it failed; empty where it did not.
    pub error: String,
    pub vertices: Option<usize>,
    pub levels: Option<usize>,
    pub part_count: Option<usize>,
    pub singletons: Option<usize>,
    pub contact_parts: Option<usize>,
    pub displacement_rms_mm: Option<f64>,
    pub penetrating_vertices: Option<usize>,
    pub residual_over_weight: Option<f64>,
    pub strain_p95: Option<f64>,
    pub rms_mm: Option<f64>,
    pub canonical_rms_mm: Option<f64>,
    pub representable_rms_mm: Option<f64>,
    /// blake3 over the bits of the displaced positions.
    pub result_hash: String,
    /// Medians over the repeats, and interquartile ranges where there is more than one repeat.
    pub time_distance_ms: Option<f64>,
    pub time_distance_spread_ms: Option<f64>,
    pub time_segment_ms: Option<f64>,
    pub time_segment_spread_ms: Option<f64>,
    pub time_mechanics_ms: Option<f64>,
    pub time_mechanics_spread_ms: Option<f64>,
    pub time_refine_ms: Option<f64>,
    pub time_refine_spread_ms: Option<f64>,
    pub time_total_ms: Option<f64>,
    pub time_total_spread_ms: Option<f64>,
}

/// The columns of [`Row`], in order.
pub const COLUMNS: [&str; 37] = [
    "point",
    "index",
    "body",
    "garment",
    "fabric",
    "model",
    "table",
    "extent_cm",
    "min_part",
    "refine",
    "seed",
    "options",
    "status",
    "error",
    "vertices",
    "levels",
    "part_count",
    "singletons",
    "contact_parts",
    "displacement_rms_mm",
    "penetrating_vertices",
    "residual_over_weight",
    "strain_p95",
    "rms_mm",
    "canonical_rms_mm",
    "representable_rms_mm",
    "result_hash",
    "time_distance_ms",
    "time_distance_spread_ms",
    "time_segment_ms",
    "time_segment_spread_ms",
    "time_mechanics_ms",
    "time_mechanics_spread_ms",
    "time_refine_ms",
    "time_refine_spread_ms",
    "time_total_ms",
    "time_total_spread_ms",
];

impl Row {
    /// The row of a point that failed.
    #[must_use]
    pub fn failed(point: &Point, error: impl Into<String>) -> Self {
        Self {
            point: point.id.clone(),
            index: point.index,
            body: point.body.label.clone(),
            garment: point.garment.label.clone(),
            fabric: point.fabric.label.clone(),
            model: point.model.to_string(),
            table: point.table.label.clone(),
            extent_cm: point.extent_text(),
            min_part: point.min_part,
            refine: point.refine.to_string(),
            seed: point.seed,
            options: point.options_text(),
            status: Status::Error,
            error: error.into(),
            ..Self::default()
        }
    }

    /// The row of a point with a result; a failed one where a figure is not finite.
    #[must_use]
    pub fn solved(point: &Point, measures: &Measures, result_hash: &str, timing: &Timing) -> Self {
        let empty = Self::failed(point, "");
        let figures = [
            ("displacement_rms_mm", Some(measures.displacement_rms_mm)),
            ("residual_over_weight", measures.residual_over_weight),
            ("strain_p95", measures.strain_p95),
            ("rms_mm", measures.rms_mm),
            ("canonical_rms_mm", measures.canonical_rms_mm),
            ("representable_rms_mm", measures.representable_rms_mm),
        ];
        if let Some((name, Some(value))) = figures.iter().find(|(_, v)| v.is_some_and(|v| !v.is_finite())) {
            return Self { error: format!("{name} is {value}, expected a finite figure: the drape diverged"), ..empty };
        }
        let [distance, segment, mechanics, refine, total] = timing.stages;
        Self {
            status: Status::Ok,
            vertices: Some(measures.vertices),
            levels: Some(measures.levels),
            part_count: Some(measures.part_count),
            singletons: Some(measures.singletons),
            contact_parts: Some(measures.contact_parts),
            displacement_rms_mm: Some(figure(measures.displacement_rms_mm)),
            penetrating_vertices: Some(measures.penetrating_vertices),
            residual_over_weight: measures.residual_over_weight.map(figure),
            strain_p95: measures.strain_p95.map(figure),
            rms_mm: measures.rms_mm.map(figure),
            canonical_rms_mm: measures.canonical_rms_mm.map(figure),
            representable_rms_mm: measures.representable_rms_mm.map(figure),
            result_hash: result_hash.to_owned(),
            time_distance_ms: Some(figure(distance.median_ms)),
            time_distance_spread_ms: distance.spread_ms.map(figure),
            time_segment_ms: Some(figure(segment.median_ms)),
            time_segment_spread_ms: segment.spread_ms.map(figure),
            time_mechanics_ms: Some(figure(mechanics.median_ms)),
            time_mechanics_spread_ms: mechanics.spread_ms.map(figure),
            time_refine_ms: Some(figure(refine.median_ms)),
            time_refine_spread_ms: refine.spread_ms.map(figure),
            time_total_ms: Some(figure(total.median_ms)),
            time_total_spread_ms: total.spread_ms.map(figure),
            ..empty
        }
    }

    /// The row without what differs from run to run.
    #[must_use]
    pub fn without_times(&self) -> Self {
        Self {
            time_distance_ms: None,
            time_distance_spread_ms: None,
            time_segment_ms: None,
            time_segment_spread_ms: None,
            time_mechanics_ms: None,
            time_mechanics_spread_ms: None,
            time_refine_ms: None,
            time_refine_spread_ms: None,
            time_total_ms: None,
            time_total_spread_ms: None,
            ..self.clone()
        }
    }

    /// Names of the columns, timings aside, in which two rows differ.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<&'static str> {
        let (mine, theirs) = (self.cells(), other.cells());
        let pairs = COLUMNS.iter().zip(mine.iter().zip(&theirs));
        pairs.filter(|(name, (a, b))| a != b && !name.starts_with("time_")).map(|(name, _)| *name).collect()
    }

    /// The CSV record's fields.
    fn cells(&self) -> Vec<String> {
        let line = csv_line(self);
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_slice());
        let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
        record.iter().map(str::to_owned).collect()
    }
}

/// The row as one line of JSON, line end included.
pub(super) fn json_line(row: &Row) -> Vec<u8> {
    // Plain data into memory: neither writer can fail; an empty line would be caught as damage on reading.
    let mut line = serde_json::to_vec(row).unwrap_or_default();
    line.push(b'\n');
    line
}

/// The row as one record of CSV, line end included.
pub(super) fn csv_line(row: &Row) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let written = writer.serialize(row).and_then(|()| writer.into_inner().map_err(|e| e.into_error().into()));
    written.unwrap_or_default()
}

/// The CSV's first line.
pub(super) fn csv_header() -> String {
    format!("{}\n", COLUMNS.join(","))
}

/// Nine significant digits, 0 below 1e-12.
fn figure(value: f64) -> f64 {
    let rounded = format!("{value:.8e}").parse().unwrap_or(value);
    if f64::abs(rounded) < 1e-12 { 0.0 } else { rounded }
}
