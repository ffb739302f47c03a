//! What stands side by side: chosen tables, or ways to drape; and the plots of the latter.

use super::super::eye::Eye;
use super::super::legend::visible;
use super::super::paths;
use super::super::scatter::VISIBLE;
use super::Node;
use super::layout::{ASPECT, BARS_HEIGHT, Layout, Tab};
use super::rows::{grid, in_rows, view_of};
use super::view::{View, on_the_body};

/// Time over error, and over vertices.
pub(super) fn numbers() -> Node {
    let picture = |name: &str, path: &str| (1.0, View::plane(name, &[path], VISIBLE).into());
    let pictures = vec![
        picture("Time against error", paths::SCATTER),
        picture("Vertices against time, in the colours above", paths::GROWTH),
    ];
    Node::Column("Numbers", pictures)
}

impl Layout {
    /// The chosen, each with a line of text at its place below all; ways to drape say it in their titles, and have a bar of colours there.
    pub(super) fn side_by_side(&self, eye: &Eye) -> Node {
        let (rows, _) = self.compare_grid(eye);
        let cells = self.captions(eye);
        let eye = &self.eye(Tab::SideBySide, eye);
        let view =
            |(slot, title): (usize, &String)| on_the_body(title.clone(), &format!("{}/{slot}", paths::COMPARE), eye);
        let views = in_rows("Side by side", self.compare.iter().enumerate().map(view).collect(), rows);
        let name = if self.table4 { "Colours: distance to the canonical drape" } else { "What they cost" };
        let below = View::plane(name, &[paths::COMPARE_CAPTIONS], visible(cells)).into();
        let height = BARS_HEIGHT * cells[1] as f32;
        Node::Column("Side by side", vec![(1.0 - height, views), (height, below)])
    }

    /// In how many rows they stand, and width over height of a view.
    pub(super) fn compare_grid(&self, eye: &Eye) -> (usize, f64) {
        let below = |lines: usize| [ASPECT, 1.0 - f64::from(BARS_HEIGHT) * lines as f64];
        let (rows, aspect) = grid(eye, self.compare.len(), below(1));
        if rows == 1 || self.table4 {
            return (rows, aspect);
        }
        let [w, h] = view_of(self.compare.len(), rows, below(rows));
        (rows, w / h)
    }

    /// Columns and rows of the drawing below.
    pub(crate) fn captions(&self, eye: &Eye) -> [usize; 2] {
        let (rows, _) = self.compare_grid(eye);
        [self.compare.len().div_ceil(rows), if self.table4 { 1 } else { rows }]
    }
}
