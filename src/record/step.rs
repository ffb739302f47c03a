//! One step of the timeline `table`: the PARTs of a range table, their forces, the drape, and what was measured.

use std::borrow::Cow;

use glam::DVec3;
use rerun::components::{Scalar, Text};
use rerun::{AnyValues, Arrows3D, Color, ComponentIdentifier, Scalars, SeriesLines, SeriesPoints, TextDocument};

use super::colour_map::{ColourMap, Range};
use super::colours::{self, colour_parts};
use super::error::RecordError;
use super::eye::Eye;
use super::legend::Legend;
use super::meshes::{self, single};
use super::panel::Panel;
use super::{Open, Tab, levels, paths};
use crate::mesh::TriMesh;
use crate::parts::UNASSIGNED;

/// Share of the garment's height that the longest arrow takes.
const LONGEST_ARROW: f64 = 0.16;
/// With more arrows than this they shrink.
const MANY_ARROWS: f64 = 150.0;
/// Values above this quantile share the last colour.
pub(super) const QUANTILE: f64 = 0.99;
/// The same for forces, of which a few PARTs hold most: one of a single vertex can have any.
pub(super) const FORCE_QUANTILE: f64 = 0.95;

/// A value per vertex of the draped garment.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// `error`, or what the recording's layout lists under fit (`strain`, `pressure`).
    pub name: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// One value per vertex.
    pub values: &'a [f64],
}

/// All that one range table gives. Slices are per vertex of the garment unless they say otherwise.
#[derive(Debug, Clone, Copy)]
pub struct StepView<'a> {
    /// Step of the timeline `table`.
    pub index: i64,
    /// Distance to the body, m.
    pub distance_m: &'a [f64],
    /// PART of each vertex, or [`UNASSIGNED`].
    pub part_of_vertex: &'a [u32],
    /// Resultant force of each PART, N; as many as there are PARTs.
    pub part_force_n: &'a [DVec3],
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// The text panel; its levels give the bars.
    pub panel: &'a Panel,
    /// Further scalars over `table`: leaf of `/numbers` and value (`error/rms_mm`).
    pub scalars: &'a [(&'a str, f64)],
    /// Error, strain, pressure.
    pub overlays: &'a [Overlay<'a>],
}

/// PARTs with one more for the vertices outside every level, if there are any; `parts` are there without it.
pub(super) fn covering(part_of_vertex: &[u32], parts: usize) -> Cow<'_, [u32]> {
    if !part_of_vertex.contains(&UNASSIGNED) {
        return part_of_vertex.into();
    }
    part_of_vertex.iter().map(|&p| if p == UNASSIGNED { parts as u32 } else { p }).collect()
}

impl StepView<'_> {
    pub(crate) fn check(&self, vertices: usize) -> Result<(), RecordError> {
        let lengths = [
            ("distances", self.distance_m.len()),
            ("PART numbers", self.part_of_vertex.len()),
            ("displaced positions", self.draped.len()),
        ];
        let overlays = self.overlays.iter().map(|o| (o.name, o.values.len()));
        let all: Vec<(&str, usize)> = lengths.into_iter().chain(overlays).collect();
        RecordError::unless_per_vertex(vertices, &all)?;
        let known = self.part_of_vertex.iter().filter(|p| **p != UNASSIGNED);
        let expected = known.max().map_or(0, |&p| p as usize + 1);
        if self.part_force_n.len() < expected {
            let found = self.part_force_n.len();
            return Err(RecordError::Mismatch { what: "forces".to_owned(), found, expected, of: "PARTs" });
        }
        Ok(())
    }
}

/// Logs the whole step.
pub(crate) fn log(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let part_of_vertex = covering(step.part_of_vertex, step.part_force_n.len());
    // Nothing pulls at what is in no PART.
    let with_rest = [step.part_force_n, &[DVec3::ZERO]].concat();
    let part_force_n =
        if part_of_vertex.contains(&(step.part_force_n.len() as u32)) { &with_rest } else { step.part_force_n };
    let step = &StepView { part_of_vertex: &part_of_vertex, part_force_n, ..*step };
    distance(open, step)?;
    parts(open, step)?;
    force(open, step)?;
    drape(open, step)?;
    levels::log(open, step)?;
    numbers(open, step)
}

