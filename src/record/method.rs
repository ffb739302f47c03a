//! A reference method: what it made on its way, each in a view of its own, and the garment as it moves.

use rerun::{LineStrips3D, Radius, TextDocument};

use super::meshes::{self, rerun_colours, singles};
use super::overlay::overlay;
use super::step::series;
use super::{Open, Overlay, Panel, RecordError, colours, paths};
use crate::methods::Exhibit;
use glam::DVec3;

/// Thickness of lines on screen, points.
const THICKNESS: f32 = 1.3;

/// All that a reference method gives. Slices are per vertex of the garment.
#[derive(Debug, Clone, Copy)]
pub struct MethodView<'a> {
    /// What it made on its way, by the names that the layout lists.
    pub exhibits: &'a [(&'a str, Exhibit)],
    /// Draped vertices, m.
    pub draped: &'a [DVec3],
    /// The last step.
    pub steps: usize,
    /// The text panel.
    pub panel: &'a Panel,
    /// Strain and pressure.
    pub overlays: &'a [Overlay<'a>],
}

/// The garment after a step in time: RMS speed in m/s, and the mesh every so often.
pub(super) fn moment(
    open: &mut Open,
    step: i64,
    rms_speed: f64,
    positions: Option<&[DVec3]>,
) -> Result<(), RecordError> {
    open.at_iteration(step);
    open.last_iteration = Some(step);
    series(open, paths::SPEED, "RMS speed, cm/s", 0, 100.0 * rms_speed)?;
    open.garment_at(positions)
}

pub(super) fn log(open: &mut Open, view: &MethodView<'_>) -> Result<(), RecordError> {
    let lists: Vec<(&str, usize)> = view.overlays.iter().map(|o| (o.name, o.values.len())).collect();
    let draped = ("displaced positions", view.draped.len());
    RecordError::unless_per_vertex(open.garment.positions.len(), &[&lists[..], &[draped]].concat())?;
    for (number, (_, exhibit)) in view.exhibits.iter().enumerate() {
        let path = format!("{}/{number}", paths::METHOD);
        open.at(0, 3);
        match exhibit {
            Exhibit::Lines(lines) => open.log(&path, &drawn(lines))?,
            Exhibit::Surface(surface) => open.log(&path, &meshes::plain(surface, colours::DRAPED))?,
            Exhibit::Moving { mesh, frames } => {
                let hues = colours::palette();
                let mut shades = vec![colours::CLOTH; mesh.vertex_count()];
                for (triangle, group) in mesh.triangles.iter().zip(&mesh.triangle_group) {
                    triangle.iter().for_each(|&v| shades[v as usize] = hues[*group as usize % hues.len()]);
                }
                open.log(&path, &meshes::whole(mesh).with_vertex_colors(rerun_colours(shades)))?;
                for (step, positions) in frames {
                    open.at_iteration(i64::try_from(*step).unwrap_or(i64::MAX));
                    open.log(&path, &meshes::shape(&mesh.with_positions(positions.clone())))?;
                }
            }
        }
    }
    let last = i64::try_from(view.steps).unwrap_or(i64::MAX);
    open.at(0, 6);
    let draped = open.garment.with_positions(view.draped.to_vec());
    for (column, values) in view.overlays.iter().enumerate() {
        let [branch, legend] = [paths::FIT, paths::FIT_LEGEND].map(|of| format!("{of}/{}", values.name));
        overlay(open, &branch, &draped, values, (&legend, [column, 0]))?;
    }
    open.report = view.panel.markdown();
    open.log(paths::REPORT, &TextDocument::from_markdown(open.report.as_str()))?;
    open.last_iteration = Some(last);
    open.draped = Some(draped);
    Ok(())
}

/// Lines in the colours of what they belong to.
fn drawn(lines: &[(usize, Vec<DVec3>)]) -> LineStrips3D {
    let hues = colours::palette();
    let shades = lines.iter().map(|(of, _)| meshes::colour(hues[of % hues.len()]));
    LineStrips3D::new(lines.iter().map(|(_, line)| singles(line)).collect::<Vec<_>>())
        .with_colors(shades)
        .with_radii([Radius::new_ui_points(THICKNESS)])
}
