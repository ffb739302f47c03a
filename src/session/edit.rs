//! An edit of a job, as plain data that is parsed from JSON; and the range tables that an edit can name.

use std::collections::BTreeMap;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use crate::base::files::names_a_file;
use crate::body::ShapeError;
use crate::drape::{DrapeError, Model, Refine};
use crate::garment::fabric::{Fabric, FabricError};
use crate::mechanics::coupled::Motion;
use crate::parts::range_table::{GapRule, RangeTable, TABLE_3, TableError, TableRule};
use crate::scene::{FileRole, SceneError};
use crate::study::job::Job;

/// The files of `assets/tuned/`, compiled in.
macro_rules! tuned {
    ($($name:literal)*) => { &[$(($name, include_str!(concat!("../../assets/tuned/", $name, ".toml")))),*] };
}

const TUNED: &[(&str, &str)] = tuned![
    "pullover-1-levels" "pullover-1-levels-and-extents"
    "pullover-2-levels" "pullover-2-levels-and-extents"
    "flared-skirt-levels" "flared-skirt-levels-and-extents"
    "low-cut-dress-levels" "low-cut-dress-levels-and-extents"
    "long-sleeved-dress-levels" "long-sleeved-dress-levels-and-extents"
];

/// The names of the built-in range tables: the paper's, `table-3`, first, then the results of the table search.
#[must_use]
pub fn preset_names() -> Vec<&'static str> {
    std::iter::once(TABLE_3).chain(TUNED.iter().map(|(name, _)| *name)).collect()
}

/// A built-in range table, or one from a TOML file.
fn table_by_name(name: &str) -> Result<RangeTable, TableError> {
    if let Some((known, text)) = TUNED.iter().find(|(known, _)| *known == name) {
        return RangeTable::parse(text, known);
    }
    if name == TABLE_3 || names_a_file(name) {
        return RangeTable::by_name(name);
    }
    Err(TableError::Value {
        what: "table".to_owned(),
        found: format!("\"{name}\""),
        expected: "table-3, a tuned table such as \"low-cut-dress-levels\", or rows {\"levels\": [[lower, upper], ...]}",
    })
}

