//! The tab of a reference method: what it is given, what it makes on its way, and the garment as it moves.

use super::super::eye::Eye;
use super::super::paths;
use super::Node;
use super::layout::{ASPECT, Layout, capital};
use super::view::View;

/// Share of the tab's height that the speed takes.
const SPEED_HEIGHT: f32 = 0.22;
/// Width of the text panel over that of a view.
const REPORT_OVER_VIEW: f32 = 1.0;

impl Layout {
    /// The garment as placed, the exhibits, the garment on its way; speed below, report beside.
    pub(super) fn of_method(&self, exhibits: &[String], eye: &Eye) -> Node {
        let count = 2 + exhibits.len();
        let width = ASPECT * count as f64 / (count as f64 + f64::from(REPORT_OVER_VIEW));
        let eye = &eye.through(width / count as f64 / f64::from(1.0 - SPEED_HEIGHT));
        let seen = |name: String, path: &str| (1.0, View::spatial(name, &[paths::BODY, path], eye).into());
        let mut views = vec![seen("As placed".to_owned(), paths::GARMENT)];
        for (number, name) in exhibits.iter().enumerate() {
            views.push(seen(capital(name), &format!("{}/{number}", paths::METHOD)));
        }
        views.push(seen("Drape".to_owned(), "/drape"));
        let speed = View::plot("RMS speed of the vertices, cm/s", &[paths::SPEED], false).into();
        let left =
            Node::Column("Method", vec![(1.0 - SPEED_HEIGHT, Node::Row("Method", views)), (SPEED_HEIGHT, speed)]);
        let report = View::text("Report", paths::REPORT).into();
        Node::Row("Method", vec![(count as f32, left), (REPORT_OVER_VIEW, report)])
    }
}
