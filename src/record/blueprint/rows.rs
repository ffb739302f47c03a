//! Views of one kind in one row or two.

use super::super::eye::Eye;
use super::Node;

/// Height of a view's title bar over that of a tab, in a window of 1280 × 800.
const TITLE_HEIGHT: f64 = 0.036;

/// In how many rows, one or two, so many views of the same share a place of this width and height (of a tab's height) so that what `eye`
/// is on is largest; and width over height of a view.
pub(super) fn grid(eye: &Eye, count: usize, [width, height]: [f64; 2]) -> (usize, f64) {
    let scale = |rows: usize| {
        let [w, h] = view_of(count, rows, [width, height]);
        (w / eye.half_width.max(1e-9)).min(h / eye.half_height.max(1e-9))
    };
    let rows = if scale(2) > scale(1) { 2 } else { 1 };
    let [w, h] = view_of(count, rows, [width, height]);
    (rows, w / h)
}

/// Width and height of one of so many views in so many rows.
pub(super) fn view_of(count: usize, rows: usize, [width, height]: [f64; 2]) -> [f64; 2] {
    [width / count.div_ceil(rows) as f64, height / rows as f64 - TITLE_HEIGHT]
}

/// These views in so many rows.
pub(super) fn in_rows(name: &'static str, mut views: Vec<(f32, Node)>, rows: usize) -> Node {
    if rows == 1 {
        return Node::Row(name, views);
    }
    let lower = views.split_off(views.len().div_ceil(2));
    Node::Column(name, vec![(1.0, Node::Row(name, views)), (1.0, Node::Row(name, lower))])
}
