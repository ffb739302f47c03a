//! Panels beside each other on a table, as a pattern is looked at: upright, in rows, none over another.

use glam::DVec2;

use super::SewingPattern;

/// Between two panels, m.
const GAP: f64 = 0.04;

/// Width over height of the picture that the panels are to fill.
const ASPECT: f64 = 1.8;

/// Panels that a row is tried to begin with, and to hold.
const TRIED: usize = 48;

/// What to add to the points of each panel, m; the lower left corner of all comes to the origin.
#[must_use]
pub fn laid_out(pattern: &SewingPattern) -> Vec<DVec2> {
    let boxes: Vec<[DVec2; 2]> = pattern.panels.iter().map(|panel| box_about(panel.points())).collect();
    let sizes: Vec<DVec2> = boxes.iter().map(|[low, high]| high - low).collect();
    // Rows as wide as some of the panels beside each other; what is then largest in a picture of this shape.
    let sums = |first: usize| {
        sizes[first..].iter().scan(-GAP, |sum, size| {
            *sum += size.x + GAP;
            Some(*sum)
        })
    };
    let shown = |rows: &Rows| (ASPECT / rows.size.x).min(1.0 / rows.size.y);
    // A file may have thousands.
    let candidates =
        (0..sizes.len().min(TRIED)).flat_map(|first| sums(first).take(TRIED)).map(|width| in_rows(&sizes, width));
    let Some(Rows { corners, size: DVec2 { y: height, .. } }) =
        candidates.reduce(|best, other| if shown(&other) > shown(&best) { other } else { best })
    else {
        return Vec::new();
    };
    let mut offsets: Vec<DVec2> = corners.iter().zip(&boxes).map(|(corner, [low, _])| corner - low).collect();
    // The first row on top.
    for ((offset, [low, _]), size) in offsets.iter_mut().zip(&boxes).zip(&sizes) {
        let y = offset.y + low.y;
        offset.y = height - y - size.y - low.y;
    }
    offsets
}

/// Lower and upper corner of the box about some points, m.
pub(super) fn box_about(points: impl IntoIterator<Item = DVec2>) -> [DVec2; 2] {
    let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    points.into_iter().fold(none, |[low, high], p| [low.min(p), high.max(p)])
}

/// Boxes one after the other in rows, the first row at 0.
struct Rows {
    /// Lower left corner of each.
    corners: Vec<DVec2>,
    /// Size of all together.
    size: DVec2,
}

/// Boxes in rows at most `width` wide, but for a single one that is wider.
fn in_rows(sizes: &[DVec2], width: f64) -> Rows {
    let (mut cursor, mut row, mut widest) = (DVec2::ZERO, 0.0_f64, 0.0_f64);
    let mut place = |size: &DVec2| {
        if cursor.x > 0.0 && cursor.x + size.x > width * (1.0 + 1e-9) {
            cursor = DVec2::new(0.0, cursor.y + row + GAP);
            row = 0.0;
        }
        let corner = cursor;
        cursor.x += size.x + GAP;
        (row, widest) = (row.max(size.y), widest.max(corner.x + size.x));
        corner
    };
    let corners = sizes.iter().map(&mut place).collect();
    Rows { corners, size: DVec2::new(widest, cursor.y + row) }
}
