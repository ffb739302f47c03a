//! The recorder: logs the stages of a drape to the sinks of a recording.

use std::time::Instant;

use glam::DVec3;
use rerun::{Scalars, TextDocument};

use super::charts::log_scalar;
use super::compare::{self, Compared};
use super::error::RecordError;
use super::layout::Layout;
use super::method::{self, MethodView};
use super::open_recording::{OpenRecording, RecordOptions, RecordSummary};
use super::overlay::{self, PatternView};
use super::scatter::{self, Picture, ScatterPoint};
use super::step::{self, OutfitView, StepView};
use super::web::WebViewer;
use super::wrinkles::{self, FoldView, WrinkleView};
use super::{blueprint, meshes, paths, tabs};
use crate::mesh::TriMesh;
use crate::picture::colour::cells::CellMesh;
use crate::picture::colour::map::Range;
use crate::picture::colour::palette;

/// A recording in progress. Its methods fail if Rerun rejects the data, and if a slice does not fit the garment. Dropping it without
/// [`finish`](Self::finish) leaves no file.
pub struct Recorder {
    recording: Option<Box<OpenRecording>>,
}

impl Recorder {
    /// Opens every sink, or none. Without sinks, nothing is recorded.
    ///
    /// # Errors
    /// An unwritable file, a port in use, a viewer that does not answer.
    pub fn open(options: RecordOptions) -> Result<Self, RecordError> {
        if options.sinks.is_empty() {
            return Ok(Self { recording: None });
        }
        Ok(Self { recording: Some(Box::new(OpenRecording::new(options)?)) })
    }

    /// The address of the web viewer, if one is served.
    #[must_use]
    pub fn web_url(&self) -> Option<&str> {
        self.recording.as_ref()?.web.as_ref().map(WebViewer::url)
    }

    /// Logs the body. `index` is its step if meshes are replaceable. The same body again is not logged.
    pub fn body(&mut self, index: i64, body: &TriMesh) -> Result<(), RecordError> {
        self.timed(|recording| {
            if recording.body == *body {
                return Ok(());
            }
            body.clone_into(&mut recording.body);
            recording.at(index, 0);
            recording.log_mesh(paths::BODY, &meshes::plain(body, palette::BODY))
        })
    }

    /// Logs the garment as loaded, and sends the layout with the first one. The same garment again is not logged.
    pub fn garment(&mut self, index: i64, garment: &TriMesh) -> Result<(), RecordError> {
        self.timed(|recording| {
            if recording.garment == *garment {
                return Ok(());
            }
            recording.set_garment(garment);
            if !recording.views_sent && !garment.positions.is_empty() {
                send_views(recording)?;
                recording.views_sent = true;
            }
            recording.at(index, 1);
            let placed = meshes::whole(garment);
            recording.log_mesh(paths::GARMENT, &meshes::coloured(placed.clone(), palette::CLOTH))?;
            if recording.layout().method.is_none() && !recording.layout().table4 {
                recording.log_mesh(paths::DISTANCE, &meshes::coloured(placed, [255; 3]))?;
                if recording.layout().several_tables {
                    recording.cells = CellMesh::new(garment);
                    recording.log_cells()?;
                }
            }
            recording.triangles_once(paths::DRAPE)?;
            recording.log_mesh(paths::DRAPE, &meshes::colours(palette::by_component(garment)))
        })
    }

    /// Replaces the layout, and sends it where it differs from the one before.
    pub(crate) fn set_layout(&mut self, layout: Layout) -> Result<(), RecordError> {
        self.timed(|recording| {
            if *recording.layout() == layout {
                return Ok(());
            }
            recording.options.layout = layout;
            if recording.views_sent { send_views(recording) } else { Ok(()) }
        })
    }

    /// Colours the drape by fabric.
    pub(crate) fn fabrics(&mut self, index: i64, fabric_of_vertex: &[u16]) -> Result<(), RecordError> {
        self.timed(|recording| {
            recording.check_lengths(&[("fabrics", fabric_of_vertex.len())])?;
            recording.at(index, 1);
            let colours = fabric_of_vertex.iter().map(|&fabric| palette::of_layer(fabric.into()));
            recording.log_mesh(paths::DRAPE, &meshes::colours(colours))
        })
    }

    /// Sets the range of a quantity's colour map (`error` in mm, `force` in N) for a recording whose steps are all known. By default
    /// the first step sets it.
    pub(crate) fn set_range(&mut self, quantity: &str, range: Range) {
        if let Some(recording) = &self.recording {
            recording.range(quantity, || range);
        }
    }

