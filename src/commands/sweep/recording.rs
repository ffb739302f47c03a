//! The recording of a sweep: one file per garment, each table a step, a few tables side by side, time against error.
//!
//! It is made at the end from the stored points, in the order of the plan. A sweep that was interrupted, sharded or run with several
//! jobs gives the same recording as an uninterrupted one.

use std::collections::BTreeMap;
use std::path::Path;

use crate::base::quantiles::nearest_rank;
use crate::picture::colour::map::Range;
use crate::record::{
    Colours, Compared, Layout, Overlay, Panel, Picture, RecordOptions, RecordSummary, Recorder, ScatterPoint, Sink,
    StepView, Tab,
};
use crate::study::metrics::Metrics;
use crate::study::sweep::{Row, Status, Timing};

use super::store::{PointStore, StoredPoint};

/// Lower bound on the upper end of the error's colour scale, mm, so that small errors do not look large. A heuristic.
const MIN_ERROR_SCALE_MM: f64 = 10.0;

/// The rows of one recording.
pub(crate) struct Group<'a> {
    /// Name of the file and the recording, such as `flared-skirt`.
    pub(crate) name: String,
    scene: String,
    rows: Vec<&'a Row>,
}

/// The rows with a stored point, by body and garment, in the order of the plan; and the number of rows without a stored point.
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
    // The same garment on two bodies: the names get the body and the scene's id.
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

/// A label as the name of a file.
fn file_stem(label: &str) -> String {
    let stem = Path::new(label).file_name().map_or(label.into(), std::ffi::OsStr::to_string_lossy);
    let endings = [".obj", ".ply", ".stl", ".glb", ".gltf", ".npz", ".toml"];
    let stem = endings.iter().find_map(|ending| stem.strip_suffix(ending)).unwrap_or(&stem);
    stem.chars().map(|c| if c.is_alphanumeric() || "-_@=. ".contains(c) { c } else { '-' }).collect()
}

/// Garments side by side at most. More views would be too narrow; a heuristic.
pub(crate) const MAX_SIDE_BY_SIDE: usize = 6;

/// Garments side by side at least, if there are as many rows: a Pareto front of two tables shows little of the sweep. A heuristic.
const MIN_SIDE_BY_SIDE: usize = 4;

/// The error by which rows are compared, mm.
pub(crate) fn error_mm(row: &Row) -> Option<f64> {
    row.metrics.as_ref()?.error_mm()
}

/// The time of a row, ms.
pub(crate) fn total_ms(row: &Row) -> Option<f64> {
    Some(row.timing.as_ref()?.time_total_ms)
}

/// Labels of rows: the name of the table, and every other setting that differs between the rows.
pub(crate) fn labels(rows: &[&Row]) -> Vec<String> {
    let fields = |row: &Row| {
        [
            row.table.clone(),
            row.model.clone(),
            row.fabric.clone(),
            if row.extent_cm == "none" { "not cut".to_owned() } else { format!("{} cm", row.extent_cm) },
            row.motion.clone(),
            format!("min {}", row.min_part),
            if row.refine == "converged" { row.refine.clone() } else { format!("{} steps", row.refine) },
            format!("seed {}", row.seed),
            row.options.clone(),
        ]
    };
    let all: Vec<[String; 9]> = rows.iter().map(|row| fields(row)).collect();
    let varies: Vec<bool> = (0..9).map(|i| all.windows(2).any(|pair| pair[0][i] != pair[1][i])).collect();
    let some = varies.contains(&true);
    let label = |fields: &[String; 9]| {
        let kept = fields.iter().zip(&varies).enumerate().filter(|(i, (_, v))| **v || (*i == 0 && !some));
        kept.map(|(_, (field, _))| field.as_str()).collect::<Vec<_>>().join(", ")
    };
    all.iter().map(label).collect()
}

/// Up to [`MAX_SIDE_BY_SIDE`] rows, ascending: all if they are few enough, otherwise the first (the reference of a comparison) and
/// an even selection from the Pareto front of PART count and error. A small front is filled up with the rows whose PART counts are
/// farthest from the selected ones. All criteria are deterministic, so that shards select the same rows.
pub(crate) fn select(rows: &[&Row]) -> Vec<usize> {
    if rows.len() <= MAX_SIDE_BY_SIDE {
        return (0..rows.len()).collect();
    }
    let metrics: Vec<Option<(usize, f64)>> =
        rows.iter().map(|row| Some((row.metrics.as_ref()?.part_count, error_mm(row).unwrap_or(0.0)))).collect();
    let beaten = |mine: (usize, f64)| {
        metrics
            .iter()
            .flatten()
            .any(|&(parts, error)| parts <= mine.0 && error <= mine.1 && (parts < mine.0 || error < mine.1))
    };
    let known = rows.iter().any(|row| error_mm(row).is_some());
    let mut front: Vec<usize> = (1..rows.len()).filter(|&i| metrics[i].is_some_and(|f| !known || !beaten(f))).collect();
    front.sort_by_key(|&i| metrics[i].map(|f| f.0));
    front.dedup_by_key(|i| metrics[*i].map(|f| (f.0, f.1.to_bits())));
    let room = MAX_SIDE_BY_SIDE - 1;
    let mut selected = vec![0];
    if front.len() <= room {
        selected.extend(front);
    } else {
        selected.extend((0..room).map(|i| front[i * (front.len() - 1) / (room - 1)]));
    }
    selected.sort_unstable();
    selected.dedup();
    let apart = |i: usize, selected: &[usize]| {
        let parts = |i: usize| metrics[i].map(|f| (f.0.max(1) as f64).ln());
        let gaps = selected.iter().map(|&c| Some((parts(i)? - parts(c)?).abs()));
        gaps.flatten().fold(f64::INFINITY, f64::min)
    };
    while selected.len() < MIN_SIDE_BY_SIDE {
        let others = (0..rows.len()).filter(|i| metrics[*i].is_some() && !selected.contains(i));
        // Ties select the first row.
        let Some(next) = others.rev().max_by(|&a, &b| apart(a, &selected).total_cmp(&apart(b, &selected))) else {
            break;
        };
        selected.push(next);
        selected.sort_unstable();
    }
    selected
}

