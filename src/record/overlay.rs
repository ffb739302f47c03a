//! Per-vertex values in colours: on the draped garment, on the flat panels of its pattern, and in exported meshes.

use glam::DVec3;

use super::error::RecordError;
use super::layout::{PANELS_ASPECT, Tab};
use super::legend::{Cell, Legend};
use super::meshes::{self, rerun_colours};
use super::open_recording::OpenRecording;
use super::paths;
use crate::mesh::TriMesh;
use crate::picture::colour::Overlay;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::{ColourMap, Range};
use crate::picture::colour::palette::CLOTH;

/// Share of a view's height or width that flat panels fill.
const PANELS_FILL: f64 = 0.95;

impl Overlay<'_> {
    /// The range of the colour map in a recording, fixed by the first step.
    fn range(&self, recording: &OpenRecording) -> Range {
        recording.range(self.name, || self.own_range())
    }
}

/// Logs values on the draped garment, `{branch}/garment`, and their colour bar, `legend`, in a cell of its drawing.
pub(super) fn log_overlay(
    recording: &OpenRecording,
    branch: &str,
    draped: &TriMesh,
    overlay: &Overlay<'_>,
    legend: &str,
    cell: Cell,
) -> Result<(), RecordError> {
    let path = format!("{branch}/garment");
    recording.triangles_once(&path)?;
    let range = overlay.range(recording);
    let map = ColourMap::ALARM;
    let colours = rerun_colours(map.colours(overlay.values, range));
    let shape = match overlay.positions {
        Some(positions) => meshes::shape(&draped.with_positions(positions.to_vec())),
        None => meshes::shape(draped),
    };
    recording.log(&path, &shape.with_vertex_colors(colours))?;
    Legend::new(overlay.name, overlay.unit, map, range, overlay.values).log(recording, legend, cell)
}

/// Logs an overlay of the fit, whose colour bar is in a column of its tab.
pub(super) fn log_fit(
    recording: &OpenRecording,
    draped: &TriMesh,
    overlay: &Overlay<'_>,
    column: usize,
) -> Result<(), RecordError> {
    let [branch, legend] = [paths::FIT, paths::FIT_LEGEND].map(|of| format!("{of}/{}", overlay.name));
    log_overlay(recording, &branch, draped, overlay, &legend, [column, 0])
}

/// The flat panels of a sewing pattern.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PatternView<'a> {
    /// Step of the timeline `table`.
    pub(crate) index: i64,
    /// The panels side by side, unsewn, m: x to the right and z up.
    pub(crate) flat: &'a TriMesh,
    /// The garment's vertex of each vertex of the panels.
    pub(crate) garment_vertex: &'a [u32],
    /// Values at the garment's vertices.
    pub(crate) overlays: &'a [Overlay<'a>],
}

/// Logs the panels in the colours of the last step: by PART, and by each overlay.
pub(super) fn log_pattern(recording: &OpenRecording, view: &PatternView<'_>) -> Result<(), RecordError> {
    let lists: Vec<(&str, usize)> = view.overlays.iter().map(|o| (o.name, o.values.len())).collect();
    recording.check_lengths(&lists)?;
    let vertices = [("the garment's vertices", view.garment_vertex.len())];
    RecordError::unless_per_vertex(view.flat.vertex_count(), &vertices)?;
    let Some(flat) = facing_the_eye(recording, view.flat) else { return Ok(()) };
    recording.at(view.index, 6);
    let part = |&v: &u32| recording.vertex_colour.get(v as usize).copied().unwrap_or(CLOTH);
    let parts: Vec<_> = view.garment_vertex.iter().map(part).collect();
    let cells = CellMesh::of_values(&flat, &parts);
    let panels = cells.shape().with_vertex_colors(rerun_colours(cells.of_vertices(&parts)));
    recording.log(&format!("{}/parts/panels", paths::PATTERN), &panels)?;
    let shape = meshes::whole(&flat);
    for overlay in view.overlays {
        let values: Vec<f64> = view.garment_vertex.iter().map(|&v| overlay.values[v as usize]).collect();
        let colours = ColourMap::ALARM.colours(&values, overlay.range(recording));
        let panels = shape.clone().with_vertex_colors(rerun_colours(colours));
        recording.log(&format!("{}/{}/panels", paths::PATTERN, overlay.name), &panels)?;
    }
    Ok(())
}

/// The panels at the garment's place, perpendicular to the view, as large as the view allows.
fn facing_the_eye(recording: &OpenRecording, flat: &TriMesh) -> Option<TriMesh> {
    let (low, high) = flat.bounds()?;
    let (middle, size) = (0.5 * (low + high), high - low);
    let eye = &recording.eye;
    let half = recording.layout().eye(Tab::Pattern, eye).half_seen();
    let scale = PANELS_FILL * (2.0 * half / size.z).min(2.0 * half * PANELS_ASPECT / size.x);
    let right = DVec3::Z.cross(eye.toward).normalize_or(DVec3::X);
    let up = eye.toward.cross(right);
    let place = |p: &DVec3| {
        let d = (*p - middle) * scale;
        eye.target + d.x * right + d.z * up
    };
    Some(flat.with_positions(flat.positions.iter().map(place).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::open_recording::RecordOptions;

    #[test]
    fn colours_are_comparable_from_step_to_step_and_a_small_error_is_pale() {
        let recording = OpenRecording::new(RecordOptions::default()).unwrap();
        let error = |values| Overlay { name: "error", unit: "mm", values, positions: None };
        let first = error(&[0.0, 40.0]).range(&recording);
        assert!(first.high >= 40.0);
        assert_eq!(error(&[0.0, 0.4]).range(&recording), first);
        assert!(error(&[0.0, 0.4]).own_range().high >= 10.0, "0.4 mm would be red");
    }

    #[test]
    fn exported_colours_differ_with_the_strain_and_a_small_strain_is_pale() {
        let colours = |values| Overlay { name: "strain", unit: "%", values, positions: None }.vertex_colours();
        let strain = colours(&[0.0, 2.0, 4.0, 40.0]);
        assert!(strain.windows(2).all(|two| two[0] != two[1]) && strain.iter().all(|c| c[3] == 255), "{strain:?}");
        let small = colours(&[0.0, 0.1, 0.0, 0.1]);
        assert!(small[1][0].abs_diff(small[0][0]) < 16, "{small:?}");
    }
}
