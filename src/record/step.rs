//! One step of the timeline `table`: the PARTs of a range table, their forces, the drape, and its metrics. The layers of an outfit
//! show the same, each under its own entity path.

use glam::DVec3;
use rerun::Mesh3D;

use super::charts;
use super::error::RecordError;
use super::legend::{Legend, caption, log_level_hues, table_title};
use super::meshes::{self, rerun_colours};
use super::open_recording::OpenRecording;
use super::overlay::{log_fit, log_overlay};
use super::panel::Panel;
use super::{part_marks, paths};
use crate::parts::UNASSIGNED;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::{ColourMap, Range, Rgb};
use crate::picture::colour::palette::{self, colour_parts, with_outside};
use crate::picture::colour::{FORCE_QUANTILE, Overlay, QUANTILE};
use crate::scene::Layer;

/// The result of one range table. Slices have one value per vertex of the garment unless stated otherwise.
#[derive(Debug, Clone, Copy)]
pub struct StepView<'a> {
    /// Step of the timeline `table`.
    pub index: i64,
    /// Distance to the body, m.
    pub distances_m: &'a [f64],
    /// PART of each vertex, or [`UNASSIGNED`].
    pub part_of_vertex: &'a [u32],
    /// Resultant force of each PART, N.
    pub part_force_n: &'a [DVec3],
    /// Draped vertices, m.
    pub draped: &'a [DVec3],
    /// The text panel; its levels give the bars.
    pub panel: &'a Panel,
    /// Further scalars over `table`: leaf of `/numbers` and value (`error/rms_mm`).
    pub scalars: &'a [(&'a str, f64)],
    /// Error, strain, pressure.
    pub overlays: &'a [Overlay<'a>],
}

impl StepView<'_> {
    fn check(&self, recording: &OpenRecording) -> Result<(), RecordError> {
        let mut lists = vec![
            ("distances", self.distances_m.len()),
            ("PART numbers", self.part_of_vertex.len()),
            ("displaced positions", self.draped.len()),
        ];
        for overlay in self.overlays {
            lists.push((overlay.name, overlay.values.len()));
            lists.extend(overlay.positions.map(|positions| ("positions of an overlay", positions.len())));
        }
        recording.check_lengths(&lists)?;
        let assigned = self.part_of_vertex.iter().filter(|part| **part != UNASSIGNED);
        let (found, expected) = (self.part_force_n.len(), assigned.max().map_or(0, |&part| part as usize + 1));
        if found < expected {
            return Err(RecordError::Mismatch { what: "forces".to_owned(), found, expected, of: "PARTs" });
        }
        Ok(())
    }
}

/// Logs all stages of a step.
pub(super) fn log(recording: &mut OpenRecording, step: &StepView<'_>) -> Result<(), RecordError> {
    step.check(recording)?;
    let parts = step.part_force_n.len();
    let part_of_vertex = with_outside(step.part_of_vertex, parts);
    // No force acts on the vertices in no level.
    let outside = part_of_vertex.contains(&(parts as u32)).then_some(DVec3::ZERO);
    let part_force_n: Vec<DVec3> = step.part_force_n.iter().copied().chain(outside).collect();
    let step = &StepView { part_of_vertex: &part_of_vertex, part_force_n: &part_force_n, ..*step };
    log_distance(recording, step)?;
    let tooltips = part_marks::tooltips(step.part_of_vertex, step.part_force_n, &step.panel.levels);
    log_parts(recording, step, &tooltips)?;
    log_force(recording, step, tooltips)?;
    log_drape(recording, step)?;
    charts::log_levels(recording, &step.panel.levels, step.distances_m)?;
    let panel = step.panel;
    charts::log_numbers(recording, &panel.table, step.part_force_n.len(), &panel.timings_ms, step.scalars)?;
    recording.log_report(panel.markdown())
}

fn log_distance(recording: &mut OpenRecording, step: &StepView<'_>) -> Result<(), RecordError> {
    if recording.distance == step.distances_m {
        return Ok(());
    }
    step.distances_m.clone_into(&mut recording.distance);
    recording.at(step.index, 2);
    let cm: Vec<f64> = step.distances_m.iter().map(|d| 100.0 * d).collect();
    let range = recording.range("distance", || Range::to_quantile(cm.iter().copied(), QUANTILE));
    let map = ColourMap::DISTANCE;
    recording.log(paths::DISTANCE, &meshes::colours(map.colours(&cm, range)))?;
    Legend::new("distance", "cm", map, range, &cm).log(recording, &format!("{}/distance", paths::STAGES_LEGEND), [0, 2])
}

