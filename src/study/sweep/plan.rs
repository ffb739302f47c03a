//! From a sweep file to its points.
//!
//! # Order
//! The grid's points come first, nested as body, garment, size, fabric, model, table, extent, motion, smallest PART,
//! refinement, seed, options (the last fastest), each axis in the order written; then the single points as written. A
//! point with the same id as an earlier one (for example Table 3 scaled by 1) is left out, and [`Plan::notes`] reports it.

use std::collections::BTreeMap;
use std::path::Path;

use super::axes::Axes;
use super::file::{At, Grid, Source};
use super::inputs::Inputs;
use super::{PlanError, Point};
use crate::base::files::read_text;
use crate::study::job::Job;

/// Largest number of timed passes, and of warm-up passes. Heuristic: more passes do not improve the median.
pub(crate) const MAX_PASSES: usize = 100;

/// All points of a sweep, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The sweep's name.
    pub name: String,
    /// Description; may be empty.
    pub about: String,
    /// Timed passes of each point, at least 1.
    pub repeats: usize,
    /// Passes before those.
    pub warm_up: usize,
    /// The points.
    pub points: Vec<Point>,
    /// Warnings for the user: omitted points.
    pub notes: Vec<String>,
}

impl Plan {
    /// Reads a sweep file. Paths in it are relative to its folder; keys that it leaves out are as in `start`.
    pub fn read(path: &Path, start: &Job) -> Result<Self, PlanError> {
        let name = path.display().to_string();
        let text = read_text(path).map_err(PlanError::Unreadable)?;
        Self::parse(&text, &name, path.parent().unwrap_or(Path::new("")), start)
    }

    /// The plan of a sweep file's text. `name` is used in messages; paths are relative to `folder`.
    pub fn parse(text: &str, name: &str, folder: &Path, start: &Job) -> Result<Self, PlanError> {
        let source = Source { text, name };
        let file = source.parse()?;
        let passes = |value: &Option<At>, key, least| match value {
            None => Ok(least),
            Some(value) => {
                let expected = format!("a whole number of passes, at least {least} and at most {MAX_PASSES}");
                let found = source.count(value, key, least, &expected)?;
                if found > MAX_PASSES { Err(source.wrong(value, key, &expected)) } else { Ok(found) }
            }
        };
        let (repeats, warm_up) = (passes(&file.repeats, "repeats", 1)?, passes(&file.warm_up, "warm_up", 0)?);
        let mut inputs = Inputs::new(folder);
        let mut points = Vec::new();
        let sizes = file.sizes.as_ref();
        let named = file.points.iter().chain([&file.base]).find_map(|single| single.get("body"));
        let listed = file.grid.as_ref().and_then(|grid| grid.get("bodies")).map(toml::Spanned::span);
        if let (Some(_), Some(span)) = (sizes, named.map(toml::Spanned::span).or(listed)) {
            let (place, found) = (source.line(span.start), "a body beside [sizes]".to_owned());
            let expected = "one of the two: [sizes] are the bodies of all points".to_owned();
            return Err(PlanError::Value { place, key: "body", found, expected });
        }
        // Sizes alone are a grid of one point each.
        let alone = (sizes.is_some() && file.points.is_empty()).then(Grid::default);
        if let Some(grid) = file.grid.as_ref().or(alone.as_ref()) {
            Axes::read(source, &file.base, grid, sizes, &mut inputs)?.expand(&mut points, start, name)?;
        }
        for single in &file.points {
            let mut all = file.base.clone();
            all.extend(single.clone());
            let axes = Axes::read(source, &all, &Grid::default(), sizes, &mut inputs)?;
            let bodies = sizes.map_or(1, |sizes| sizes.list.len());
            if let (Some(table), true) = (single.get("table"), axes.count() > bodies) {
                let expected = "one table for one point; lists belong into [grid] as tables";
                return Err(source.wrong(table, "table", expected));
            }
            axes.expand(&mut points, start, name)?;
        }
        if points.is_empty() {
            return Err(PlanError::Empty { name: name.to_owned() });
        }
        let (points, notes) = distinct(points);
        Ok(Self { name: file.name, about: file.about, repeats, warm_up, points, notes })
    }

    /// The plan of jobs with one timed pass each; hashes the files that they name.
    pub fn of_jobs(name: &str, jobs: Vec<Job>) -> Result<Self, PlanError> {
        let mut inputs = Inputs::new(Path::new(""));
        let mut point = |job: Job| {
            let mut point = Point::of(job);
            point.set_body(&inputs.input(&point.body, name)?);
            point.set_garment(&inputs.garment(&point.garment, name)?);
            Ok(point.named())
        };
        let (points, notes) = distinct(jobs.into_iter().map(&mut point).collect::<Result<_, PlanError>>()?);
        Ok(Self { name: name.to_owned(), about: String::new(), repeats: 1, warm_up: 0, points, notes })
    }
}

/// Removes duplicate points and numbers the others.
fn distinct(points: Vec<Point>) -> (Vec<Point>, Vec<String>) {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let (mut kept, mut notes): (Vec<Point>, Vec<String>) = (Vec::with_capacity(points.len()), Vec::new());
    for mut point in points {
        if let Some(&first) = seen.get(&point.id) {
            let (same, left_out) = (kept[first].label(), point.label());
            notes.push(format!("point left out, the same as point {first} ({same}): {left_out}"));
            continue;
        }
        seen.insert(point.id.clone(), kept.len());
        point.index = kept.len();
        kept.push(point);
    }
    (kept, notes)
}
