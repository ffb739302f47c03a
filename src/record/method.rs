//! A reference method: a view for each intermediate result, and the garment as it moves.

use glam::DVec3;
use rerun::{LineStrips3D, Radius};

use super::charts::log_scalar;
use super::error::RecordError;
use super::meshes::{self, rerun_colours, singles};
use super::open_recording::OpenRecording;
use super::overlay::log_fit;
use super::panel::Panel;
use super::paths;
use crate::mechanics::methods::Exhibit;
use crate::picture::colour::Overlay;
use crate::picture::colour::palette;

/// Thickness of lines on screen, points.
const THICKNESS: f32 = 1.3;

/// The result of a reference method. Slices have one value per vertex of the garment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MethodView<'a> {
    /// Intermediate results, in the order of the layout's names.
    pub(crate) exhibits: &'a [(&'a str, Exhibit)],
    /// Draped vertices, m.
    pub(crate) draped: &'a [DVec3],
    /// Number of the last time step.
    pub(crate) steps: usize,
    /// The text panel.
    pub(crate) panel: &'a Panel,
    /// Strain and pressure.
    pub(crate) overlays: &'a [Overlay<'a>],
}

/// Logs a time step: RMS speed of the vertices, m/s, and some of the meshes.
pub(super) fn log_time_step(
    recording: &mut OpenRecording,
    step: i64,
    rms_speed: f64,
    positions: Option<&[DVec3]>,
) -> Result<(), RecordError> {
    recording.at_iteration(step);
    recording.last_iteration = Some(step);
    log_scalar(recording, paths::SPEED, "RMS speed, cm/s", 0, 100.0 * rms_speed)?;
    recording.log_positions(positions)
}

/// Logs the intermediate results and the drape.
pub(super) fn log(recording: &mut OpenRecording, view: &MethodView<'_>) -> Result<(), RecordError> {
    let overlays = view.overlays.iter().map(|overlay| (overlay.name, overlay.values.len()));
    let draped = ("displaced positions", view.draped.len());
    recording.check_lengths(&overlays.chain([draped]).collect::<Vec<_>>())?;
    let palette = palette::palette();
    let hue = |group: usize| palette[group % palette.len()];
    for (number, (_, exhibit)) in view.exhibits.iter().enumerate() {
        let path = format!("{}/{number}", paths::METHOD);
        recording.at(0, 3);
        match exhibit {
            Exhibit::Lines(lines) => {
                let strips = LineStrips3D::new(lines.iter().map(|(_, line)| singles(line)).collect::<Vec<_>>())
                    .with_colors(rerun_colours(lines.iter().map(|(group, _)| hue(*group))))
                    .with_radii([Radius::new_ui_points(THICKNESS)]);
                recording.log(&path, &strips)?;
            }
            Exhibit::Surface(surface) => recording.log(&path, &meshes::plain(surface, palette::DRAPED))?,
            Exhibit::Moving { mesh, frames } => {
                let mut of_vertices = vec![palette::CLOTH; mesh.vertex_count()];
                for (triangle, group) in mesh.triangles.iter().zip(&mesh.triangle_group) {
                    triangle.iter().for_each(|&v| of_vertices[v as usize] = hue(*group as usize));
                }
                recording.log(&path, &meshes::whole(mesh).with_vertex_colors(rerun_colours(of_vertices)))?;
                for (step, positions) in frames {
                    recording.at_iteration(i64::try_from(*step).unwrap_or(i64::MAX));
                    recording.log(&path, &meshes::shape(&mesh.with_positions(positions.clone())))?;
                }
            }
        }
    }
    recording.at(0, 6);
    let draped = recording.garment.with_positions(view.draped.to_vec());
    for (column, overlay) in view.overlays.iter().enumerate() {
        log_fit(recording, &draped, overlay, column)?;
    }
    recording.log_report(view.panel.markdown())?;
    recording.last_iteration = Some(i64::try_from(view.steps).unwrap_or(i64::MAX));
    recording.draped = Some(draped);
    Ok(())
}