fn log_parts(recording: &mut OpenRecording, step: &StepView<'_>, tooltips: &[String]) -> Result<(), RecordError> {
    recording.at(step.index, 3);
    if !recording.layout().several_tables && recording.first_use(paths::PARTS) {
        recording.cells = CellMesh::of_values(&recording.garment, step.part_of_vertex);
        recording.log_cells()?;
    }
    let (parts, levels) = (step.part_force_n.len(), &step.panel.levels);
    let triangles = &recording.garment.triangles;
    let chosen = colour_parts(step.part_of_vertex, parts, levels, triangles, &recording.vertex_shade);
    recording.log(paths::PARTS, &recording.cells.colours(&chosen.of_vertices))?;
    (recording.vertex_shade, recording.vertex_colour) = (chosen.vertex_shade, chosen.of_vertices);
    let placed = &recording.garment.positions;
    let dots = part_marks::dots(&recording.eye, placed, step.part_of_vertex, tooltips.to_vec());
    recording.log(paths::PART_DOTS, &dots)?;
    log_level_hues(recording, &format!("{}/levels", paths::STAGES_LEGEND), [0, 1], levels)?;
    caption(recording, &format!("{}/table", paths::STAGES_LEGEND), &table_title(&step.panel.table, parts), [0, 0])
}

fn log_force(recording: &OpenRecording, step: &StepView<'_>, tooltips: Vec<String>) -> Result<(), RecordError> {
    recording.at(step.index, 4);
    let force_n: Vec<f64> = step.part_of_vertex.iter().map(|&p| step.part_force_n[p as usize].length()).collect();
    let in_n = recording.range("force", || Range::to_quantile(force_n.iter().copied(), FORCE_QUANTILE));
    let map = ColourMap::FORCE;
    recording.log(paths::FORCE, &recording.cells.colours(&map.colours(&force_n, in_n)))?;
    let (factor, unit) = if in_n.high < 0.1 { (1e3, "mN") } else { (1.0, "N") };
    let range = Range { low: factor * in_n.low, high: factor * in_n.high };
    let open_end = force_n.iter().any(|&f| f > in_n.high);
    let legend = Legend { title: "|F|", unit, map, range, open_end };
    legend.log(recording, &format!("{}/force", paths::STAGES_LEGEND), [0, 3])?;
    let placed = &recording.garment.positions;
    let arrows = part_marks::arrows(&recording.eye, placed, step.part_of_vertex, step.part_force_n, in_n.high);
    recording.log(paths::FORCE_ARROWS, &arrows.with_labels(tooltips).with_show_labels(false))
}

fn log_drape(recording: &mut OpenRecording, step: &StepView<'_>) -> Result<(), RecordError> {
    let draped = recording.garment.with_positions(step.draped.to_vec());
    // Not at iteration 0: the drape is the result of the last iteration.
    recording.at_table(step.index, 5);
    recording.log(paths::DRAPE, &meshes::shape(&draped))?;
    recording.at(step.index, 6);
    let mut fit = 0;
    for overlay in step.overlays {
        if overlay.name == "error" {
            let legend = format!("{}/error", paths::STAGES_LEGEND);
            log_overlay(recording, paths::ERROR, &draped, overlay, &legend, [0, 4])?;
        } else {
            log_fit(recording, &draped, overlay, fit)?;
            fit += 1;
        }
    }
    recording.draped = Some(draped);
    Ok(())
}

/// The layers of an outfit. Slices have one value per vertex of all garments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutfitView<'a> {
    /// Step of the timeline `table`.
    pub(crate) index: i64,
    /// Magnitude of the force on each vertex's PART, N.
    pub(crate) force_n: &'a [f64],
    /// Draped vertices, m.
    pub(crate) draped: &'a [DVec3],
}

/// The branch of entity paths of layer number `k`.
pub(super) fn layer_branch(k: usize, layer: &Layer) -> String {
    format!("{}/{}-{}", paths::OUTFIT, k + 1, layer.name)
}

/// Logs PARTs, forces and drape of each layer, in the PART colours of the last step.
pub(super) fn log_outfit(recording: &OpenRecording, view: &OutfitView<'_>) -> Result<(), RecordError> {
    recording.check_lengths(&[("forces", view.force_n.len()), ("displaced positions", view.draped.len())])?;
    let range = recording.range("force", || Range::to_quantile(view.force_n.iter().copied(), FORCE_QUANTILE));
    let force = ColourMap::FORCE.colours(view.force_n, range);
    let garment = &recording.garment;
    for (k, layer) in recording.layout().outfit.iter().enumerate() {
        let branch = layer_branch(k, layer);
        let cut_out = |positions: &[DVec3]| layer.cut_out(&garment.triangles, positions);
        let placed = cut_out(&garment.positions);
        let coloured = |of_vertex: &[Rgb]| -> Mesh3D {
            let own = &of_vertex[layer.vertices.clone()];
            let cells = CellMesh::of_values(&placed, own);
            cells.shape().with_vertex_colors(rerun_colours(cells.of_vertices(own)))
        };
        if recording.vertex_colour.len() == garment.positions.len() {
            recording.at(view.index, 3);
            recording.log(&format!("{branch}/parts"), &coloured(&recording.vertex_colour))?;
        }
        recording.at(view.index, 4);
        recording.log(&format!("{branch}/force"), &coloured(&force))?;
        recording.at(view.index, 5);
        recording.log(&format!("{branch}/drape"), &meshes::plain(&cut_out(view.draped), palette::of_layer(k)))?;
    }
    Ok(())
}
