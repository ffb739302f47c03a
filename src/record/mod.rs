//! The recording: every stage of a drape as Rerun shows it. The only module that knows Rerun.
//!
//! Results come in as plain meshes and slices; [`paths`] lists what a recording holds. Triangles are logged once, later
//! steps send only what changed. Without a sink nothing is made: see [`Recorder::disabled`].

pub mod blueprint;
pub mod colour_map;
pub mod colours;
pub mod error;
pub mod eye;
pub mod inspect;
mod legend;
mod meshes;
pub mod panel;
pub mod paths;
pub mod sinks;
pub mod step;
pub mod web;

use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::DVec3;
use rerun::{AsComponents, RecordingStream, RecordingStreamBuilder, Scalars};

pub use blueprint::layout::Layout;
pub use error::RecordError;
pub use panel::{LevelRow, Panel};
pub use sinks::Sink;
pub use step::{Overlay, StepView};

use crate::mesh::TriMesh;
use eye::Eye;
use meshes::CellMesh;
use sinks::{OpenSinks, Target};

/// How long the last data may take to reach viewers.
const LAST_FLUSH: Duration = Duration::from_secs(10);

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

/// A recording in the making.
pub struct Recorder {
    open: Option<Box<Open>>,
}

/// The state of a recording that goes somewhere.
pub(crate) struct Open {
    stream: RecordingStream,
    targets: Vec<Target>,
    web: Option<web::WebViewer>,
    options: RecordOptions,
    garment: TriMesh,
    cells: CellMesh,
    eye: Eye,
    distance: Vec<f64>,
    vertex_colour: Vec<u8>,
    levels: usize,
    with_triangles: RefCell<BTreeSet<String>>,
    laid_out: bool,
    raw_bytes: Cell<u64>,
    spent: Duration,
}

impl Recorder {
    /// A recorder that makes nothing and costs nothing.
    #[must_use]
    pub fn disabled() -> Self {
        Self { open: None }
    }

    /// Opens every sink, or none.
    ///
    /// # Errors
    /// An unwritable file, a port in use, a viewer that is not there.
    pub fn open(options: RecordOptions) -> Result<Self, RecordError> {
        if options.sinks.is_empty() {
            return Ok(Self::disabled());
        }
        let started = Instant::now();
        let OpenSinks { sinks, targets, web } = OpenSinks::open(&options.sinks)?;
        let stream = RecordingStreamBuilder::new("partwise").recording_name(options.name.as_str()).set_sinks(sinks)?;
        // Steps are counted by our own timelines; wall-clock columns would only cost bytes.
        stream.set_log_tick_enabled(false);
        stream.set_log_time_enabled(false);
        let open = Open {
            stream,
            targets,
            web,
            options,
            garment: TriMesh::default(),
            cells: CellMesh::new(&TriMesh::default()),
            eye: Eye::default(),
            distance: Vec::new(),
            vertex_colour: Vec::new(),
            levels: 0,
            with_triangles: RefCell::new(BTreeSet::new()),
            laid_out: false,
            raw_bytes: Cell::new(0),
            spent: started.elapsed(),
        };
        Ok(Self { open: Some(Box::new(open)) })
    }

    /// Whether anything is recorded.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.open.is_some()
    }

    /// The address of the web viewer, where one is served.
    #[must_use]
    pub fn web_url(&self) -> Option<&str> {
        self.open.as_ref()?.web.as_ref().map(web::WebViewer::url)
    }

    /// The body. `index` is the step it belongs to where meshes are replaceable.
    ///
    /// # Errors
    /// What Rerun refuses.
    pub fn body(&mut self, index: i64, body: &TriMesh) -> Result<(), RecordError> {
        self.timed(|open| {
            open.at(index, 0);
            open.log_mesh(paths::BODY, &meshes::plain(body, colours::BODY))
        })
    }

    /// The garment as loaded; with the first one the layout is sent.
    ///
    /// # Errors
    /// What Rerun refuses.
    pub fn garment(&mut self, index: i64, garment: &TriMesh) -> Result<(), RecordError> {
        self.timed(|open| open.take_garment(index, garment))
    }

    /// One range table's result.
    ///
    /// # Errors
    /// A slice that does not fit the garment; what Rerun refuses.
    pub fn step(&mut self, step: &StepView<'_>) -> Result<(), RecordError> {
        self.timed(|open| {
            step.check(open.garment.positions.len())?;
            step::log(open, step)?;
            open.flush_live()
        })
    }

    /// One iteration of the solver: energy in J, residual over weight, and the mesh every so often.
    ///
    /// # Errors
    /// What Rerun refuses.
    pub fn iteration(
        &mut self,
        iteration: i64,
        energy_j: f64,
        residual_over_weight: f64,
        positions: Option<&[DVec3]>,
    ) -> Result<(), RecordError> {
        self.timed(|open| {
            open.stream.reset_time();
            open.stream.set_time_sequence(paths::ITERATION, iteration);
            open.log(paths::ENERGY, &Scalars::single(energy_j))?;
            open.log(paths::RESIDUAL, &Scalars::single(residual_over_weight.log10()))?;
            match positions {
                Some(x) if x.len() == open.garment.positions.len() => {
                    let moved = open.garment.with_positions(x.to_vec());
                    open.log(paths::DRAPE, &meshes::shape(&moved))
                }
                _ => Ok(()),
            }
        })
    }

    /// Sends what is left, closes the file and gives it its name.
    ///
    /// # Errors
    /// A file that could not be completed, a viewer that went away.
    pub fn finish(mut self) -> Result<RecordSummary, RecordError> {
        self.open.take().map_or_else(|| Ok(RecordSummary::default()), |open| open.finish())
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
            open.stream.disconnect();
            for target in &open.targets {
                let _ = std::fs::remove_file(&target.part);
            }
        }
    }
}

