//! The state of a recording that goes somewhere: its stream, what was logged already, and how to log more.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use glam::DVec3;
use rerun::{ApplicationId, AsComponents, RecordingStream, RecordingStreamBuilder};

use super::blueprint::layout::Layout;
use super::colour_map::Rgb;
use super::eye::Eye;
use super::meshes::{self, CellMesh};
use super::sinks::{OpenSinks, Target};
use super::web::WebViewer;
use super::{Range, RecordError, RecordOptions, RecordSummary, blueprint, colours, paths};
use crate::mesh::TriMesh;

/// Bytes of an application's name.
const LONGEST_ID: usize = 100;
/// How long the last data may take to reach viewers.
const LAST_FLUSH: Duration = Duration::from_secs(10);

/// The state of a recording that goes somewhere.
pub(crate) struct Open {
    pub(super) stream: RecordingStream,
    targets: Vec<Target>,
    pub(super) web: Option<WebViewer>,
    pub(super) options: RecordOptions,
    body: TriMesh,
    pub(super) garment: TriMesh,
    pub(super) cells: CellMesh,
    /// Where the views look from, at the garment alone.
    pub(super) eye: Eye,
    pub(super) distance: Vec<f64>,
    pub(super) vertex_shade: Vec<u8>,
    /// Colour of each vertex's PART in the step before.
    pub(super) vertex_colour: Vec<Rgb>,
    pub(super) levels: usize,
    /// What the ends of each quantity's colour map stand for, from its first step on.
    scales: RefCell<BTreeMap<String, Range>>,
    /// The displaced garment of the last step.
    pub(super) draped: Option<TriMesh>,
    /// The last iteration of the solver.
    pub(super) last_iteration: Option<i64>,
    /// The text panel as last logged, Markdown.
    pub(super) report: String,
    seen: RefCell<BTreeSet<String>>,
    laid_out: bool,
    raw_bytes: Cell<u64>,
    pub(super) spent: Duration,
}

