//! The recording of a sweep: one file a garment, each table a step, the few chosen side by side, speed against error.
//!
//! It is put together at the end from what is kept on the shelf, in the plan's order, so that a sweep that was interrupted, cut
//! into shards or run with several jobs gives the recording of an undisturbed one.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use partwise::parts::UNASSIGNED;
use partwise::range_table::{Extent, METRES_PER_CM};
use partwise::record::{
    Chosen, Layout, LevelRow, Overlay, Panel, RecordOptions, RecordSummary, Recorder, ScatterPoint, Sink, StepView,
    Tab, When,
};
use partwise::sweep::{Row, Status};

use super::chosen::{choose, error_mm, labels};
use super::kept::{KeptPoint, Shelf};

/// A recording to be made.
pub(crate) struct Group<'a> {
    /// Names the file and the recording: `flared-skirt`.
    pub(crate) name: String,
    scene: String,
    rows: Vec<&'a Row>,
}

/// The rows with a result and a kept point, by body and garment, in the plan's order; and how many have no kept point.
pub(crate) fn groups<'a>(rows: &'a [Row], shelf: &Shelf) -> (Vec<Group<'a>>, usize) {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut missing = 0;
    for row in rows.iter().filter(|row| row.status == Status::Ok) {
        let Some(scene) = shelf.scene_of(&row.point) else {
            missing += 1;
            continue;
        };
        match groups.iter_mut().find(|g| g.scene == scene) {
            Some(group) => group.rows.push(row),
            None => groups.push(Group { name: file_stem(&row.garment), scene, rows: vec![row] }),
        }
    }
    // Two bodies, one garment: the body's name tells them apart, and where that fails, the scene's.
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    for group in &groups {
        *count.entry(group.name.clone()).or_default() += 1;
    }
    for group in &mut groups {
        if count[&group.name] > 1 {
            let body = group.rows.first().map_or(String::new(), |row| file_stem(&row.body));
            group.name = format!("{} on {body} {}", group.name, &group.scene[..group.scene.len().min(6)]);
        }
    }
    (groups, missing)
}

/// A label as a file's name.
fn file_stem(label: &str) -> String {
    let stem = Path::new(label).file_name().map_or(label.into(), std::ffi::OsStr::to_string_lossy);
    let stem = stem.strip_suffix(".obj").or(stem.strip_suffix(".toml")).unwrap_or(&stem);
    stem.chars().map(|c| if c.is_alphanumeric() || "-_@=. ".contains(c) { c } else { '-' }).collect()
}

/// Records a group. `sweep` is its name, for the text panel; `opens_on` the tab shown first.
pub(crate) fn record(
    group: &Group<'_>,
    shelf: &Shelf,
    sweep: &str,
    sinks: Vec<Sink>,
    opens_on: Tab,
) -> anyhow::Result<RecordSummary> {
    let Some(scene) = shelf.scene(&group.scene) else { anyhow::bail!("the scene of {} cannot be read", group.name) };
    let rows = &group.rows;
    let label = labels(rows);
    let chosen = choose(rows);
    let judged = rows.iter().any(|row| error_mm(row).is_some());
    let layout = Layout {
        several_tables: true,
        table_count: u32::try_from(rows.len()).ok(),
        error: judged,
        compare: if chosen.len() > 1 { chosen.iter().map(|&i| label[i].clone()).collect() } else { Vec::new() },
        scatter: judged,
        opens_on,
        ..Layout::default()
    };
    let name = format!("{}: {sweep}", group.name);
    let mut recorder = Recorder::open(RecordOptions { sinks, name, layout, ..RecordOptions::default() })?;
    recorder.body(0, &scene.body)?;
    recorder.garment(0, &scene.garment)?;
    for (index, (row, label)) in (0..).zip(rows.iter().zip(&label)) {
        let Some(point) = shelf.point(&row.point) else { continue };
        let (part_of_vertex, force_n) = covering(&point);
        let error = Overlay { name: "error", unit: "mm", values: &point.error_mm };
        let overlays = if point.error_mm.is_empty() { &[][..] } else { std::slice::from_ref(&error) };
        recorder.step(&StepView {
            index,
            distance_m: &scene.distance_m,
            part_of_vertex: &part_of_vertex,
            part_force_n: &force_n,
            draped: &point.positions,
            panel: &panel(row, label, sweep, &point),
            scalars: &scalars(row),
            overlays,
        })?;
    }
    if judged {
        let cost = if chosen.len() > 1 { "time, ms (green: side by side)" } else { "time, ms" };
        recorder.scatter(When::Table(0), cost, &scatter(rows, &label, &chosen))?;
    }
    if chosen.len() > 1 {
        for (slot, &i) in chosen.iter().enumerate() {
            let Some(point) = shelf.point(&rows[i].point) else { continue };
            let (part_of_vertex, _) = covering(&point);
            recorder.compare(&Chosen {
                index: 0,
                slot,
                caption: &caption(rows[i]),
                draped: &point.positions,
                part_of_vertex: &part_of_vertex,
                overlay: None,
            })?;
        }
    }
    Ok(recorder.finish()?)
}

