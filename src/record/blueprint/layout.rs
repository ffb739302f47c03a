//! Which views there are, and where: the stages side by side, levels and colour bars below, the report beside both; more in
//! further tabs.

use super::super::eye::Eye;
use super::super::legend::visible;
use super::super::outfit;
use super::super::scatter::VISIBLE;
use super::super::{paths, pattern};
use super::rows::{grid, in_rows};
use super::view::{View, on_the_body};
use super::{Node, TimePanel};
use super::{detail_tabs, table4};
use crate::scene::Layer;

/// Width over height of a tab in a window of 16:10, below the bars of the viewer.
pub(crate) const ASPECT: f64 = 1.8;
/// Share of the first tab's height that the stages take; the levels below take the rest.
const STAGE_HEIGHT: f64 = 0.75;
/// Width of the text panel over that of a stage.
const REPORT_OVER_STAGE: f32 = 1.25;
/// Share of a tab's height that a row of colour bars takes: its title bar, the strip and the numbers.
pub(super) const BARS_HEIGHT: f32 = 0.115;

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
    /// The garments of an outfit, inner to outer, where there are several.
    pub outfit: Vec<Layer>,
    /// Both measures of wrinkles will come.
    pub wrinkles: bool,
    /// Titles of the chosen tables shown side by side, at most six.
    pub compare: Vec<String>,
    /// A scatter of time against error will come.
    pub scatter: bool,
    /// A reference method, with the names of what it shows besides the garment: its tab stands for the stages.
    pub method: Option<Vec<String>>,
    /// What is side by side are ways to drape: they stand for the stages, and times are plotted over errors and over vertices.
    pub table4: bool,
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
    /// Garments worn over each other, each by itself and all together.
    Outfit,
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
        if self.table4 {
            return Node::Tabs(0, vec![self.side_by_side(eye), table4::numbers()]);
        }
        let first = self.method.as_ref().map_or_else(|| self.stages(eye), |exhibits| self.of_method(exhibits, eye));
        let further: [(Tab, bool, &dyn Fn() -> Node); 7] = [
            (Tab::SideBySide, !self.compare.is_empty(), &|| self.side_by_side(eye)),
            (Tab::Numbers, self.several_tables || self.scatter, &|| self.numbers()),
            (Tab::Fit, !self.fit.is_empty(), &|| self.fit(eye)),
            (Tab::Pattern, self.pattern, &|| self.panels(eye)),
            (Tab::Outfit, !self.outfit.is_empty(), &|| self.wardrobe(eye)),
            (Tab::Wrinkles, self.wrinkles, &|| detail_tabs::wrinkles(&self.eye(Tab::Wrinkles, eye))),
            (Tab::Solver, self.iterations && self.method.is_none(), &|| {
                detail_tabs::solver(&self.eye(Tab::Solver, eye))
            }),
        ];
        let there = further.into_iter().filter(|(_, there, _)| *there);
        let (mut tabs, mut nodes) = (vec![Tab::Stages], vec![first]);
        for (tab, _, node) in there {
            tabs.push(tab);
            nodes.push(node());
        }
        let open = tabs.iter().position(|tab| *tab == self.opens_on).unwrap_or(0);
        match nodes.pop() {
            Some(only) if nodes.is_empty() => only,
            last => Node::Tabs(open, nodes.into_iter().chain(last).collect()),
        }
    }

    /// The eye for the views of a tab, which share its width.
    pub(crate) fn eye(&self, tab: Tab, eye: &Eye) -> Eye {
        eye.through(match tab {
            Tab::Stages | Tab::Numbers => self.stage_grid(eye).1,
            Tab::SideBySide => self.compare_grid(eye).1,
            Tab::Fit => over_bars(ASPECT / self.fit.len() as f64),
            Tab::Pattern => over_bars(pattern::ASPECT),
            Tab::Outfit => 0.5 * ASPECT,
            Tab::Wrinkles => over_bars(0.5 * ASPECT),
            Tab::Solver => ASPECT / 3.0,
        })
    }

    /// How many stages are shown.
    fn stage_count(&self) -> usize {
        3 + usize::from(!self.held) + usize::from(self.error)
    }

    /// In how many rows the stages stand, and width over height of a view: a gown in one row, a pullover in two.
    fn stage_grid(&self, eye: &Eye) -> (usize, f64) {
        let count = self.stage_count() as f64;
        grid(eye, self.stage_count(), [ASPECT * count / (count + f64::from(REPORT_OVER_STAGE)), STAGE_HEIGHT])
    }

    fn stages(&self, eye: &Eye) -> Node {
        let (rows, _) = self.stage_grid(eye);
        let eye = &self.eye(Tab::Stages, eye);
        let seen = |name: &str, path: &str| on_the_body(name, path, eye);
        let mut views = vec![seen("Distance", "/distance"), seen("PARTs", "/parts")];
        if !self.held {
            views.push(seen("Force per PART", "/force"));
        }
        // What is drawn through the body there is no drape.
        views.push(seen(if self.held { "PARTs at best" } else { "Drape" }, "/drape"));
        if self.error {
            views.push(seen("Error", paths::ERROR));
        }
        let wide = views.len() as f32;
        let views = in_rows("Stages", views, rows);
        // Four beside each other cut long names.
        let histogram = if self.several_tables {
            "Vertices over distance, cm"
        } else {
            "Vertices over distance, cm; colours are levels"
        };
        let mut below: Vec<(f32, Node)> = vec![
            (1.3, View::bars(histogram, &[paths::HISTOGRAM]).into()),
            (1.0, View::bars("PARTs per level", &[paths::LEVEL_PARTS]).into()),
        ];
        if self.several_tables {
            below.push((0.8, self.plot("All PARTs", "/numbers/part_count", false)));
        }
        below.push((1.0, View::plane("Colours", &[paths::STAGES_LEGEND], visible([1, self.stage_bars()])).into()));
        let left = Node::Column(
            "Stages",
            vec![(STAGE_HEIGHT as f32, views), (1.0 - STAGE_HEIGHT as f32, Node::Row("Levels", below))],
        );
        let report = View::text("Report", paths::REPORT).into();
        Node::Row("Stages", vec![(wide, left), (REPORT_OVER_STAGE, report)])
    }

    /// Rows of the first tab's colours: the table's name, distance, force and error.
    fn stage_bars(&self) -> usize {
        2 + usize::from(!self.held) + usize::from(self.error)
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

    /// A row for each garment, its PARTs, forces and drape, beside all of them.
    fn wardrobe(&self, eye: &Eye) -> Node {
        let all = self.eye(Tab::Outfit, eye);
        let rows = self.outfit.len() as f64;
        let one = eye.through(ASPECT / 6.0 * rows);
        let row = |(k, worn): (usize, &Layer)| {
            let branch = outfit::branch(k, worn);
            // The drape bears the garment's name: all three would be cut with it.
            let stages = [("PARTs", "parts"), ("Force per PART", "force"), (worn.name.as_str(), "drape")];
            let view = |(title, leaf): (&str, &str)| on_the_body(title, &format!("{branch}/{leaf}"), &one);
            (1.0, Node::Row("Garment", stages.map(view).into()))
        };
        let garments = Node::Column("Garments", self.outfit.iter().enumerate().map(row).collect());
        let mut shown = vec![paths::BODY.to_owned()];
        shown.extend(self.outfit.iter().enumerate().map(|(k, worn)| format!("{}/drape", outfit::branch(k, worn))));
        let shown: Vec<&str> = shown.iter().map(String::as_str).collect();
        Node::Row("Outfit", vec![(1.0, garments), (1.0, View::spatial("Outfit", &shown, &all).into())])
    }

    fn fit(&self, eye: &Eye) -> Node {
        let eye = &self.eye(Tab::Fit, eye);
        let view = |name: &String| on_the_body(capital(name), &format!("{}/{name}", paths::FIT), eye);
        over("Fit", self.fit.iter().map(view).collect(), "Colours", paths::FIT_LEGEND, self.fit.len())
    }
}

