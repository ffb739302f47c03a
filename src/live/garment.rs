//! The garment of a snapshot as OBJ, and each PART of it.

use std::ops::RangeInclusive;

use axum::http::{StatusCode, Uri};
use glam::DVec3;
use serde_json::{Value, json};

use super::pieces::{Pieces, shown_pins};
use crate::base::files::read_own;
use crate::base::math;
use crate::parts::UNASSIGNED;
use crate::picture::colour::map::ColourMap;
use crate::record::{Overlay, Refused, eyes, outlines, query, rest_colours};
use crate::session::{LoadedScene, Segmented, Snapshot};

/// The garment as OBJ: `of=rest`, `of=preview`, `pin=ID`, or by default the newest drape.
pub(super) fn obj(snapshot: &Snapshot, uri: &Uri) -> Result<Vec<u8>, Refused> {
    let none = |what: &str| (StatusCode::CONFLICT, format!("no {what} yet; wait for an event that has one"));
    let rest = snapshot.rest.as_ref().map(|rest| (&rest.loaded_scene, &rest.positions));
    let preview = snapshot.preview.as_ref().map(|preview| (&preview.loaded_scene, &preview.positions));
    let (loaded_scene, positions) = match (query(uri, "pin").as_deref(), query(uri, "of").as_deref()) {
        (Some(id), _) => {
            let pin = snapshot.pins.iter().find(|pin| pin.id.to_string() == id);
            let pin =
                pin.ok_or_else(|| (StatusCode::NOT_FOUND, format!("found pin={id}, expected the number of a pin")))?;
            (&pin.loaded_scene, &pin.positions)
        }
        (None, None) => rest.or(preview).ok_or_else(|| none("drape"))?,
        (None, Some("rest")) => rest.ok_or_else(|| none("drape at rest"))?,
        (None, Some("preview")) => preview.ok_or_else(|| none("preview"))?,
        (None, Some(of)) => return Err((StatusCode::BAD_REQUEST, format!("found of={of}, expected rest or preview"))),
    };
    let failed = |e: &dyn std::fmt::Display| (StatusCode::INTERNAL_SERVER_ERROR, format!("cannot write it: {e}"));
    let folder = tempfile::tempdir().map_err(|e| failed(&e))?;
    let path = folder.path().join("drape.obj");
    loaded_scene.input.write(&path, positions).map_err(|e| failed(&e))?;
    read_own(&path).map_err(|e| failed(&e))
}

/// The outline of a PART (`number=N`) in each view, RRD; without a number, no outline.
pub(super) fn outline(snapshot: &Snapshot, uri: &Uri, recording: (&str, &str)) -> Result<Vec<u8>, Refused> {
    let found = part_list(snapshot)?;
    let scene = &found.loaded_scene.input.scene;
    let of_this = |other: &LoadedScene| other.generation == found.loaded_scene.generation;
    let mut chosen = vec![false; scene.garment.vertex_count()];
    if let Some(text) = query(uri, "number") {
        let part = &found.parts.parts[numbered(found, &text)? as usize];
        part.vertices.iter().for_each(|&v| chosen[v as usize] = true);
    }
    let preview = snapshot.preview.as_ref().filter(|p| of_this(&p.loaded_scene)).map(|p| p.positions.as_slice());
    let rest = snapshot.rest.as_ref().filter(|r| of_this(&r.loaded_scene)).map(|r| r.positions.as_slice());
    let shapes = [Some(scene.garment.positions.as_slice()), preview, rest];
    let made = outlines(recording, &scene.garment, &scene.topology, &chosen, shapes);
    made.map_err(|e| (StatusCode::INTERNAL_SERVER_ERROR, e.to_string()))
}

/// Largest elevation of the eye, degrees: straight from above a view has no upright direction.
const MAX_ELEVATION_DEG: f64 = 85.0;

/// The layout with all views seen from one direction: `azimuth` and `elevation` in degrees, from the front towards the wearer's left and
/// upwards, RRD.
pub(super) fn eye(snapshot: &Snapshot, uri: &Uri, pieces: &Pieces) -> Result<Vec<u8>, Refused> {
    let degrees = |name: &str, range: RangeInclusive<f64>| {
        let text = query(uri, name).unwrap_or_default();
        text.parse().ok().filter(|found| range.contains(found)).ok_or_else(|| {
            let (low, high) = range.clone().into_inner();
            (StatusCode::BAD_REQUEST, format!("found {name}={text}, expected degrees from {low} to {high}"))
        })
    };
    let azimuth: f64 = degrees("azimuth", -360.0..=360.0)?;
    let elevation: f64 = degrees("elevation", -MAX_ELEVATION_DEG..=MAX_ELEVATION_DEG)?;
    let scene = &part_list(snapshot)?.loaded_scene.input.scene;
    let (sin, cos) = math::sin_cos(elevation.to_radians());
    let toward = math::rotation(DVec3::Z, azimuth.to_radians()) * pieces.front * cos + DVec3::Z * sin;
    let made = eyes(pieces.recording(), &scene.garment, toward, shown_pins(snapshot).len());
    made.map_err(|e| (StatusCode::INTERNAL_SERVER_ERROR, e.to_string()))
}

