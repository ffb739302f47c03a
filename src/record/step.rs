//! One step of the timeline `table`: the PARTs of a range table, their forces, the drape, and what was measured.

use glam::DVec3;
use rerun::components::{Scalar, Text};
use rerun::{
    AnyValues, Arrows3D, BarChart, Clear, Color, ComponentIdentifier, Scalars, SeriesLines, SeriesPoints, TextDocument,
};

use super::colour_map::{ColourMap, Range};
use super::colours::{self, colour_parts};
use super::error::RecordError;
use super::legend::Legend;
use super::meshes::{self, single};
use super::panel::{LevelRow, Panel};
use super::{Open, paths};
use crate::mesh::TriMesh;

/// Share of the garment's height that the longest arrow takes.
const LONGEST_ARROW: f64 = 0.16;
/// With more arrows than this they shrink.
const MANY_ARROWS: f64 = 150.0;
/// Values above this quantile share the last colour.
const QUANTILE: f64 = 0.99;
/// The same for forces, of which a few PARTs hold most: one of a single vertex can have any.
const FORCE_QUANTILE: f64 = 0.95;
/// Bars of the distance histogram, about.
const BINS: usize = 80;

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
    /// PART of each vertex.
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

impl StepView<'_> {
    pub(crate) fn check(&self, vertices: usize) -> Result<(), RecordError> {
        let lengths = [
            ("distances", self.distance_m.len()),
            ("PART numbers", self.part_of_vertex.len()),
            ("displaced positions", self.draped.len()),
        ];
        let overlays = self.overlays.iter().map(|o| (o.name, o.values.len()));
        for (what, found) in lengths.into_iter().chain(overlays) {
            if found != vertices {
                return Err(RecordError::Mismatch {
                    what: what.to_owned(),
                    found,
                    expected: vertices,
                    of: "vertices of the garment",
                });
            }
        }
        let expected = self.part_of_vertex.iter().max().map_or(0, |&p| p as usize + 1);
        if self.part_force_n.len() < expected {
            return Err(RecordError::Mismatch {
                what: "forces".to_owned(),
                found: self.part_force_n.len(),
                expected,
                of: "PARTs",
            });
        }
        Ok(())
    }
}

/// Logs the whole step.
pub(crate) fn log(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    distance(open, step)?;
    parts(open, step)?;
    force(open, step)?;
    drape(open, step)?;
    levels(open, step)?;
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
    Legend { title: "distance", unit: "cm", map, range, open_end }.log(open, paths::DISTANCE_LEGEND)
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
    Legend { title: "|F|", unit, map, range, open_end }.log(open, paths::FORCE_LEGEND)?;
    arrows(open, step, range.high / factor)
}

/// One arrow per PART, from its vertex nearest the eye's side of its middle: the centroid of a ring lies inside the body.
fn arrows(open: &Open, step: &StepView<'_>, full: f64) -> Result<(), RecordError> {
    let toward = open.eye.toward;
    let parts = step.part_force_n.len();
    let mut sum = vec![(DVec3::ZERO, 0.0, f64::NEG_INFINITY); parts];
    for (&p, &x) in step.part_of_vertex.iter().zip(&open.garment.positions) {
        let (total, count, front) = &mut sum[p as usize];
        *total += x;
        *count += 1.0;
        *front = front.max(x.dot(toward));
    }
    let mut best = vec![(f64::INFINITY, DVec3::ZERO); parts];
    for (&p, &x) in step.part_of_vertex.iter().zip(&open.garment.positions) {
        let (total, count, front) = sum[p as usize];
        let middle = total / count;
        let wanted = middle + toward * (front - middle.dot(toward));
        let off = x.distance_squared(wanted);
        if off < best[p as usize].0 {
            best[p as usize] = (off, x);
        }
    }
    let height = 2.0 * open.eye.half_height;
    // Hundreds of arrows would hide the garment: the more, the smaller.
    let small = (MANY_ARROWS / parts as f64).sqrt().clamp(0.4, 1.0);
    let longest = LONGEST_ARROW * height * small;
    // Off the surface by a hair, so that an arrow along the cloth is not half sunk in it.
    let origins = best.iter().map(|(_, x)| single(*x + 0.035 * height * toward));
    let vectors = step.part_force_n.iter().map(|f| {
        let length = (f.length() / full).min(1.25) * longest;
        single(f.normalize_or_zero() * length)
    });
    let arrows = Arrows3D::from_vectors(vectors)
        .with_origins(origins)
        .with_radii([(0.0045 * height * small) as f32])
        .with_colors([Color::from_rgb(238, 240, 243)]);
    open.log(paths::FORCE_ARROWS, &arrows)
}

fn drape(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    open.at(step.index, 5);
    let draped = open.garment.with_positions(step.draped.to_vec());
    open.log(paths::DRAPE, &meshes::shape(&draped))?;
    open.at(step.index, 6);
    for overlay in step.overlays {
        let branch =
            if overlay.name == "error" { paths::ERROR.to_owned() } else { format!("{}/{}", paths::FIT, overlay.name) };
        self::overlay(open, &branch, &draped, overlay)?;
    }
    Ok(())
}

