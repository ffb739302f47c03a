//! The views of each tab of a recording.
//!
//! The first tab has the stages side by side, levels and colour bars below them, and the report beside both.

use super::blueprint::{Node, TimePanel, View};
use super::eye::Eye;
use super::layout::{ASPECT, BARS_HEIGHT, Layout, REPORT_OVER_STAGE, STAGE_HEIGHT, Tab};
use super::legend::{visible, visible_captions};
use super::paths;
use super::scatter::VISIBLE;
use super::step::layer_branch;
use crate::scene::Layer;

/// Share of a method's tab for the plot of its speed.
const SPEED_HEIGHT: f32 = 0.22;
/// Shares of an outfit's tab: its garments, all of them together, the report.
const OUTFIT_SHARES: [f32; 3] = [1.0, 0.75, 0.55];

/// The time panel of a recording.
pub(super) fn time_panel(layout: &Layout) -> TimePanel {
    // A cursor that follows stands at the last iteration, the result.
    let timeline = if layout.iterations { paths::ITERATION } else { paths::TABLE };
    TimePanel { timeline, follow: layout.follow || layout.iterations }
}

/// All tabs of a recording, seen from `eye`.
pub(super) fn root(layout: &Layout, eye: &Eye) -> Node {
    Tabs { layout, eye }.root()
}

struct Tabs<'a> {
    layout: &'a Layout,
    eye: &'a Eye,
}

