//! The values of every axis of a sweep, read from its file, and their full grid.
//!
//! A value of an axis is an edit of a [`Point`]; keys that the file leaves out keep the value of the initial job.

use toml::Value;

use super::bodies::{body, sizes};
use super::file::{At, Axis, Grid, Single, Sizes, Source, number};
use super::garments::garments;
use super::inputs::Inputs;
use super::point::{Edit, one};
use super::tables::tables;
use super::{PlanError, Point};
use crate::base::files::names_a_file;
use crate::drape::{Model, Refine};
use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::Motion;
use crate::study::job::{Against, Job};

/// Largest number of points of a plan; more are probably a mistake. At 0.1 s per point, this many take three hours, and their
/// list takes 200 MB.
const MAX_POINTS: usize = 100_000;

/// The values of every axis, in the order in which a grid is nested.
pub(super) struct Axes(Vec<Vec<Edit>>);

impl Axes {
    /// Reads the axes of a grid. An axis that the grid lacks has the value of `base`, if any; `sizes` are bodies in place of those of
    /// both.
    pub(super) fn read(
        source: Source<'_>,
        base: &Single,
        grid: &Grid,
        of_sizes: Option<&Sizes>,
        inputs: &mut Inputs,
    ) -> Result<Self, PlanError> {
        let axis = Axis { source, base, grid };
        let bodies = match of_sizes {
            Some(list) => sizes(source, list)?,
            None => axis.edits(["body", "bodies"], |v| body(source, v, inputs))?,
        };
        Ok(Self(vec![
            bodies,
            garments(axis, inputs)?,
            axis.edits(["fabric", "fabrics"], |v| fabric(source, v, inputs))?,
            axis.edits(["model", "models"], |v| {
                let model = v.get_ref().as_str().and_then(Model::by_name);
                let model = model.ok_or_else(|| source.wrong(v, "model", "\"paper\" or \"coupled\""))?;
                Ok(one(move |point| point.job.settings.model = model.clone()))
            })?,
            axis.edits(["table", "tables"], |v| tables(source, v, inputs))?,
            axis.edits(["extent_cm", "extents_cm"], |v| {
                let extents = extents(source, v)?;
                Ok(one(move |point| {
                    let model = std::mem::take(&mut point.job.settings.model);
                    point.job.settings.model = model.with_extents_cm(&extents);
                }))
            })?,
            axis.edits(["motion", "motions"], |v| {
                let expected = "\"affine\" or \"translation\"";
                let motion: Option<Motion> = v.get_ref().as_str().and_then(|text| text.parse().ok());
                let motion = motion.ok_or_else(|| source.wrong(v, "motion", expected))?;
                Ok(one(move |point| {
                    let model = std::mem::take(&mut point.job.settings.model);
                    point.job.settings.model = model.with_motion(motion);
                }))
            })?,
            axis.edits(["min_part", "min_parts"], |v| {
                let expected = "a number of vertices, 1 for PARTs as the paper defines them";
                let least: usize = source.count(v, "min_part", 1, expected)?;
                Ok(one(move |point| point.job.settings.min_part = least))
            })?,
            axis.edits(["refine", "refine"], |v| {
                let refine = match v.get_ref().as_str() {
                    Some("converged") => Refine::Converged,
                    _ => Refine::Steps(source.count(v, "refine", 0, "a number of steps, or \"converged\"")?),
                };
                Ok(one(move |point| point.job.settings.refine = refine))
            })?,
            axis.edits(["seed", "seeds"], |v| {
                let seed = source.count(v, "seed", 0, "a whole number, 0 for the undisturbed start")?;
                Ok(one(move |point| point.job.seed = seed))
            })?,
            axis.edits(["accuracy", "accuracy"], |v| {
                let expected = "\"none\", \"canonical\" or \"own\"";
                let against: Option<Against> = v.get_ref().as_str().and_then(|text| text.parse().ok());
                let against = against.ok_or_else(|| source.wrong(v, "accuracy", expected))?;
                Ok(one(move |point| point.job.accuracy = against))
            })?,
            axis.edits(["options", "options"], |v| options(source, v))?,
        ]))
    }

    /// Number of points of the grid.
    pub(super) fn count(&self) -> usize {
        self.0.iter().fold(1, |n: usize, axis| n.saturating_mul(axis.len()))
    }

