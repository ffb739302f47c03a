//! The recording: every stage of a drape as Rerun shows it. The only module that knows Rerun.
//!
//! Results come in as plain meshes and slices; [`paths`] lists what a recording holds. Triangles are logged once, later
//! steps send only what changed. Without a sink nothing is made.

mod blueprint;
mod colour_map;
mod colours;
mod compare;
mod dots;
mod error;
mod eye;
mod folds;
mod labels;
mod legend;
mod levels;
mod live;
mod meshes;
mod method;
mod native;
mod open;
mod outfit;
mod overlay;
mod page;
mod panel;
pub mod paths;
mod pattern;
mod remote;
mod scatter;
mod sinks;
mod step;
pub mod vertex_colours;
pub mod web;
mod wrinkles;
mod writer;

use std::path::PathBuf;
use std::time::Instant;

use glam::DVec3;
use rerun::{Scalars, TextDocument};

pub use blueprint::layout::{Layout, Tab};
pub use colour_map::Range;
pub use colours::level_colours;
pub use compare::{Chosen, Colours};
pub use error::RecordError;
pub use folds::FoldView;
pub use live::{LiveEncoder, LiveShape, PinnedView};
pub use method::MethodView;
pub use outfit::OutfitView;
pub use overlay::Overlay;
pub use page::Limits;
pub(crate) use page::{Connection, Hosts, Refused, Server, file, name_of_run, query, whole};
pub use panel::Panel;
pub use pattern::PatternView;
pub use scatter::{Picture, ScatterPoint};
pub use sinks::Sink;
pub use step::StepView;
pub use wrinkles::WrinkleView;

use crate::mesh::TriMesh;
use open::Open;

/// Where to record, under which name, and what will come.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordOptions {
    /// Where it goes. None: nothing is recorded.
    pub sinks: Vec<Sink>,
    /// Name of the recording in the viewer (`low-cut dress, Table 3`).
    pub name: String,
    /// What will come, hence which views there are.
    pub layout: Layout,
    /// Where the wearer looks to (horizontal).
    pub front: DVec3,
    /// Whether meshes may be replaced later (`--watch`): they are then logged at a step instead of once for all.
    pub replaceable: bool,
}

impl Default for RecordOptions {
    fn default() -> Self {
        Self {
            sinks: Vec::new(),
            name: String::new(),
            layout: Layout::default(),
            front: DVec3::NEG_Y,
            replaceable: false,
        }
    }
}

/// What a finished recording came to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordSummary {
    /// The file, where there is one.
    pub path: Option<PathBuf>,
    /// Its size, bytes.
    pub bytes: u64,
    /// Bytes of positions, colours and the rest that were logged, before encoding and compression.
    pub raw_bytes: u64,
    /// Time spent here, ms.
    pub log_ms: f64,
}

impl RecordSummary {
    /// Where the file is, in words, where there is one.
    #[must_use]
    pub(crate) fn said(&self) -> Option<String> {
        self.path.as_ref().map(|path| format!("recording: {}", path.display()))
    }
}

/// A recording in the making. What logs to it fails with what Rerun refuses, and where a slice does not fit the garment.
pub struct Recorder {
    open: Option<Box<Open>>,
}

impl Recorder {
    /// Opens every sink, or none. Without a sink it makes nothing and costs nothing.
    ///
    /// # Errors
    /// An unwritable file, a port in use, a viewer that is not there.
    pub fn open(options: RecordOptions) -> Result<Self, RecordError> {
        if options.sinks.is_empty() {
            return Ok(Self { open: None });
        }
        Ok(Self { open: Some(Box::new(Open::new(options)?)) })
    }

    /// The address of the web viewer, where one is served.
    #[must_use]
    pub fn web_url(&self) -> Option<&str> {
        self.open.as_ref()?.web.as_ref().map(web::WebViewer::url)
    }

    /// The body. `index` is the step it belongs to where meshes are replaceable.
    pub fn body(&mut self, index: i64, body: &TriMesh) -> Result<(), RecordError> {
        self.timed(|open| open.take_body(index, body))
    }

    /// The garment as loaded; with the first one the layout is sent.
    pub fn garment(&mut self, index: i64, garment: &TriMesh) -> Result<(), RecordError> {
        self.timed(|open| open.take_garment(index, garment))
    }

    /// Which of several fabrics each vertex of the garment is cut from, so that they are told apart in the drape.
    pub(crate) fn cut_from(&mut self, index: i64, fabric_of_vertex: &[u16]) -> Result<(), RecordError> {
        self.timed(|open| {
            RecordError::unless_per_vertex(open.garment.positions.len(), &[("fabrics", fabric_of_vertex.len())])?;
            open.at(index, 1);
            open.log_mesh(paths::DRAPE, &meshes::colours(colours::by_fabric(fabric_of_vertex)))
        })
    }

