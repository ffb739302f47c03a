//! The results of a search: text, CSV, JSON, range tables with their provenance, and a recording.
//!
//! The recording has a step for Table 3, one for each table that was the best when it was found, and the final tables side by side, in
//! the first fabric.

use std::fmt::Write as _;

use crate::parts::range_table::RangeTable;
use crate::record::{
    Colours, Compared, Layout, Overlay, Panel, Picture, RecordOptions, RecordSummary, Recorder, ScatterPoint, Sink,
    StepView,
};
use crate::study::accuracy::{rms, vertex_errors_mm};
use crate::study::metrics::LevelCount;
use crate::study::table_search::Judged;
use serde::Serialize;

use super::garment::Garment;
use crate::commands::console;
use crate::commands::summary::command_line;

/// A tuned table compared with Table 3 on one garment in one fabric.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Verdict {
    /// The garments that the table was tuned on.
    pub(super) tuned_on: String,
    /// `levels`, or `levels and extents`.
    pub(super) kind: &'static str,
    /// The garment of this comparison.
    pub(super) garment: String,
    pub(super) fabric: String,
    /// Whether the garment was excluded from the search.
    pub(super) held_out: bool,
    /// Factor on the extents that gives a held-out garment Table 3's number of PARTs; 1 for the unscaled table.
    pub(super) extent_factor: f64,
    pub(super) levels: usize,
    /// Number of levels cut to an extent.
    pub(super) cut_levels: usize,
    pub(super) parts: usize,
    pub(super) table_3_parts: usize,
    /// RMS distance of stage two from the canonical drape.
    pub(super) error_mm: f64,
    pub(super) table_3_error_mm: f64,
    /// The error over Table 3's.
    pub(super) ratio: f64,
}

impl Verdict {
    /// One for each fabric.
    pub(super) fn all(
        tuned_on: &str,
        kind: &'static str,
        table: &RangeTable,
        garment: &Garment,
    ) -> anyhow::Result<Vec<Self>> {
        let parts = garment.parts(table);
        let verdict = |(i, tailored): (usize, &super::garment::Tailored)| {
            let error_mm = garment.error_mm(i, &parts)?;
            Ok(Self {
                tuned_on: tuned_on.to_owned(),
                kind,
                garment: garment.name.clone(),
                fabric: tailored.fabric.clone(),
                held_out: false,
                extent_factor: 1.0,
                levels: table.levels.len(),
                cut_levels: table.levels.iter().filter(|l| l.extent.is_some_and(|e| e.cuts())).count(),
                parts: parts.len(),
                table_3_parts: garment.table_3_parts,
                error_mm,
                table_3_error_mm: tailored.table_3_mm,
                ratio: error_mm / tailored.table_3_mm,
            })
        };
        garment.tailored.iter().enumerate().map(verdict).collect()
    }
}

/// The comparisons with Table 3 as a table.
pub(super) fn verdicts(all: &[Verdict]) -> String {
    let kind = |v: &Verdict| match v.extent_factor {
        1.0 => v.kind.to_owned(),
        factor => format!("{} × {factor:.2}", v.kind),
    };
    let columns = |v: &Verdict| {
        [
            ("tuned on", v.tuned_on.clone()),
            ("searched", kind(v)),
            ("garment", format!("{}{}", v.garment, if v.held_out { " (held out)" } else { "" })),
            ("fabric", v.fabric.clone()),
            ("levels", v.levels.to_string()),
            ("cut", v.cut_levels.to_string()),
            ("PARTs", v.parts.to_string()),
            ("of Table 3", v.table_3_parts.to_string()),
            ("error mm", format!("{:.1}", v.error_mm)),
            ("of Table 3, mm", format!("{:.1}", v.table_3_error_mm)),
            ("ratio", format!("{:.2}", v.ratio)),
        ]
    };
    let header = columns(&Verdict::default()).map(|(name, _)| name);
    console::table(console::OPEN, header, 4.., all.iter().map(|v| columns(v).map(|(_, cell)| cell)))
}

/// The tables with a larger error than Table 3.
pub(super) fn worse(all: &[Verdict]) -> String {
    let mut out = String::new();
    for v in all.iter().filter(|v| v.ratio > 1.0) {
        let _ =
            writeln!(out, "Table 3 has a smaller error: {}, {}, on {} in {}", v.tuned_on, v.kind, v.garment, v.fabric);
    }
    out
}