/// PARTs and forces with one more PART, without a force, for the vertices outside every level.
fn covering(point: &KeptPoint) -> (Vec<u32>, Vec<DVec3>) {
    let rest = point.force_n.len() as u32;
    let mut force = point.force_n.clone();
    if point.part_of_vertex.contains(&UNASSIGNED) {
        force.push(DVec3::ZERO);
    }
    (point.part_of_vertex.iter().map(|&p| if p == UNASSIGNED { rest } else { p }).collect(), force)
}

fn caption(row: &Row) -> String {
    let error = error_mm(row).map_or(String::new(), |mm| format!(" · {mm:.1} mm"));
    let parts = row.part_count.unwrap_or_default();
    format!("{parts} PARTs · {:.0} ms{error}", row.time_total_ms.unwrap_or_default())
}

/// As many points as these have their names written beside them; of more only the chosen.
const ALL_NAMED: usize = 16;

fn scatter<'a>(rows: &[&Row], labels: &'a [String], chosen: &[usize]) -> Vec<ScatterPoint<'a>> {
    let point = |(i, row): (usize, &&Row)| {
        Some(ScatterPoint {
            label: &labels[i],
            cost: row.time_total_ms?,
            error_mm: error_mm(row)?,
            group: usize::from(chosen.contains(&i)),
            named: rows.len() <= ALL_NAMED || chosen.contains(&i),
        })
    };
    rows.iter().enumerate().filter_map(point).collect()
}

fn scalars(row: &Row) -> Vec<(&'static str, f64)> {
    let count = |n: Option<usize>| n.map(|n| n as f64);
    let all = [
        ("error/rms_mm", row.rms_mm),
        ("error/canonical_rms_mm", row.canonical_rms_mm),
        ("error/representable_rms_mm", row.representable_rms_mm),
        ("displacement_rms_mm", row.displacement_rms_mm),
        ("levels", count(row.levels)),
        ("singletons", count(row.singletons)),
        ("penetrating_vertices", count(row.penetrating_vertices)),
    ];
    all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
}

fn panel(row: &Row, label: &str, sweep: &str, point: &KeptPoint) -> Panel {
    let mut levels: Vec<LevelRow> = point
        .levels_cm
        .iter()
        .zip(&point.extents_cm)
        .map(|(&[lower, upper], &[width_cm, height_cm])| LevelRow {
            lower_m: lower * METRES_PER_CM,
            upper_m: upper * METRES_PER_CM,
            vertices: 0,
            parts: 0,
            extent: (width_cm > 0.0).then(|| Extent { width_cm, height_cm }.to_string()),
        })
        .collect();
    for &level in &point.level_of_part {
        levels[level as usize].parts += 1;
    }
    for level in point.part_of_vertex.iter().filter_map(|&p| point.level_of_part.get(p as usize)) {
        levels[*level as usize].vertices += 1;
    }
    let mut facts = vec![
        ("sweep".to_owned(), sweep.to_owned()),
        ("point".to_owned(), row.index.to_string()),
        ("model".to_owned(), row.model.clone()),
        ("fabric".to_owned(), row.fabric.clone()),
        ("extent, cm".to_owned(), row.extent_cm.clone()),
        ("refinement".to_owned(), row.refine.clone()),
    ];
    let mut fact = |name: &str, value: Option<String>| facts.extend(value.map(|v| (name.to_owned(), v)));
    let mm = |value: Option<f64>| value.map(|v| format!("{v:.1} mm RMS"));
    fact("vertices", row.vertices.map(|n| n.to_string()));
    fact("PARTs", row.part_count.map(|n| format!("{n} ({} single vertices)", row.singletons.unwrap_or_default())));
    fact("moved", mm(row.displacement_rms_mm));
    fact("off its own continuation", mm(row.rms_mm));
    fact("off the canonical drape", mm(row.canonical_rms_mm));
    fact("representable error", mm(row.representable_rms_mm));
    fact("inside the body", row.penetrating_vertices.map(|n| format!("{n} vertices")));
    let times = [
        ("distance", row.time_distance_ms),
        ("segment", row.time_segment_ms),
        ("mechanics", row.time_mechanics_ms),
        ("refine", row.time_refine_ms),
    ];
    Panel {
        title: format!("{} on {}", row.garment, row.body),
        table: label.to_owned(),
        levels,
        facts,
        timings_ms: times.into_iter().filter_map(|(stage, ms)| Some((stage.to_owned(), ms?))).collect(),
        ..Panel::default()
    }
}
