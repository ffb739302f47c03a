//! What a search found, for the terminal, as CSV, as JSON, and as range tables that say where they come from.

use std::fmt::Write as _;

use crate::parts::range_table::{Extent, RangeTable};
use crate::study::table_search::Front;
use comfy_table::Table;
use serde::Serialize;

use super::check::Taken;
use super::garment::{Garment, TableFit, TableQuality};
use crate::commands::console;
use crate::commands::summary::command_line;

/// A tuned table beside Table 3 on one garment.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Verdict {
    /// What the table was tuned on.
    pub(super) tuned_on: String,
    /// `levels`, or `levels and extents`.
    pub(super) kind: &'static str,
    /// The garment it is tried on.
    pub(super) garment: String,
    /// Whether the search did not see this garment.
    pub(super) held_out: bool,
    /// What the extents are multiplied by, so that the PARTs of a garment held out come to Table 3's number; 1 for the table as it is.
    pub(super) extent_factor: f64,
    pub(super) levels: usize,
    /// How many of them are cut to an extent.
    pub(super) cut_levels: usize,
    pub(super) parts: usize,
    pub(super) table_3_parts: usize,
    /// What a translation of each PART leaves at best; over Table 3's.
    pub(super) translation_mm: f64,
    pub(super) translation_ratio: f64,
    /// What affine maps, blended over the seams, leave at best; over Table 3's.
    pub(super) affine_mm: f64,
    pub(super) affine_ratio: f64,
    /// What the coupled model leaves of the canonical drape after both stages, of the table and of Table 3, and one over the other.
    pub(super) model_mm: f64,
    pub(super) table_3_model_mm: f64,
    pub(super) model_ratio: f64,
    /// The same, of where each result itself would settle.
    pub(super) own_mm: Option<f64>,
    pub(super) table_3_own_mm: Option<f64>,
    pub(super) own_ratio: Option<f64>,
}

impl Verdict {
    pub(super) fn new(
        (tuned_on, kind): (&str, &'static str),
        table: &RangeTable,
        worth: TableQuality,
        on: &Garment,
    ) -> Self {
        let TableQuality { translation_mm, affine_mm, model_mm, own_mm } = worth;
        let three = on.table_3_worth;
        Self {
            tuned_on: tuned_on.to_owned(),
            kind,
            garment: on.name.clone(),
            held_out: false,
            extent_factor: 1.0,
            levels: table.levels.len(),
            cut_levels: table.levels.iter().filter(|l| l.extent.is_some_and(|e| e.cuts())).count(),
            parts: on.parts(table).len(),
            table_3_parts: on.table_3.parts,
            translation_mm,
            translation_ratio: translation_mm / three.translation_mm,
            affine_mm,
            affine_ratio: affine_mm / three.affine_mm,
            model_mm,
            table_3_model_mm: three.model_mm,
            model_ratio: model_mm / three.model_mm,
            own_mm,
            table_3_own_mm: three.own_mm,
            own_ratio: own_mm.zip(three.own_mm).map(|(own, three)| own / three),
        }
    }

    /// The same of a table whose search did not see the garment, with its extents scaled.
    pub(super) fn held_out(self, extent_factor: f64) -> Self {
        Self { held_out: true, extent_factor, ..self }
    }
}

/// The verdicts for the terminal.
pub(super) fn verdicts(all: &[Verdict]) -> Table {
    let what = |v: &Verdict| match v.extent_factor {
        1.0 => v.kind.to_owned(),
        factor => format!("{} × {factor:.2}", v.kind),
    };
    let error = |(mm, ratio): (f64, f64)| format!("{mm:.1} ({ratio:.2})");
    let columns = |v: &Verdict| {
        [
            ("tuned on", v.tuned_on.clone()),
            ("what", what(v)),
            ("garment", format!("{}{}", v.garment, if v.held_out { " (held out)" } else { "" })),
            ("levels", v.levels.to_string()),
            ("cut", v.cut_levels.to_string()),
            ("PARTs", v.parts.to_string()),
            ("Table 3", v.table_3_parts.to_string()),
            ("translations mm", error((v.translation_mm, v.translation_ratio))),
            ("affine mm", error((v.affine_mm, v.affine_ratio))),
            ("model mm", error((v.model_mm, v.model_ratio))),
            ("to its own rest mm", v.own_mm.zip(v.own_ratio).map_or_else(String::new, error)),
        ]
    };
    let mut table = console::table(console::OPEN, columns(&Verdict::default()).map(|(name, _)| name), 3..);
    table.add_rows(all.iter().map(|v| columns(v).map(|(_, cell)| cell)));
    table
}

/// Tables that the model makes less of than of Table 3, with no more PARTs than it.
pub(super) fn worse(all: &[Verdict]) -> String {
    let mut out = String::new();
    for v in all.iter().filter(|v| v.model_ratio > 1.0) {
        let _ = writeln!(out, "Table 3 itself is nearer in the model: {}, {}, on {}", v.tuned_on, v.kind, v.garment);
    }
    out
}

/// Lines of a front shown on the terminal at most; the CSV has all.
const SHOWN: usize = 12;

/// A front for the terminal, thinned.
pub(super) fn front(title: &str, front: &Front, garments: &[&Garment], exact: bool) -> String {
    let mut table = console::table(console::OPEN, ["PARTs", "error mm", "levels", "extents cm"], 0..);
    let last = front.points.len().saturating_sub(1);
    let mut shown: Vec<usize> = (0..SHOWN).map(|i| i * last / (SHOWN - 1)).collect();
    shown.dedup();
    for point in shown.into_iter().filter_map(|i| front.points.get(i)) {
        table.add_row([
            point.parts.to_string(),
            format!("{:.2}", 1e3 * point.rms_m),
            (point.inner_bounds_cm.len() + 1).to_string(),
            between(&point.extents),
        ]);
    }
    let beats = if exact { "can beat, every bound tried" } else { "found beats" };
    let mut out = format!("{title}: {} tables that no other {beats}\n{table}\n", front.points.len());
    let (parts, rms) = table_3(garments);
    let _ = writeln!(out, "Table 3: {parts} PARTs, {rms:.2} mm\n");
    out
}

/// The extents of a table in a few letters: the smallest and the largest.
fn between(extents: &[Extent]) -> String {
    let area = |e: &&Extent| e.width_cm * e.height_cm;
    let smallest = extents.iter().min_by(|a, b| area(a).total_cmp(&area(b)));
    let largest = extents.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
    match (smallest, largest) {
        (Some(low), Some(high)) if low != high => format!("{low} to {high}"),
        (Some(one), Some(_)) => one.to_string(),
        _ => Extent::UNCUT.to_string(),
    }
}

/// Table 3's PARTs and error over a set, weighted as the search weighs them.
pub(super) fn table_3(garments: &[&Garment]) -> (usize, f64) {
    let parts = garments.iter().map(|w| w.table_3.parts).sum();
    let weights = garments.iter().map(|w| w.weight());
    let total: f64 = weights.clone().sum();
    let mean = garments.iter().zip(weights).map(|(w, weight)| weight * w.table_3.rms_mm.powi(2)).sum::<f64>() / total;
    (parts, mean.sqrt())
}

/// A table of a front.
#[derive(Serialize)]
pub(super) struct Line<'a> {
    tuned_on: &'a str,
    kind: &'a str,
    parts: usize,
    rms_mm: f64,
    levels: usize,
    inner_bounds_cm: String,
    extents_cm: String,
}

