//! Panels beside each other on a table, as a pattern is looked at: upright, in rows, none over another.

use glam::DVec2;

use super::SewingPattern;

/// Between two panels, m.
const GAP: f64 = 0.04;

/// Rows are as wide as makes the whole about this much wider than high.
const ASPECT: f64 = 1.5;

/// What to add to the points of each panel, m; the lower left corner of all comes to the origin.
#[must_use]
pub fn laid_out(pattern: &SewingPattern) -> Vec<DVec2> {
    let boxes: Vec<[DVec2; 2]> = pattern
        .panels
        .iter()
        .map(|panel| {
            let points = panel.edges.iter().flat_map(|e| e.curve.divided(16));
            points.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
        })
        .collect();
    let sizes: Vec<DVec2> = boxes.iter().map(|[low, high]| high - low).collect();
    let area: f64 = sizes.iter().map(|s| (s.x + GAP) * (s.y + GAP)).sum();
    let widest = sizes.iter().fold(0.0, |w: f64, s| w.max(s.x));
    let width = (ASPECT * area).sqrt().max(widest);
    let mut offsets = vec![DVec2::ZERO; boxes.len()];
    let (mut cursor, mut row) = (DVec2::ZERO, 0.0_f64);
    for (i, size) in sizes.iter().enumerate() {
        if cursor.x > 0.0 && cursor.x + size.x > width {
            cursor = DVec2::new(0.0, cursor.y + row + GAP);
            row = 0.0;
        }
        offsets[i] = cursor - boxes[i][0];
        cursor.x += size.x + GAP;
        row = row.max(size.y);
    }
    // The first row on top.
    let height = cursor.y + row;
    for ((offset, [low, _]), size) in offsets.iter_mut().zip(&boxes).zip(&sizes) {
        let y = offset.y + low.y;
        offset.y = height - y - size.y - low.y;
    }
    offsets
}
