//! Which views there are, and where: the stages side by side with the report, the levels below, more in further tabs.

use super::super::eye::Eye;
use super::super::scatter::VISIBLE;
use super::super::{paths, pattern};
use super::view::View;
use super::{Node, TimePanel};

/// Width over height of a tab in a window of 16:10, below the bars of the viewer.
pub(crate) const ASPECT: f64 = 1.8;
/// Height of a tab in a window of 1440 × 900, pixels: how large texts are beside what they stand by.
const HEIGHT_PX: f64 = 795.0;
/// Share of the first tab's height that the stages take; the levels below take the rest.
const STAGE_HEIGHT: f64 = 0.75;
/// Width of the text panel over that of a stage.
const REPORT_OVER_STAGE: f32 = 1.25;

/// What a recording will hold beyond the stages of one drape; each piece gets its views only if it is there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layout {
    /// Several steps of the timeline `table`: numbers are plotted over it.
    pub several_tables: bool,
    /// How many those steps are, where it is known: plots leave room for their legends then.
    pub table_count: Option<u32>,
    /// The steps show what PARTs can hold and run no mechanics: no views of forces and of the stages' times.
    pub held: bool,
    /// Steps of the timeline `iteration` will come: a tab for the solver, and the timeline the recording opens on.
    pub iterations: bool,
    /// The error garment will come.
    pub error: bool,
    /// Names of the per-vertex overlays that will come (`strain`, `pressure`).
    pub fit: Vec<String>,
    /// The flat panels of a sewing pattern will come.
    pub pattern: bool,
    /// Both measures of wrinkles will come.
    pub wrinkles: bool,
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
    /// The flat panels of a sewing pattern beside the drape.
    Pattern,
    /// Jumps at the PARTs' seams, and mean curvature.
    Wrinkles,
    /// Energy and residual over the iterations.
    Solver,
}

impl Layout {
    pub(crate) fn time_panel(&self) -> TimePanel {
        // Following rests on the last iteration: the result.
        let timeline = if self.iterations { paths::ITERATION } else { paths::TABLE };
        TimePanel { timeline, follow: self.follow || self.iterations }
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
        if self.pattern {
            tabs.push((Tab::Pattern, self.panels(eye)));
        }
        if self.wrinkles {
            tabs.push((Tab::Wrinkles, wrinkles(&self.eye(Tab::Wrinkles, eye))));
        }
        if self.iterations {
            tabs.push((Tab::Solver, solver(&self.eye(Tab::Solver, eye))));
        }
        let open = tabs.iter().position(|(tab, _)| *tab == self.opens_on).unwrap_or(0);
        let mut nodes: Vec<Node> = tabs.into_iter().map(|(_, node)| node).collect();
        match nodes.pop() {
            Some(only) if nodes.is_empty() => only,
            last => Node::Tabs(open, nodes.into_iter().chain(last).collect()),
        }
    }

    /// The eye for the views of a tab, which share its width.
    fn eye(&self, tab: Tab, eye: &Eye) -> Eye {
        eye.through(match tab {
            Tab::Stages | Tab::Numbers => {
                let wide = if self.error { 5.0 } else { 4.0 } + f64::from(REPORT_OVER_STAGE);
                ASPECT / (wide * STAGE_HEIGHT)
            }
            Tab::SideBySide => ASPECT / self.compare.len() as f64,
            Tab::Fit => ASPECT / self.fit.len() as f64,
            Tab::Pattern => pattern::ASPECT,
            Tab::Wrinkles => 0.5 * ASPECT,
            Tab::Solver => ASPECT / 3.0,
        })
    }

    /// Length of a pixel under the garment in the views of a tab, m.
    pub(crate) fn pixel_m(&self, tab: Tab, eye: &Eye) -> f64 {
        let share = match tab {
            Tab::Stages => STAGE_HEIGHT,
            Tab::Pattern => 0.5,
            _ => 1.0,
        };
        self.eye(tab, eye).pixel_m(HEIGHT_PX * share)
    }

