//! The recording of a sweep: one file a garment, each table a step, the few chosen side by side, speed against error.
//!
//! It is put together at the end from what is kept in the store, in the plan's order, so that a sweep that was
//! interrupted, cut into shards or run with several jobs gives the recording of an undisturbed one.

use std::collections::BTreeMap;
use std::path::Path;

use crate::base::quantiles::nearest_rank;
use crate::record::{
    Colours, Compared, Layout, Overlay, Panel, Picture, Range, RecordOptions, RecordSummary, Recorder, ScatterPoint,
    Sink, StepView, Tab,
};
use crate::study::metrics::Metrics;
use crate::study::sweep::{Row, Status, Timing};

use super::chosen::{choose, error_mm, labels, total_ms};
use super::store::{KeptPoint, PointStore};

/// What the error's colours reach to at least, mm.
const LEAST_ERROR_MM: f64 = 10.0;

/// A recording to be made.
pub(crate) struct Group<'a> {
    /// Names the file and the recording: `flared-skirt`.
    pub(crate) name: String,
    scene: String,
    rows: Vec<&'a Row>,
}

/// The rows with a result and a kept point, by body and garment, in the plan's order; and how many have no kept point.
pub(crate) fn groups<'a>(rows: &'a [Row], store: &PointStore) -> (Vec<Group<'a>>, usize) {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut missing = 0;
    for row in rows.iter().filter(|row| row.status == Status::Ok) {
        let Some(scene) = store.scene_of(&row.point) else {
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
    store: &PointStore,
    sweep: &str,
    sinks: Vec<Sink>,
    opens_on: Tab,
) -> anyhow::Result<RecordSummary> {
    let Some(scene) = store.scene(&group.scene) else { anyhow::bail!("the scene of {} cannot be read", group.name) };
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
    // One scale for all steps, which suits three quarters of them.
    let points: Vec<KeptPoint> = rows.iter().filter_map(|row| store.point(&row.point)).collect();
    let share = |of: fn(&KeptPoint) -> f64| Range::to_quantile(points.iter().map(of), 0.75);
    let error = share(|point| nearest_rank(&point.error_mm, 0.99).max(LEAST_ERROR_MM));
    recorder.set_range("error", error);
    recorder.set_range("force", share(|point| nearest_rank(&point.force_of_vertex(), 0.95)));
    drop(points);
    recorder.body(0, &scene.body)?;
    recorder.garment(0, &scene.garment)?;
    for (index, (row, label)) in (0..).zip(rows.iter().zip(&label)) {
        let Some(point) = store.point(&row.point) else { continue };
        let error = Overlay { name: "error", unit: "mm", values: &point.error_mm };
        let overlays = if point.error_mm.is_empty() { &[][..] } else { std::slice::from_ref(&error) };
        recorder.step(&StepView {
            index,
            distance_m: &scene.distance_m,
            part_of_vertex: &point.part_of_vertex,
            part_force_n: &point.force_n,
            draped: &point.positions,
            panel: &panel(row, label, sweep, &point),
            scalars: &row.metrics.as_ref().map(Metrics::scalars).unwrap_or_default(),
            overlays,
        })?;
    }
    if judged {
        let cost = if chosen.len() > 1 { "time, ms (green: side by side)" } else { "time, ms" };
        recorder.scatter(0, Picture::of_error(cost), &scatter(rows, &label, &chosen))?;
    }
    if chosen.len() > 1 {
        for (slot, &i) in chosen.iter().enumerate() {
            let Some(point) = store.point(&rows[i].point) else { continue };
            recorder.compare(&Compared {
                index: 0,
                slot,
                caption: &caption(rows[i]),
                draped: &point.positions,
                colours: Colours::Parts { part_of_vertex: &point.part_of_vertex, levels: &point.levels },
            })?;
        }
    }
    Ok(recorder.finish()?)
}

fn caption(row: &Row) -> String {
    let error = error_mm(row).map_or(String::new(), |mm| format!(" · {mm:.1} mm"));
    let parts = row.metrics.as_ref().map_or(0, |f| f.part_count);
    format!("{parts} PARTs · {:.0} ms{error}", total_ms(row).unwrap_or_default())
}

/// As many points as these have their names written beside them; of more only the chosen.
const ALL_NAMED: usize = 16;

fn scatter<'a>(rows: &[&Row], labels: &'a [String], chosen: &[usize]) -> Vec<ScatterPoint<'a>> {
    let point = |(i, row): (usize, &&Row)| {
        Some(ScatterPoint {
            label: &labels[i],
            x: total_ms(row)?,
            y: error_mm(row)?,
            group: usize::from(chosen.contains(&i)),
            named: rows.len() <= ALL_NAMED || chosen.contains(&i),
        })
    };
    rows.iter().enumerate().filter_map(point).collect()
}

fn panel(row: &Row, label: &str, sweep: &str, point: &KeptPoint) -> Panel {
    let facts = [
        ("sweep", sweep.to_owned()),
        ("point", row.index.to_string()),
        ("model", row.model.clone()),
        ("fabric", row.fabric.clone()),
        ("extent, cm", row.extent_cm.clone()),
        ("motion", row.motion.clone()),
        ("refinement", row.refine.clone()),
    ];
    let measured = row.metrics.iter().flat_map(Metrics::facts);
    let times = row.timing.iter().flat_map(Timing::stages);
    Panel {
        title: format!("{} on {}", row.garment, row.body),
        table: label.to_owned(),
        levels: point.levels.clone(),
        facts: facts.into_iter().chain(measured).map(|(name, value)| (name.to_owned(), value)).collect(),
        timings_ms: times.map(|(stage, ms)| (stage.to_owned(), ms)).collect(),
        ..Panel::default()
    }
}