    /// Appends all combinations, the last axis fastest.
    pub(super) fn expand(&self, points: &mut Vec<Point>, start: &Job, name: &str) -> Result<(), PlanError> {
        let count = self.count();
        let found = count.saturating_add(points.len());
        if found > MAX_POINTS {
            return Err(PlanError::TooMany { name: name.to_owned(), found, limit: MAX_POINTS });
        }
        for number in 0..count {
            let mut point = Point::of(start.clone());
            // Mixed-radix digits of the number, one per axis.
            let mut block = count;
            for axis in &self.0 {
                block /= axis.len();
                axis[number / block % axis.len()](&mut point);
            }
            points.push(point.named());
        }
        Ok(())
    }
}

fn fabric(source: Source<'_>, value: &At, inputs: &Inputs) -> Result<Vec<Edit>, PlanError> {
    let place = source.place(value);
    if let Value::Table(constants) = value.get_ref() {
        let fabric = Fabric::parse(&constants.to_string(), &place).map_err(PlanError::input(&place, "fabric"))?;
        return Ok(one(move |point| point.job.settings.fabric = fabric.clone()));
    }
    let label = source.text(value, "fabric", "a built-in name, a file, or a table of all constants")?;
    let fabric = match names_a_file(&label) {
        true => Fabric::parse(&inputs.text(&label, &place)?, &label),
        false => Fabric::by_name(&label),
    };
    let fabric = Fabric { name: label, ..fabric.map_err(PlanError::input(&place, "fabric"))? };
    Ok(one(move |point| point.job.settings.fabric = fabric.clone()))
}

/// No extent, one extent, or a cascade from coarse to fine.
fn extents(source: Source<'_>, value: &At) -> Result<Vec<f64>, PlanError> {
    let wrong =
        || source.wrong(value, "extent_cm", "centimetres, 0 or \"none\" for not cut, or a falling list of them");
    let positive = |v: &Value| number(v).filter(|cm| *cm > 0.0 && cm.is_finite());
    match value.get_ref() {
        Value::String(word) if word == "none" => Ok(Vec::new()),
        Value::Array(list) => {
            let cascade: Vec<f64> = list.iter().map(positive).collect::<Option<_>>().ok_or_else(wrong)?;
            if cascade.is_empty() || !cascade.is_sorted_by(|a, b| a > b) {
                return Err(wrong());
            }
            Ok(cascade)
        }
        one if number(one) == Some(0.0) => Ok(Vec::new()),
        one => positive(one).map(|cm| vec![cm]).ok_or_else(wrong),
    }
}

/// The reference of a point, and further keys of its scene that do not name files.
fn options(source: Source<'_>, value: &At) -> Result<Vec<Edit>, PlanError> {
    let expected = "{ name = value, ... } with accuracy = \"none\", \"canonical\" or \"own\", or a key of the scene such as \
                    rest = \"texture\", hold, unit, up, weld, or an option of the solver such as \"newton.damping\"";
    let wrong = |what: &str| source.wrong(value, "options", format!("{expected}{what}"));
    let given = value.get_ref().as_table().ok_or_else(|| wrong(""))?.clone();
    let set = move |point: &mut Point| -> Result<(), String> {
        let mut scene = toml::Table::try_from(&point.job.scene).map_err(|e| e.to_string())?;
        for (key, v) in &given {
            let text = v.as_str().map_or_else(|| v.to_string(), str::to_owned);
            match key.as_str() {
                "accuracy" => point.job.accuracy = text.parse()?,
                "body" | "garment" => return Err("bodies and garments have axes of their own".to_owned()),
                "rest" | "fabrics" if names_a_file(&text) => return Err("options name no file".to_owned()),
                "fabrics_file" => return Err("options name no file; put one beside the garment's".to_owned()),
                name if name.contains('.') => {
                    let value = number(v).ok_or_else(|| format!("{name}: found {v}, expected a number"))?;
                    point.job.settings.solver =
                        point.job.settings.solver.with(name, value).map_err(|e| e.to_string())?;
                }
                _ => drop(scene.insert(key.clone(), v.clone())),
            }
            point.options.insert(key.clone(), text);
        }
        point.job.scene = scene.try_into().map_err(|e: toml::de::Error| e.message().replace('\n', ", "))?;
        Ok(())
    };
    set(&mut Point::of(Job::default())).map_err(|e| wrong(&format!("; {e}")))?;
    // The edit succeeded above, and it does not depend on the point.
    Ok(one(move |point| set(point).unwrap_or_default()))
}