    /// Sets what the ends of a quantity's colour map stand for (`error` in mm, `force` in N), for a recording whose steps are known
    /// beforehand; without it the first step's values do.
    pub(crate) fn scale(&mut self, quantity: &str, range: Range) {
        if let Some(open) = &self.open {
            open.scale(quantity, || range);
        }
    }

    /// One range table's result.
    pub fn step(&mut self, step: &StepView<'_>) -> Result<(), RecordError> {
        self.timed(|open| {
            step.check(open.garment.positions.len())?;
            step::log(open, step)?;
            open.flush_live()
        })
    }

    /// Puts a message above the text panel of a step that stays as it is: what is wrong with a file just edited.
    pub fn notice(&mut self, index: i64, message: &str) -> Result<(), RecordError> {
        self.timed(|open| {
            open.at(index, 6);
            let quoted = message.replace('\n', "\n> ");
            let text = format!("> ⚠ **{quoted}**\n\nBelow: the last result that could be solved.\n\n{}", open.report);
            open.log(paths::REPORT, &TextDocument::from_markdown(text))?;
            open.flush_live()
        })
    }

    /// One iteration of the solver: energy in J, residual over weight, and the mesh every so often.
    pub fn iteration(
        &mut self,
        iteration: i64,
        energy_j: f64,
        residual_over_weight: f64,
        positions: Option<&[DVec3]>,
    ) -> Result<(), RecordError> {
        self.timed(|open| {
            open.at_iteration(iteration);
            open.last_iteration = Some(iteration);
            step::series(open, paths::ENERGY, "energy", 1, energy_j)?;
            open.log(paths::RESIDUAL, &Scalars::single(residual_over_weight))?;
            // Plots have no logarithmic axis.
            step::series(open, paths::RESIDUAL_LOG10, "residual over weight, log10", 0, residual_over_weight.log10())?;
            open.garment_at(positions)
        })
    }

    /// The garment after a step in time of a reference method, m/s and m.
    pub(crate) fn moment(&mut self, step: i64, rms_speed: f64, positions: Option<&[DVec3]>) -> Result<(), RecordError> {
        self.timed(|open| method::moment(open, step, rms_speed, positions))
    }

    /// What a reference method made.
    pub(crate) fn method(&mut self, view: &MethodView<'_>) -> Result<(), RecordError> {
        self.timed(|open| method::log(open, view))
    }

    /// The jumps at the PARTs' seams beside the mean curvature.
    pub fn wrinkles(&mut self, view: &WrinkleView<'_>) -> Result<(), RecordError> {
        self.timed(|open| wrinkles::log(open, view))
    }

    /// Lines along the folds that no PART shows.
    pub(crate) fn folds(&mut self, view: &FoldView<'_>) -> Result<(), RecordError> {
        self.timed(|open| folds::log(open, view))
    }

    /// Garments worn over each other, in the colours of the step before.
    pub(crate) fn outfit(&mut self, view: &OutfitView<'_>) -> Result<(), RecordError> {
        self.timed(|open| outfit::log(open, view))
    }

    /// The flat panels of a sewing pattern in the colours of the step before.
    pub(crate) fn pattern(&mut self, view: &PatternView<'_>) -> Result<(), RecordError> {
        self.timed(|open| pattern::log(open, view))
    }

    /// One of the tables chosen to stand side by side.
    pub fn compare(&mut self, chosen: &Chosen<'_>) -> Result<(), RecordError> {
        self.timed(|open| compare::chosen(open, chosen))
    }

    /// All points of a picture so far, as of this step of the timeline `table`.
    pub fn scatter(
        &mut self,
        index: i64,
        picture: Picture<'_>,
        points: &[ScatterPoint<'_>],
    ) -> Result<(), RecordError> {
        self.timed(|open| scatter::scatter(open, index, picture, points))
    }

    /// Sends what is on its way, where someone watches.
    ///
    /// # Errors
    /// A file that cannot be written, a viewer that went away.
    pub(crate) fn flush(&mut self) -> Result<(), RecordError> {
        self.timed(|open| open.flush_live())
    }

    /// Sends what is left, closes the file and gives it its name.
    ///
    /// # Errors
    /// A file that could not be completed, a viewer that went away.
    pub fn finish(mut self) -> Result<RecordSummary, RecordError> {
        self.open.take().map_or_else(|| Ok(RecordSummary::default()), Open::finish)
    }

    fn timed(&mut self, log: impl FnOnce(&mut Open) -> Result<(), RecordError>) -> Result<(), RecordError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let started = Instant::now();
        let result = log(open);
        open.spent += started.elapsed();
        result
    }
}

impl Drop for Recorder {
    /// A recording that was not finished leaves no file.
    fn drop(&mut self) {
        if let Some(open) = self.open.take() {
            open.discard();
        }
    }
}
