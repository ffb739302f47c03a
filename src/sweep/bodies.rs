//! The bodies of a sweep: the built-in form, to measure or as it comes, or a mesh.

use toml::Value;

use super::choice::{BodyChoice, Input};
use super::error::PlanError;
use super::file::{At, Source, number};
use super::inputs::Inputs;
use crate::shapes::BodySpec;

/// The body where a sweep names none.
pub const DEFAULT_BODY: &str = "form";

/// The form as it comes.
pub(super) fn dress_form() -> BodyChoice {
    BodyChoice {
        label: DEFAULT_BODY.to_owned(),
        input: Input::built_in(DEFAULT_BODY),
        measurements: BodySpec::default(),
    }
}

/// A body by name, file, or measurements.
pub(super) fn body(source: Source<'_>, value: &At, inputs: &mut Inputs) -> Result<BodyChoice, PlanError> {
    let expected = "\"form\", an OBJ file, a TOML file of measurements, or { bust = 92, ... } in centimetres with an \
                    optional name = \"...\" and of = (one of these)";
    let place = source.place(value);
    let table = match value.get_ref() {
        Value::String(label) => return named_body(source, value, label, expected, inputs),
        Value::Table(table) => table,
        _ => return Err(source.wrong(value, "body", expected)),
    };
    let text = |key| table.get(key).map(|v: &Value| v.as_str().ok_or_else(|| source.wrong(value, "body", expected)));
    let (name, of) = (text("name").transpose()?, text("of").transpose()?.unwrap_or(DEFAULT_BODY));
    let mut body = named_body(source, value, of, expected, inputs)?;
    for (measure, entry) in table.iter().filter(|(key, _)| *key != "name" && *key != "of") {
        let cm = number(entry).ok_or_else(|| source.wrong(value, "body", expected))?;
        let changed = body.measurements.with(measure, cm);
        body.measurements = changed.map_err(|e| PlanError::Shape { place: place.clone(), key: "body", source: e })?;
        body.label = format!("{} {measure}={cm}", body.label);
    }
    body.label = name.map_or(body.label, str::to_owned);
    match body.measurements.measures() {
        Ok(_) => Ok(body),
        Err(source) => Err(PlanError::Shape { place, key: "body", source }),
    }
}

/// The form, as it comes or from a file of measurements, or a mesh.
fn named_body(
    source: Source<'_>,
    value: &At,
    label: &str,
    expected: &str,
    inputs: &mut Inputs,
) -> Result<BodyChoice, PlanError> {
    let place = source.place(value);
    let body = BodyChoice { label: label.to_owned(), ..dress_form() };
    if label == DEFAULT_BODY {
        return Ok(body);
    }
    if !Inputs::names_a_file(label) {
        return Err(source.wrong(value, "body", expected));
    }
    if label.ends_with(".toml") {
        let spec = BodySpec::from_toml(&inputs.text(label, &place)?);
        let measurements = spec.map_err(|source| PlanError::Shape { place, key: "body", source })?;
        return Ok(BodyChoice { measurements, ..body });
    }
    Ok(BodyChoice { input: inputs.input(label, &place)?, ..body })
}
