//! A snapshot of the session as JSON, for `GET /api/state` and events.

use serde_json::{Map, Value, json};
use std::sync::Arc;

use super::pieces::shown_pins;
use crate::base::error_text;
use crate::drape::{Model, Settings};
use crate::garment::builtin;
use crate::garment::fabric;
use crate::parts::range_table::TableRule;
use crate::picture::colour::level_colours;
use crate::session::{AtRest, Finished, LoadedScene, Pin, Preview, Refusal, Segmented, Snapshot, preset_names};
use crate::study::job::Job;
use crate::study::metrics::LevelCount;

/// Bars of the histogram of distances.
const BARS: usize = 80;

/// The whole state.
pub(super) fn state(snapshot: &Snapshot) -> Value {
    let mut all = event(snapshot);
    all["trail"] = json!(*snapshot.trail);
    all["histogram"] =
        snapshot.loaded_scene.as_ref().map_or(Value::Null, |loaded_scene| histogram(loaded_scene.distances_m()));
    all
}

/// The state without histogram and trail.
pub(super) fn event(snapshot: &Snapshot) -> Value {
    json!({
        "state": snapshot.state,
        "serial": snapshot.serial,
        "idle": snapshot.idle,
        "job": job(&snapshot.job),
        "garment": snapshot.loaded_scene.as_deref().map(garment),
        "parts": snapshot.segmented.as_deref().map(segmented),
        "preview": snapshot.preview.as_deref().map(preview),
        "rest": snapshot.rest.as_deref().map(rest),
        "figures": snapshot.finished.as_deref().map(figures),
        "refused": snapshot.refused.as_deref().map(refused),
        "pins": snapshot.pins.iter().map(|p| pin(p, shown_pins(snapshot))).collect::<Vec<_>>(),
        "trail_end": snapshot.trail.last(),
        "undo": snapshot.undo,
        "redo": snapshot.redo,
        "superseded": snapshot.superseded,
    })
}

/// Everything that an edit can name.
pub(super) fn choices() -> Value {
    json!({
        "tables": preset_names(),
        "fabrics": fabric::BUILT_IN,
        "garments": builtin::BUILT_IN,
        "sizes": builtin::TABLE_4_SIZES,
    })
}

/// A job in the fields of an edit.
fn job(job: &Job) -> Value {
    let Settings { table, min_part, model, refine, fabric, self_contact, solver: _ } = &job.settings;
    let table = match table {
        TableRule::Rows(rows) => json!(rows),
        TableRule::Quantile { levels, .. } => json!({ "quantile": levels }),
    };
    let built_in = fabric::BUILT_IN.contains(&fabric.name.as_str());
    json!({
        "body": job.scene.body,
        "garment": job.scene.garment,
        "measurements": measurements(job),
        "table": table,
        "fabric": if built_in { json!(fabric.name) } else { json!(fabric) },
        "min_part": min_part,
        "model": model.name(),
        "max_extent_cm": model.extents_cm(),
        "motion": match model { Model::Coupled(_) => json!(model.motion()), Model::Paper(_) => Value::Null },
        "refine": refine,
        "self_contact": self_contact,
    })
}

/// Measurements by their names in an edit.
fn measurements(job: &Job) -> Value {
    let Ok(Value::Object(all)) = serde_json::to_value(&job.scene.measurements) else { return Value::Null };
    let short = all.into_iter().map(|(name, cm)| (name.trim_end_matches("_cm").to_owned(), cm));
    Value::Object(short.collect::<Map<_, _>>())
}

/// A refusal; the reason why a file cannot be used would quote the file, and stays on the terminal.
fn refused(refusal: &Refusal) -> Value {
    let error = refusal.file.as_deref().map_or_else(|| error_text::short(&refusal.sentence), unusable_file);
    json!({ "state": refusal.state, "error": error, "back_to": refusal.back_to })
}

/// The refusal of an edit that names this file of the command line.
pub(super) fn unusable_file(file: &str) -> String {
    format!("{file} cannot be used with this edit; the terminal of the program shows the reason")
}

fn garment(loaded_scene: &LoadedScene) -> Value {
    let scene = &loaded_scene.input.scene;
    json!({
        "generation": loaded_scene.generation,
        "name": loaded_scene.input.garment_name,
        "body": loaded_scene.input.body_name,
        "vertices": scene.garment.vertex_count(),
        "triangles": scene.garment.triangles.len(),
        "load_ms": loaded_scene.load_ms,
        "notes": loaded_scene.input.notes(),
        "warnings": loaded_scene.input.warnings(),
    })
}

fn segmented(found: &Segmented) -> Value {
    let levels = LevelCount::all(&found.table, &found.parts);
    let css = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let colours: Vec<String> = level_colours(&levels).into_iter().map(css).collect();
    let strongest = found.force_n.iter().map(|f| f.length()).fold(0.0, f64::max);
    json!({
        "state": found.state,
        "count": found.parts.len(),
        "table_count": found.table_parts.len(),
        "singletons": found.parts.singletons,
        "unassigned": found.parts.unassigned,
        "levels": levels,
        "colours": colours,
        "force_max_n": (!found.force_n.is_empty()).then_some(strongest),
        "segment_ms": found.segment_ms,
        "after_ms": found.after_ms,
    })
}

fn preview(found: &Preview) -> Value {
    json!({
        "state": found.state, "done": found.done, "count": found.parts.len(),
        "ms": found.ms, "after_ms": found.after_ms,
    })
}

fn rest(found: &AtRest) -> Value {
    json!({
        "state": found.state, "done": found.done, "balanced": found.balanced, "kept": found.reused, "warm": found.warm,
        "residual_over_weight": found.residual_over_weight, "steps": found.steps,
        "ms": found.ms, "after_ms": found.after_ms,
    })
}

fn figures(found: &Finished) -> Value {
    let mut all = json!(found.metrics);
    all["state"] = json!(found.state);
    all["preview_error_mm"] = json!(found.preview_error_mm);
    all["bound_mm"] = json!(found.bound_mm);
    all["release"] = json!(found.drape.release.map(|release| release.to_string()));
    all["warnings"] = json!([found.loaded_scene.input.warnings(), found.drape.warnings.clone()].concat());
    all
}

fn pin(pin: &Pin, shown: &[Arc<Pin>]) -> Value {
    json!({
        "shown": shown.iter().any(|other| other.id == pin.id),
        "id": pin.id, "label": pin.label, "state": pin.state, "numbers": pin.numbers,
        "garment": pin.job.scene.garment, "fabric": pin.job.settings.fabric.name,
        "table": pin.job.settings.table.name(), "max_extent_cm": pin.job.settings.model.extents_cm(),
    })
}

/// Vertices by their distance, in bars of equal width over the root of the distance: levels are thin near the body.
fn histogram(distances_m: &[f64]) -> Value {
    let farthest_cm = 100.0 * distances_m.iter().fold(1e-6_f64, |a, &b| a.max(b));
    let bars = BARS as f64;
    let edges_cm: Vec<f64> = (0..=BARS).map(|i| farthest_cm * (i as f64 / bars).powi(2)).collect();
    let mut counts = vec![0_usize; BARS];
    for d in distances_m {
        counts[((100.0 * d / farthest_cm).sqrt() * bars).min(bars - 1.0) as usize] += 1;
    }
    json!({ "edges_cm": edges_cm, "counts": counts })
}
