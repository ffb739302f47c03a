//! Wrinkles: the jump of the displacement at the PARTs' seams beside the mean curvature, and the directions of folds that are
//! narrower than a PART.
//!
//! A seam runs between vertices: through the midpoints of the edges that join its two PARTs and the centroids of the adjacent
//! triangles, where the PARTs' colours meet.

use glam::DVec3;
use rerun::{Color, LineStrips3D, Radius};

use super::error::RecordError;
use super::legend::Legend;
use super::meshes::{self, single};
use super::open_recording::OpenRecording;
use super::overlay::log_overlay;
use super::paths;
use crate::mesh::TriMesh;
use crate::picture::colour::map::{ColourMap, Range};
use crate::picture::colour::palette;
use crate::picture::colour::{Overlay, QUANTILE};

/// Height of the lines above the cloth, m: lines in the cloth would be half hidden.
const ABOVE_M: f64 = 0.002;
/// Thickness of a seam on screen, points.
const SEAM_THICKNESS: f32 = 1.6;
/// Thickness of a fold line on screen, points.
const FOLD_THICKNESS: f32 = 1.2;
/// Length of a fold line over the relative excess length, m: an excess of a fifth gives two centimetres.
const LENGTH_M: f64 = 0.1;
/// Longest fold line, m.
const MAX_LENGTH_M: f64 = 0.03;
/// More lines than this are hard to distinguish; a heuristic.
const MAX_LINES: usize = 700;
/// Least excess length of a fold, percent; less is strain.
const MIN_EXCESS_PERCENT: f64 = 2.0;

/// Both measures of wrinkles: the paper's, and the curvature of the drape.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WrinkleView<'a> {
    /// Step of the timeline `table`.
    pub(crate) index: i64,
    /// Draped vertices, m.
    pub(crate) draped: &'a [DVec3],
    /// Edges that join two PARTs, as vertices, with the difference of the PARTs' displacements, mm.
    pub(crate) jumps_mm: &'a [([u32; 2], f64)],
    /// Mean curvature at each vertex, 1/m.
    pub(crate) curvature_per_m: &'a [f64],
}

/// Logs both measures of wrinkles.
pub(super) fn log(recording: &OpenRecording, view: &WrinkleView<'_>) -> Result<(), RecordError> {
    let lists = [("displaced positions", view.draped.len()), ("curvatures", view.curvature_per_m.len())];
    recording.check_lengths(&lists)?;
    let draped = recording.garment.with_positions(view.draped.to_vec());
    recording.at(view.index, 6);
    let curvature = Overlay { name: "curvature", unit: "1/m", values: view.curvature_per_m, positions: None };
    let legend = |name: &str| format!("{}/{name}", paths::WRINKLES_LEGEND);
    log_overlay(recording, paths::CURVATURE, &draped, &curvature, &legend("curvature"), [1, 0])?;

    let path = format!("{}/garment", paths::SEAMS);
    recording.log_mesh(&path, &meshes::plain(&draped, palette::BODY))?;
    let values: Vec<f64> = view.jumps_mm.iter().map(|(_, jump)| *jump).collect();
    let range = recording.range("seams", || Range::to_quantile(values.iter().copied(), QUANTILE));
    let map = ColourMap::FORCE;
    let lines = LineStrips3D::new(seam_lines(&draped, view.jumps_mm))
        .with_colors(meshes::rerun_colours(map.colours(&values, range)))
        .with_radii([Radius::new_ui_points(SEAM_THICKNESS)]);
    recording.log(&format!("{}/lines", paths::SEAMS), &lines)?;
    Legend::new("PART jump", "mm", map, range, &values).log(recording, &legend("seams"), [0, 0])
}

/// For each joining edge the section of the seam that crosses it: from one adjacent triangle's centroid through the edge's
/// midpoint to the other's.
fn seam_lines(draped: &TriMesh, joining: &[([u32; 2], f64)]) -> Vec<Vec<[f32; 3]>> {
    let normals = draped.vertex_normals();
    let raised: Vec<DVec3> = draped.positions.iter().zip(&normals).map(|(x, n)| *x + ABOVE_M * *n).collect();
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut order: Vec<([u32; 2], usize)> =
        joining.iter().enumerate().map(|(i, ([a, b], _))| (ordered(*a, *b), i)).collect();
    order.sort_unstable();
    let midpoint = |[a, b]: [u32; 2]| single(0.5 * (raised[a as usize] + raised[b as usize]));
    let mut lines: Vec<Vec<[f32; 3]>> = joining.iter().map(|(edge, _)| vec![midpoint(*edge)]).collect();
    for &[a, b, c] in &draped.triangles {
        let centroid = single([a, b, c].iter().map(|&v| raised[v as usize]).sum::<DVec3>() / 3.0);
        for edge in [ordered(a, b), ordered(b, c), ordered(c, a)] {
            let Ok(found) = order.binary_search_by_key(&edge, |entry| entry.0) else { continue };
            let line = &mut lines[order[found].1];
            if line.len() == 1 {
                line.insert(0, centroid);
            } else {
                line.push(centroid);
            }
        }
    }
    lines
}

/// Folds narrower than a PART. Their excess length is also an overlay, `folds`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FoldView<'a> {
    /// Step of the timeline `table`.
    pub(crate) index: i64,
    /// Draped vertices, m.
    pub(crate) draped: &'a [DVec3],
    /// Excess length at each vertex, percent.
    pub(crate) excess_percent: &'a [f64],
    /// Unit direction across the folds at each vertex.
    pub(crate) across: &'a [DVec3],
}

/// Logs a line along the fold at some of the vertices, longer for a larger excess.
pub(super) fn log_folds(recording: &OpenRecording, view: &FoldView<'_>) -> Result<(), RecordError> {
    let lists = [
        ("displaced positions", view.draped.len()),
        ("excess lengths", view.excess_percent.len()),
        ("directions of folds", view.across.len()),
    ];
    recording.check_lengths(&lists)?;
    recording.at(view.index, 6);
    let vertices = view.draped.len();
    let normals = recording.garment.with_positions(view.draped.to_vec()).vertex_normals();
    let stride = vertices.div_ceil(MAX_LINES).max(1);
    let folded = (0..vertices).step_by(stride).filter(|&v| view.excess_percent[v] > MIN_EXCESS_PERCENT);
    let lines = folded.map(|v| {
        let along = normals[v].cross(view.across[v]).normalize_or_zero();
        let half = 0.5 * (LENGTH_M * view.excess_percent[v] / 100.0).min(MAX_LENGTH_M) * along;
        let middle = view.draped[v] + ABOVE_M * normals[v];
        vec![single(middle - half), single(middle + half)]
    });
    let lines = LineStrips3D::new(lines.collect::<Vec<_>>())
        .with_colors([Color::from_rgb(40, 40, 48)])
        .with_radii([Radius::new_ui_points(FOLD_THICKNESS)]);
    recording.log(&format!("{}/folds/lines", paths::FIT), &lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seam_runs_between_its_two_parts() {
        // Two triangles; vertices 0 and 3 belong to another PART than 1 and 2.
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y], vec![[0, 1, 2], [0, 2, 3]]);
        let lines = seam_lines(&mesh, &[([0, 1], 1.0), ([2, 0], 1.0), ([2, 3], 1.0)]);
        assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [2, 3, 2]);
        // The outer sections meet the inner one at the centroids, and the midpoint of the diagonal lies in between.
        assert_eq!((lines[1][0], lines[1][2]), (lines[0][0], lines[2][0]));
        assert_eq!(lines[1][1], [0.5, 0.5, ABOVE_M as f32]);
    }
}
