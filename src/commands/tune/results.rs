//! The results of a search: text, CSV, JSON, range tables with their provenance, and a recording.
//!
//! The recording has a step for Table 3, one for each iteration with the best table so far, and the selected tables side by side. It
//! shows no forces and times: its drapes are the best that the PARTs can represent, blended over the seams. The error of the coupled
//! model is in the captions of the selected tables.

use std::fmt::Write as _;

use crate::parts::Parts;
use crate::parts::range_table::{Extent, RangeTable};
use crate::record::{
    Colours, Compared, Layout, Overlay, Panel, Picture, RecordOptions, RecordSummary, Recorder, ScatterPoint, Sink,
    StepView,
};
use crate::study::accuracy::vertex_errors;
use crate::study::metrics::LevelCount;
use crate::study::table_search::Front;
use comfy_table::Table;
use glam::DVec3;
use serde::Serialize;

use super::garment::{Garment, TableFit, TableQuality};
use super::search::{Found, Selected};
use crate::commands::console;
use crate::commands::summary::command_line;

/// A tuned table compared with Table 3 on one garment. `…_ratio` is the error over Table 3's.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Verdict {
    /// The garments that the table was tuned on.
    pub(super) tuned_on: String,
    /// `levels`, or `levels and extents`.
    pub(super) kind: &'static str,
    /// The garment of this comparison.
    pub(super) garment: String,
    /// Whether the garment was excluded from the search.
    pub(super) held_out: bool,
    /// Factor on the extents that gives a held-out garment Table 3's number of PARTs; 1 for the unscaled table.
    pub(super) extent_factor: f64,
    pub(super) levels: usize,
    /// Number of levels cut to an extent.
    pub(super) cut_levels: usize,
    pub(super) parts: usize,
    pub(super) table_3_parts: usize,
    /// Bound with a translation of each PART.
    pub(super) translation_mm: f64,
    pub(super) translation_ratio: f64,
    /// Bound with affine maps blended over the seams.
    pub(super) affine_mm: f64,
    pub(super) affine_ratio: f64,
    /// Error of the coupled model without refinement against the canonical drape.
    pub(super) model_mm: f64,
    pub(super) table_3_model_mm: f64,
    pub(super) model_ratio: f64,
    /// Error of the same drape against its own continuation.
    pub(super) own_mm: Option<f64>,
    pub(super) table_3_own_mm: Option<f64>,
    pub(super) own_ratio: Option<f64>,
}

