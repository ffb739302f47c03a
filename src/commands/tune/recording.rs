//! The recording of a search: a step for Table 3, one for each iteration with the best table so far, and the tables taken side
//! by side. No forces and times of stages are shown: what is shown as the drape is the best these PARTs can hold, blended over the
//! seams, and what the model makes of the tables taken is said beside it.

use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::record::{
    Colours, Compared, Layout, Overlay, Panel, Picture, RecordOptions, RecordSummary, Recorder, ScatterPoint, Sink,
    StepView,
};
use crate::study::accuracy::vertex_errors;
use crate::study::metrics::LevelCount;
use crate::study::table_search::Front;
use glam::DVec3;

use super::check::Taken;
use super::find::Found;
use super::garment::Garment;
use crate::commands::summary::command_line;

/// One table of the recording.
struct Shown<'a> {
    index: i64,
    title: String,
    table: &'a RangeTable,
}

/// Records what a search found on one of its garments.
pub(super) fn record(
    garment: &Garment,
    all: &[&Garment],
    found: &Found,
    taken: &[(&'static str, Taken)],
    sinks: Vec<Sink>,
) -> anyhow::Result<RecordSummary> {
    let titles =
        std::iter::once("table-3".to_owned()).chain(taken.iter().map(|(kind, _)| (*kind).to_owned())).collect();
    let layout = Layout {
        several_tables: true,
        without_mechanics: true,
        error: true,
        compare: titles,
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
    slot(&mut recorder, garment, (0, garment.table_3_worth.model_mm), &start)?;
    for (index, iteration) in (1..).zip(&found.iterations) {
        let Some(best) = &iteration.front.best else { continue };
        let title = format!("best after {}, round {}", iteration.what, iteration.round);
        let shown = Shown { index, title, table: &best.table("best so far", "")? };
        step(&mut recorder, garment, &shown)?;
        scatter(&mut recorder, index, all, &iteration.front)?;
    }
    for (place, (kind, taken)) in (1..).zip(taken) {
        let shown = Shown { index: 0, title: (*kind).to_owned(), table: &taken.table };
        let worth = all.iter().zip(&taken.worth).find(|(w, _)| w.name == garment.name);
        slot(&mut recorder, garment, (place, worth.map_or(f64::NAN, |(_, worth)| worth.model_mm)), &shown)?;
    }
    Ok(recorder.finish()?)
}

/// The garment with its PARTs moved as near to the reference as they can.
fn held(garment: &Garment, parts: &Parts) -> anyhow::Result<Vec<DVec3>> {
    let moved = garment.nearest(parts, garment.motion)?;
    Ok(garment.scene.garment.positions.iter().zip(moved).map(|(x, u)| *x + u).collect())
}

fn step(recorder: &mut Recorder, garment: &Garment, shown: &Shown<'_>) -> anyhow::Result<()> {
    let parts = garment.parts(shown.table);
    let positions = held(garment, &parts)?;
    let error_mm: Vec<f64> = vertex_errors(&positions, &garment.reference).iter().map(|e| 1e3 * e).collect();
    let holds = garment.holds(shown.table);
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let panel = Panel {
        title: format!("Search: {}", garment.name),
        table: shown.title.clone(),
        levels: LevelCount::all(shown.table, &parts),
        facts: vec![
            fact("PARTs", holds.parts.to_string()),
            fact("representable error", format!("{:.2} mm RMS", holds.rms_mm)),
            fact("of Table 3's", format!("{:.2}", holds.rms_mm / garment.table_3.rms_mm)),
            fact("PARTs at best", format!("what {} motions of the PARTs can hold", garment.motion.name())),
        ],
        command_line: command_line(),
        ..Panel::default()
    };
    recorder.step(&StepView {
        index: shown.index,
        distance_m: &garment.distances_m,
        part_of_vertex: &parts.part_of_vertex,
        part_force_n: &vec![DVec3::ZERO; parts.len()],
        draped: &positions,
        panel: &panel,
        scalars: &[("error/representable_rms_mm", holds.rms_mm), ("levels", shown.table.levels.len() as f64)],
        overlays: &[Overlay { name: "error", unit: "mm", values: &error_mm }],
    })?;
    Ok(())
}

fn slot(
    recorder: &mut Recorder,
    garment: &Garment,
    (slot, model_mm): (usize, f64),
    shown: &Shown<'_>,
) -> anyhow::Result<()> {
    let parts = garment.parts(shown.table);
    let holds = garment.holds(shown.table);
    recorder.compare(&Compared {
        index: shown.index,
        slot,
        caption: &format!("{} PARTs · holds to {:.1} mm · model {model_mm:.1} mm", holds.parts, holds.rms_mm),
        draped: &held(garment, &parts)?,
        colours: Colours::Parts {
            part_of_vertex: &parts.part_of_vertex,
            levels: &LevelCount::all(shown.table, &parts),
        },
    })?;
    Ok(())
}

/// The front so far beside Table 3, all garments of the search together.
fn scatter(recorder: &mut Recorder, index: i64, all: &[&Garment], front: &Front) -> anyhow::Result<()> {
    let (parts, error_mm) = super::report::table_3(all);
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
