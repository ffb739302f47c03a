//! From keyword arguments to a job.
//!
//! `scene`, `settings`, `seed`, `accuracy` and `spread_starts` are the fields of a [`Job`]. All other keys are those of an [`Edit`], the
//! short form that the live interface uses too.

use std::collections::BTreeMap;
use std::sync::Arc;

use pyo3::PyResult;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::error::{Error, exception};
use crate::base::error_text::with_causes;
use crate::mesh::MeshSource;
use crate::session::Edit;
use crate::study::job::Job;

/// The fields of a job that may be given beside the keys of an edit.
const FIELDS: [&str; 5] = ["scene", "settings", "seed", "accuracy", "spread_starts"];

/// The job of these keyword arguments, a JSON object. `meshes` are those that it names as body, garment or rest shape.
pub(super) fn job(keywords: &str, meshes: BTreeMap<String, Arc<MeshSource>>) -> PyResult<Job> {
    let mut keys: Map<String, Value> = serde_json::from_str(keywords).map_err(|e| exception(&e))?;
    let fields: Map<String, Value> =
        FIELDS.iter().filter_map(|field| Some(((*field).to_owned(), keys.remove(*field)?))).collect();
    // A number of steps, as on the command line.
    if let Some(steps) = keys.get("refine").and_then(Value::as_u64) {
        keys.insert("refine".to_owned(), serde_json::json!({ "steps": steps }));
    }
    let (names_model, names_refine) = (keys.contains_key("model"), keys.contains_key("refine"));
    let mut start: Job = read(Value::Object(fields))?;
    start.scene.in_memory = meshes;
    let edit: Edit = read(Value::Object(keys))?;
    let mut job = edit.applied(&start).map_err(|e| exception(&e))?;
    job.scene.check_names().map_err(|e| exception(&e))?;
    if names_model && !names_refine {
        job.settings.refine = job.settings.model.default_refine();
    }
    Ok(job)
}

/// Reads a value that came as JSON.
pub(super) fn read<T: DeserializeOwned>(value: Value) -> PyResult<T> {
    serde_json::from_value(value).map_err(|error| {
        let mut text = with_causes(&error, ": ");
        if text.starts_with("unknown field") && text.contains("`max_extent_cm`") {
            text += &format!(", or a field of a job: {}", FIELDS.join(", "));
        }
        Error::new_err(text)
    })
}