impl Verdict {
    pub(super) fn new(
        tuned_on: &str,
        kind: &'static str,
        table: &RangeTable,
        quality: TableQuality,
        garment: &Garment,
    ) -> Self {
        let TableQuality { translation_mm, affine_mm, model_mm, own_mm } = quality;
        let three = garment.table_3_quality;
        Self {
            tuned_on: tuned_on.to_owned(),
            kind,
            garment: garment.name.clone(),
            held_out: false,
            extent_factor: 1.0,
            levels: table.levels.len(),
            cut_levels: table.levels.iter().filter(|l| l.extent.is_some_and(|e| e.cuts())).count(),
            parts: garment.parts(table).len(),
            table_3_parts: garment.table_3.parts,
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
}

/// The comparisons with Table 3 as a table.
pub(super) fn verdicts(all: &[Verdict]) -> Table {
    let kind = |v: &Verdict| match v.extent_factor {
        1.0 => v.kind.to_owned(),
        factor => format!("{} × {factor:.2}", v.kind),
    };
    let error = |(mm, ratio): (f64, f64)| format!("{mm:.1} ({ratio:.2})");
    let columns = |v: &Verdict| {
        [
            ("tuned on", v.tuned_on.clone()),
            ("searched", kind(v)),
            ("garment", format!("{}{}", v.garment, if v.held_out { " (held out)" } else { "" })),
            ("levels", v.levels.to_string()),
            ("cut", v.cut_levels.to_string()),
            ("PARTs", v.parts.to_string()),
            ("Table 3", v.table_3_parts.to_string()),
            ("translation bound mm", error((v.translation_mm, v.translation_ratio))),
            ("affine bound mm", error((v.affine_mm, v.affine_ratio))),
            ("canonical error mm", error((v.model_mm, v.model_ratio))),
            ("own error mm", v.own_mm.zip(v.own_ratio).map_or_else(String::new, error)),
        ]
    };
    let header = columns(&Verdict::default()).map(|(name, _)| name);
    console::table(console::OPEN, header, 3.., all.iter().map(|v| columns(v).map(|(_, cell)| cell)))
}

/// The tables with a larger error of the coupled model than Table 3.
pub(super) fn worse(all: &[Verdict]) -> String {
    let mut out = String::new();
    for v in all.iter().filter(|v| v.model_ratio > 1.0) {
        let _ = writeln!(out, "Table 3 has a smaller canonical error: {}, {}, on {}", v.tuned_on, v.kind, v.garment);
    }
    out
}

/// Lines of a front printed at most; the CSV has all.
const MAX_PRINTED: usize = 12;

/// A front as a table of at most [`MAX_PRINTED`] lines.
pub(super) fn front(title: &str, front: &Front, garments: &[&Garment], exact: bool) -> String {
    let last = front.points.len().saturating_sub(1);
    let mut printed: Vec<usize> = (0..MAX_PRINTED).map(|i| i * last / (MAX_PRINTED - 1)).collect();
    printed.dedup();
    let rows = printed.into_iter().filter_map(|i| front.points.get(i)).map(|point| {
        let levels = (point.inner_bounds_cm.len() + 1).to_string();
        [point.parts.to_string(), format!("{:.2}", 1e3 * point.rms_m), levels, extent_range(&point.extents)]
    });
    let table = console::table(console::OPEN, ["PARTs", "search error mm", "levels", "extents cm"], 0.., rows);
    let optimal = if exact { "optimal over all bounds" } else { "the best found" };
    let mut out = format!("{title}: front of {} tables, {optimal}\n{table}\n", front.points.len());
    let (parts, rms) = table_3(garments);
    let _ = writeln!(out, "Table 3: {parts} PARTs, {rms:.2} mm\n");
    out
}

/// The smallest and the largest extent of a table.
fn extent_range(extents: &[Extent]) -> String {
    let area = |e: &&Extent| e.width_cm * e.height_cm;
    let smallest = extents.iter().min_by(|a, b| area(a).total_cmp(&area(b)));
    let largest = extents.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
    match (smallest, largest) {
        (Some(low), Some(high)) if low != high => format!("{low} to {high}"),
        (Some(one), Some(_)) => one.to_string(),
        _ => Extent::UNCUT.to_string(),
    }
}

/// Table 3's PARTs and search error over several garments, weighted as in the search.
pub(super) fn table_3(garments: &[&Garment]) -> (usize, f64) {
    let parts = garments.iter().map(|g| g.table_3.parts).sum();
    let weights = garments.iter().map(|g| g.weight());
    let total: f64 = weights.clone().sum();
    let mean = garments.iter().zip(weights).map(|(g, weight)| weight * g.table_3.rms_mm.powi(2)).sum::<f64>() / total;
    (parts, mean.sqrt())
}

/// A line of `front.csv`: a table of a front.
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

/// Lines as CSV, the names of their fields as header.
pub(super) fn csv(lines: impl IntoIterator<Item = impl Serialize>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    lines.into_iter().try_for_each(|line| writer.serialize(line))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// The lines of a front, with the garments tuned on and the kind of tables.
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

/// The table with its provenance: program and command line, garments and errors.
pub(super) fn with_provenance(selected: &Selected, garments: &[&Garment]) -> RangeTable {
    let errors = |parts: usize, quality: &TableQuality| {
        let TableQuality { translation_mm, affine_mm, model_mm, .. } = quality;
        format!("{parts} PARTs, {translation_mm:.2}, {affine_mm:.2} and {model_mm:.2} mm")
    };
    let line = |((g, fit), quality): ((&&Garment, &TableFit), &TableQuality)| {
        let three = errors(g.table_3.parts, &g.table_3_quality);
        format!("{}: {} (Table 3: {three})", g.name, errors(fit.parts, quality))
    };
    let lines: Vec<String> = garments.iter().zip(&selected.fits).zip(&selected.qualities).map(line).collect();
    let extent = if selected.table.has_extents() {
        "levels with their own extents, which replace --max-extent"
    } else {
        "levels alone (--max-extent 0)"
    };
    let source = format!(
        "partwise {} by `{}`, {extent}, selected from {} previews; PARTs, translation bound, affine bound and canonical error, {}",
        env!("CARGO_PKG_VERSION"),
        command_line(),
        selected.previewed,
        lines.join("; ")
    );
    selected.table.clone().with_source(source)
}

/// A table of the recording.
struct Shown<'a> {
    index: i64,
    title: String,
    table: &'a RangeTable,
}

/// Records a search on one of its garments.
pub(super) fn record(
    garment: &Garment,
    all: &[&Garment],
    found: &Found,
    selected: &[(&'static str, Selected)],
    sinks: Vec<Sink>,
) -> anyhow::Result<RecordSummary> {
    let compare = ["table-3"].into_iter().chain(selected.iter().map(|(kind, _)| *kind)).map(str::to_owned).collect();
    let layout = Layout {
        several_tables: true,
        without_mechanics: true,
        error: true,
        compare,
        scatter: true,
        ..Layout::default()
    };
    let name = format!("{}: search", garment.name);
    let mut recorder = Recorder::open(RecordOptions { sinks, name, layout, ..RecordOptions::default() })?;
    recorder.body(0, garment.scene.body.mesh())?;
    recorder.garment(0, &garment.scene.garment)?;
    let table_3 = RangeTable::table_3();
    let start = Shown { index: 0, title: "table-3".to_owned(), table: &table_3 };
    step(&mut recorder, garment, &start)?;
    scatter(&mut recorder, 0, all, &Front::default())?;
    compare_table(&mut recorder, garment, 0, garment.table_3_quality.model_mm, &start)?;
    for (index, iteration) in (1..).zip(&found.iterations) {
        let Some(best) = &iteration.front.best else { continue };
        let title = format!("best after {}, round {}", iteration.title, iteration.round);
        let shown = Shown { index, title, table: &best.table("best so far", "")? };
        step(&mut recorder, garment, &shown)?;
        scatter(&mut recorder, index, all, &iteration.front)?;
    }
    for (slot, (kind, selected)) in (1..).zip(selected) {
        let shown = Shown { index: 0, title: (*kind).to_owned(), table: &selected.table };
        let quality = all.iter().zip(&selected.qualities).find(|(g, _)| g.name == garment.name);
        let model_mm = quality.map_or(f64::NAN, |(_, quality)| quality.model_mm);
        compare_table(&mut recorder, garment, slot, model_mm, &shown)?;
    }
    Ok(recorder.finish()?)
}

/// The positions of the garment with each PART moved as near to the reference as its motion allows, m.
fn nearest_positions(garment: &Garment, parts: &Parts) -> anyhow::Result<Vec<DVec3>> {
    let moved = garment.nearest(parts, garment.motion)?;
    Ok(garment.scene.garment.positions.iter().zip(moved).map(|(x, u)| *x + u).collect())
}

fn step(recorder: &mut Recorder, garment: &Garment, shown: &Shown<'_>) -> anyhow::Result<()> {
    let parts = garment.parts(shown.table);
    let positions = nearest_positions(garment, &parts)?;
    let error_mm: Vec<f64> = vertex_errors(&positions, &garment.reference).iter().map(|e| 1e3 * e).collect();
    let fit = garment.fit(shown.table);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let panel = Panel {
        title: format!("Search: {}", garment.name),
        table: shown.title.clone(),
        levels: LevelCount::all(shown.table, &parts),
        facts: vec![
            fact("PARTs", fit.parts.to_string()),
            fact("representable error", format!("{:.2} mm RMS", fit.rms_mm)),
            fact("over Table 3's", format!("{:.2}", fit.rms_mm / garment.table_3.rms_mm)),
            fact("drape shown", format!("nearest to the reference by {} motions of the PARTs", garment.motion.name())),
        ],
        command_line: command_line(),
        ..Panel::default()
    };
    recorder.step(&StepView {
        index: shown.index,
        distances_m: &garment.distances_m,
        part_of_vertex: &parts.part_of_vertex,
        part_force_n: &vec![DVec3::ZERO; parts.len()],
        draped: &positions,
        panel: &panel,
        scalars: &[("error/representable_rms_mm", fit.rms_mm), ("levels", shown.table.levels.len() as f64)],
        overlays: &[Overlay { name: "error", unit: "mm", values: &error_mm, positions: None }],
    })?;
    Ok(())
}

fn compare_table(
    recorder: &mut Recorder,
    garment: &Garment,
    slot: usize,
    model_mm: f64,
    shown: &Shown<'_>,
) -> anyhow::Result<()> {
    let parts = garment.parts(shown.table);
    let fit = garment.fit(shown.table);
    recorder.compare(&Compared {
        index: shown.index,
        slot,
        caption: &format!("{} PARTs · search error {:.1} mm · canonical error {model_mm:.1} mm", fit.parts, fit.rms_mm),
        draped: &nearest_positions(garment, &parts)?,
        colours: Colours::Parts {
            part_of_vertex: &parts.part_of_vertex,
            levels: &LevelCount::all(shown.table, &parts),
        },
    })?;
    Ok(())
}

/// Plots the front so far and Table 3, over all garments of the search.
fn scatter(recorder: &mut Recorder, index: i64, all: &[&Garment], front: &Front) -> anyhow::Result<()> {
    let (parts, error_mm) = table_3(all);
    let mut points = vec![ScatterPoint { label: "Table 3", x: parts as f64, y: error_mm, group: 1, named: true }];
    points.extend(front.points.iter().map(|p| ScatterPoint {
        label: "",
        x: p.parts as f64,
        y: 1e3 * p.rms_m,
        group: 0,
        named: false,
    }));
    Ok(recorder.scatter(index, Picture::of_error("PARTs"), &points)?)
}