impl Open {
    /// Opens every sink, or none.
    pub(super) fn new(options: RecordOptions) -> Result<Self, RecordError> {
        let started = Instant::now();
        let OpenSinks { sinks, targets, web } = OpenSinks::open(&options.sinks)?;
        let stream = RecordingStreamBuilder::new(application(&options.name))
            .recording_name(options.name.as_str())
            .set_sinks(sinks)?;
        // Steps are counted by our own timelines; wall-clock columns would only cost bytes.
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
            distance: Vec::new(),
            vertex_shade: Vec::new(),
            vertex_colour: Vec::new(),
            levels: 0,
            scales: RefCell::default(),
            draped: None,
            last_iteration: None,
            report: String::new(),
            seen: RefCell::new(BTreeSet::new()),
            laid_out: false,
            raw_bytes: Cell::new(0),
            spent: started.elapsed(),
        })
    }

    /// What the recording holds, and how large its views are.
    pub(super) fn layout(&self) -> &Layout {
        &self.options.layout
    }

    /// What the ends of a quantity's colour map stand for: as they were at its first step, or set before it, so that colours compare
    /// from step to step.
    pub(super) fn scale(&self, quantity: &str, first: impl FnOnce() -> Range) -> Range {
        *self.scales.borrow_mut().entry(quantity.to_owned()).or_insert_with(first)
    }

    /// Sets the step and the stage of what is logged next. Where the solver's iterations come too, all stages are there from
    /// the first on: a view shows one timeline at a time, and none would otherwise show both.
    pub(super) fn at(&self, index: i64, stage: i64) {
        self.at_table(index, stage);
        if self.layout().iterations {
            self.stream.set_time_sequence(paths::ITERATION, 0);
        }
    }

    /// Sets the step and the stage of what is logged next, and no iteration.
    pub(super) fn at_table(&self, index: i64, stage: i64) {
        self.stream.reset_time();
        self.stream.set_time_sequence(paths::TABLE, index);
        self.stream.set_time_sequence(paths::STAGE, stage);
    }

    /// Sets the iteration of what is logged next.
    pub(super) fn at_iteration(&self, iteration: i64) {
        self.stream.reset_time();
        self.stream.set_time_sequence(paths::ITERATION, iteration);
    }

    pub(super) fn log(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, false, what)
    }

    /// Logs where the garment is on its way to rest, where that is told.
    pub(super) fn garment_at(&self, positions: Option<&[DVec3]>) -> Result<(), RecordError> {
        match positions.filter(|x| x.len() == self.garment.positions.len()) {
            Some(x) => self.log(paths::DRAPE, &meshes::shape(&self.garment.with_positions(x.to_vec()))),
            None => Ok(()),
        }
    }

    /// Logs a mesh once for all, or at the step where it may be replaced.
    pub(super) fn log_mesh(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, !self.options.replaceable, what)
    }

    /// Logs what never changes, a style.
    pub(super) fn log_fixed(&self, path: &str, what: &dyn AsComponents) -> Result<(), RecordError> {
        self.log_as(path, true, what)
    }

    /// Whether nothing asked for this path yet, since the garment came.
    pub(super) fn first_use(&self, path: &str) -> bool {
        self.seen.borrow_mut().insert(path.to_owned())
    }

    fn log_as(&self, path: &str, fixed: bool, what: &dyn AsComponents) -> Result<(), RecordError> {
        let batches = what.as_serialized_batches();
        let bytes: usize = batches.iter().map(|b| b.array.to_data().get_slice_memory_size().unwrap_or(0)).sum();
        self.raw_bytes.set(self.raw_bytes.get() + bytes as u64);
        Ok(self.stream.log_serialized_batches(path, fixed, batches)?)
    }

    /// Takes the body; the one already shown is not sent again.
    pub(super) fn take_body(&mut self, index: i64, body: &TriMesh) -> Result<(), RecordError> {
        if self.body == *body {
            return Ok(());
        }
        body.clone_into(&mut self.body);
        self.at(index, 0);
        self.log_mesh(paths::BODY, &meshes::plain(body, colours::BODY))
    }

    /// Takes the garment, and lays the views out with the first.
    pub(super) fn take_garment(&mut self, index: i64, garment: &TriMesh) -> Result<(), RecordError> {
        if self.garment == *garment {
            return Ok(());
        }
        self.garment = garment.clone();
        self.cells = CellMesh::new(garment);
        self.distance.clear();
        self.vertex_shade.clear();
        self.vertex_colour.clear();
        self.seen.borrow_mut().clear();
        if let Some(eye) = Eye::on(garment, self.options.front, blueprint::layout::ASPECT) {
            self.eye = eye;
            if !self.laid_out {
                blueprint::send(&self.stream, &self.options.layout.root(&eye), self.options.layout.time_panel())?;
                self.laid_out = true;
            }
        }
        self.at(index, 1);
        self.log_mesh(paths::GARMENT, &meshes::plain(garment, colours::CLOTH))?;
        if self.layout().method.is_none() && !self.layout().table4 {
            self.log_mesh(paths::DISTANCE, &meshes::plain(garment, [255; 3]))?;
            self.log_mesh(paths::PARTS, &self.cells.shape())?;
            self.log_mesh(paths::FORCE, &self.cells.shape())?;
        }
        self.triangles_once(paths::DRAPE)?;
        self.log_mesh(paths::DRAPE, &meshes::colours(colours::by_part(garment)))
    }

    /// Logs the garment's triangles to a path that does not have them yet.
    pub(super) fn triangles_once(&self, path: &str) -> Result<(), RecordError> {
        if !self.first_use(path) {
            return Ok(());
        }
        let triangles = rerun::Mesh3D::update_fields().with_triangle_indices(self.garment.triangles.iter().copied());
        self.log_mesh(path, &triangles)
    }

    /// Sends the step on where someone watches. A viewer that was closed does not end a recording that goes to a file
    /// too: it is told at the end.
    pub(super) fn flush_live(&self) -> Result<(), RecordError> {
        if !self.options.layout.follow {
            return Ok(());
        }
        let flushed = self.stream.flush_with_timeout(LAST_FLUSH);
        self.targets
            .iter()
            .try_for_each(|target| target.writer.check().map_err(|reason| target.incomplete(&reason)))?;
        if self.targets.is_empty() { flushed.map_err(not_taken) } else { Ok(()) }
    }

    /// The mesh comes every so often; the last iteration shows the result.
    fn end_of_iterations(&self) -> Result<(), RecordError> {
        if let (Some(last), Some(draped)) = (self.last_iteration, &self.draped) {
            self.at_iteration(last);
            self.log(paths::DRAPE, &meshes::shape(draped))?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self: Box<Self>) -> Result<RecordSummary, RecordError> {
        let started = Instant::now();
        if let Err(error) = self.end_of_iterations() {
            self.discard();
            return Err(error);
        }
        let flushed = self.stream.flush_with_timeout(LAST_FLUSH);
        self.stream.disconnect();
        let mut summary = RecordSummary::default();
        for target in std::mem::take(&mut self.targets) {
            let file = target.writer.end().map_err(|reason| target.incomplete(&reason))?;
            summary.bytes = file.finish().map_err(|error| target.incomplete(&error.to_string()))?;
            summary.path = Some(target.path);
        }
        flushed.map_err(not_taken)?;
        summary.raw_bytes = self.raw_bytes.get();
        summary.log_ms = (self.spent + started.elapsed()).as_secs_f64() * 1e3;
        Ok(summary)
    }

    /// Takes back what was begun.
    pub(super) fn discard(self: Box<Self>) {
        self.stream.disconnect();
        self.targets.iter().for_each(|target| target.writer.discard());
    }
}

impl Target {
    fn incomplete(&self, reason: &str) -> RecordError {
        let path = self.path.display();
        RecordError::Incomplete { reason: format!("{path}: {reason}; make room, or choose another place with --save") }
    }
}

fn not_taken(error: impl std::fmt::Display) -> RecordError {
    RecordError::Incomplete { reason: format!("a viewer does not take the data: {error}") }
}

/// The viewer keeps one layout for each application: under one name, a recording opened later would rearrange the views of
/// those before, and leave some blank.
pub(super) fn application(name: &str) -> ApplicationId {
    let pieces = name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|piece| !piece.is_empty());
    let mut id = std::iter::once("partwise").chain(pieces).collect::<Vec<_>>().join("-");
    id.truncate(LONGEST_ID);
    ApplicationId::try_new(id).unwrap_or_else(|_| ApplicationId::from("partwise"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_of_different_names_have_different_layouts() {
        assert_eq!(application("flared-skirt@1200: Table 3").to_string(), "partwise-flared-skirt-1200-Table-3");
        assert_eq!(application("").to_string(), "partwise");
        assert_eq!(application(&"a".repeat(1000)).to_string().len(), LONGEST_ID);
    }
}
