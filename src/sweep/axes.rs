//! The values of every axis of a sweep, read from its file, and their full grid.

use std::collections::BTreeMap;

use toml::{Spanned, Value};

use super::bodies::{body, dress_form};
use super::choice::{BodyChoice, FabricChoice, Input, ModelChoice, Refine, TableChoice};
use super::error::PlanError;
use super::file::{At, Grid, Single, Source, number};
use super::garments::garments;
use super::inputs::Inputs;
use super::point::Point;
use super::tables::{default_table, tables};
use crate::fabric::Fabric;

/// The fabric where a sweep names none.
pub const DEFAULT_FABRIC: &str = "interlock";
/// Points a plan may have: a larger grid is a slip of the pen (at a tenth of a second a point it takes three hours, and its
/// points take 200 MB of memory).
const LIMIT: usize = 100_000;

/// The values of every axis.
pub(super) struct Axes {
    bodies: Vec<BodyChoice>,
    garments: Vec<Input>,
    fabrics: Vec<FabricChoice>,
    models: Vec<ModelChoice>,
    pub(super) tables: Vec<TableChoice>,
    extents_cm: Vec<Vec<f64>>,
    min_parts: Vec<usize>,
    refine: Vec<Refine>,
    seeds: Vec<u64>,
    options: Vec<BTreeMap<String, String>>,
}

impl Axes {
    /// Reads the axes of a grid; an axis it lacks has the one value of `base`, or the default.
    pub(super) fn read(source: Source<'_>, base: &Single, grid: &Grid, inputs: &mut Inputs) -> Result<Self, PlanError> {
        let axis = Axis { source };
        let models = axis.of(&base.model, &grid.models, "models", |v| match v.get_ref().as_str() {
            Some("paper") => Ok(ModelChoice::Paper),
            Some("coupled") => Ok(ModelChoice::Coupled),
            _ => Err(source.wrong(v, "model", "\"paper\" or \"coupled\"")),
        })?;
        let extents_cm = axis.of(&base.extent_cm, &grid.extents_cm, "extents_cm", |v| extent(source, v))?;
        let min_parts = axis.of(&base.min_part, &grid.min_parts, "min_parts", |v| {
            source.count(v, "min_part", 1, "a number of vertices, 1 for PARTs as the paper defines them")
        })?;
        let refine = axis.of(&base.refine, &grid.refine, "refine", |v| match v.get_ref().as_str() {
            Some("converged") => Ok(Refine::Converged),
            _ => source.count(v, "refine", 0, "a number of steps, or \"converged\"").map(Refine::Steps),
        })?;
        let seeds = axis.of(&base.seed, &grid.seeds, "seeds", |v| {
            source.count(v, "seed", 0, "a whole number, 0 for the undisturbed start")
        })?;
        let options = axis.of(&base.options, &grid.options, "options", |v| options(source, v))?;
        let fabrics = axis.of(&base.fabric, &grid.fabrics, "fabrics", |v| {
            let label = source.text(v, "fabric", "a built-in name or a file")?;
            let place = source.place(v);
            let fabric = match Inputs::names_a_file(&label) {
                true => Fabric::parse(&inputs.text(&label, &place)?, &label),
                false => Fabric::by_name(&label),
            };
            fabric.map(|fabric| FabricChoice { label, fabric }).map_err(|source| PlanError::Fabric { place, source })
        })?;
        let bodies = axis.of(&base.body, &grid.bodies, "bodies", |v| body(source, v, inputs))?;
        let tables = axis.of(&base.table, &grid.tables, "tables", |v| tables(source, v, inputs))?;
        Ok(Self {
            bodies: bodies.unwrap_or_else(|| vec![dress_form()]),
            garments: garments(axis, base, grid, inputs)?,
            fabrics: fabrics.map_or_else(default_fabric, Ok)?,
            models: models.unwrap_or_else(|| vec![ModelChoice::Coupled]),
            tables: tables.map_or_else(|| vec![default_table()], |t| t.into_iter().flatten().collect()),
            extents_cm: extents_cm.unwrap_or_else(|| vec![Vec::new()]),
            min_parts: min_parts.unwrap_or_else(|| vec![1]),
            refine: refine.unwrap_or_else(|| vec![Refine::Steps(0)]),
            seeds: seeds.unwrap_or_else(|| vec![0]),
            options: options.unwrap_or_else(|| vec![BTreeMap::new()]),
        })
    }