/// The garment at rest coloured by its fit: `of=strain`, `pressure` or `none`, RRD; and the value (% or kPa) of the last colour.
pub(super) fn fit(snapshot: &Snapshot, uri: &Uri, recording: (&str, &str)) -> Result<(Vec<u8>, f64), Refused> {
    let of = query(uri, "of").unwrap_or_default();
    let rest = || {
        let none = || (StatusCode::CONFLICT, "no drape at rest yet; wait for an event that has one".to_owned());
        let state = snapshot.rest.as_ref().and_then(|rest| rest.cloth_state.as_deref());
        state.map(|state| &state.fit).ok_or_else(none)
    };
    let (name, unit, values) = match of.as_str() {
        "none" => ("", "", &[][..]),
        "strain" => ("strain", "%", &rest()?.strain_percent[..]),
        "pressure" => ("pressure", "kPa", &rest()?.pressure_kpa[..]),
        _ => return Err((StatusCode::BAD_REQUEST, format!("found of={of}, expected strain, pressure or none"))),
    };
    let overlay = Overlay { name, unit, values, positions: None };
    let range = overlay.own_range();
    let colours = ColourMap::ALARM.colours(values, range);
    let made = rest_colours(recording, &colours);
    made.map(|bytes| (bytes, range.high)).map_err(|e| (StatusCode::INTERNAL_SERVER_ERROR, e.to_string()))
}

/// Stage one of the newest state.
fn part_list(snapshot: &Snapshot) -> Result<&Segmented, Refused> {
    let none = || (StatusCode::CONFLICT, "no PARTs yet: the garment is still being made".to_owned());
    snapshot.segmented.as_deref().ok_or_else(none)
}

/// The index of the PART with this number.
fn numbered(found: &Segmented, text: &str) -> Result<u32, Refused> {
    let number: Result<u32, _> = text.parse();
    let wrong = |_| (StatusCode::BAD_REQUEST, format!("found number={text}, expected a PART's number from 1"));
    let index = number.map_err(wrong)?.wrapping_sub(1);
    if (index as usize) < found.parts.len() { Ok(index) } else { Err(no_part(found)) }
}

fn no_part(found: &Segmented) -> Refused {
    (StatusCode::NOT_FOUND, format!("found no PART there, expected one of 1 to {}", found.parts.len()))
}

/// A PART and its results: `number=N`, counted from 1 as levels are, or the PART nearest the point `at=x,y,z`, m, of the garment `on=parts`, `preview` or `rest`.
pub(super) fn part(snapshot: &Snapshot, uri: &Uri) -> Result<Value, Refused> {
    let bad = |sentence: String| (StatusCode::BAD_REQUEST, sentence);
    let found = part_list(snapshot)?;
    let loaded_scene: &LoadedScene = &found.loaded_scene;
    let of_this = |other: &LoadedScene| other.generation == loaded_scene.generation;
    let placed = &loaded_scene.input.scene.garment.positions;
    let preview = snapshot.preview.as_ref().filter(|p| of_this(&p.loaded_scene));
    let rest = snapshot.rest.as_ref().filter(|r| of_this(&r.loaded_scene)).map(|r| &*r.positions);
    let index = if let Some(text) = query(uri, "number") {
        numbered(found, &text)?
    } else {
        let text = query(uri, "at").unwrap_or_default();
        let numbers: Vec<f64> =
            text.split(',').filter_map(|t| t.parse().ok()).filter(|m: &f64| m.is_finite()).collect();
        let &[x, y, z] = numbers.as_slice() else {
            return Err(bad(format!("found at={text}, expected number=N, or three metres as in at=0.1,0,1.2")));
        };
        let on = match query(uri, "on").as_deref() {
            None | Some("parts") => placed,
            Some("preview") => preview.map_or(placed, |preview| &*preview.positions),
            Some("rest") => rest.unwrap_or(placed),
            Some(other) => return Err(bad(format!("found on={other}, expected parts, preview or rest"))),
        };
        let point = DVec3::new(x, y, z);
        let nearest =
            on.iter().enumerate().min_by(|a, b| a.1.distance_squared(point).total_cmp(&b.1.distance_squared(point)));
        nearest.map_or(UNASSIGNED, |(vertex, _)| found.parts.part_of_vertex[vertex])
    };
    let part = found.parts.parts.get(index as usize).ok_or_else(|| no_part(found))?;
    let mean = |to: &[DVec3]| {
        let moved = part.vertices.iter().map(|&v| to[v as usize] - placed[v as usize]).sum::<DVec3>();
        1e3 * (moved / part.vertices.len() as f64)
    };
    let areas = loaded_scene.input.scene.garment.vertex_areas();
    let level = found.table.effective_levels().get(part.level as usize).copied();
    let force_n = found.force_n.get(index as usize);
    Ok(json!({
        "state": found.state,
        "part": index + 1,
        "level": part.level + 1,
        "lower_cm": level.map(|l| l.lower_cm),
        "upper_cm": level.map(|l| l.upper_cm).filter(|cm| cm.is_finite()),
        "vertices": part.vertices.len(),
        "area_cm2": 1e4 * part.vertices.iter().map(|&v| areas[v as usize]).sum::<f64>(),
        "force_n": force_n.map(DVec3::to_array),
        "force_size_n": force_n.map(|f| f.length()),
        "preview_displacement_mm": preview.map(|p| mean(&p.positions).to_array()),
        "rest_displacement_mm": rest.map(|x| mean(x).to_array()),
    }))
}
