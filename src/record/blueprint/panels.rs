//! The tab of a sewing pattern's flat panels, beside the worn garment.

use super::super::eye::Eye;
use super::super::legend::visible;
use super::super::paths;
use super::Node;
use super::layout::{BARS_HEIGHT, Layout, Tab, capital};
use super::view::View;

impl Layout {
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
            views.push((1.0, View::spatial(format!("Worn: {}", capital(name)), &[paths::BODY, &path], eye).into()));
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