/// Why an edit was refused; the session is unchanged.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message names each field")]
pub enum EditError {
    /// An invalid range table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// An invalid fabric.
    #[error(transparent)]
    Fabric(#[from] FabricError),
    /// An invalid body or garment.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Invalid measurements.
    #[error(transparent)]
    Measurements(#[from] ShapeError),
    /// The drape failed.
    #[error(transparent)]
    Drape(#[from] DrapeError),
    /// Any other invalid value.
    #[error("{what}: found {found}, expected {expected}")]
    Value { what: &'static str, found: String, expected: String },
}

impl EditError {
    pub(super) fn value(what: &'static str, found: impl ToString, expected: impl ToString) -> Self {
        Self::Value { what, found: found.to_string(), expected: expected.to_string() }
    }
}

/// The range table of an edit.
#[derive(Debug, Clone, PartialEq)]
pub enum TableEdit {
    /// A built-in table (see [`preset_names`]) or a TOML file.
    Name(String),
    /// Rows, or a rule that generates them.
    Rule(TableRule),
}

impl<'de> Deserialize<'de> for TableEdit {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        const EXPECTED: &str =
            "expected a preset's name, {\"levels\": [[lower, upper], ...]} or {\"quantile\": levels}";
        let wrong = |found: &dyn std::fmt::Display| D::Error::custom(format!("table: {found}; {EXPECTED}"));
        match Value::deserialize(from)? {
            Value::String(name) => Ok(Self::Name(name)),
            Value::Object(mut fields) => {
                if let (Some(levels), 1) = (fields.get("quantile"), fields.len()) {
                    let levels = levels.as_u64().and_then(|n| usize::try_from(n).ok());
                    let levels = levels.ok_or_else(|| wrong(&format!("found quantile = {}", fields["quantile"])))?;
                    return Ok(Self::Rule(TableRule::Quantile { name: format!("{levels} quantile levels"), levels }));
                }
                fields.entry("name").or_insert_with(|| "edited".into());
                let rows = fields.contains_key("levels");
                let table: RangeTable = serde_json::from_value(Value::Object(fields))
                    .map_err(|e| if rows { D::Error::custom(e) } else { wrong(&e) })?;
                Ok(Self::Rule(table.into()))
            }
            other => Err(wrong(&format!("found {other}"))),
        }
    }
}

/// The fabric of an edit.
#[derive(Debug, Clone, PartialEq)]
pub enum FabricEdit {
    /// A built-in fabric or a TOML file.
    Name(String),
    /// All constants of a fabric.
    Constants(Box<Fabric>),
}

impl<'de> Deserialize<'de> for FabricEdit {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match Value::deserialize(from)? {
            Value::String(name) => Ok(Self::Name(name)),
            other => serde_json::from_value(other).map(Self::Constants).map_err(|e| {
                D::Error::custom(format!("fabric: {e}; expected a built-in name or all constants of a fabric"))
            }),
        }
    }
}

/// Changes to a job; a field that is left out keeps its value.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Edit {
    /// `form`, or a mesh file.
    pub body: Option<String>,
    /// A built-in garment, `name` or `name@vertices`, or a file.
    pub garment: Option<String>,
    /// Measurements of the form by name, cm (`{"bust": 92}`).
    pub measurements: Option<BTreeMap<String, f64>>,
    /// The range table.
    pub table: Option<TableEdit>,
    /// The level that takes the distances in a gap between two levels.
    pub gap: Option<GapRule>,
    /// The fabric.
    pub fabric: Option<FabricEdit>,
    /// PARTs with fewer vertices than this join a neighbour.
    pub min_part: Option<usize>,
    /// Extents that PARTs are cut to, cm, coarse to fine; none, or 0, leaves PARTs uncut.
    pub max_extent_cm: Option<Vec<f64>>,
    /// Motion of a PART: `affine` or `translation`.
    pub motion: Option<Motion>,
    /// Model of stage two: `coupled` or `paper`, with its defaults.
    pub model: Option<String>,
    /// Steps at full resolution: `"converged"` or `{"steps": n}`.
    pub refine: Option<Refine>,
    /// Whether steps at full resolution resolve self-contact.
    pub self_contact: Option<bool>,
}

impl Edit {
    /// Every value that is opened as a file, with its field. A new field does not compile until it is listed here.
    pub(crate) fn file_names(&self) -> Vec<(FileRole, &str)> {
        let Self {
            body,
            garment,
            table,
            fabric,
            // Numbers and choices.
            measurements: _,
            gap: _,
            min_part: _,
            max_extent_cm: _,
            motion: _,
            model: _,
            refine: _,
            self_contact: _,
        } = self;
        let table = table.iter().filter_map(|t| if let TableEdit::Name(name) = t { Some(name) } else { None });
        let fabric = fabric.iter().filter_map(|f| if let FabricEdit::Name(name) = f { Some(name) } else { None });
        let named = (body.iter().map(|name| (FileRole::Body, name)))
            .chain(garment.iter().map(|name| (FileRole::Garment, name)))
            .chain(table.map(|name| (FileRole::Table, name)))
            .chain(fabric.map(|name| (FileRole::Fabric, name)));
        named.map(|(role, name)| (role, name.as_str())).filter(|(_, name)| names_a_file(name)).collect()
    }

    /// `job` with this edit applied.
    pub(crate) fn applied(&self, job: &Job) -> Result<Job, EditError> {
        let mut job = job.clone();
        self.change_scene(&mut job)?;
        let settings = &mut job.settings;
        match &self.table {
            None => {}
            Some(TableEdit::Name(name)) => settings.table = table_by_name(name)?.into(),
            Some(TableEdit::Rule(rule)) => settings.table = rule.clone(),
        }
        if let (Some(gap), TableRule::Rows(table)) = (self.gap, &mut settings.table) {
            table.gap = gap;
            table.validate()?;
        }
        match &self.fabric {
            None => {}
            Some(FabricEdit::Name(name)) => settings.fabric = Fabric::by_name(name)?,
            Some(FabricEdit::Constants(fabric)) => {
                fabric.check("fabric")?;
                settings.fabric = (**fabric).clone();
            }
        }
        settings.self_contact = self.self_contact.unwrap_or(settings.self_contact);
        if let Some(min_part) = self.min_part {
            settings.min_part = min_part.max(1);
        }
        if let Some(name) = &self.model {
            let model =
                Model::by_name(name).ok_or_else(|| EditError::value("model", name, "\"coupled\" or \"paper\""))?;
            let (extents_cm, motion) = (settings.model.extents_cm(), settings.model.motion());
            settings.model = model.with_extents_cm(&extents_cm).with_motion(motion);
        }
        if let Some(extents) = &self.max_extent_cm {
            let cuts: Vec<f64> = extents.iter().copied().filter(|cm| *cm != 0.0).collect();
            if !cuts.is_sorted_by(|a, b| a > b) || cuts.iter().any(|cm| !cm.is_finite() || *cm < 0.0) {
                let expected = "centimetres above 0 from coarse to fine, or 0 for PARTs as the table makes them";
                return Err(EditError::value("max_extent_cm", format!("{extents:?}"), expected));
            }
            settings.model = settings.model.clone().with_extents_cm(&cuts);
        }
        if let Some(motion) = self.motion {
            settings.model = settings.model.clone().with_motion(motion);
        }
        settings.refine = self.refine.unwrap_or(settings.refine);
        Ok(job)
    }

