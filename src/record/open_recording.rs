//! The state of a recording with sinks: its stream, the meshes and colours logged so far, and how to log more.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::DVec3;
use rerun::{ApplicationId, AsComponents, RecordingStream, RecordingStreamBuilder};

use super::error::RecordError;
use super::eye::Eye;
use super::layout::{ASPECT, Layout};
use super::sinks::{OpenSinks, Sink, Target};
use super::web::WebViewer;
use super::{meshes, paths};
use crate::mesh::TriMesh;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::{Range, Rgb};

/// Longest application id, bytes.
const MAX_ID: usize = 100;
/// Longest wait for viewers to take the last data.
const LAST_FLUSH: Duration = Duration::from_secs(10);

/// The sinks, name and layout of a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordOptions {
    /// Where the recording goes. Without sinks nothing is recorded.
    pub sinks: Vec<Sink>,
    /// Name of the recording in the viewer (`low-cut dress, Table 3`).
    pub name: String,
    /// The contents that will be logged, which determine the views.
    pub layout: Layout,
    /// Direction in which the wearer looks (horizontal); zero stands for −y.
    pub front: DVec3,
    /// Whether meshes may be replaced later (`--watch`): they are then logged at a step instead of statically.
    pub replaceable: bool,
}

/// Size and cost of a finished recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordSummary {
    /// The file, if the recording has one.
    pub path: Option<PathBuf>,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// Bytes of the logged data before encoding and compression.
    pub raw_bytes: u64,
    /// Time spent on recording, ms.
    pub log_ms: f64,
}

impl RecordSummary {
    /// A line that names the file, if there is one.
    pub(crate) fn file_line(&self) -> Option<String> {
        self.path.as_ref().map(|path| format!("recording: {}", path.display()))
    }
}

/// A recording with sinks.
pub(super) struct OpenRecording {
    pub(super) stream: RecordingStream,
    targets: Vec<Target>,
    pub(super) web: Option<WebViewer>,
    pub(super) options: RecordOptions,
    pub(super) body: TriMesh,
    pub(super) garment: TriMesh,
    /// The cells of PARTs and forces: of one table, divided at its borders alone.
    pub(super) cells: CellMesh,
    /// The eye of the views, at the garment alone.
    pub(super) eye: Eye,
    pub(super) views_sent: bool,
    pub(super) distance: Vec<f64>,
    pub(super) vertex_shade: Vec<u8>,
    /// Colour of each vertex's PART in the last step.
    pub(super) vertex_colour: Vec<Rgb>,
    pub(super) levels: usize,
    /// Range of each quantity's colour map, fixed by its first step.
    ranges: RefCell<BTreeMap<String, Range>>,
    /// The drape of the last step.
    pub(super) draped: Option<TriMesh>,
    /// The last iteration of the solver.
    pub(super) last_iteration: Option<i64>,
    /// The last text panel, Markdown.
    pub(super) report: String,
    used_paths: RefCell<BTreeSet<String>>,
    raw_bytes: Cell<u64>,
    pub(super) spent: Duration,
}

impl OpenRecording {
    /// Opens every sink, or none.
    pub(super) fn new(options: RecordOptions) -> Result<Self, RecordError> {
        let started = Instant::now();
        let OpenSinks { sinks, targets, web } = OpenSinks::open(&options.sinks)?;
        let stream = RecordingStreamBuilder::new(application(&options.name))
            .recording_name(options.name.as_str())
            .set_sinks(sinks)?;
        // Our own timelines count the steps; wall-clock columns would cost bytes.
        stream.set_log_tick_enabled(false);
        stream.set_log_time_enabled(false);
        Ok(Self {
            stream,
            targets,
            web,
            options,
            body: TriMesh::default(),
            garment: TriMesh::default(),
            cells: CellMesh::new(&TriMesh::default()),
            eye: Eye::default(),
            views_sent: false,
            distance: Vec::new(),
            vertex_shade: Vec::new(),
            vertex_colour: Vec::new(),
            levels: 0,
            ranges: RefCell::default(),
            draped: None,
            last_iteration: None,
            report: String::new(),
            used_paths: RefCell::default(),
            raw_bytes: Cell::new(0),
            spent: started.elapsed(),
        })
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.options.layout
    }

    /// The range of a quantity's colour map. It is set once, by the first step or before it, so that colours are comparable
    /// from step to step.
    pub(super) fn range(&self, quantity: &str, first: impl FnOnce() -> Range) -> Range {
        *self.ranges.borrow_mut().entry(quantity.to_owned()).or_insert_with(first)
    }

    /// Replaces the garment. Colours and triangles of the previous one are forgotten.
    pub(super) fn set_garment(&mut self, garment: &TriMesh) {
        self.garment = garment.clone();
        self.cells = CellMesh::new(&TriMesh::default());
        self.distance.clear();
        self.vertex_shade.clear();
        self.vertex_colour.clear();
        self.used_paths.borrow_mut().clear();
        if let Some(eye) = Eye::on(garment, self.options.front, ASPECT) {
            self.eye = eye;
        }
    }

    /// Fails unless each list has one value per vertex of the garment.
    pub(super) fn check_lengths(&self, lists: &[(&str, usize)]) -> Result<(), RecordError> {
        RecordError::unless_per_vertex(self.garment.positions.len(), lists)
    }

    /// Sets step and stage of the next data. If the recording has iterations, all stages are also at the first iteration:
    /// a view shows one timeline at a time, and none would otherwise show both.
    pub(super) fn at(&self, index: i64, stage: i64) {
        self.at_table(index, stage);
        if self.layout().iterations {
            self.stream.set_time_sequence(paths::ITERATION, 0);
        }
    }

