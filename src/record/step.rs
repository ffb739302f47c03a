//! One step of the timeline `table`: the PARTs of a range table, their forces, the drape, and what was measured.

use std::borrow::Cow;

use glam::DVec3;
use rerun::components::{Scalar, Text};
use rerun::{AnyValues, Arrows3D, Color, ComponentIdentifier, Scalars, SeriesLines, SeriesPoints, TextDocument};

use super::colour_map::ColourMap;
use super::colours::{self, colour_parts};
use super::eye::Eye;
use super::legend::{Legend, caption, titled};
use super::meshes::{self, single};
use super::overlay::{self, QUANTILE};
use super::{Open, Overlay, Panel, Range, RecordError, dots, levels, paths};
use crate::parts::UNASSIGNED;

/// Share of the garment's height that the longest arrow takes.
const LONGEST_ARROW: f64 = 0.16;
/// With more arrows than this they shrink.
const MANY_ARROWS: f64 = 150.0;
/// The same for forces, of which a few PARTs hold most: one of a single vertex can have any.
pub(super) const FORCE_QUANTILE: f64 = 0.95;

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
    let range = open.scale("distance", || Range::to_quantile(cm.iter().copied(), QUANTILE));
    let map = ColourMap::DISTANCE;
    open.log(paths::DISTANCE, &meshes::colours(map.colours(&cm, range)))?;
    let open_end = cm.iter().any(|&d| d > range.high);
    let legend = Legend { title: "distance", unit: "cm", map, range, open_end };
    legend.log(open, &format!("{}/distance", paths::STAGES_LEGEND), [0, 1])
}

fn parts(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    open.at(step.index, 3);
    let (count, levels) = (step.part_force_n.len(), &step.panel.levels);
    let chosen = colour_parts(step.part_of_vertex, count, levels, &open.garment.triangles, &open.vertex_shade);
    open.vertex_shade = step.part_of_vertex.iter().map(|&p| chosen.shade[p as usize]).collect();
    open.vertex_colour = step.part_of_vertex.iter().map(|&p| chosen.colour[p as usize]).collect();
    let mesh = open.cells.colours(|v| chosen.colour[step.part_of_vertex[v as usize] as usize]);
    open.log(paths::PARTS, &mesh)?;
    dots::log(open, step, dots::told(step))?;
    let named = titled(&step.panel.table, count);
    caption(open, &format!("{}/table", paths::STAGES_LEGEND), &named, [0, 0])
}

fn force(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    open.at(step.index, 4);
    let force_n: Vec<f64> = step.part_of_vertex.iter().map(|&p| step.part_force_n[p as usize].length()).collect();
    let scale = open.scale("force", || Range::to_quantile(force_n.iter().copied(), FORCE_QUANTILE));
    let (factor, unit) = if scale.high < 0.1 { (1e3, "mN") } else { (1.0, "N") };
    let map = ColourMap::FORCE;
    let shades = map.colours(&force_n, scale);
    open.log(paths::FORCE, &open.cells.colours(|v| shades[v as usize]))?;
    let open_end = force_n.iter().any(|&f| f > scale.high);
    let range = Range { low: factor * scale.low, high: factor * scale.high };
    // Where nobody sees the forces the bar of the error has their row.
    if !open.layout().held {
        let legend = Legend { title: "|F|", unit, map, range, open_end };
        legend.log(open, &format!("{}/force", paths::STAGES_LEGEND), [0, 2])?;
    }
    let placed = &open.garment.positions;
    let arrows = part_arrows(&open.eye, placed, step.part_of_vertex, step.part_force_n, scale.high);
    open.log(paths::FORCE_ARROWS, &arrows.with_labels(dots::told(step)).with_show_labels(false))
}

/// One arrow per PART. A force of `full` is as long as an arrow should be.
pub(super) fn part_arrows(
    eye: &Eye,
    placed: &[DVec3],
    part_of_vertex: &[u32],
    part_force_n: &[DVec3],
    full: f64,
) -> Arrows3D {
    let parts = part_force_n.len();
    let height = 2.0 * eye.half_height;
    // Hundreds of arrows would hide the garment: the more, the smaller.
    let small = (MANY_ARROWS / parts as f64).sqrt().clamp(0.4, 1.0);
    let longest = LONGEST_ARROW * height * small;
    // Off the surface by a hair, so that an arrow along the cloth is not half sunk in it.
    let anchors = dots::anchors(eye, placed, part_of_vertex, parts);
    let origins = anchors.into_iter().map(|x| single(x + 0.035 * height * eye.toward));
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
    let bars = if open.layout().held { 2 } else { 3 };
    let mut fit = 0;
    for overlay in step.overlays {
        let (branch, legend, cell) = if overlay.name == "error" {
            (paths::ERROR.to_owned(), format!("{}/error", paths::STAGES_LEGEND), [0, bars])
        } else {
            fit += 1;
            let [branch, legend] = [paths::FIT, paths::FIT_LEGEND].map(|of| format!("{of}/{}", overlay.name));
            (branch, legend, [fit - 1, 0])
        };
        overlay::overlay(open, &branch, &draped, overlay, (&legend, cell))?;
    }
    open.draped = Some(draped);
    Ok(())
}

fn numbers(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let count = step.part_force_n.len() as f64;
    series(open, "/numbers/part_count", "PARTs", 0, count)?;
    let mut row = vec![("part_count".to_owned(), count)];
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

/// What a line is called.
fn name_of(leaf: &str) -> String {
    match leaf {
        "error/rms_mm" => "to its own rest".to_owned(),
        "error/canonical_rms_mm" => "to the canonical drape".to_owned(),
        "error/representable_rms_mm" => "bound, one displacement a PART".to_owned(),
        "error/representable_affine_rms_mm" => "bound, one affine map a PART".to_owned(),
        other => other.trim_start_matches("error/").replace('_', " "),
    }
}

/// A scalar, drawn as a line with a dot at each step: one step alone is then seen too.
pub(super) fn series(open: &Open, path: &str, name: &str, place: usize, value: f64) -> Result<(), RecordError> {
    if open.first_use(path) {
        let colour = meshes::colour(colours::palette()[place % colours::HUES]);
        open.log_fixed(path, &SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([2.0]))?;
        open.log_fixed(path, &SeriesPoints::new().with_names([name]).with_colors([colour]).with_marker_sizes([4.0]))?;
    }
    open.log(path, &Scalars::single(value))
}
