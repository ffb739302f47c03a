//! Writes jobs as a sweep file, so that pinned states can be run again and varied.
//!
//! Every job becomes one of the `[[points]]`; keys that are equal in all jobs are in `[base]`. The text is parsed again before it is
//! returned: its points equal the jobs, or an error names the first job that a sweep file cannot express (readings of the paper's
//! model, a rest shape from a separate file).

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use toml::{Table, Value};

use super::{Plan, PlanError};
use crate::base::files::names_a_file;
use crate::drape::{Model, Refine};
use crate::garment::fabric::Fabric;
use crate::parts::range_table::{RangeTable, TABLE_3, TableRule};
use crate::scene::{DRESS_FORM, SceneSpec};
use crate::study::job::Job;

/// The sweep file of labelled jobs; equal jobs become one point.
///
/// # Errors
/// [`PlanError`] for the first job that a sweep file cannot express.
pub(crate) fn sweep_file(name: &str, jobs: &[(String, Job)]) -> Result<String, PlanError> {
    let mut written: Vec<(&str, BTreeMap<&str, Value>)> = Vec::with_capacity(jobs.len());
    let mut tables: Vec<&TableRule> = Vec::new();
    for (label, job) in jobs {
        // Different tables of the same name get different names, because reports group rows by name.
        let known = tables.iter().any(|t| t.name() == job.settings.table.name() && **t != job.settings.table);
        tables.push(&job.settings.table);
        let table = if known { format!("{}, {label}", job.settings.table.name()) } else { String::new() };
        let keys = keys(job, &table).map_err(|e| cannot(label, e))?;
        let text = text(name, &BTreeMap::new(), &[(label.as_str(), keys.clone())]);
        read_back(&text, std::slice::from_ref(job)).map_err(|e| cannot(label, e))?;
        written.push((label, keys));
    }
    let mut base: BTreeMap<&str, Value> = written.first().map(|(_, keys)| keys.clone()).unwrap_or_default();
    base.retain(|key, value| written.len() > 1 && written.iter().all(|(_, keys)| keys.get(key) == Some(value)));
    for (_, keys) in &mut written {
        keys.retain(|key, _| !base.contains_key(key));
    }
    Ok(text(name, &base, &written))
}

fn cannot(label: &str, why: impl std::fmt::Display) -> PlanError {
    PlanError::Unsayable { label: label.to_owned(), why: why.to_string() }
}

/// Checks that the points of the text are these jobs.
fn read_back(text: &str, jobs: &[Job]) -> Result<(), String> {
    let Some(first) = jobs.first() else { return Ok(()) };
    let start = Job { accuracy: first.accuracy, spread_starts: first.spread_starts, ..Job::preview() };
    let found = Plan::parse(text, "sweep.toml", Path::new(""), &start).map_err(|e| e.to_string())?;
    let meant = Plan::of_jobs("sweep", jobs.to_vec()).map_err(|e| e.to_string())?;
    let ids = |plan: &Plan| plan.points.iter().map(|point| point.id.clone()).collect::<Vec<_>>();
    if ids(&found) == ids(&meant) {
        return Ok(());
    }
    Err("it has a setting without a key there, such as a reading of the paper's equations".to_owned())
}

/// A job in the keys of a point; `table` renames its range table unless empty.
fn keys(job: &Job, table: &str) -> Result<BTreeMap<&'static str, Value>, String> {
    let Job { scene, settings, seed, .. } = job;
    let count = |n: u64| i64::try_from(n).map(Value::Integer).map_err(|_| format!("{n} is more than TOML can write"));
    let mut keys = BTreeMap::new();
    keys.insert("body", body(scene)?);
    keys.insert("garment", Value::String(path(&scene.garment)?));
    keys.insert("fabric", fabric(&settings.fabric)?);
    keys.insert("model", Value::String(settings.model.name().to_owned()));
    keys.insert("table", rows(&settings.table, table)?);
    if let Model::Coupled(_) = settings.model {
        let extents: Vec<Value> = settings.model.extents_cm().into_iter().map(Value::Float).collect();
        keys.insert(
            "extent_cm",
            if extents.is_empty() { Value::String("none".to_owned()) } else { Value::Array(extents) },
        );
        keys.insert("motion", Value::String(settings.model.motion().name().to_owned()));
    }
    keys.insert("min_part", count(settings.min_part as u64)?);
    let refine = match settings.refine {
        Refine::Converged => Value::String("converged".to_owned()),
        Refine::Steps(steps) => count(steps as u64)?,
    };
    keys.insert("refine", refine);
    keys.insert("seed", count(*seed)?);
    let options = options(scene)?;
    if !options.is_empty() {
        keys.insert("options", Value::Table(options));
    }
    Ok(keys)
}