    fn stages(&self, eye: &Eye) -> Node {
        let eye = &self.eye(Tab::Stages, eye);
        let seen = |name: &str, path: &str| (1.0, View::spatial(name, &[paths::BODY, path], eye).into());
        let mut views = vec![seen("Distance", "/distance"), seen("PARTs", "/parts")];
        if !self.held {
            views.push(seen("Force per PART", "/force"));
        }
        views.push(seen("Drape", "/drape"));
        if self.error {
            views.push(seen("Error", paths::ERROR));
        }
        let top = Node::Row(
            "Stages",
            vec![
                (views.len() as f32, Node::Row("Stages", views)),
                (REPORT_OVER_STAGE, View::text("Report", paths::REPORT).into()),
            ],
        );
        let mut below: Vec<(f32, Node)> = vec![
            (1.6, View::bars("Vertices over distance, cm; the levels", &[paths::HISTOGRAM]).into()),
            (1.0, View::bars("PARTs per level", &[paths::LEVEL_PARTS]).into()),
        ];
        if self.several_tables {
            below.push((1.0, self.plot("PARTs", "/numbers/part_count", false)));
            if !self.held {
                below.push((1.0, self.plot("Time of each stage, ms", paths::STAGE_MS, false)));
            }
            if self.error {
                below.push((1.0, self.plot("Error, mm", "/numbers/error", false)));
            }
        }
        Node::Column(
            "Stages",
            vec![(STAGE_HEIGHT as f32, top), (1.0 - STAGE_HEIGHT as f32, Node::Row("Levels", below))],
        )
    }

    fn numbers(&self) -> Node {
        let mut plots = vec![(1.0, self.plot("Time of each stage, ms", paths::STAGE_MS, true))];
        if self.error {
            plots.push((1.0, self.plot("Error, mm", "/numbers/error", true)));
        }
        let mut top = vec![(1.0, Node::Column("Numbers", plots))];
        if self.scatter {
            top.insert(0, (2.0, View::plane("Cost against error", &[paths::SCATTER], VISIBLE).into()));
        }
        let rows = View::rows("Numbers", &[paths::ROWS], paths::TABLE);
        Node::Column("Numbers", vec![(1.6, Node::Row("Numbers", top)), (1.0, rows.into())])
    }

    /// Scalars over `table`, each step apart from the edges; a legend takes two fifths of the width, left of the first.
    fn plot(&self, name: &str, path: &str, legend: bool) -> Node {
        let view = View::plot(name, &[path], legend);
        let Some(count) = self.table_count.map(i64::from) else { return view.into() };
        let room = if legend { 2 * count / 3 } else { 0 };
        view.between(-1 - room, count).into()
    }

    fn side_by_side(&self, eye: &Eye) -> Node {
        let eye = &self.eye(Tab::SideBySide, eye);
        let views = self.compare.iter().enumerate().map(|(slot, title)| {
            let path = format!("{}/{slot}", paths::COMPARE);
            (1.0, View::spatial(title.clone(), &[paths::BODY, &path], eye).into())
        });
        Node::Row("Side by side", views.collect())
    }

    fn fit(&self, eye: &Eye) -> Node {
        let eye = &self.eye(Tab::Fit, eye);
        let mut views: Vec<(f32, Node)> = Vec::new();
        for name in &self.fit {
            let path = format!("{}/{name}", paths::FIT);
            views.push((1.0, View::spatial(capital(name), &[paths::BODY, &path], eye).into()));
        }
        Node::Row("Fit", views)
    }

    /// Two rows of two, so that each view is as wide as panels on a table are.
    fn panels(&self, eye: &Eye) -> Node {
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
        Node::Column("Pattern", rows.map(|row| (1.0, Node::Row("Pattern", row))).collect())
    }
}

fn wrinkles(eye: &Eye) -> Node {
    let views = vec![
        (1.0, View::spatial("PARTs' displacements differ", &[paths::BODY, paths::SEAMS], eye).into()),
        (1.0, View::spatial("Mean curvature", &[paths::BODY, paths::CURVATURE], eye).into()),
    ];
    Node::Row("Wrinkles", views)
}

fn solver(eye: &Eye) -> Node {
    let plots = vec![
        (1.0, View::plot("Energy, J", &[paths::ENERGY], false).into()),
        (1.0, View::plot("Residual over weight, log10", &[paths::RESIDUAL_LOG10], false).into()),
    ];
    Node::Row(
        "Solver",
        vec![(1.0, View::spatial("Drape", &[paths::BODY, "/drape"], eye).into()), (2.0, Node::Column("Solver", plots))],
    )
}

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