    /// Appends every combination, the last axis fastest.
    pub(super) fn expand(&self, points: &mut Vec<Point>, name: &str) -> Result<(), PlanError> {
        let lengths = [
            self.bodies.len(),
            self.garments.len(),
            self.fabrics.len(),
            self.models.len(),
            self.tables.len(),
            self.extents_cm.len(),
            self.min_parts.len(),
            self.refine.len(),
            self.seeds.len(),
            self.options.len(),
        ];
        let count = lengths.iter().fold(1_usize, |n, &length| n.saturating_mul(length));
        let found = count.saturating_add(points.len());
        if found > LIMIT {
            return Err(PlanError::TooMany { name: name.to_owned(), found, limit: LIMIT });
        }
        for number in 0..count {
            // The number's digits, one base an axis.
            let mut rest = number;
            let mut at = [0; 10];
            for (digit, &length) in at.iter_mut().zip(&lengths).rev() {
                *digit = rest % length;
                rest /= length;
            }
            let point = Point {
                id: String::new(),
                index: 0,
                body: self.bodies[at[0]].clone(),
                garment: self.garments[at[1]].clone(),
                fabric: self.fabrics[at[2]].clone(),
                model: self.models[at[3]],
                table: self.tables[at[4]].clone(),
                extents_cm: self.extents_cm[at[5]].clone(),
                min_part: self.min_parts[at[6]],
                refine: self.refine[at[7]],
                seed: self.seeds[at[8]],
                options: self.options[at[9]].clone(),
            };
            points.push(point.named());
        }
        Ok(())
    }
}

/// Reads one axis after the other.
#[derive(Clone, Copy)]
pub(super) struct Axis<'a> {
    pub(super) source: Source<'a>,
}

impl Axis<'_> {
    /// The values of an axis: of the grid's list, or the base's one; `None` where neither has it.
    pub(super) fn of<T>(
        self,
        base: &Option<At>,
        grid: &Option<Spanned<Vec<At>>>,
        key: &'static str,
        mut read: impl FnMut(&At) -> Result<T, PlanError>,
    ) -> Result<Option<Vec<T>>, PlanError> {
        let Some(list) = grid else {
            return base.as_ref().map(|v| read(v).map(|value| vec![value])).transpose();
        };
        if list.get_ref().is_empty() {
            let (place, found) = (self.source.line(list.span().start), "an empty list".to_owned());
            let expected = "at least one value; leave the key out for the value of [base]".to_owned();
            return Err(PlanError::Value { place, key, found, expected });
        }
        list.get_ref().iter().map(&mut read).collect::<Result<_, _>>().map(Some)
    }
}

fn default_fabric() -> Result<Vec<FabricChoice>, PlanError> {
    let label = DEFAULT_FABRIC.to_owned();
    match Fabric::by_name(&label) {
        Ok(fabric) => Ok(vec![FabricChoice { label, fabric }]),
        Err(source) => Err(PlanError::Fabric { place: "the default".to_owned(), source }),
    }
}

/// No extent, one, or a cascade from coarse to fine.
fn extent(source: Source<'_>, value: &At) -> Result<Vec<f64>, PlanError> {
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

/// Scalars by name, as text.
fn options(source: Source<'_>, value: &At) -> Result<BTreeMap<String, String>, PlanError> {
    let wrong = || source.wrong(value, "options", "{ name = value, ... } of strings, numbers and true or false");
    let text = |v: &Value| match v {
        Value::String(text) => Some(text.clone()),
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) => Some(v.to_string()),
        _ => None,
    };
    let table = value.get_ref().as_table().ok_or_else(wrong)?;
    table.iter().map(|(key, v)| text(v).map(|text| (key.clone(), text)).ok_or_else(wrong)).collect()
}
