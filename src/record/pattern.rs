//! The flat pattern beside the drape: the same colours on the panels as they were cut.

use glam::DVec3;

use super::blueprint::layout::Tab;
use super::colour_map::ColourMap;
use super::meshes::{self, CellMesh};
use super::overlay::scale;
use super::{Open, Overlay, RecordError, colours, paths};
use crate::mesh::TriMesh;

/// Share of the height in a view that the panels take.
const FILLED: f64 = 0.95;
/// Width over height of the views: see the layout.
pub(super) const ASPECT: f64 = 1.8;

/// Panels and what is shown on them.
#[derive(Debug, Clone, Copy)]
pub struct PatternView<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// The panels beside each other, unsewn, m: x to the right and z up.
    pub flat: &'a TriMesh,
    /// The garment's vertex that each vertex of theirs is.
    pub garment_vertex: &'a [u32],
    /// Values of the garment's vertices.
    pub overlays: &'a [Overlay<'a>],
}

pub(super) fn log(open: &Open, view: &PatternView<'_>) -> Result<(), RecordError> {
    let n = open.garment.positions.len();
    let lists: Vec<(&str, usize)> = view.overlays.iter().map(|o| (o.name, o.values.len())).collect();
    RecordError::unless_per_vertex(n, &lists)?;
    RecordError::unless_per_vertex(view.flat.vertex_count(), &[("the garment's vertices", view.garment_vertex.len())])?;
    let Some(flat) = facing_the_eye(open, view.flat) else { return Ok(()) };
    let of = |v: u32| view.garment_vertex[v as usize] as usize;
    open.at(view.index, 6);
    let cells = CellMesh::new(&flat);
    let part = |v: u32| open.vertex_colour.get(of(v)).copied().unwrap_or(colours::CLOTH);
    let shown = cells.shape().with_vertex_colors(meshes::rerun_colours(cells.of_vertices(part)));
    open.log(&format!("{}/parts/panels", paths::PATTERN), &shown)?;
    let shape = meshes::whole(&flat);
    for overlay in view.overlays {
        let values: Vec<f64> = view.garment_vertex.iter().map(|&v| overlay.values[v as usize]).collect();
        let map = ColourMap::ALARM;
        let range = scale(open, overlay);
        let shown = shape.clone().with_vertex_colors(meshes::rerun_colours(map.colours(&values, range)));
        open.log(&format!("{}/{}/panels", paths::PATTERN, overlay.name), &shown)?;
    }
    Ok(())
}

/// The panels where the garment is, as large as a view lets them be, and square to the eye.
fn facing_the_eye(open: &Open, flat: &TriMesh) -> Option<TriMesh> {
    let (low, high) = flat.bounds()?;
    let (middle, size) = (0.5 * (low + high), high - low);
    let half = open.layout().eye(Tab::Pattern, &open.eye).half_seen();
    let scale = FILLED * (2.0 * half / size.z).min(2.0 * half * ASPECT / size.x);
    let toward = open.eye.toward;
    let right = DVec3::Z.cross(toward).normalize_or(DVec3::X);
    let up = toward.cross(right);
    let place = |p: &DVec3| {
        let d = (*p - middle) * scale;
        open.eye.target + d.x * right + d.z * up
    };
    Some(flat.with_positions(flat.positions.iter().map(place).collect()))
}