/// Views side by side over a row of colour bars or texts, one for each.
pub(super) fn over(tab: &'static str, views: Vec<(f32, Node)>, name: &str, path: &str, columns: usize) -> Node {
    let bars = View::plane(name, &[path], visible([columns, 1])).into();
    Node::Column(tab, vec![(1.0 - BARS_HEIGHT, Node::Row(tab, views)), (BARS_HEIGHT, bars)])
}

/// Width over height of a view that has a row of bars below.
fn over_bars(aspect: f64) -> f64 {
    aspect / (1.0 - f64::from(BARS_HEIGHT))
}

pub(super) fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use glam::DVec3;

    /// The eye on a garment of this width and height.
    fn on(width: f64, height: f64) -> Eye {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        let corner = |[x, z]: [f64; 2]| DVec3::new(width * x, 0.0, height * z);
        let sheet = TriMesh::new(corners.map(corner).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        Eye::on(&sheet, DVec3::NEG_Y, ASPECT).unwrap()
    }

    #[test]
    fn a_gown_stands_in_one_row_and_a_pullover_in_two_and_each_fills_its_view() {
        let layout = Layout::default();
        for (width, height, rows) in [(0.7, 1.1, 1), (1.5, 0.65, 2)] {
            let eye = on(width, height);
            let (found, aspect) = layout.stage_grid(&eye);
            assert_eq!(found, rows, "{width} × {height}");
            let seen = eye.through(aspect);
            // Half the height seen at the garment, and how much of the view it takes along its tighter side.
            let half = (seen.position - seen.target).dot(seen.toward) * 27.5f64.to_radians().tan();
            let fills = (seen.half_height / half).max(seen.half_width / (half * aspect));
            assert!((0.7..1.0).contains(&fills), "{fills}");
        }
    }
}
