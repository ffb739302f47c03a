//! The report of a sweep as text, JSON or CSV: its rows, and the size and time of its recordings.

use std::collections::BTreeSet;
use std::path::Path;

use crate::record::RecordSummary;
use crate::study::sweep::{Outcome, Row, Status, csv_text};
use serde_json::json;

use super::recording::{labels, total_ms};
use crate::commands::console::{self, RowFormat};

/// The result of a sweep.
pub(crate) struct Report<'a> {
    pub(crate) name: &'a str,
    pub(crate) folder: &'a Path,
    pub(crate) outcome: &'a Outcome,
    /// Wall time of the points, s.
    pub(crate) seconds: f64,
    /// Time spent storing points for the recording, ms.
    pub(crate) storing_ms: f64,
    pub(crate) recordings: &'a [RecordSummary],
}

impl Report<'_> {
    pub(crate) fn print(&self, format: RowFormat) -> anyhow::Result<()> {
        match format {
            RowFormat::Text => console::prose(&self.text()),
            RowFormat::Json => console::json(&self.json())?,
            RowFormat::Csv => console::result(&String::from_utf8(csv_text(&self.outcome.rows))?),
        }
        Ok(())
    }

    /// Time spent storing points and writing the recordings, ms.
    fn logging_ms(&self) -> f64 {
        self.storing_ms + self.recordings.iter().map(|r| r.log_ms).sum::<f64>()
    }

    fn json(&self) -> serde_json::Value {
        // JSON is Unicode; file names need not be.
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

    fn text(&self) -> String {
        let Outcome { total, skipped, failed, rows, .. } = self.outcome;
        let (done, seconds, folder) = (rows.len(), self.seconds, self.folder.display());
        let points = format!(
            "{done} of {total} points done, {failed} failed; {skipped} from an earlier run, the others in {seconds:.1} s"
        );
        let recordings: String = self.recordings.iter().map(recording_line).collect();
        let mut out = format!("{}{}{points}\nrows: {folder}/rows.csv\n{recordings}", rows_text(rows), fit_text(rows));
        if !self.recordings.is_empty() {
            out += &format!("storing and recording the points took {:.1} s\n", self.logging_ms() / 1e3);
        }
        out
    }
}

/// A recording, its size and its time in a line.
pub(crate) fn recording_line(recording: &RecordSummary) -> String {
    let Some(path) = recording.file_line() else { return String::new() };
    let [bytes, raw] = [recording.bytes, recording.raw_bytes.max(1)].map(|bytes| bytes as f64);
    let (mb, share, seconds) = (bytes / 1e6, bytes / raw, recording.log_ms / 1e3);
    format!("{path} ({mb:.1} MB, {share:.2} of the uncompressed size, {seconds:.1} s)\n")
}

/// The rows as text: a table of settings, PARTs, times and errors, and the definitions of the errors.
pub(crate) fn rows_text(rows: &[Row]) -> String {
    let mm = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
    let refs: Vec<&Row> = rows.iter().collect();
    let errors = |row: &Row| {
        let m = row.metrics.as_ref()?;
        Some([m.rms_mm, m.canonical_rms_mm, m.representable_affine_rms_mm, m.representable_rms_mm])
    };
    let measured = rows.iter().filter_map(errors).flatten().any(|error| error.is_some());
    let bodies = rows.windows(2).any(|pair| pair[0].body != pair[1].body);
    let cells = rows.iter().zip(labels(&refs)).filter_map(|(row, label)| {
        let body = bodies.then(|| row.body.clone());
        let first = [row.index.to_string()].into_iter().chain(body).chain([row.garment.clone()]);
        if row.status == Status::Error {
            return Some(first.chain([format!("{label}: {}", row.error)]).collect::<Vec<String>>());
        }
        let (parts, time) = (row.metrics.as_ref()?.part_count.to_string(), mm(total_ms(row)));
        let errors = errors(row).filter(|_| measured).into_iter().flatten().map(mm);
        Some(first.chain([label, parts, time]).chain(errors).collect())
    });
    let names = ["own error mm", "canonical error mm", "best affine mm", "best translation mm"];
    let mut header = vec![""];
    header.extend(bodies.then_some("body"));
    header.extend(["garment", "setting"]);
    let first = header.len();
    header.extend(["PARTs", "ms"]);
    header.extend(names.into_iter().filter(|_| measured));
    let table = console::table(console::OPEN, header, [0].into_iter().chain(first..), cells);
    format!("{table}\n{}", if measured { ERRORS } else { "" })
}

/// The fit of one garment on several bodies: a line for each row with its eases and its verdict; empty for rows of a single body.
fn fit_text(rows: &[Row]) -> String {
    let bodies: BTreeSet<&str> = rows.iter().map(|row| row.body.as_str()).collect();
    if bodies.len() < 2 {
        return String::new();
    }
    let garments = rows.windows(2).any(|pair| pair[0].garment != pair[1].garment);
    let refs: Vec<&Row> = rows.iter().collect();
    let settings = labels(&refs);
    let varies = settings.windows(2).any(|pair| pair[0] != pair[1]);
    let cells = rows.iter().zip(&settings).map(|(row, setting)| {
        let mut cells = vec![row.body.clone()];
        cells.extend(garments.then(|| row.garment.clone()));
        cells.extend(varies.then(|| setting.clone()));
        let Some(m) = &row.metrics else {
            cells.extend([const { String::new() }; 5]);
            cells.push(row.error.clone());
            return cells;
        };
        let eases = m.eases_cm();
        cells.extend(eases.map(|(_, cm)| cm.map_or_else(|| "–".to_owned(), |cm| format!("{cm:+.1}"))));
        cells.push(m.strain_max.map_or_else(|| "–".to_owned(), |strain| format!("{:.0}", 100.0 * strain)));
        let small = eases.into_iter().filter_map(|(at, cm)| Some((at, cm.filter(|cm| *cm < 0.0)?)));
        let small: Vec<String> = small.map(|(at, cm)| format!("{at} by {:.1} cm", -cm)).collect();
        let small = if small.is_empty() { String::new() } else { format!("too small at {}; ", small.join(", ")) };
        cells.push(small + &m.verdict);
        cells
    });
    let mut header = vec!["body"];
    header.extend(garments.then_some("garment"));
    header.extend(varies.then_some("setting"));
    let first = header.len();
    header.extend(["bust", "waist", "hip", "hem", "strain %", "verdict"]);
    let table = console::table(console::OPEN, header, first..first + 5, cells);
    format!("\nFit: ease in cm, the garment as cut less the body\n{table}\n")
}

/// Definitions of the errors in [`rows_text`].
const ERRORS: &str = "\
Errors are RMS over the vertices. Own error: to the equilibrium that this drape
converges to. Canonical error: to the canonical drape of the garment, the same
for all tables. Best affine and best translation: to the canonical drape, if
each PART moved by its best affine map, or by its best displacement. A drape can
be nearer than these where steps of single vertices follow.
";
