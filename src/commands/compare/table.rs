//! The comparison as rows: for the terminal, as CSV (a line for each level), as JSON.

use std::fmt::Write as _;

use comfy_table::{CellAlignment, Table, presets};
use partwise::sweep::{Row, Status};
use serde::Serialize;

use super::changes::Changes;
use crate::commands::sweep::report::rows_table;

/// One level of a table on a garment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct LevelCount {
    pub(super) level: usize,
    pub(super) lower_cm: f64,
    /// `None` for the open last level.
    pub(super) upper_cm: Option<f64>,
    /// The extent of the level's own that the model cuts its PARTs to, cm: `12`, `6x24`.
    pub(super) extent_cm: Option<String>,
    pub(super) vertices: usize,
    pub(super) parts: usize,
}

/// One table on one garment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Compared {
    /// The figures, as in the rows of a sweep.
    #[serde(flatten)]
    pub(super) row: Row,
    /// PARTs by levels alone, before any cut.
    pub(super) level_part_count: usize,
    /// Against the first table: PARTs that stay the same.
    pub(super) kept: usize,
    /// Against the first table: its PARTs that are split.
    pub(super) split: usize,
    /// Against the first table: PARTs that merge several of its own.
    pub(super) merged: usize,
    /// Level by level.
    pub(super) per_level: Vec<LevelCount>,
}

impl Compared {
    pub(super) fn new(row: Row, level_part_count: usize, changes: Changes, per_level: Vec<LevelCount>) -> Self {
        let Changes { kept, split, merged } = changes;
        Self { row, level_part_count, kept, split, merged, per_level }
    }
}

/// For the terminal.
pub(super) fn text(all: &[Compared]) -> String {
    let rows: Vec<Row> = all.iter().map(|c| c.row.clone()).collect();
    let mut out = format!("{}\n", rows_table(&rows));
    for of_garment in all.chunk_by(|a, b| a.row.garment == b.row.garment) {
        let _ = writeln!(
            out,
            "\n{}: PARTs by levels alone, and what became of the first table's",
            of_garment[0].row.garment
        );
        let mut table = Table::new();
        table.load_preset(presets::UTF8_BORDERS_ONLY).set_header(["table", "PARTs", "kept", "split", "merged"]);
        for c in of_garment {
            let counts = [c.level_part_count, c.kept, c.split, c.merged].map(|n| n.to_string());
            table.add_row(std::iter::once(c.row.table.clone()).chain(counts));
        }
        right(&mut table, 1..5);
        let _ = writeln!(out, "{table}");
        let mut table = Table::new();
        let pairs = of_garment.iter().flat_map(|c| [c.row.table.clone(), "PARTs".to_owned()]);
        table.load_preset(presets::UTF8_BORDERS_ONLY).set_header(std::iter::once("level".to_owned()).chain(pairs));
        let most = of_garment.iter().map(|c| c.per_level.len()).max().unwrap_or(0);
        for level in 0..most {
            if of_garment.iter().all(|c| c.per_level.get(level).is_none_or(|l| l.vertices == 0)) {
                continue;
            }
            let cells = of_garment.iter().flat_map(|c| match c.per_level.get(level) {
                Some(l) => [range(l), l.parts.to_string()],
                None => [String::new(), String::new()],
            });
            table.add_row(std::iter::once(level.to_string()).chain(cells));
        }
        right(&mut table, 0..1 + 2 * of_garment.len());
        let _ = writeln!(out, "{table}");
    }
    out
}

fn range(level: &LevelCount) -> String {
    let short = |cm: f64| format!("{cm:.3}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let own =
        level.extent_cm.as_ref().map_or_else(String::new, |extent| format!(", cut to {}", extent.replace('x', " × ")));
    format!("{}–{} cm{own}", short(level.lower_cm), level.upper_cm.map_or_else(|| "∞".to_owned(), short))
}

fn right(table: &mut Table, columns: std::ops::Range<usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

#[derive(Serialize)]
struct Line<'a> {
    garment: &'a str,
    table: &'a str,
    level: Option<usize>,
    lower_cm: Option<f64>,
    upper_cm: Option<f64>,
    extent_cm: Option<&'a str>,
    vertices: Option<usize>,
    parts: Option<usize>,
    level_part_count: usize,
    kept: usize,
    split: usize,
    merged: usize,
    part_count: Option<usize>,
    time_total_ms: Option<f64>,
    rms_mm: Option<f64>,
    canonical_rms_mm: Option<f64>,
    representable_rms_mm: Option<f64>,
    error: &'a str,
}

/// As CSV: a line for each level, the totals of its table repeated; a failed table has one line without a level.
pub(super) fn csv(all: &[Compared]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for c in all {
        let failed = c.row.status == Status::Error;
        let levels: Vec<Option<&LevelCount>> = if failed { vec![None] } else { c.per_level.iter().map(Some).collect() };
        for level in levels {
            writer.serialize(Line {
                garment: &c.row.garment,
                table: &c.row.table,
                level: level.map(|l| l.level),
                lower_cm: level.map(|l| l.lower_cm),
                upper_cm: level.and_then(|l| l.upper_cm),
                extent_cm: level.and_then(|l| l.extent_cm.as_deref()),
                vertices: level.map(|l| l.vertices),
                parts: level.map(|l| l.parts),
                level_part_count: c.level_part_count,
                kept: c.kept,
                split: c.split,
                merged: c.merged,
                part_count: c.row.part_count,
                time_total_ms: c.row.time_total_ms,
                rms_mm: c.row.rms_mm,
                canonical_rms_mm: c.row.canonical_rms_mm,
                representable_rms_mm: c.row.representable_rms_mm,
                error: &c.row.error,
            })?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