    /// Logs the result of one range table.
    pub fn step(&mut self, step: &StepView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| {
            step::log(recording, step)?;
            recording.flush_live()
        })
    }

    /// Logs a message above the text panel of an unchanged step: the error in a file that was edited.
    pub(crate) fn notice(&mut self, index: i64, message: &str) -> Result<(), RecordError> {
        self.timed(|recording| {
            recording.at(index, 6);
            let bold = message.replace('\n', "**\n\n**");
            let report = &recording.report;
            let text = format!("**⚠ {bold}**\n\nBelow: the last result that could be solved.\n\n{report}");
            recording.log(paths::REPORT, &TextDocument::from_markdown(text))?;
            recording.flush_live()
        })
    }

    /// Logs an iteration of the solver: energy, J, residual over weight, and some of the meshes.
    pub(crate) fn iteration(
        &mut self,
        iteration: i64,
        energy_j: f64,
        residual_over_weight: f64,
        positions: Option<&[DVec3]>,
    ) -> Result<(), RecordError> {
        self.timed(|recording| {
            recording.at_iteration(iteration);
            recording.last_iteration = Some(iteration);
            log_scalar(recording, paths::ENERGY, "energy", 1, energy_j)?;
            recording.log(paths::RESIDUAL, &Scalars::single(residual_over_weight))?;
            // The viewer's plots have no logarithmic axis.
            let log10 = residual_over_weight.log10();
            log_scalar(recording, paths::RESIDUAL_LOG10, "residual over weight, log10", 0, log10)?;
            recording.log_positions(positions)
        })
    }

    /// Logs a time step of a reference method: RMS speed of the vertices, m/s, and some of the meshes.
    pub(crate) fn time_step(
        &mut self,
        step: i64,
        rms_speed: f64,
        positions: Option<&[DVec3]>,
    ) -> Result<(), RecordError> {
        self.timed(|recording| method::log_time_step(recording, step, rms_speed, positions))
    }

    /// Logs the result of a reference method.
    pub(crate) fn method(&mut self, view: &MethodView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| method::log(recording, view))
    }

    /// Logs both measures of wrinkles.
    pub(crate) fn wrinkles(&mut self, view: &WrinkleView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| wrinkles::log(recording, view))
    }

    /// Logs the directions of folds narrower than a PART.
    pub(crate) fn folds(&mut self, view: &FoldView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| wrinkles::log_folds(recording, view))
    }

    /// Logs the layers of an outfit, in the PART colours of the last step.
    pub(crate) fn outfit(&mut self, view: &OutfitView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| step::log_outfit(recording, view))
    }

    /// Logs the flat panels of a sewing pattern, in the PART colours of the last step.
    pub(crate) fn pattern(&mut self, view: &PatternView<'_>) -> Result<(), RecordError> {
        self.timed(|recording| overlay::log_pattern(recording, view))
    }

    /// Logs one of the results side by side.
    pub(crate) fn compare(&mut self, compared: &Compared<'_>) -> Result<(), RecordError> {
        self.timed(|recording| compare::log(recording, compared))
    }

    /// Logs all points of a scatter plot so far, at a step of the timeline `table`.
    pub(crate) fn scatter(
        &mut self,
        index: i64,
        picture: Picture<'_>,
        points: &[ScatterPoint<'_>],
    ) -> Result<(), RecordError> {
        self.timed(|recording| scatter::log(recording, index, picture, points))
    }

    /// Sends the logged data to live viewers.
    pub(crate) fn flush(&mut self) -> Result<(), RecordError> {
        self.timed(|recording| recording.flush_live())
    }

    /// Sends the remaining data, and completes and renames the file.
    ///
    /// # Errors
    /// A file that could not be completed, a viewer that was closed.
    pub fn finish(mut self) -> Result<RecordSummary, RecordError> {
        self.recording.take().map_or_else(|| Ok(RecordSummary::default()), OpenRecording::finish)
    }

    fn timed(&mut self, log: impl FnOnce(&mut OpenRecording) -> Result<(), RecordError>) -> Result<(), RecordError> {
        let Some(recording) = &mut self.recording else { return Ok(()) };
        let started = Instant::now();
        let result = log(recording);
        recording.spent += started.elapsed();
        result
    }
}

/// Sends the layout of a recording.
fn send_views(recording: &OpenRecording) -> Result<(), RecordError> {
    let layout = recording.layout();
    blueprint::send(&recording.stream, &tabs::root(layout, &recording.eye), tabs::time_panel(layout))
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Some(recording) = self.recording.take() {
            recording.discard();
        }
    }
}