impl Tabs<'_> {
    fn root(&self) -> Node {
        let layout = self.layout;
        if layout.table4 {
            return Node::Tabs(0, vec![self.side_by_side(), table4_plots()]);
        }
        let first = layout.method.as_ref().map_or_else(|| self.stages(), |exhibits| self.method(exhibits));
        let further: [(Tab, bool, &dyn Fn() -> Node); 7] = [
            (Tab::SideBySide, !layout.compare.is_empty(), &|| self.side_by_side()),
            (Tab::Numbers, layout.several_tables || layout.scatter, &|| self.numbers()),
            (Tab::Fit, !layout.fit.is_empty(), &|| self.fit()),
            (Tab::Pattern, layout.pattern, &|| self.panels()),
            (Tab::Outfit, !layout.outfit.is_empty(), &|| self.outfit()),
            (Tab::Wrinkles, layout.wrinkles, &|| self.wrinkles()),
            (Tab::Solver, layout.iterations && layout.method.is_none(), &|| self.solver()),
        ];
        let (mut tabs, mut nodes) = (vec![Tab::Stages], vec![first]);
        for (tab, _, node) in further.into_iter().filter(|(_, present, _)| *present) {
            tabs.push(tab);
            nodes.push(node());
        }
        let open = tabs.iter().position(|tab| *tab == layout.opens_on).unwrap_or(0);
        match nodes.pop() {
            Some(only) if nodes.is_empty() => only,
            last => Node::Tabs(open, nodes.into_iter().chain(last).collect()),
        }
    }

    /// The eye for the views of a tab.
    fn eye(&self, tab: Tab) -> Eye {
        self.layout.eye(tab, self.eye)
    }

    fn stages(&self) -> Node {
        let (layout, eye) = (self.layout, &self.eye(Tab::Stages));
        let mut views = vec![
            View::with_body("Distance", "/distance", eye),
            View::with_body("PARTs", "/parts", eye),
            View::with_body("Force per PART", "/force", eye),
            View::with_body("Drape", "/drape", eye),
        ];
        if layout.error {
            views.push(View::with_body("Error", paths::ERROR, eye));
        }
        let width = views.len() as f32;
        let views = in_rows("Stages", views, layout.stage_grid(self.eye).rows);
        // Four plots side by side cut long names.
        let histogram = if layout.several_tables {
            "Vertices over distance, cm"
        } else {
            "Vertices over distance, cm; colours are levels"
        };
        let mut below: Vec<(f32, Node)> = vec![
            (1.3, View::bars(histogram, &[paths::HISTOGRAM]).into()),
            (1.0, View::bars("PARTs per level", &[paths::LEVEL_PARTS]).into()),
        ];
        if layout.several_tables {
            below.push((0.8, self.plot("All PARTs", "/numbers/part_count", false)));
        }
        // The table's name, levels, distance, force and error.
        let bars = 4 + usize::from(layout.error);
        below.push((1.0, View::plane("Colours", &[paths::STAGES_LEGEND], visible([1, bars])).into()));
        let height = STAGE_HEIGHT as f32;
        let left = Node::Column("Stages", vec![(height, views), (1.0 - height, Node::Row("Levels", below))]);
        Node::Row("Stages", vec![(width, left), (REPORT_OVER_STAGE, View::report().into())])
    }

    /// The compared garments, over one caption each. Methods have their name in the view's title, and a colour bar below.
    fn side_by_side(&self) -> Node {
        let (layout, eye) = (self.layout, &self.eye(Tab::SideBySide));
        let cells = layout.captions(self.eye);
        let view = |(slot, title): (usize, &String)| View::with_body(title, &format!("{}/{slot}", paths::COMPARE), eye);
        let views = layout.compare.iter().enumerate().map(view).collect();
        let views = in_rows("Side by side", views, layout.compare_grid(self.eye).rows);
        let (name, seen) = if layout.table4 {
            ("Colours: distance to the canonical drape", visible(cells))
        } else {
            ("PARTs, time and error", visible_captions(cells))
        };
        let below = View::plane(name, &[paths::COMPARE_CAPTIONS], seen).into();
        let height = BARS_HEIGHT * cells[1] as f32;
        Node::Column("Side by side", vec![(1.0 - height, views), (height, below)])
    }

    fn numbers(&self) -> Node {
        // The legend has a line for each stage, seven, and a line for each error, four.
        let mut plots = vec![(1.5, self.plot("Time of each stage, ms", paths::STAGE_MS, true))];
        if self.layout.error {
            plots.push((1.0, self.plot("Error, mm", "/numbers/error", true)));
        }
        let mut top = vec![(1.0, Node::Column("Numbers", plots))];
        if self.layout.scatter {
            top.insert(0, (2.0, View::plane("Cost against error", &[paths::SCATTER], VISIBLE).into()));
        }
        let rows = View::rows("Numbers", &[paths::ROWS], paths::TABLE);
        Node::Column("Numbers", vec![(1.6, Node::Row("Numbers", top)), (1.0, rows.into())])
    }

    /// Scalars over `table`, with a margin of one step. A legend takes two fifths of the width, left of the first step.
    fn plot(&self, name: &str, path: &str, legend: bool) -> Node {
        let view = View::plot(name, &[path], legend);
        let Some(count) = self.layout.table_count.map(i64::from) else { return view.into() };
        let legend_width = if legend { 2 * count / 3 } else { 0 };
        view.between(-1 - legend_width, count).into()
    }

    fn fit(&self) -> Node {
        let (names, eye) = (&self.layout.fit, &self.eye(Tab::Fit));
        let view = |name: &String| View::with_body(capital(name), &format!("{}/{name}", paths::FIT), eye);
        over_bars("Fit", names.iter().map(view).collect(), paths::FIT_LEGEND, names.len())
    }

    /// The flat panels in two rows of two, since panels are wider than high; the worn garment beside them.
    fn panels(&self) -> Node {
        let (layout, eye) = (self.layout, &self.eye(Tab::Pattern));
        let flat = |name: &str| {
            let title = if name == "parts" { "PARTs".to_owned() } else { capital(name) };
            (1.0, View::spatial(format!("Flat: {title}"), &[&format!("{}/{name}", paths::PATTERN)], eye).into())
        };
        let mut views: Vec<(f32, Node)> = vec![flat("parts")];
        let of_fit = || layout.fit.iter().filter(|name| ["strain", "pressure"].contains(&name.as_str()));
        views.extend(of_fit().map(|name| flat(name)));
        if let Some(name) = of_fit().next() {
            let path = format!("{}/{name}", paths::FIT);
            views.push(View::with_body(format!("Worn: {}", capital(name)), &path, eye));
        }
        let below = views.split_off(views.len().div_ceil(2));
        let rows = [views, below].into_iter().filter(|row| !row.is_empty());
        let mut rows: Vec<(f32, Node)> = rows.map(|row| (1.0, Node::Row("Pattern", row))).collect();
        if !layout.fit.is_empty() {
            // The colours and their bars are those of the fit.
            let bars = View::plane("Colours", &[paths::FIT_LEGEND], visible([layout.fit.len(), 1])).into();
            rows.push((rows.len() as f32 * BARS_HEIGHT, bars));
        }
        Node::Column("Pattern", rows)
    }

    /// A row for each garment with its PARTs, forces and drape, beside a view of all garments and the report.
    fn outfit(&self) -> Node {
        let layers = &self.layout.outfit;
        let width = ASPECT / OUTFIT_SHARES.iter().map(|share| f64::from(*share)).sum::<f64>();
        let eye = self.eye.through(width / 3.0 * layers.len() as f64);
        let eye_on_all = self.eye.through(width * f64::from(OUTFIT_SHARES[1]));
        let row = |(k, layer): (usize, &Layer)| {
            let branch = layer_branch(k, layer);
            // The drape has the garment's name; three titles with it would be cut.
            let stages = [("PARTs", "parts"), ("Force", "force"), (layer.name.as_str(), "drape")];
            let view = |(title, leaf): (&str, &str)| View::with_body(title, &format!("{branch}/{leaf}"), &eye);
            (1.0, Node::Row("Garment", stages.map(view).into()))
        };
        let garments = Node::Column("Garments", layers.iter().enumerate().map(row).collect());
        let drapes = layers.iter().enumerate().map(|(k, layer)| format!("{}/drape", layer_branch(k, layer)));
        let contents: Vec<String> = std::iter::once(paths::BODY.to_owned()).chain(drapes).collect();
        let contents: Vec<&str> = contents.iter().map(String::as_str).collect();
        let all = View::spatial("Outfit", &contents, &eye_on_all).into();
        Node::Row(
            "Outfit",
            vec![(OUTFIT_SHARES[0], garments), (OUTFIT_SHARES[1], all), (OUTFIT_SHARES[2], View::report().into())],
        )
    }

    fn wrinkles(&self) -> Node {
        let eye = &self.eye(Tab::Wrinkles);
        let views = vec![
            View::with_body("Displacement jump between PARTs", paths::SEAMS, eye),
            View::with_body("Mean curvature", paths::CURVATURE, eye),
        ];
        over_bars("Wrinkles", views, paths::WRINKLES_LEGEND, 2)
    }

    fn solver(&self) -> Node {
        let plots = vec![
            (1.0, View::plot("Energy, J", &[paths::ENERGY], false).into()),
            (1.0, View::plot("Residual over weight, log10", &[paths::RESIDUAL_LOG10], false).into()),
        ];
        let drape = View::with_body("Drape", "/drape", &self.eye(Tab::Solver));
        Node::Row("Solver", vec![drape, (2.0, Node::Column("Solver", plots))])
    }

    /// A reference method: the garment as placed, the exhibits and the drape; the speed below, the report beside.
    fn method(&self, exhibits: &[String]) -> Node {
        // The report is as wide as a view.
        let count = 2 + exhibits.len();
        let width = ASPECT * count as f64 / (count as f64 + 1.0);
        let eye = &self.eye.through(width / count as f64 / f64::from(1.0 - SPEED_HEIGHT));
        let mut views = vec![View::with_body("As placed", paths::GARMENT, eye)];
        for (number, name) in exhibits.iter().enumerate() {
            views.push(View::with_body(capital(name), &format!("{}/{number}", paths::METHOD), eye));
        }
        views.push(View::with_body("Drape", "/drape", eye));
        let speed = View::plot("RMS speed of the vertices, cm/s", &[paths::SPEED], false).into();
        let rows = vec![(1.0 - SPEED_HEIGHT, Node::Row("Method", views)), (SPEED_HEIGHT, speed)];
        Node::Row("Method", vec![(count as f32, Node::Column("Method", rows)), (1.0, View::report().into())])
    }
}

/// The plots of Table 4: time over error, and over vertices.
fn table4_plots() -> Node {
    let plot = |name: &str, path: &str| (1.0, View::plane(name, &[path], VISIBLE).into());
    let plots = vec![
        plot("Time against error", paths::SCATTER),
        plot("Vertices against time, in the colours above", paths::GROWTH),
    ];
    Node::Column("Numbers", plots)
}

/// Views in one row or two.
fn in_rows(name: &'static str, mut views: Vec<(f32, Node)>, rows: usize) -> Node {
    if rows == 1 {
        return Node::Row(name, views);
    }
    let lower = views.split_off(views.len().div_ceil(2));
    Node::Column(name, vec![(1.0, Node::Row(name, views)), (1.0, Node::Row(name, lower))])
}

/// Views side by side over a row of colour bars.
fn over_bars(tab: &'static str, views: Vec<(f32, Node)>, legend: &str, columns: usize) -> Node {
    let bars = View::plane("Colours", &[legend], visible([columns, 1])).into();
    Node::Column(tab, vec![(1.0 - BARS_HEIGHT, Node::Row(tab, views)), (BARS_HEIGHT, bars)])
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
