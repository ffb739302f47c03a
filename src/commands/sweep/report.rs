//! A sweep on the terminal and for scripts: its rows as a table, JSON or CSV, and what the recordings cost.

use std::path::Path;

use crate::record::RecordSummary;
use crate::study::sweep::{Outcome, Row, Status, csv_text};
use clap::ValueEnum;
use comfy_table::Table;
use serde_json::json;

use super::chosen::{labels, total_ms};
use crate::commands::console;

/// What stdout is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Tables for people
    Text,
    /// One JSON object
    Json,
    /// The rows as CSV
    Csv,
}

/// What became of a sweep.
pub(crate) struct Report<'a> {
    pub(crate) name: &'a str,
    pub(crate) folder: &'a Path,
    pub(crate) outcome: &'a Outcome,
    /// Wall time of the points, s.
    pub(crate) seconds: f64,
    /// Time spent on keeping points for the recording, ms.
    pub(crate) keeping_ms: f64,
    pub(crate) recordings: &'a [RecordSummary],
}

impl Report<'_> {
    /// In the format asked for.
    pub(crate) fn text(&self, format: Format) -> anyhow::Result<String> {
        match format {
            Format::Text => Ok(self.table()),
            Format::Json => Ok(crate::base::error_text::json(&self.json())?),
            Format::Csv => Ok(String::from_utf8(csv_text(&self.outcome.rows))?),
        }
    }

    /// Time to keep points and to write the recordings, ms.
    fn logging_ms(&self) -> f64 {
        self.keeping_ms + self.recordings.iter().map(|r| r.log_ms).sum::<f64>()
    }

    fn json(&self) -> serde_json::Value {
        // JSON is Unicode; names of files need not be.
        let name = |r: &RecordSummary| r.path.as_ref().map(|path| path.display().to_string());
        let recordings: Vec<_> = self
            .recordings
            .iter()
            .map(|r| json!({ "path": name(r), "bytes": r.bytes, "raw_bytes": r.raw_bytes, "log_ms": r.log_ms }))
            .collect();
        json!({
            "sweep": self.name,
            "folder": self.folder.display().to_string(),
            "points": self.outcome.total,
            "skipped": self.outcome.skipped,
            "failed": self.outcome.failed,
            "seconds": self.seconds,
            "logging_ms": self.logging_ms(),
            "recordings": recordings,
            "rows": self.outcome.rows,
        })
    }

    fn table(&self) -> String {
        let Outcome { total, skipped, failed, rows, .. } = self.outcome;
        let mut out = format!("{}\n{}", rows_table(rows), explained(rows));
        let (done, seconds, folder) = (rows.len(), self.seconds, self.folder.display());
        out.push_str(&format!(
            "{done} of {total} points done, {failed} failed; {skipped} found there, the others took {seconds:.1} s\nrows: {folder}/rows.csv\n"
        ));
        for recording in self.recordings {
            out.push_str(&line(recording));
        }
        if !self.recordings.is_empty() {
            out.push_str(&format!("keeping and recording the points took {:.1} s\n", self.logging_ms() / 1e3));
        }
        out
    }
}

/// A recording, its size and its cost in a line.
pub(crate) fn line(recording: &RecordSummary) -> String {
    let Some(said) = recording.file_line() else { return String::new() };
    let [bytes, raw] = [recording.bytes, recording.raw_bytes.max(1)].map(|bytes| bytes as f64);
    let (mb, share, seconds) = (bytes / 1e6, bytes / raw, recording.log_ms / 1e3);
    format!("{said} ({mb:.1} MB, {share:.2} of the bytes that changed, {seconds:.1} s)\n")
}

/// What the columns of [`rows_table`] are, where an error was measured.
pub(crate) fn explained(rows: &[Row]) -> &'static str {
    let measured = |row: &Row| row.metrics.as_ref().is_some_and(|metrics| metrics.canonical_rms_mm.is_some());
    if !rows.iter().any(measured) {
        return "";
    }
    "RMS over the vertices, mm. own: to where this drape would settle; canonical: to the drape of the garment as placed, the same for \
     all tables;\naffine, translation: what one affine map, one displacement, a PART leaves of the canonical drape at best\n"
}

/// The rows for people: what tells them apart, how many PARTs, how fast, how far off.
pub(crate) fn rows_table(rows: &[Row]) -> Table {
    let header = ["", "garment", "setting", "PARTs", "ms", "own mm", "canonical mm", "affine mm", "translation mm"];
    let mut table = console::table(console::OPEN, header, [0].into_iter().chain(3..));
    let refs: Vec<&Row> = rows.iter().collect();
    let mm = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| format!("{v:.1}"));
    for (row, label) in rows.iter().zip(labels(&refs)) {
        let (index, garment) = (row.index.to_string(), row.garment.clone());
        if row.status == Status::Error {
            table.add_row([index, garment, format!("{label}: {}", row.error)]);
            continue;
        }
        let Some(metrics) = &row.metrics else { continue };
        table.add_row([
            index,
            garment,
            label,
            metrics.part_count.to_string(),
            mm(total_ms(row)),
            mm(metrics.rms_mm),
            mm(metrics.canonical_rms_mm),
            mm(metrics.representable_affine_rms_mm),
            mm(metrics.representable_rms_mm),
        ]);
    }
    table
}