fn distance(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    if open.distance == step.distance_m {
        return Ok(());
    }
    step.distance_m.clone_into(&mut open.distance);
    open.at(step.index, 2);
    let cm: Vec<f64> = step.distance_m.iter().map(|d| 100.0 * d).collect();
    let range = Range::to_quantile(cm.iter().copied(), QUANTILE);
    let map = ColourMap::DISTANCE;
    open.log(paths::DISTANCE, &meshes::colours(map.colours(&cm, range)))?;
    let open_end = cm.iter().any(|&d| d > range.high);
    let legend = Legend { title: "distance", unit: "cm", map, range, open_end };
    legend.log(open, paths::DISTANCE_LEGEND, open.pixel_m(Tab::Stages))
}

fn parts(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    open.at(step.index, 3);
    let chosen =
        colour_parts(step.part_of_vertex, step.part_force_n.len(), &open.garment.triangles, &open.vertex_colour);
    let palette = colours::palette();
    open.vertex_colour = step.part_of_vertex.iter().map(|&p| chosen[p as usize]).collect();
    let mesh = open.cells.colours(|v| palette[open.vertex_colour[v as usize] as usize]);
    open.log(paths::PARTS, &mesh)
}

fn force(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    open.at(step.index, 4);
    let per_vertex =
        |unit: f64| step.part_of_vertex.iter().map(move |&p| unit * step.part_force_n[p as usize].length());
    let (factor, unit) =
        if Range::to_quantile(per_vertex(1.0), FORCE_QUANTILE).high < 0.1 { (1e3, "mN") } else { (1.0, "N") };
    let magnitude: Vec<f64> = per_vertex(factor).collect();
    let range = Range::to_quantile(magnitude.iter().copied(), FORCE_QUANTILE);
    let map = ColourMap::FORCE;
    let shades = map.colours(&magnitude, range);
    let mesh = open.cells.colours(|v| shades[v as usize]);
    open.log(paths::FORCE, &mesh)?;
    let open_end = magnitude.iter().any(|&f| f > range.high);
    let legend = Legend { title: "|F|", unit, map, range, open_end };
    legend.log(open, paths::FORCE_LEGEND, open.pixel_m(Tab::Stages))?;
    arrows(open, step, range.high / factor)
}

fn arrows(open: &Open, step: &StepView<'_>, full: f64) -> Result<(), RecordError> {
    let arrows = part_arrows(&open.eye, &open.garment.positions, step.part_of_vertex, step.part_force_n, full);
    open.log(paths::FORCE_ARROWS, &arrows)
}

/// One arrow per PART, from its vertex nearest the eye's side of its middle: the centroid of a ring lies inside the body. A force of `full`
/// is as long as an arrow should be.
pub(super) fn part_arrows(
    eye: &Eye,
    placed: &[DVec3],
    part_of_vertex: &[u32],
    part_force_n: &[DVec3],
    full: f64,
) -> Arrows3D {
    let toward = eye.toward;
    let parts = part_force_n.len();
    let mut sum = vec![(DVec3::ZERO, 0.0, f64::NEG_INFINITY); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (total, count, front) = &mut sum[p as usize];
        *total += x;
        *count += 1.0;
        *front = front.max(x.dot(toward));
    }
    let mut best = vec![(f64::INFINITY, DVec3::ZERO); parts];
    for (&p, &x) in part_of_vertex.iter().zip(placed) {
        let (total, count, front) = sum[p as usize];
        let middle = total / count;
        let wanted = middle + toward * (front - middle.dot(toward));
        let off = x.distance_squared(wanted);
        if off < best[p as usize].0 {
            best[p as usize] = (off, x);
        }
    }
    let height = 2.0 * eye.half_height;
    // Hundreds of arrows would hide the garment: the more, the smaller.
    let small = (MANY_ARROWS / parts as f64).sqrt().clamp(0.4, 1.0);
    let longest = LONGEST_ARROW * height * small;
    // Off the surface by a hair, so that an arrow along the cloth is not half sunk in it.
    let origins = best.iter().map(|(_, x)| single(*x + 0.035 * height * toward));
    let vectors = part_force_n.iter().map(|f| {
        let length = (f.length() / full).min(1.25) * longest;
        single(f.normalize_or_zero() * length)
    });
    Arrows3D::from_vectors(vectors)
        .with_origins(origins)
        .with_radii([(0.0045 * height * small) as f32])
        .with_colors([Color::from_rgb(238, 240, 243)])
}