    fn change_scene(&self, job: &mut Job) -> Result<(), EditError> {
        let scene = &mut job.scene;
        if let Some(body) = &self.body {
            scene.body.clone_from(body);
        }
        if let Some(garment) = &self.garment {
            scene.garment.clone_from(garment);
            scene.over.clear();
            scene.fabrics.clear();
            scene.fabrics_file = None;
        }
        if self.body.is_some() || self.garment.is_some() {
            scene.check_names()?;
        }
        let Some(changed) = &self.measurements else { return Ok(()) };
        if scene.body != crate::scene::DRESS_FORM {
            let expected = "body = \"form\", whose measurements these are";
            return Err(EditError::value("measurements", format!("body = \"{}\"", scene.body), expected));
        }
        for (name, cm) in changed {
            scene.measurements = scene.measurements.with(name.trim_end_matches("_cm"), *cm)?;
        }
        scene.measurements.measures()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edit(json: &str) -> Result<Job, String> {
        let edit: Edit = serde_json::from_str(json).map_err(|e| e.to_string())?;
        edit.applied(&Job::default()).map_err(|e| e.to_string())
    }

    #[test]
    fn fields_left_out_keep_their_values() {
        assert_eq!(edit("{}").unwrap(), Job::default());
        let job = edit(r#"{"table": {"levels": [[0, 1.5], [1.5, "inf"]]}, "fabric": "denim", "max_extent_cm": [12]}"#);
        let job = job.unwrap();
        assert_eq!((job.settings.table.name(), job.settings.fabric.name.as_str()), ("edited", "denim"));
        assert_eq!(job.settings.model.extents_cm(), [12.0]);
        assert_eq!(job.scene, Job::default().scene);
        let job = edit(r#"{"measurements": {"bust": 92}}"#).unwrap();
        assert_eq!(job.scene.measurements.bust_cm, 92.0);
    }

    #[test]
    fn an_invalid_edit_is_refused_with_the_expected_values() {
        for (json, words) in [
            (r#"{"tabel": "table-3"}"#, "tabel"),
            (r#"{"table": {"levels": [[0, 2], [1, 3]]}}"#, "row 2 starts at 1"),
            (r#"{"table": {"levels": [[0, -2]]}}"#, "row 1"),
            (r#"{"table": 7}"#, "expected a preset"),
            (r#"{"table": "table-4"}"#, "table-3"),
            (r#"{"fabric": "tweed"}"#, "denim"),
            (r#"{"garment": "kimono"}"#, "flared-skirt"),
            (r#"{"max_extent_cm": [6, 12]}"#, "coarse to fine"),
            (r#"{"measurements": {"bust": 3}}"#, "bust"),
            (r#"{"measurements": {"brain": 3}}"#, "brain"),
            (r#"{"model": "finite"}"#, "coupled"),
            (r#"{"min_part": -1}"#, "-1"),
            (r#"{"body": "no-body"}"#, "no-body"),
        ] {
            let error = edit(json).unwrap_err();
            assert!(error.contains(words), "{json}: {error}");
        }
    }

    #[test]
    fn every_built_in_table_is_valid() {
        for name in preset_names() {
            assert!(table_by_name(name).unwrap().levels.len() > 1, "{name}");
        }
    }
}