/// Records as CSV, the names of their fields as header.
pub(super) fn csv(lines: impl IntoIterator<Item = impl Serialize>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| writer.serialize(line))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// The table with its provenance: program and command line, garments and errors.
pub(super) fn with_provenance(table: RangeTable, tables: usize, verdicts: &[Verdict]) -> RangeTable {
    let line = |v: &Verdict| {
        let Verdict { garment, fabric, parts, table_3_parts, error_mm, table_3_error_mm, .. } = v;
        format!(
            "{garment} in {fabric}: {parts} PARTs, {error_mm:.2} mm (Table 3: {table_3_parts}, {table_3_error_mm:.2} mm)"
        )
    };
    let source = format!(
        "partwise {} by `{}`, the best of {tables} tables judged by stage two without --max-extent; PARTs and error to the canonical \
         drape: {}",
        env!("CARGO_PKG_VERSION"),
        command_line(),
        verdicts.iter().map(line).collect::<Vec<_>>().join("; ")
    );
    table.with_source(source)
}

/// A table of the recording.
struct Shown<'a> {
    title: String,
    table: &'a RangeTable,
    /// Error over Table 3's, over all garments and fabrics.
    ratio: f64,
}

/// Records the searches of all kinds on one of their garments.
pub(super) fn record(
    garment: &Garment,
    found: &[(&'static str, Vec<Judged>)],
    sinks: Vec<Sink>,
) -> anyhow::Result<RecordSummary> {
    let compare = std::iter::once("table-3").chain(found.iter().map(|(kind, _)| *kind)).map(str::to_owned).collect();
    let layout = Layout { several_tables: true, error: true, compare, scatter: true, ..Layout::default() };
    let name = format!("{}: search", garment.name);
    let mut recorder = Recorder::open(RecordOptions { sinks, name, layout, ..RecordOptions::default() })?;
    recorder.body(0, garment.scene.body.mesh())?;
    recorder.garment(0, &garment.scene.garment)?;
    let table_3 = RangeTable::table_3();
    let mut shown = vec![Shown { title: "table-3".to_owned(), table: &table_3, ratio: 1.0 }];
    let mut slots = vec![0];
    for (kind, judged) in found {
        shown.extend((1..).zip(judged).map(|(number, Judged { table, fit })| Shown {
            title: format!("{kind}, {number}"),
            table,
            ratio: fit.error,
        }));
        slots.push(shown.len() - 1);
    }
    let mut points = Vec::new();
    for (i, one) in (0..).zip(&shown) {
        points.push(step(&mut recorder, garment, i, one)?);
        recorder.scatter(i, Picture::of_error("PARTs"), &points)?;
    }
    for (slot, &i) in slots.iter().enumerate() {
        let parts = garment.parts(shown[i].table);
        let stage = garment.preview(0, &parts)?;
        let error_mm = rms(&vertex_errors_mm(&stage.positions, &garment.tailored[0].reference));
        recorder.compare(&Compared {
            index: 0,
            slot,
            caption: &format!("{} PARTs · canonical error {error_mm:.1} mm", parts.len()),
            draped: &stage.positions,
            colours: Colours::Parts {
                part_of_vertex: &parts.part_of_vertex,
                levels: &LevelCount::all(shown[i].table, &parts),
            },
        })?;
    }
    Ok(recorder.finish()?)
}

/// Records a table as a step; returns its point of the scatter.
fn step(
    recorder: &mut Recorder,
    garment: &Garment,
    index: i64,
    one: &Shown<'_>,
) -> anyhow::Result<ScatterPoint<'static>> {
    let parts = garment.parts(one.table);
    let stage = garment.preview(0, &parts)?;
    let error_mm = vertex_errors_mm(&stage.positions, &garment.tailored[0].reference);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let panel = Panel {
        title: format!("Search: {}", garment.name),
        table: one.title.clone(),
        levels: LevelCount::all(one.table, &parts),
        facts: vec![
            fact("PARTs", parts.len().to_string()),
            fact("fabric", garment.tailored[0].fabric.clone()),
            fact("canonical error", format!("{:.2} mm RMS", rms(&error_mm))),
            fact("error over Table 3's, all garments and fabrics", format!("{:.2}", one.ratio)),
        ],
        command_line: command_line(),
        ..Panel::default()
    };
    let forces: Vec<_> = stage.outcomes.iter().map(|outcome| outcome.force_n).collect();
    recorder.step(&StepView {
        index,
        distances_m: &garment.distances.unsigned_m,
        part_of_vertex: &parts.part_of_vertex,
        part_force_n: &forces,
        draped: &stage.positions,
        panel: &panel,
        scalars: &[("error/canonical_rms_mm", rms(&error_mm)), ("levels", one.table.levels.len() as f64)],
        overlays: &[Overlay { name: "error", unit: "mm", values: &error_mm, positions: None }],
    })?;
    let is_table_3 = index == 0;
    Ok(ScatterPoint {
        label: if is_table_3 { "Table 3" } else { "" },
        x: parts.len() as f64,
        y: rms(&error_mm),
        group: usize::from(is_table_3),
        named: is_table_3,
    })
}