fn drape(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let draped = open.garment.with_positions(step.draped.to_vec());
    // Its iterations show how it came to be; the last of them is this.
    open.at_table(step.index, 5);
    open.log(paths::DRAPE, &meshes::shape(&draped))?;
    open.at(step.index, 6);
    for overlay in step.overlays {
        let (branch, pixel_m) = if overlay.name == "error" {
            (paths::ERROR.to_owned(), open.pixel_m(Tab::Stages))
        } else {
            (format!("{}/{}", paths::FIT, overlay.name), open.pixel_m(Tab::Fit))
        };
        self::overlay(open, &branch, &draped, overlay, pixel_m)?;
    }
    open.draped = Some(draped);
    Ok(())
}

/// Values on the draped garment: `{branch}/garment` and `{branch}/legend`.
pub(super) fn overlay(
    open: &Open,
    branch: &str,
    draped: &TriMesh,
    overlay: &Overlay<'_>,
    pixel_m: f64,
) -> Result<(), RecordError> {
    let path = format!("{branch}/garment");
    open.triangles_once(&path)?;
    let range = Range::to_quantile(overlay.values.iter().copied(), QUANTILE);
    let map = ColourMap::ALARM;
    let coloured = meshes::shape(draped).with_vertex_colors(meshes::rerun_colours(map.colours(overlay.values, range)));
    open.log(&path, &coloured)?;
    let open_end = overlay.values.iter().any(|&v| v > range.high);
    let legend = Legend { title: overlay.name, unit: overlay.unit, map, range, open_end };
    legend.log(open, &format!("{branch}/legend"), pixel_m)
}

fn numbers(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let parts = ("part_count", "PARTs", step.part_force_n.len() as f64);
    series(open, "/numbers/part_count", parts.1, 0, parts.2)?;
    let mut row = vec![(parts.0.to_owned(), parts.2)];
    for (i, (stage, ms)) in step.panel.timings_ms.iter().enumerate() {
        series(open, &format!("{}/{stage}", paths::STAGE_MS), stage, i, *ms)?;
        row.push((format!("{stage}_ms"), *ms));
    }
    for (i, (leaf, value)) in step.scalars.iter().enumerate() {
        series(open, &format!("{}/{leaf}", paths::NUMBERS), &name_of(leaf), i, *value)?;
        row.push((leaf.replace('/', "_"), *value));
    }
    // The viewer sorts the columns by name, capitals first.
    let mut cells = AnyValues::default().with_component::<Text>("Table", [step.panel.table.as_str()]);
    for (name, value) in row {
        // Micrometres and microseconds: further digits fill the screen with noise.
        let value = (1e3 * value).round() / 1e3;
        // A column without a name cannot be shown.
        if let Ok(column) = ComponentIdentifier::try_new(name) {
            cells = cells.with_component::<Scalar>(column, [value]);
        }
    }
    open.log(paths::ROWS, &cells)?;
    open.report = step.panel.markdown();
    open.log(paths::REPORT, &TextDocument::from_markdown(open.report.as_str()))
}

/// What a line is called: errors as in the terminal's tables (`own`, `canonical`, `representable`).
fn name_of(leaf: &str) -> String {
    let Some(error) = leaf.strip_prefix("error/") else { return leaf.replace('_', " ") };
    match error.trim_end_matches("rms_mm").trim_end_matches('_') {
        "" => "own".to_owned(),
        kind => kind.to_owned(),
    }
}

/// A scalar, drawn as a line with a dot at each step: one step alone is then seen too.
pub(super) fn series(open: &Open, path: &str, name: &str, place: usize, value: f64) -> Result<(), RecordError> {
    if open.first_use(path) {
        let [r, g, b] = colours::palette()[place % colours::HUES];
        let colour = Color::from_rgb(r, g, b);
        open.log_fixed(path, &SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([2.0]))?;
        open.log_fixed(path, &SeriesPoints::new().with_names([name]).with_colors([colour]).with_marker_sizes([4.0]))?;
    }
    open.log(path, &Scalars::single(value))
}
