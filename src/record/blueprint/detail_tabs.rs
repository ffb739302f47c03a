//! Further tabs of one drape: its wrinkles, the solver's way to it, a sewing pattern's flat panels beside the worn garment; and the tab of a
//! reference method: what it is given, what it makes on its way, and the garment as it moves.

use super::super::eye::Eye;
use super::super::legend::visible;
use super::super::paths;
use super::Node;
use super::layout::{ASPECT, BARS_HEIGHT, Layout, Tab, capital, over};
use super::view::{View, on_the_body};

/// Share of the tab's height that the speed takes.
const SPEED_HEIGHT: f32 = 0.22;
/// Width of the text panel over that of a view.
const REPORT_OVER_VIEW: f32 = 1.0;

pub(super) fn wrinkles(eye: &Eye) -> Node {
    let views = vec![
        on_the_body("PARTs' displacements differ", paths::SEAMS, eye),
        on_the_body("Mean curvature", paths::CURVATURE, eye),
    ];
    over("Wrinkles", views, "Colours", paths::WRINKLES_LEGEND, 2)
}

pub(super) fn solver(eye: &Eye) -> Node {
    let plots = vec![
        (1.0, View::plot("Energy, J", &[paths::ENERGY], true).into()),
        (1.0, View::plot("Residual over weight, log10", &[paths::RESIDUAL_LOG10], true).into()),
    ];
    Node::Row("Solver", vec![on_the_body("Drape", "/drape", eye), (2.0, Node::Column("Solver", plots))])
}

impl Layout {
    /// The garment as placed, the exhibits, the garment on its way; speed below, report beside.
    pub(super) fn of_method(&self, exhibits: &[String], eye: &Eye) -> Node {
        let count = 2 + exhibits.len();
        let width = ASPECT * count as f64 / (count as f64 + f64::from(REPORT_OVER_VIEW));
        let eye = &eye.through(width / count as f64 / f64::from(1.0 - SPEED_HEIGHT));
        let mut views = vec![on_the_body("As placed", paths::GARMENT, eye)];
        for (number, name) in exhibits.iter().enumerate() {
            views.push(on_the_body(capital(name), &format!("{}/{number}", paths::METHOD), eye));
        }
        views.push(on_the_body("Drape", "/drape", eye));
        let speed = View::plot("RMS speed of the vertices, cm/s", &[paths::SPEED], false).into();
        let left =
            Node::Column("Method", vec![(1.0 - SPEED_HEIGHT, Node::Row("Method", views)), (SPEED_HEIGHT, speed)]);
        let report = View::text("Report", paths::REPORT).into();
        Node::Row("Method", vec![(count as f32, left), (REPORT_OVER_VIEW, report)])
    }

    /// Two rows of two, so that each view is as wide as panels on a table are.
    pub(super) fn panels(&self, eye: &Eye) -> Node {
        let eye = &self.eye(Tab::Pattern, eye);
        let flat = |name: &str| {
            let path = format!("{}/{name}", paths::PATTERN);
            let name = if name == "parts" { "PARTs".to_owned() } else { capital(name) };
            (1.0, View::spatial(format!("Flat: {name}"), &[&path], eye).into())
        };
        let mut views: Vec<(f32, Node)> = vec![flat("parts")];
        let of_fit = || self.fit.iter().filter(|name| ["strain", "pressure"].contains(&name.as_str()));
        views.extend(of_fit().map(|name| flat(name)));
        if let Some(name) = of_fit().next() {
            let path = format!("{}/{name}", paths::FIT);
            views.push(on_the_body(format!("Worn: {}", capital(name)), &path, eye));
        }
        let below = views.split_off(views.len().div_ceil(2));
        let rows = [views, below].into_iter().filter(|row| !row.is_empty());
        let mut rows: Vec<(f32, Node)> = rows.map(|row| (1.0, Node::Row("Pattern", row))).collect();
        if !self.fit.is_empty() {
            // The colours are those of the fit, and so are their bars.
            let bars = View::plane("Colours", &[paths::FIT_LEGEND], visible([self.fit.len(), 1])).into();
            rows.push((rows.len() as f32 * BARS_HEIGHT, bars));
        }
        Node::Column("Pattern", rows)
    }
}
