//! The bodies of a sweep: the dress form with default or given measurements, or a mesh.

use toml::Value;

use super::error::PlanError;
use super::file::{At, Source, number};
use super::inputs::{Input, Inputs};
use super::point::{Edit, one};
use crate::base::files::{has_ending, names_a_file};
use crate::body::BodySpec;
use crate::scene::DRESS_FORM;

/// A body by name, file, or measurements.
pub(super) fn body(source: Source<'_>, value: &At, inputs: &mut Inputs) -> Result<Vec<Edit>, PlanError> {
    let (input, measurements) = chosen(source, value, inputs)?;
    Ok(one(move |point| {
        point.set_body(&input);
        point.job.scene.measurements = measurements.clone();
    }))
}

fn chosen(source: Source<'_>, value: &At, inputs: &mut Inputs) -> Result<(Input, BodySpec), PlanError> {
    let expected = "\"form\", an OBJ file, a TOML file of measurements, or { bust = 92, ... } in centimetres with an \
                    optional name = \"...\" and of = (one of these)";
    let place = source.place(value);
    let wrong = || source.wrong(value, "body", expected);
    let table = match value.get_ref() {
        Value::String(label) => return named_body(source, value, label, expected, inputs),
        Value::Table(table) => table,
        _ => return Err(wrong()),
    };
    let text = |key| table.get(key).map(|v: &Value| v.as_str().ok_or_else(wrong));
    let (name, of) = (text("name").transpose()?, text("of").transpose()?.unwrap_or(DRESS_FORM));
    let (mut input, mut measurements) = named_body(source, value, of, expected, inputs)?;
    for (measure, entry) in table.iter().filter(|(key, _)| *key != "name" && *key != "of") {
        let cm = number(entry).ok_or_else(wrong)?;
        measurements = measurements.with(measure, cm).map_err(PlanError::input(&place, "body"))?;
        input.label = format!("{} {measure}={cm}", input.label);
    }
    input.label = name.map_or(input.label, str::to_owned);
    measurements.measures().map_err(PlanError::input(&place, "body"))?;
    Ok((input, measurements))
}

/// The dress form with default measurements or those of a file, or a mesh.
fn named_body(
    source: Source<'_>,
    value: &At,
    label: &str,
    expected: &str,
    inputs: &mut Inputs,
) -> Result<(Input, BodySpec), PlanError> {
    let place = source.place(value);
    let form = Input { label: label.to_owned(), ..Input::built_in(DRESS_FORM) };
    if label == DRESS_FORM {
        return Ok((form, BodySpec::default()));
    }
    if !names_a_file(label) {
        return Err(source.wrong(value, "body", expected));
    }
    if has_ending(label.as_ref(), "toml") {
        let spec = BodySpec::from_toml(&inputs.text(label, &place)?);
        return Ok((form, spec.map_err(PlanError::input(&place, "body"))?));
    }
    Ok((inputs.input(label, &place)?, BodySpec::default()))
}