impl Open {
    /// Sets the step and the stage of what is logged next.
    fn at(&self, index: i64, stage: i64) {
        self.stream.reset_time();
        self.stream.set_time_sequence(paths::TABLE, index);
        self.stream.set_time_sequence(paths::STAGE, stage);
    }

    fn log(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, false, what)
    }

    /// Logs a mesh once for all, or at the step where it may be replaced.
    fn log_mesh(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, !self.options.replaceable, what)
    }

    fn log_as(&self, path: &str, fixed: bool, what: &dyn AsComponents) -> Result<(), RecordError> {
        let batches = what.as_serialized_batches();
        let bytes: usize = batches.iter().map(|b| b.array.get_buffer_memory_size()).sum();
        self.raw_bytes.set(self.raw_bytes.get() + bytes as u64);
        Ok(self.stream.log_serialized_batches(path, fixed, batches)?)
    }

    fn take_garment(&mut self, index: i64, garment: &TriMesh) -> Result<(), RecordError> {
        self.garment = garment.clone();
        self.cells = CellMesh::new(garment);
        self.distance.clear();
        self.vertex_colour.clear();
        self.with_triangles.borrow_mut().clear();
        if let Some(eye) = Eye::on(garment, self.options.front, blueprint::layout::ASPECT) {
            self.eye = eye;
            if !self.laid_out {
                blueprint::send(&self.stream, &self.options.layout.root(&eye), self.options.layout.time_panel())?;
                self.laid_out = true;
            }
        }
        self.at(index, 1);
        self.log_mesh(paths::GARMENT, &meshes::plain(garment, colours::CLOTH))?;
        self.log_mesh(paths::DISTANCE, &meshes::plain(garment, [255; 3]))?;
        self.log_mesh(paths::PARTS, &self.cells.shape())?;
        self.log_mesh(paths::FORCE, &self.cells.shape())?;
        self.triangles_once(paths::DRAPE)?;
        let [r, g, b] = colours::DRAPED;
        let colour = rerun::Mesh3D::update_fields().with_albedo_factor(rerun::Rgba32::from_rgb(r, g, b));
        self.log_mesh(paths::DRAPE, &colour)
    }

    /// Logs the garment's triangles to a path that does not have them yet.
    fn triangles_once(&self, path: &str) -> Result<(), RecordError> {
        if !self.with_triangles.borrow_mut().insert(path.to_owned()) {
            return Ok(());
        }
        let triangles = rerun::Mesh3D::update_fields().with_triangle_indices(self.garment.triangles.iter().copied());
        self.log_mesh(path, &triangles)
    }

    /// Sends the step on where someone watches.
    fn flush_live(&self) -> Result<(), RecordError> {
        if !self.options.layout.follow {
            return Ok(());
        }
        self.stream
            .flush_with_timeout(LAST_FLUSH)
            .map_err(|e| RecordError::Incomplete { reason: format!("a viewer does not take the data: {e}") })
    }

    fn finish(mut self: Box<Self>) -> Result<RecordSummary, RecordError> {
        let started = Instant::now();
        let flushed = self.stream.flush_with_timeout(LAST_FLUSH);
        // Dropping the sinks ends the file with its footer.
        self.stream.disconnect();
        let mut summary = RecordSummary::default();
        for Target { part, path } in std::mem::take(&mut self.targets) {
            let unwritable = |source| RecordError::Unwritable { path: path.clone(), source };
            inspect::check_complete(&part).inspect_err(|_| {
                let _ = std::fs::remove_file(&part);
            })?;
            std::fs::rename(&part, &path).map_err(unwritable)?;
            summary.bytes = std::fs::metadata(&path).map_err(unwritable)?.len();
            summary.path = Some(path);
        }
        flushed.map_err(|e| RecordError::Incomplete { reason: e.to_string() })?;
        summary.raw_bytes = self.raw_bytes.get();
        summary.log_ms = (self.spent + started.elapsed()).as_secs_f64() * 1e3;
        Ok(summary)
    }
}
