//! The comparison as rows: for the terminal, as CSV (a line for each level), as JSON.

use std::fmt::Write as _;

use crate::parts::range_table::Extent;
use crate::study::metrics::LevelCount;
use crate::study::sweep::{Row, Status, cell};
use serde::Serialize;
use serde_json::{Map, Value};

use super::changes::Changes;
use crate::commands::console;
use crate::commands::sweep::report::{explained, rows_table};

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
        let mut table = console::table(console::OPEN, ["table", "PARTs", "kept", "split", "merged"], 1..);
        for c in of_garment {
            let Changes { kept, split, merged } = c.changes;
            let counts = [c.parts_by_levels(), kept, split, merged].map(|n| n.to_string());
            table.add_row(std::iter::once(c.row.table.clone()).chain(counts));
        }
        let _ = writeln!(out, "{table}");
        let pairs = of_garment.iter().flat_map(|c| [c.row.table.clone(), "PARTs".to_owned()]);
        let mut table = console::table(console::OPEN, std::iter::once("level".to_owned()).chain(pairs), 0..);
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

/// The header of the CSV: columns of the row, and of the level.
const HEADER: &str = "garment,table,level,lower_cm,upper_cm,extent_cm,vertices,parts,level_part_count,kept,split,merged,\
    part_count,time_total_ms,rms_mm,canonical_rms_mm,representable_rms_mm,representable_affine_rms_mm,error";

/// As CSV: a line for each level, the totals of its table repeated; a failed table has one line without a level.
pub(super) fn csv(all: &[Compared]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(HEADER.split(','))?;
    for c in all {
        let mut cells: Map<String, Value> = serde_json::from_value(serde_json::to_value(c)?)?;
        let mut write =
            |cells: &Map<String, Value>| writer.write_record(HEADER.split(',').map(|name| cell(cells.get(name))));
        if c.row.status == Status::Error || c.per_level.is_empty() {
            write(&cells)?;
            continue;
        }
        for level in &c.per_level {
            cells.extend(serde_json::from_value::<Map<String, Value>>(serde_json::to_value(level)?)?);
            write(&cells)?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