fn overlay(open: &mut Open, branch: &str, draped: &TriMesh, overlay: &Overlay<'_>) -> Result<(), RecordError> {
    let path = format!("{branch}/garment");
    open.triangles_once(&path)?;
    let range = Range::to_quantile(overlay.values.iter().copied(), QUANTILE);
    let map = ColourMap::ALARM;
    let coloured = meshes::shape(draped).with_vertex_colors(meshes::rerun_colours(map.colours(overlay.values, range)));
    open.log(&path, &coloured)?;
    let open_end = overlay.values.iter().any(|&v| v > range.high);
    Legend { title: overlay.name, unit: overlay.unit, map, range, open_end }.log(open, &format!("{branch}/legend"))
}

/// Bars of one level: how many vertices lie in each, and its middle and width, m. A level's bars tile its own range, so
/// that no bar holds vertices of two.
fn bars(row: &LevelRow, distance_m: &[f64], widest: f64, end: f64) -> Vec<(f64, f64, f64)> {
    let upper = row.upper_m.min(end.max(row.lower_m + widest));
    let count = ((upper - row.lower_m) / widest).ceil().max(1.0);
    let width = (upper - row.lower_m) / count;
    let mut bars: Vec<(f64, f64, f64)> =
        (0..count as usize).map(|i| (0.0, row.lower_m + (i as f64 + 0.5) * width, width)).collect();
    let last = bars.len() - 1;
    for &d in distance_m.iter().filter(|d| (row.lower_m..row.upper_m).contains(*d)) {
        bars[(((d - row.lower_m) / width) as usize).min(last)].0 += 1.0;
    }
    bars.retain(|bar| bar.0 > 0.0);
    bars
}

fn levels(open: &mut Open, step: &StepView<'_>) -> Result<(), RecordError> {
    let rows = &step.panel.levels;
    let end = Range::to_quantile(step.distance_m.iter().copied(), 0.995).high;
    let shade = |level: usize| {
        let [r, g, b] = ColourMap::DISTANCE.at((level as f64 + 0.5) / rows.len() as f64);
        Color::from_rgb(r, g, b)
    };
    for (level, row) in rows.iter().enumerate() {
        let bars = bars(row, step.distance_m, end / BINS as f64, end);
        let chart = BarChart::new(bars.iter().map(|b| b.0).collect::<Vec<f64>>())
            .with_abscissa(bars.iter().map(|b| 100.0 * b.1).collect::<Vec<f64>>())
            .with_widths(bars.iter().map(|b| 100.0 * b.2 as f32).collect::<Vec<f32>>())
            .with_color(shade(level));
        open.log(&format!("{}/{level:02}", paths::HISTOGRAM), &chart)?;
        let parts = BarChart::new(vec![row.parts as f64]).with_abscissa(vec![level as f64]).with_color(shade(level));
        open.log(&format!("{}/{level:02}", paths::LEVEL_PARTS), &parts)?;
    }
    for gone in rows.len()..open.levels {
        for branch in [paths::HISTOGRAM, paths::LEVEL_PARTS] {
            open.log(&format!("{branch}/{gone:02}"), &Clear::flat())?;
        }
    }
    open.levels = rows.len();
    Ok(())
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
        series(open, &format!("{}/{leaf}", paths::NUMBERS), leaf, i, *value)?;
        row.push((leaf.replace('/', "_"), *value));
    }
    let mut cells = AnyValues::default().with_component::<Text>("table", [step.panel.table.as_str()]);
    for (name, value) in row {
        // A column without a name cannot be shown.
        if let Ok(column) = ComponentIdentifier::try_new(name) {
            cells = cells.with_component::<Scalar>(column, [value]);
        }
    }
    open.log(paths::ROWS, &cells)?;
    open.report = step.panel.markdown();
    open.log(paths::REPORT, &TextDocument::from_markdown(open.report.as_str()))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_tile_their_level_and_count_every_vertex_once() {
        let row = |lower_m, upper_m| LevelRow { lower_m, upper_m, vertices: 0, parts: 0, extent: None };
        let distances = [0.0, 0.001, 0.0099, 0.01, 0.02, 0.049, 0.3];
        // A narrow level has one bar of its own width.
        assert_eq!(bars(&row(0.0, 0.01), &distances, 0.02, 0.1), [(3.0, 0.005, 0.01)]);
        // A wide one is cut evenly; empty bars are left out.
        let wide = bars(&row(0.01, 0.05), &distances, 0.02, 0.1);
        assert_eq!(wide.iter().map(|b| b.0).sum::<f64>(), 3.0);
        assert!(wide.iter().all(|b| (b.2 - 0.02).abs() < 1e-12));
        // The open level ends at the picture's end; what lies beyond counts in its last bar.
        let open = bars(&row(0.05, f64::INFINITY), &distances, 0.02, 0.1);
        assert_eq!(open.len(), 1);
        assert!(open[0].1 < 0.1);
    }
}
