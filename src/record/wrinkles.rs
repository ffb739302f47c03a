//! Both readings of the folds side by side: the jump of the displacement at the PARTs' seams, and the mean curvature.
//!
//! A seam runs between vertices: through the middles of the edges that join its two PARTs and the centroids of the triangles
//! beside them, where the PARTs' colours meet.

use glam::DVec3;
use rerun::{LineStrips3D, Radius};

use super::colour_map::ColourMap;
use super::legend::Legend;
use super::meshes::{self, single};
use super::overlay::{QUANTILE, overlay};
use super::{Open, Overlay, Range, RecordError, colours, paths};
use crate::mesh::TriMesh;

/// The seams lie this far above the cloth, m: in it they would be half hidden.
const ABOVE_M: f64 = 0.002;
/// Thickness of a seam on screen, points.
const THICKNESS: f32 = 1.6;

/// What the paper reads as wrinkles, and what a fold is.
#[derive(Debug, Clone, Copy)]
pub struct WrinkleView<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// Edges of the garment that join two PARTs, as their vertices, and how far the two PARTs' displacements differ, mm.
    pub jumps_mm: &'a [([u32; 2], f64)],
    /// Mean curvature of each vertex, 1/m.
    pub curvature_per_m: &'a [f64],
}

pub(super) fn log(open: &Open, view: &WrinkleView<'_>) -> Result<(), RecordError> {
    let lists = [("displaced positions", view.draped.len()), ("curvatures", view.curvature_per_m.len())];
    RecordError::unless_per_vertex(open.garment.positions.len(), &lists)?;
    let draped = open.garment.with_positions(view.draped.to_vec());
    open.at(view.index, 6);
    let curvature = Overlay { name: "curvature", unit: "1/m", values: view.curvature_per_m };
    let legend = |name: &str| format!("{}/{name}", paths::WRINKLES_LEGEND);
    overlay(open, paths::CURVATURE, &draped, &curvature, (&legend("curvature"), [1, 0]))?;

    let path = format!("{}/garment", paths::SEAMS);
    open.log_mesh(&path, &meshes::plain(&draped, colours::BODY))?;
    let values: Vec<f64> = view.jumps_mm.iter().map(|(_, jump)| *jump).collect();
    let range = open.scale("seams", || Range::to_quantile(values.iter().copied(), QUANTILE));
    let map = ColourMap::FORCE;
    let lines = LineStrips3D::new(borders(&draped, view.jumps_mm))
        .with_colors(meshes::rerun_colours(map.colours(&values, range)))
        .with_radii([Radius::new_ui_points(THICKNESS)]);
    open.log(&format!("{}/lines", paths::SEAMS), &lines)?;
    let open_end = values.iter().any(|&v| v > range.high);
    let bar = Legend { title: "PART jump", unit: "mm", map, range, open_end };
    bar.log(open, &legend("seams"), [0, 0])
}

/// For each joining edge the piece of the seam that crosses it.
fn borders(draped: &TriMesh, joining: &[([u32; 2], f64)]) -> Vec<Vec<[f32; 3]>> {
    let normals = draped.vertex_normals();
    let raised: Vec<DVec3> = draped.positions.iter().zip(&normals).map(|(x, n)| *x + ABOVE_M * *n).collect();
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut order: Vec<([u32; 2], usize)> =
        joining.iter().enumerate().map(|(i, ([a, b], _))| (ordered(*a, *b), i)).collect();
    order.sort_unstable();
    let middle = |[a, b]: [u32; 2]| single(0.5 * (raised[a as usize] + raised[b as usize]));
    let mut pieces: Vec<Vec<[f32; 3]>> = joining.iter().map(|(edge, _)| vec![middle(*edge)]).collect();
    for &[a, b, c] in &draped.triangles {
        let centroid = single([a, b, c].iter().map(|&v| raised[v as usize]).sum::<DVec3>() / 3.0);
        for edge in [ordered(a, b), ordered(b, c), ordered(c, a)] {
            let Ok(found) = order.binary_search_by_key(&edge, |entry| entry.0) else { continue };
            let piece = &mut pieces[order[found].1];
            // From one triangle's centroid over the middle to the other's.
            if piece.len() == 1 {
                piece.insert(0, centroid);
            } else {
                piece.push(centroid);
            }
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seam_runs_between_its_two_parts() {
        // Two triangles side by side; vertices 0 and 3 are of another PART than 1 and 2.
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y], vec![[0, 1, 2], [0, 2, 3]]);
        let pieces = borders(&mesh, &[([0, 1], 1.0), ([2, 0], 1.0), ([2, 3], 1.0)]);
        assert_eq!(pieces.iter().map(Vec::len).collect::<Vec<_>>(), [2, 3, 2]);
        // The outer pieces meet the inner one at the centroids, and the middle of the diagonal lies in between.
        assert_eq!((pieces[1][0], pieces[1][2]), (pieces[0][0], pieces[2][0]));
        assert_eq!(pieces[1][1], [0.5, 0.5, ABOVE_M as f32]);
    }
}
