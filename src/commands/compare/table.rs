//! The comparison as rows: for the terminal, as CSV (a line for each level), as JSON.

use std::fmt::Write as _;

use comfy_table::presets;
use partwise::figures::LevelCount;
use partwise::range_table::Extent;
use partwise::sweep::{Row, Status, cell};
use serde::Serialize;
use serde_json::{Map, Value};

use super::changes::Changes;
use crate::commands::console;
use crate::commands::sweep::report::{explained, right, rows_table};

/// One table on one garment.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Compared {
    /// The figures, as in the rows of a sweep.
    #[serde(flatten)]
    pub(super) row: Row,
    /// Against the first table.
    #[serde(flatten)]
    pub(super) changes: Changes,
    /// Level by level.
    pub(super) per_level: Vec<LevelCount>,
}

impl Compared {
    /// PARTs by levels alone, before the model cuts any.
    fn parts_by_levels(&self) -> usize {
        self.per_level.iter().map(|level| level.parts).sum()
    }
}

/// For the terminal.
pub(super) fn text(all: &[Compared]) -> String {
    let rows: Vec<Row> = all.iter().map(|c| c.row.clone()).collect();
    let mut out = format!("{}\n{}", rows_table(&rows), explained(&rows));
    for of_garment in all.chunk_by(|a, b| a.row.garment == b.row.garment) {
        let _ = writeln!(
            out,
            "\n{}: PARTs by levels alone, and what became of the first table's",
            of_garment[0].row.garment
        );
        let mut table = console::table();
        table.load_preset(presets::UTF8_BORDERS_ONLY).set_header(["table", "PARTs", "kept", "split", "merged"]);
        for c in of_garment {
            let Changes { kept, split, merged } = c.changes;
            let counts = [c.parts_by_levels(), kept, split, merged].map(|n| n.to_string());
            table.add_row(std::iter::once(c.row.table.clone()).chain(counts));
        }
        right(&mut table, 1..5);
        let _ = writeln!(out, "{table}");
        let mut table = console::table();
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
            table.add_row(std::iter::once((level + 1).to_string()).chain(cells));
        }
        right(&mut table, 0..1 + 2 * of_garment.len());
        let _ = writeln!(out, "{table}");
    }
    out
}

fn range(level: &LevelCount) -> String {
    let short = |cm: f64| format!("{cm:.3}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let own = level.extent.filter(Extent::cuts).map_or_else(String::new, |extent| format!(", cut to {extent}"));
    let upper = if level.upper_cm.is_finite() { short(level.upper_cm) } else { "∞".to_owned() };
    format!("{}–{upper} cm{own}", short(level.lower_cm))
}

/// Columns of the CSV: of the row, and of the level.
const COLUMNS: [&str; 19] = [
    "garment",
    "table",
    "level",
    "lower_cm",
    "upper_cm",
    "extent_cm",
    "vertices",
    "parts",
    "level_part_count",
    "kept",
    "split",
    "merged",
    "part_count",
    "time_total_ms",
    "rms_mm",
    "canonical_rms_mm",
    "representable_rms_mm",
    "representable_affine_rms_mm",
    "error",
];

/// As CSV: a line for each level, the totals of its table repeated; a failed table has one line without a level.
pub(super) fn csv(all: &[Compared]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for c in all {
        let mut cells: Map<String, Value> = serde_json::from_value(serde_json::to_value(c)?)?;
        let levels: &[LevelCount] = if c.row.status == Status::Error { &[] } else { &c.per_level };
        for level in levels {
            cells.extend(serde_json::from_value::<Map<String, Value>>(serde_json::to_value(level)?)?);
            writer.write_record(COLUMNS.map(|name| cell(cells.get(name))))?;
        }
        if levels.is_empty() {
            writer.write_record(COLUMNS.map(|name| cell(cells.get(name))))?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
