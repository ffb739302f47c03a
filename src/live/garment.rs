//! The garment of a snapshot as OBJ, and each PART of it.

use axum::http::{StatusCode, Uri};
use glam::DVec3;
use serde_json::{Value, json};

use crate::base::files::read_own;
use crate::parts::UNASSIGNED;
use crate::record::{Refused, query};
use crate::session::{LoadedScene, Snapshot};

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

/// A PART and its results: `number=N`, or the PART nearest the point `at=x,y,z`, m, of the garment `on=parts`, `preview` or `rest`.
pub(super) fn part(snapshot: &Snapshot, uri: &Uri) -> Result<Value, Refused> {
    let bad = |sentence: String| (StatusCode::BAD_REQUEST, sentence);
    let found = snapshot.segmented.as_ref();
    let found =
        found.ok_or_else(|| (StatusCode::CONFLICT, "no PARTs yet: the garment is still being made".to_owned()))?;
    let loaded_scene: &LoadedScene = &found.loaded_scene;
    let of_this = |other: &LoadedScene| other.generation == loaded_scene.generation;
    let placed = &loaded_scene.input.scene.garment.positions;
    let preview = snapshot.preview.as_ref().filter(|p| of_this(&p.loaded_scene));
    let rest = snapshot.rest.as_ref().filter(|r| of_this(&r.loaded_scene)).map(|r| &*r.positions);
    let number = if let Some(text) = query(uri, "number") {
        text.parse().map_err(|_| bad(format!("found number={text}, expected a PART's number from 0")))?
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
    let Some(part) = found.parts.parts.get(number as usize) else {
        let none = format!("found no PART there, expected one of 0 to {}", found.parts.len().saturating_sub(1));
        return Err((StatusCode::NOT_FOUND, none));
    };
    let mean = |to: &[DVec3]| {
        let moved = part.vertices.iter().map(|&v| to[v as usize] - placed[v as usize]).sum::<DVec3>();
        1e3 * (moved / part.vertices.len() as f64)
    };
    let areas = loaded_scene.input.scene.garment.vertex_areas();
    let level = found.table.effective_levels().get(part.level as usize).copied();
    let force_n = found.force_n.get(number as usize);
    Ok(json!({
        "state": found.state,
        "part": number,
        "level": part.level,
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
