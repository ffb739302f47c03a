//! The layout of a recording: which tabs it has, and the grid of views in each.

use super::eye::Eye;
use crate::scene::Layer;

/// Width over height of a tab in a window of 16:10, below the viewer's bars.
pub(super) const ASPECT: f64 = 1.8;
/// Share of the first tab's height for the stages; the levels below take the rest.
pub(super) const STAGE_HEIGHT: f64 = 0.72;
/// Width of the text panel over that of a stage.
pub(super) const REPORT_OVER_STAGE: f32 = 1.25;
/// Share of a tab's height for a row of colour bars: its title bar, the bar and the numbers.
pub(super) const BARS_HEIGHT: f32 = 0.115;
/// Width over height of the views of flat panels.
pub(super) const PANELS_ASPECT: f64 = 1.8;
/// Height of a view's title bar over that of a tab, in a window of 1280 × 800.
const TITLE_HEIGHT: f64 = 0.036;

/// The contents of a recording beyond the stages of one drape; each of them gets its views only if it is present.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layout {
    /// Several steps of the timeline `table`, whose PARTs differ: numbers are plotted over it, and every triangle is divided into cells. Without it,
    /// those at the borders of the first PARTs are.
    pub several_tables: bool,
    /// The number of those steps, if known: plots then leave room for their legends.
    pub table_count: Option<u32>,
    /// Steps of the timeline `iteration`: adds the tab of the solver, and the recording opens on that timeline.
    pub iterations: bool,
    /// The error of the drape.
    pub error: bool,
    /// Names of the per-vertex overlays (`strain`, `pressure`).
    pub fit: Vec<String>,
    /// The flat panels of a sewing pattern.
    pub pattern: bool,
    /// The garments of an outfit, inner to outer, if there are several.
    pub outfit: Vec<Layer>,
    /// Both measures of wrinkles.
    pub wrinkles: bool,
    /// Titles of the tables that are compared side by side, at most six.
    pub compare: Vec<String>,
    /// The scatter of cost over error.
    pub scatter: bool,
    /// A reference method, with the names of its exhibits: its tab replaces the stages.
    pub method: Option<Vec<String>>,
    /// The views side by side show methods: they replace the stages, and times are plotted over errors and over vertices.
    pub table4: bool,
    /// The recording is viewed while it grows: the cursor follows the newest step.
    pub follow: bool,
    /// The tab that the recording opens on.
    pub opens_on: Tab,
}

/// The tabs of a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tab {
    /// All stages of one table.
    #[default]
    Stages,
    /// The compared tables.
    SideBySide,
    /// Cost over error, and the rows of numbers.
    Numbers,
    /// Strain and pressure.
    Fit,
    /// The flat panels of a sewing pattern beside the drape.
    Pattern,
    /// The garments of an outfit, each alone and all together.
    Outfit,
    /// Jumps at the PARTs' seams, and mean curvature.
    Wrinkles,
    /// Energy and residual over the iterations.
    Solver,
}

impl Layout {
    /// The eye for the views of a tab, which share its width.
    pub(super) fn eye(&self, tab: Tab, eye: &Eye) -> Eye {
        let over_bars = |aspect: f64| aspect / (1.0 - f64::from(BARS_HEIGHT));
        eye.through(match tab {
            Tab::Stages | Tab::Numbers => self.stage_grid(eye).aspect,
            Tab::SideBySide => self.compare_grid(eye).aspect,
            Tab::Fit => over_bars(ASPECT / self.fit.len() as f64),
            Tab::Pattern => over_bars(PANELS_ASPECT),
            // The tab has an eye for each of its shares.
            Tab::Outfit => ASPECT,
            Tab::Wrinkles => over_bars(0.5 * ASPECT),
            Tab::Solver => ASPECT / 3.0,
        })
    }

    /// The grid of the stages: one row for a gown, two for a pullover.
    pub(super) fn stage_grid(&self, eye: &Eye) -> Grid {
        let count = 4 + usize::from(self.error);
        let width = ASPECT * count as f64 / (count as f64 + f64::from(REPORT_OVER_STAGE));
        Grid::fitting(eye, count, [width, STAGE_HEIGHT])
    }

    /// The grid of the views side by side.
    pub(super) fn compare_grid(&self, eye: &Eye) -> Grid {
        let count = self.compare.len();
        let above = |lines: usize| [ASPECT, 1.0 - f64::from(BARS_HEIGHT) * lines as f64];
        let grid = Grid::fitting(eye, count, above(1));
        if grid.rows == 1 || self.table4 { grid } else { Grid::new(count, grid.rows, above(grid.rows)).0 }
    }

    /// Columns and rows of the captions below the views side by side.
    pub(super) fn captions(&self, eye: &Eye) -> [usize; 2] {
        let rows = self.compare_grid(eye).rows;
        [self.compare.len().div_ceil(rows), if self.table4 { 1 } else { rows }]
    }
}

/// Views of one kind in one row or two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub(super) rows: usize,
    /// Width over height of a view.
    pub(super) aspect: f64,
}

impl Grid {
    /// `count` views in `rows` rows of an area, in units of a tab's height; and the width and height of a view.
    fn new(count: usize, rows: usize, [width, height]: [f64; 2]) -> (Self, [f64; 2]) {
        let [w, h] = [width / count.div_ceil(rows) as f64, height / rows as f64 - TITLE_HEIGHT];
        (Self { rows, aspect: w / h }, [w, h])
    }

    /// The grid, of one row or two, in which the garment that `eye` looks at is larger.
    fn fitting(eye: &Eye, count: usize, area: [f64; 2]) -> Self {
        let scaled = |rows: usize| {
            let (grid, [w, h]) = Self::new(count, rows, area);
            (grid, (w / eye.half_width.max(1e-9)).min(h / eye.half_height.max(1e-9)))
        };
        let (one, two) = (scaled(1), scaled(2));
        if two.1 > one.1 { two.0 } else { one.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use glam::DVec3;

    /// The eye on a garment of this width and height.
    fn eye_on(width: f64, height: f64) -> Eye {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        let corner = |[x, z]: [f64; 2]| DVec3::new(width * x, 0.0, height * z);
        let sheet = TriMesh::new(corners.map(corner).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        Eye::on(&sheet, DVec3::NEG_Y, ASPECT).unwrap()
    }

    #[test]
    fn a_gown_takes_one_row_and_a_pullover_two_and_each_fills_its_view() {
        let layout = Layout::default();
        for (width, height, rows) in [(0.7, 1.1, 1), (1.5, 0.65, 2)] {
            let eye = eye_on(width, height);
            let grid = layout.stage_grid(&eye);
            assert_eq!(grid.rows, rows, "{width} × {height}");
            let eye = eye.through(grid.aspect);
            // Half the height visible at the garment, and the garment's share of the view along its tighter side.
            let half = (eye.position - eye.target).dot(eye.toward) * 27.5f64.to_radians().tan();
            let share = (eye.half_height / half).max(eye.half_width / (half * grid.aspect));
            assert!((0.7..1.0).contains(&share), "{share}");
        }
    }
}
