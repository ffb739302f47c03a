//! The bodies of a sweep: the dress form with default or given measurements, or a mesh.

use toml::Value;

use super::error::PlanError;
use super::file::{At, Sizes, Source, number};
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

/// The bodies of `[sizes]`, each an edit of the body. An empty list has none.
pub(super) fn sizes(source: Source<'_>, sizes: &Sizes) -> Result<Vec<Edit>, PlanError> {
    sizes.list.iter().map(|value| size(source, value)).collect()
}

/// One size: the number of a European size, or measurements with a name.
fn size(source: Source<'_>, value: &At) -> Result<Edit, PlanError> {
    let place = source.place(value);
    let known = || BodySpec::eu_sizes().map(|size| size.to_string()).collect::<Vec<_>>().join(", ");
    let wrong = || {
        let expected = format!(
            "a European size ({}), or {{ name = \"...\", bust = 92, waist = 76, hip = 100 }} in centimetres, with any other measurement",
            known()
        );
        source.wrong(value, "sizes", expected)
    };
    let (label, measurements) = match value.get_ref() {
        Value::Integer(number) => {
            let spec = u32::try_from(*number).ok().and_then(BodySpec::eu_size).ok_or_else(wrong)?;
            (format!("EU {number}"), spec)
        }
        Value::Table(table) => {
            let name = table.get("name").and_then(Value::as_str).ok_or_else(wrong)?;
            let default = BodySpec::default();
            let of = |key: &str, default: f64| table.get(key).map_or(Some(default), number).ok_or_else(wrong);
            let girths = [of("bust", default.bust_cm)?, of("waist", default.waist_cm)?, of("hip", default.hip_cm)?];
            let mut spec = default.graded(girths);
            for (measure, entry) in
                table.iter().filter(|(key, _)| !["name", "bust", "waist", "hip"].contains(&key.as_str()))
            {
                spec =
                    spec.with(measure, number(entry).ok_or_else(wrong)?).map_err(PlanError::input(&place, "sizes"))?;
            }
            (name.to_owned(), spec)
        }
        _ => return Err(wrong()),
    };
    measurements.measures().map_err(PlanError::input(&place, "sizes"))?;
    let form = Input { label, ..Input::built_in(DRESS_FORM) };
    Ok(Box::new(move |point| {
        point.set_body(&form);
        point.job.scene.measurements = measurements.clone();
    }))
}

fn chosen(source: Source<'_>, value: &At, inputs: &mut Inputs) -> Result<(Input, BodySpec), PlanError> {
    let expected = "\"form\", a mesh file, a TOML file of measurements, or { bust = 92, ... } in centimetres with an \
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