    /// Sets step and stage of the next data, and no iteration.
    pub(super) fn at_table(&self, index: i64, stage: i64) {
        self.stream.reset_time();
        self.stream.set_time_sequence(paths::TABLE, index);
        self.stream.set_time_sequence(paths::STAGE, stage);
    }

    /// Sets the iteration of the next data.
    pub(super) fn at_iteration(&self, iteration: i64) {
        self.stream.reset_time();
        self.stream.set_time_sequence(paths::ITERATION, iteration);
    }

    pub(super) fn log(&self, path: &str, data: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, false, data)
    }

    /// Logs a mesh statically, or at the step if meshes are replaceable.
    pub(super) fn log_mesh(&self, path: &str, data: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, !self.options.replaceable, data)
    }

    /// Logs the cells of PARTs and forces, without colours.
    pub(super) fn log_cells(&self) -> Result<(), RecordError> {
        let cells = self.cells.shape();
        self.log_mesh(paths::PARTS, &cells)?;
        self.log_mesh(paths::FORCE, &cells)
    }

    /// Logs data that never change, such as a style.
    pub(super) fn log_static(&self, path: &str, data: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, true, data)
    }

    fn log_as(&self, path: &str, fixed: bool, data: &dyn AsComponents) -> Result<(), RecordError> {
        let batches = data.as_serialized_batches();
        let bytes: usize = batches.iter().map(|b| b.array.to_data().get_slice_memory_size().unwrap_or(0)).sum();
        self.raw_bytes.set(self.raw_bytes.get() + bytes as u64);
        Ok(self.stream.log_serialized_batches(path, fixed, batches)?)
    }

    /// Logs the garment's positions during the solve, if they are given.
    pub(super) fn log_positions(&self, positions: Option<&[DVec3]>) -> Result<(), RecordError> {
        match positions.filter(|positions| positions.len() == self.garment.positions.len()) {
            Some(x) => self.log(paths::DRAPE, &meshes::shape(&self.garment.with_positions(x.to_vec()))),
            None => Ok(()),
        }
    }

    /// Logs the text panel, and keeps it for later messages.
    pub(super) fn log_report(&mut self, report: String) -> Result<(), RecordError> {
        self.report = report;
        self.log(paths::REPORT, &rerun::TextDocument::from_markdown(self.report.as_str()))
    }

    /// Logs the garment's triangles to a path that does not have them yet.
    pub(super) fn triangles_once(&self, path: &str) -> Result<(), RecordError> {
        if !self.first_use(path) {
            return Ok(());
        }
        let triangles = rerun::Mesh3D::update_fields().with_triangle_indices(self.garment.triangles.iter().copied());
        self.log_mesh(path, &triangles)
    }

    /// Whether this is the first call with this path since the garment was set.
    pub(super) fn first_use(&self, path: &str) -> bool {
        self.used_paths.borrow_mut().insert(path.to_owned())
    }

    /// Flushes a recording that is viewed while it grows. A recording that also goes to a file outlives a viewer that was closed:
    /// `finish` reports the viewer.
    pub(super) fn flush_live(&self) -> Result<(), RecordError> {
        if !self.layout().follow {
            return Ok(());
        }
        let flushed = self.stream.flush_with_timeout(LAST_FLUSH);
        for target in &self.targets {
            target.writer.check().map_err(|reason| target.unwritable(&reason))?;
        }
        if self.targets.is_empty() { flushed.map_err(not_taken) } else { Ok(()) }
    }

    /// Logs the result at the last iteration, since the mesh is not logged at every iteration.
    fn end_iterations(&self) -> Result<(), RecordError> {
        if let (Some(last), Some(draped)) = (self.last_iteration, &self.draped) {
            self.at_iteration(last);
            self.log(paths::DRAPE, &meshes::shape(draped))?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self: Box<Self>) -> Result<RecordSummary, RecordError> {
        let started = Instant::now();
        if let Err(error) = self.end_iterations() {
            self.discard();
            return Err(error);
        }
        let flushed = self.stream.flush_with_timeout(LAST_FLUSH);
        self.stream.disconnect();
        let mut summary = RecordSummary::default();
        for target in std::mem::take(&mut self.targets) {
            let file = target.writer.end().map_err(|reason| target.unwritable(&reason))?;
            summary.bytes = file.finish().map_err(|error| target.unwritable(&error.to_string()))?;
            summary.path = Some(target.path);
        }
        flushed.map_err(not_taken)?;
        summary.raw_bytes = self.raw_bytes.get();
        summary.log_ms = (self.spent + started.elapsed()).as_secs_f64() * 1e3;
        Ok(summary)
    }

    /// Ends the recording and removes its files.
    pub(super) fn discard(self: Box<Self>) {
        self.stream.disconnect();
        self.targets.iter().for_each(|target| target.writer.discard());
    }
}

fn not_taken(error: impl std::fmt::Display) -> RecordError {
    RecordError::Incomplete { reason: format!("a viewer does not take the data: {error}") }
}

/// The application id of a recording. The viewer keeps one layout per application: under one id, a recording opened later would
/// rearrange the views of earlier ones and leave some blank.
pub(super) fn application(name: &str) -> ApplicationId {
    let pieces = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|piece| !piece.is_empty());
    let mut id = std::iter::once("partwise").chain(pieces).collect::<Vec<_>>().join("-");
    id.truncate(MAX_ID);
    ApplicationId::try_new(id).unwrap_or_else(|_| ApplicationId::from("partwise"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_of_different_names_have_different_layouts() {
        assert_eq!(application("flared-skirt@1200: Table 3").to_string(), "partwise-flared-skirt-1200-Table-3");
        assert_eq!(application("").to_string(), "partwise");
        assert_eq!(application(&"a".repeat(1000)).to_string().len(), MAX_ID);
    }
}
