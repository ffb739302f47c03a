//! Which views there are, and where: the stages side by side with the report, the levels below, more in further tabs.

use super::super::eye::Eye;
use super::super::paths;
use super::view::View;
use super::{Node, TimePanel};

/// Width over height of a 3D view of the first tab in a window of 16:10.
pub(crate) const ASPECT: f64 = 0.52;

/// What a recording will hold beyond the stages of one drape; each piece gets its views only if it is there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layout {
    /// Several steps of the timeline `table`: numbers are plotted over it.
    pub several_tables: bool,
    /// The steps show what PARTs can hold and run no mechanics: no views of forces and of the stages' times.
    pub held: bool,
    /// Steps of the timeline `iteration` will come: a tab for the solver.
    pub iterations: bool,
    /// The error garment will come.
    pub error: bool,
    /// Names of the per-vertex overlays that will come (`strain`, `pressure`).
    pub fit: Vec<String>,
    /// Titles of the chosen tables shown side by side, at most six.
    pub compare: Vec<String>,
    /// A scatter of time against error will come.
    pub scatter: bool,
    /// The recording is watched while it grows: the cursor follows the newest step.
    pub follow: bool,
    /// The tab shown when the recording opens.
    pub opens_on: Tab,
}

/// The tabs of a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tab {
    /// All stages of one table, and the numbers of all tables below.
    #[default]
    Stages,
    /// The chosen tables.
    SideBySide,
    /// Speed against error, and the rows of numbers.
    Numbers,
    /// Strain and pressure.
    Fit,
    /// Energy and residual over the iterations.
    Solver,
}

impl Layout {
    pub(crate) fn time_panel(&self) -> TimePanel {
        let timeline = if self.opens_on == Tab::Solver { paths::ITERATION } else { paths::TABLE };
        TimePanel { timeline, follow: self.follow }
    }

    /// The views, seen from `eye`.
    pub(crate) fn root(&self, eye: &Eye) -> Node {
        let mut tabs = vec![(Tab::Stages, self.stages(eye))];
        if !self.compare.is_empty() {
            tabs.push((Tab::SideBySide, self.side_by_side(eye)));
        }
        if self.several_tables || self.scatter {
            tabs.push((Tab::Numbers, self.numbers()));
        }
        if !self.fit.is_empty() {
            tabs.push((Tab::Fit, self.fit(eye)));
        }
        if self.iterations {
            tabs.push((Tab::Solver, solver(eye)));
        }
        let open = tabs.iter().position(|(tab, _)| *tab == self.opens_on).unwrap_or(0);
        let mut nodes: Vec<Node> = tabs.into_iter().map(|(_, node)| node).collect();
        match nodes.pop() {
            Some(only) if nodes.is_empty() => only,
            last => Node::Tabs(open, nodes.into_iter().chain(last).collect()),
        }
    }

    fn stages(&self, eye: &Eye) -> Node {
        let seen = |name: &str, path: &str| (1.0, View::spatial(name, &[paths::BODY, path], eye).into());
        let mut views = vec![seen("Distance to the body", "/distance"), seen("PARTs", "/parts")];
        if !self.held {
            views.push(seen("Force per PART", "/force"));
        }
        views.push(seen("Drape", "/drape"));
        if self.error {
            views.push(seen("Error", paths::ERROR));
        }
        let top = Node::Row(
            "Stages",
            vec![(views.len() as f32, Node::Row("Stages", views)), (1.25, View::text("Report", paths::REPORT).into())],
        );
        let mut below: Vec<(f32, Node)> = vec![
            (1.6, View::bars("Vertices over distance, cm, by level", &[paths::HISTOGRAM]).into()),
            (1.0, View::bars("PARTs per level", &[paths::LEVEL_PARTS]).into()),
        ];
        if self.several_tables {
            let count = "/numbers/part_count";
            below.push((1.0, View::plot("PARTs", &[count]).into()));
            if !self.held {
                below.push((1.0, View::plot("Time of each stage, ms", &[paths::STAGE_MS]).into()));
            }
            if self.error {
                below.push((1.0, View::plot("Error, mm", &["/numbers/error"]).into()));
            }
        }
        Node::Column("Stages", vec![(3.0, top), (1.0, Node::Row("Levels", below))])
    }

    fn numbers(&self) -> Node {
        let rows = View::rows("Numbers", &[paths::ROWS], paths::TABLE);
        let mut views: Vec<(f32, Node)> = vec![(1.0, rows.into())];
        if self.scatter {
            views.insert(0, (1.6, View::plane("Cost against error", &[paths::SCATTER]).into()));
        }
        Node::Column("Numbers", views)
    }

    fn side_by_side(&self, eye: &Eye) -> Node {
        let views = self.compare.iter().enumerate().map(|(slot, title)| {
            let path = format!("{}/{slot}", paths::COMPARE);
            (1.0, View::spatial(title.clone(), &[paths::BODY, &path], eye).into())
        });
        Node::Row("Side by side", views.collect())
    }

    fn fit(&self, eye: &Eye) -> Node {
        let mut views: Vec<(f32, Node)> = Vec::new();
        for name in &self.fit {
            let path = format!("{}/{name}", paths::FIT);
            views.push((1.0, View::spatial(capital(name), &[paths::BODY, &path], eye).into()));
        }
        Node::Row("Fit", views)
    }
}

fn solver(eye: &Eye) -> Node {
    let plots = vec![
        (1.0, View::plot("Energy, J", &[paths::ENERGY]).into()),
        (1.0, View::plot("Residual over weight, log10", &[paths::RESIDUAL_LOG10]).into()),
    ];
    Node::Row(
        "Solver (timeline: iteration)",
        vec![(1.0, View::spatial("Drape", &[paths::BODY, "/drape"], eye).into()), (2.0, Node::Column("Solver", plots))],
    )
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