/// Lines as CSV, verdicts say, with their fields for a header.
pub(super) fn csv(lines: impl IntoIterator<Item = impl Serialize>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| writer.serialize(line))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// The lines of a front, by what was tuned on and how.
pub(super) fn lines<'a>((tuned_on, kind, front): &'a (String, &'static str, Front)) -> impl Iterator<Item = Line<'a>> {
    front.points.iter().map(move |point| Line {
        tuned_on,
        kind,
        parts: point.parts,
        rms_mm: 1e3 * point.rms_m,
        levels: point.inner_bounds_cm.len() + 1,
        inner_bounds_cm: point.inner_bounds_cm.iter().map(f64::to_string).collect::<Vec<_>>().join(" "),
        extents_cm: point.extents.iter().map(Extent::in_a_column).collect::<Vec<_>>().join(" "),
    })
}

/// The table with its provenance: who made it how, from what, and how good it is there.
pub(super) fn with_provenance(taken: &Taken, garments: &[&Garment]) -> RangeTable {
    let of = |parts: usize, worth: &TableQuality| {
        let TableQuality { translation_mm, affine_mm, model_mm, .. } = worth;
        format!("{parts} PARTs, {translation_mm:.2}, {affine_mm:.2} and {model_mm:.2} mm")
    };
    let figure = |((w, h), worth): ((&&Garment, &TableFit), &TableQuality)| {
        format!("{}: {} (Table 3: {})", w.name, of(h.parts, worth), of(w.table_3.parts, &w.table_3_worth))
    };
    let figures: Vec<String> = garments.iter().zip(&taken.holds).zip(&taken.worth).map(figure).collect();
    let extent = if taken.table.has_extents() {
        "every level with its extent, whatever --max-extent says"
    } else {
        "levels alone (--max-extent 0)"
    };
    let source = format!(
        "partwise {} by `{}`, {extent}, of {} draped; left of the canonical drape by translations, by blended affine maps and by the model, {}",
        env!("CARGO_PKG_VERSION"),
        command_line(),
        taken.draped,
        figures.join("; ")
    );
    taken.table.clone().with_source(source)
}