/// Files as absolute paths, since the folder of the sweep file is not known.
fn path(name: &str) -> Result<String, String> {
    if !names_a_file(name) {
        return Ok(name.to_owned());
    }
    let whole = std::path::absolute(name).map_err(|e| format!("{name}: {e}"))?;
    whole.into_os_string().into_string().map_err(|path| format!("{}: not UTF-8", path.display()))
}

fn body(scene: &SceneSpec) -> Result<Value, String> {
    let of = path(&scene.body)?;
    let measured = non_default(&scene.measurements)?;
    let mut table: Table = measured.map(|(key, value)| (key.trim_end_matches("_cm").to_owned(), value)).collect();
    if table.is_empty() {
        return Ok(Value::String(of));
    }
    if of != DRESS_FORM {
        table.insert("of".to_owned(), Value::String(of));
    }
    Ok(Value::Table(table))
}

fn fabric(fabric: &Fabric) -> Result<Value, String> {
    let constants = |fabric: &Fabric| Fabric { name: String::new(), source: String::new(), ..fabric.clone() };
    let known =
        !names_a_file(&fabric.name) && Fabric::by_name(&fabric.name).is_ok_and(|k| constants(&k) == constants(fabric));
    if known {
        return Ok(Value::String(fabric.name.clone()));
    }
    Value::try_from(fabric).map_err(|e| e.to_string())
}

fn rows(rule: &TableRule, name: &str) -> Result<Value, String> {
    let name = if name.is_empty() { rule.name() } else { name };
    let mut table = Table::from_iter([("name".to_owned(), Value::String(name.to_owned()))]);
    match rule {
        TableRule::Rows(rows)
            if rows.levels == RangeTable::table_3().levels && rows.gap == RangeTable::table_3().gap =>
        {
            return Ok(Value::String(TABLE_3.to_owned()));
        }
        TableRule::Rows(rows) => {
            let file: Table = rows.to_toml().parse().map_err(|e: toml::de::Error| e.to_string())?;
            let kept = file.into_iter().filter(|(key, _)| matches!(key.as_str(), "gap" | "levels"));
            table.extend(kept.map(|(key, value)| (if key == "levels" { "rows".to_owned() } else { key }, value)));
        }
        TableRule::Quantile { levels, .. } => {
            let levels = i64::try_from(*levels).map_err(|e| e.to_string())?;
            table.insert("quantile".to_owned(), Value::Integer(levels));
        }
    }
    Ok(Value::Table(table))
}

/// Fields of the scene without a key of their own that differ from their defaults.
fn options(scene: &SceneSpec) -> Result<Table, String> {
    Ok(non_default(scene)?.filter(|(key, _)| !matches!(key.as_str(), "body" | "garment" | "measurements")).collect())
}

/// Fields that differ from their defaults.
fn non_default<T: Serialize + Default>(given: &T) -> Result<impl Iterator<Item = (String, Value)>, String> {
    let given = Table::try_from(given).map_err(|e| e.to_string())?;
    let defaults = Table::try_from(T::default()).map_err(|e| e.to_string())?;
    Ok(given.into_iter().filter(move |(key, value)| defaults.get(key) != Some(value)))
}

fn text(name: &str, base: &BTreeMap<&str, Value>, points: &[(&str, BTreeMap<&str, Value>)]) -> String {
    let quoted = |text: &str| Value::String(text.to_owned()).to_string();
    let mut text = format!("name = {}\n", quoted(name));
    let mut section = |heading: &str, comment: &str, keys: &BTreeMap<&str, Value>| {
        text.push_str(&format!("\n{heading}\n"));
        if !comment.is_empty() {
            text.push_str(&format!("# {}\n", comment.replace(char::is_control, " ")));
        }
        for (key, value) in keys {
            text.push_str(&format!("{key} = {value}\n"));
        }
    };
    if !base.is_empty() {
        section("[base]", "", base);
    }
    for (label, keys) in points {
        section("[[points]]", label, keys);
    }
    text
}
