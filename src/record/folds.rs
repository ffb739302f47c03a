//! Folds finer than a PART: lines along them on the draped garment, as long as there is cloth to fold away.
//!
//! The colours are the overlay's of the same name; a line is drawn at every so many vertices, across the direction in which
//! the cloth is too long.

use glam::DVec3;
use rerun::{Color, LineStrips3D, Radius};

use super::meshes::single;
use super::{Open, RecordError, paths};

/// Length of a line per share of excess length, m: a fifth too much cloth gives two centimetres.
const LENGTH_M: f64 = 0.1;
/// Longest line, m.
const LONGEST_M: f64 = 0.03;
/// Lines lie this far above the cloth, m.
const ABOVE_M: f64 = 0.002;
/// Thickness on screen, points.
const THICKNESS: f32 = 1.2;
/// As many lines as can be told apart.
const MOST: usize = 700;
/// Less excess than this, percent, is strain and no fold.
const LEAST_PERCENT: f64 = 2.0;

/// What is too long, and which way.
#[derive(Debug, Clone, Copy)]
pub struct FoldView<'a> {
    /// Step of the timeline `table` it belongs to.
    pub index: i64,
    /// Displaced vertices, m.
    pub draped: &'a [DVec3],
    /// Excess length of each vertex, percent.
    pub excess_percent: &'a [f64],
    /// Unit direction across the folds at each vertex.
    pub across: &'a [DVec3],
}

pub(super) fn log(open: &Open, view: &FoldView<'_>) -> Result<(), RecordError> {
    let expected = open.garment.positions.len();
    let lists = [
        ("displaced positions", view.draped.len()),
        ("excess lengths", view.excess_percent.len()),
        ("directions of folds", view.across.len()),
    ];
    RecordError::unless_per_vertex(expected, &lists)?;
    open.at(view.index, 6);
    let normals = open.garment.with_positions(view.draped.to_vec()).vertex_normals();
    let every = expected.div_ceil(MOST).max(1);
    let folded = (0..expected).step_by(every).filter(|&v| view.excess_percent[v] > LEAST_PERCENT);
    let lines = folded.map(|v| {
        let along = normals[v].cross(view.across[v]).normalize_or_zero();
        let half = 0.5 * (LENGTH_M * view.excess_percent[v] / 100.0).min(LONGEST_M) * along;
        let middle = view.draped[v] + ABOVE_M * normals[v];
        vec![single(middle - half), single(middle + half)]
    });
    let lines = LineStrips3D::new(lines.collect::<Vec<_>>())
        .with_colors([Color::from_rgb(40, 40, 48)])
        .with_radii([Radius::new_ui_points(THICKNESS)]);
    open.log(&format!("{}/folds/lines", paths::FIT), &lines)
}