/// Records a group. `sweep` is the name of the sweep; `opens_on` is the first tab.
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
    let selected = select(rows);
    let has_error = rows.iter().any(|row| error_mm(row).is_some());
    let layout = Layout {
        several_tables: true,
        table_count: u32::try_from(rows.len()).ok(),
        error: has_error,
        compare: if selected.len() > 1 { selected.iter().map(|&i| label[i].clone()).collect() } else { Vec::new() },
        scatter: has_error,
        opens_on,
        ..Layout::default()
    };
    let name = format!("{}: {sweep}", group.name);
    let mut recorder = Recorder::open(RecordOptions { sinks, name, layout, ..RecordOptions::default() })?;
    // One colour scale for all steps, at the upper quartile over the points.
    let points: Vec<StoredPoint> = rows.iter().filter_map(|row| store.point(&row.point)).collect();
    let share = |of: fn(&StoredPoint) -> f64| Range::to_quantile(points.iter().map(of), 0.75);
    let error = share(|point| nearest_rank(&point.error_mm, 0.99).max(MIN_ERROR_SCALE_MM));
    recorder.set_range("error", error);
    recorder.set_range("force", share(|point| nearest_rank(&point.force_of_vertex(), 0.95)));
    drop(points);
    recorder.body(0, &scene.body)?;
    recorder.garment(0, &scene.garment)?;
    for (index, (row, label)) in (0..).zip(rows.iter().zip(&label)) {
        let Some(point) = store.point(&row.point) else { continue };
        let error = Overlay { name: "error", unit: "mm", values: &point.error_mm, positions: None };
        let overlays = if point.error_mm.is_empty() { &[][..] } else { std::slice::from_ref(&error) };
        recorder.step(&StepView {
            index,
            distances_m: &scene.distances_m,
            part_of_vertex: &point.part_of_vertex,
            part_force_n: &point.force_n,
            draped: &point.positions,
            panel: &panel(row, label, sweep, &point),
            scalars: &row.metrics.as_ref().map(Metrics::scalars).unwrap_or_default(),
            overlays,
        })?;
    }
    if has_error {
        let cost = if selected.len() > 1 { "time, ms (green: side by side)" } else { "time, ms" };
        recorder.scatter(0, Picture::of_error(cost), &scatter(rows, &label, &selected))?;
    }
    if selected.len() > 1 {
        for (slot, &i) in selected.iter().enumerate() {
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

/// Points labelled at most; among more, only the selected ones are labelled, because labels would overlap. A heuristic.
const MAX_LABELS: usize = 16;

fn scatter<'a>(rows: &[&Row], labels: &'a [String], selected: &[usize]) -> Vec<ScatterPoint<'a>> {
    let point = |(i, row): (usize, &&Row)| {
        Some(ScatterPoint {
            label: &labels[i],
            x: total_ms(row)?,
            y: error_mm(row)?,
            group: usize::from(selected.contains(&i)),
            named: rows.len() <= MAX_LABELS || selected.contains(&i),
        })
    };
    rows.iter().enumerate().filter_map(point).collect()
}

fn panel(row: &Row, label: &str, sweep: &str, point: &StoredPoint) -> Panel {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::metrics::Metrics;

    fn row(table: &str, parts: usize, error: f64) -> Row {
        Row {
            table: table.to_owned(),
            metrics: Some(Metrics { part_count: parts, canonical_rms_mm: Some(error), ..Metrics::default() }),
            extent_cm: "8".to_owned(),
            ..Row::default()
        }
    }

    #[test]
    fn the_first_row_and_the_pareto_front_are_selected() {
        let rows = [
            row("a", 10, 5.0),
            row("b", 20, 6.0),
            row("c", 5, 9.0),
            row("d", 30, 1.0),
            row("e", 31, 1.0),
            row("f", 40, 2.0),
            row("g", 50, 2.0),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        // The last row fills up: its PART count is farthest from the other three.
        assert_eq!(select(&rows), [0, 2, 3, 6]);
        let many: Vec<Row> = (0..40).map(|i| row("t", 10 + i, 50.0 - i as f64)).collect();
        let many: Vec<&Row> = many.iter().collect();
        let selected = select(&many);
        assert_eq!(selected.len(), MAX_SIDE_BY_SIDE);
        assert_eq!((selected[0], selected[5]), (0, 39));
        assert_eq!(select(&many[..3]), [0, 1, 2]);
        assert!(select(&[]).is_empty());
    }

    #[test]
    fn labels_contain_only_settings_that_differ() {
        let mut rows = [row("a", 1, 1.0), row("b", 1, 1.0)];
        assert_eq!(labels(&rows.iter().collect::<Vec<_>>()), ["a", "b"]);
        rows[1].extent_cm = "none".to_owned();
        assert_eq!(labels(&rows.iter().collect::<Vec<_>>()), ["a, 8 cm", "b, not cut"]);
        assert_eq!(labels(&[&rows[0]]), ["a"]);
    }
}
