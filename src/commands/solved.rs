//! A garment after every stage, and its recording: one step of the timeline with all stages, fit and folds, and the iterations of the
//! solver as they come; and the recording of a session, one step for each finished state.

use std::time::{Duration, Instant};

use crate::Job;
use crate::drape::{Drape, Model, Refine, unobserved};
use crate::mechanics::folded_surface::FoldedSurface;
use crate::mechanics::refine::Step;
use crate::record::{
    FoldView, Layout, OutfitView, Overlay, PatternView, RecordError, RecordOptions, RecordSummary, Recorder, StepView,
    Tab, WrinkleView,
};
use crate::scene::{Loaded, Tailored};
use crate::session::{Finished, Session};
use crate::study::job::{Against, Measured};
use glam::DVec3;

use super::console;
use super::sinks::SinkArgs;
use super::summary::Summary;

/// A garment after every stage.
pub(super) struct Solved {
    pub(super) loaded: Loaded,
    pub(super) drape: Drape,
    pub(super) measured: Measured,
    /// The preview with its folds, where it is the result.
    pub(super) folded: Option<FoldedSurface>,
    /// Recorded iterations of the solver.
    pub(super) iterations: i64,
    pub(super) summary: Summary,
}

/// Interval, in solver iterations, at which the mesh is recorded. A smaller interval gives a smoother animation and a larger file; this
/// one, a heuristic, keeps a recording at a few megabytes.
const MESH_INTERVAL: i64 = 8;

/// Records the iterations of the solver as they come. Solves on coarser garments and rejected trials are replaced by the iteration that follows.
/// A second solve, as of a garment that has slid once released, continues the numbers of the first.
pub(super) struct IterationLog<'r> {
    recorder: Option<&'r mut Recorder>,
    /// The last iteration, which is not recorded yet, and its number.
    last: Option<Iteration>,
    number: i64,
}

/// The cloth at one iteration of the solver.
struct Iteration {
    /// As the solver counts.
    iteration: usize,
    /// J.
    energy: f64,
    residual_over_weight: f64,
    /// Positions, m; present in some iterations only.
    positions: Option<Vec<DVec3>>,
}

impl<'r> IterationLog<'r> {
    /// Records to `recorder`, if there is one.
    pub(super) fn new(recorder: Option<&'r mut Recorder>) -> Self {
        Self { recorder, last: None, number: 0 }
    }

    /// Adds a state of the solver.
    pub(super) fn add(&mut self, step: &Step<'_>) -> Result<(), RecordError> {
        // A state at rest was reported before, as an iteration.
        if self.recorder.is_none() || step.at_rest {
            return Ok(());
        }
        if self.last.as_ref().is_some_and(|last| last.iteration != step.iteration) {
            self.send()?;
        }
        let Step { iteration, energy, residual_over_weight, .. } = *step;
        let positions = (self.number % MESH_INTERVAL == 0).then(|| step.positions.to_vec());
        self.last = Some(Iteration { iteration, energy, residual_over_weight, positions });
        Ok(())
    }

    /// Records the last iteration; returns how many there are.
    pub(super) fn finish(mut self) -> Result<i64, RecordError> {
        self.send()?;
        Ok(self.number)
    }

    fn send(&mut self) -> Result<(), RecordError> {
        let (Some(recorder), Some(last)) = (&mut self.recorder, self.last.take()) else { return Ok(()) };
        let Iteration { energy, residual_over_weight, positions, .. } = last;
        recorder.iteration(self.number, energy, residual_over_weight, positions.as_deref())?;
        self.number += 1;
        Ok(())
    }
}

/// Opens the recording of a garment that is still to be draped, with the layout that its job lets expect, and records body and garment; the time
/// that this took.
pub(super) fn begin(
    sinks: &SinkArgs,
    job: &Job,
    loaded: &Loaded,
    iterations: bool,
) -> Result<(Recorder, Duration), RecordError> {
    let began = Instant::now();
    let is_coupled = matches!(job.settings.model, Model::Coupled(_));
    let fit: &[&str] = match job.settings.refine {
        _ if is_coupled => &["strain", "pressure", "folds"],
        Refine::Steps(0) => &[],
        _ => &["strain", "pressure"],
    };
    let layout = Layout {
        iterations,
        fit: fit.iter().map(|name| (*name).to_owned()).collect(),
        ..layout_of(loaded, !matches!(job.accuracy, Against::None))
    };
    let mut recorder = open(sinks, loaded, layout, false)?;
    recorder.body(0, loaded.scene.body.mesh())?;
    recorder.garment(0, &loaded.scene.garment)?;
    Ok((recorder, began.elapsed()))
}

fn open(sinks: &SinkArgs, loaded: &Loaded, layout: Layout, live: bool) -> Result<Recorder, RecordError> {
    Recorder::open(RecordOptions {
        sinks: sinks.sinks(&loaded.garment_name),
        name: loaded.garment_name.clone(),
        layout,
        replaceable: live,
        front: sinks.seen_from.direction(),
    })
}

/// The layout of a garment's recording, without fit and iterations.
fn layout_of(loaded: &Loaded, error: bool) -> Layout {
    let layers = &loaded.scene.layers;
    let layered = layers.len() > 1;
    Layout {
        error,
        pattern: loaded.tailored.is_some(),
        outfit: if layered { layers.clone() } else { Vec::new() },
        wrinkles: error,
        opens_on: if layered { Tab::Outfit } else { Tab::Stages },
        ..Layout::default()
    }
}

/// The preview with its folds, where the job ends with the preview.
pub(super) fn folded_preview(loaded: &Loaded, job: &Job, drape: &Drape) -> Option<FoldedSurface> {
    let ends = job.settings.refine == Refine::Steps(0);
    let folded = ends.then(|| drape.folded_preview(&loaded.scene)).flatten();
    folded.filter(|folded| !folded.counts.is_empty())
}

impl Solved {
    /// A state of a session and its measurements.
    pub(super) fn of_session(job: &Job, finished: &Finished, measured: Measured) -> anyhow::Result<Self> {
        let (loaded, drape) = (finished.loaded_scene.input.clone(), finished.drape.clone());
        let folded = folded_preview(&loaded, job, &drape);
        let mut summary = Summary::new(&loaded, &job.settings, &drape, &measured)?;
        summary.add_time("load", Duration::from_secs_f64(1e-3 * finished.loaded_scene.load_ms));
        Ok(Self { loaded, drape, measured, folded, iterations: 0, summary })
    }

    /// Opens a recording of this garment. Further steps follow, whose meshes may differ.
    pub(super) fn open(&self, sinks: &SinkArgs) -> Result<Recorder, RecordError> {
        let layout = Layout { several_tables: true, follow: true, iterations: false, ..self.layout() };
        open(sinks, &self.loaded, layout, true)
    }

    /// The layout of its recording.
    pub(super) fn layout(&self) -> Layout {
        let fit = self.overlays().into_iter().map(|overlay| overlay.name).filter(|name| *name != "error");
        Layout {
            iterations: self.iterations > 1,
            fit: fit.map(str::to_owned).collect(),
            ..layout_of(&self.loaded, self.measured.evaluation.is_some())
        }
    }

    /// Values per vertex shown on the draped garment: strain, pressure, folds, and the error if it was measured.
    pub(super) fn overlays(&self) -> Vec<Overlay<'_>> {
        let mut overlays = Vec::new();
        if let Some(state) = &self.drape.state {
            overlays.push(Overlay { name: "strain", unit: "%", values: &state.fit.strain_percent, positions: None });
            overlays.push(Overlay { name: "pressure", unit: "kPa", values: &state.fit.pressure_kpa, positions: None });
        }
        if let Some(folds) = &self.drape.folds {
            let (values, positions) = (&folds.excess_percent, self.folded.as_ref().map(|folded| &folded.positions[..]));
            overlays.push(Overlay { name: "folds", unit: "%", values, positions });
        }
        if self.measured.evaluation.is_some() {
            overlays.push(Overlay { name: "error", unit: "mm", values: &self.measured.error_mm, positions: None });
        }
        overlays
    }

    /// Logs step `index`.
    pub(super) fn record(&mut self, recorder: &mut Recorder, index: i64) -> anyhow::Result<()> {
        let start = Instant::now();
        let Self { loaded, drape, measured, summary, .. } = &*self;
        let scene = &loaded.scene;
        let draped = &drape.positions;
        recorder.body(index, scene.body.mesh())?;
        recorder.garment(index, &scene.garment)?;
        if scene.layers.len() == 1 && scene.own_fabrics.len() > 1 {
            recorder.fabrics(index, &scene.fabric_of_vertices())?;
        }
        let forces: Vec<DVec3> = drape.outcomes.iter().map(|o| o.force_n).collect();
        let mut scalars = summary.metrics.scalars();
        scalars.retain(|(name, _)| name.starts_with("error/"));
        recorder.step(&StepView {
            index,
            distances_m: &drape.distance,
            part_of_vertex: &drape.parts.part_of_vertex,
            part_force_n: &forces,
            draped,
            panel: &summary.panel(),
            scalars: &scalars,
            overlays: &self.overlays(),
        })?;
        if let Some(Tailored { pattern, put_on }) = &loaded.tailored {
            let (flat, garment_vertex) = put_on.garment.unsewn(pattern);
            let fit = self.overlays().into_iter().filter(|o| ["strain", "pressure"].contains(&o.name));
            let overlays = &fit.collect::<Vec<_>>();
            recorder.pattern(&PatternView { index, flat: &flat, garment_vertex: &garment_vertex, overlays })?;
        }
        if scene.layers.len() > 1 {
            let of_part = |&p: &u32| forces.get(p as usize).map_or(0.0, |force| force.length());
            let force_n: Vec<f64> = drape.parts.part_of_vertex.iter().map(of_part).collect();
            recorder.outfit(&OutfitView { index, force_n: &force_n, draped })?;
        }
        if let Some(folds) = &drape.folds {
            let (excess_percent, across) = (&folds.excess_percent, &folds.across);
            let draped = self.folded.as_ref().map_or(draped, |folded| &folded.positions);
            recorder.folds(&FoldView { index, draped, excess_percent, across })?;
        }
        if let Some(evaluation) = &measured.evaluation {
            let edges = scene.topology.edges.as_slice();
            let seams = drape.parts.seams.iter().zip(&evaluation.wrinkles.seams);
            let jumps = seams.flat_map(|(seam, measured)| {
                seam.edges.iter().map(|&e| (edges[e as usize], measured.displacement_difference_mm))
            });
            let (jumps_mm, curvature_per_m) = (&jumps.collect::<Vec<_>>(), &evaluation.wrinkles.vertex_curvature_per_m);
            recorder.wrinkles(&WrinkleView { index, draped, jumps_mm, curvature_per_m })?;
        }
        self.summary.add_time("record", start.elapsed());
        Ok(())
    }
}

/// Interval at which a session is polled.
pub(super) const POLL: Duration = Duration::from_millis(100);

/// Interval at which the connection to a viewer is tested, and a lost one is opened again.
const RECONNECT: Duration = Duration::from_secs(2);

/// Records the finished states of a session into a file until the session is closed. An error is reported at once, and the session
/// continues.
pub(super) fn record_session(session: &Session, sinks: &SinkArgs) -> anyhow::Result<RecordSummary> {
    let recorded = sinks.check_outputs(&[]).and_then(|()| follow(session, sinks, &mut || ()));
    if let Err(error) = &recorded {
        console::error(error);
        console::note("the session continues without the recording");
    }
    recorded
}

/// Streams the finished states of a session to a remote viewer until the session is closed. A viewer that connects late or again gets
/// the newest state.
pub(super) fn show_session(session: &Session, sinks: &SinkArgs) {
    let mut lost = false;
    while !session.is_closed() {
        let mut connected = || {
            if std::mem::take(&mut lost) {
                console::note("a viewer is connected");
            }
        };
        match follow(session, sinks, &mut connected) {
            Ok(_) => return,
            Err(error) if matches!(error.downcast_ref(), Some(RecordError::BadUrl { .. })) => {
                console::error(&error);
                return console::note("the session continues without a viewer");
            }
            Err(error) => {
                if !std::mem::replace(&mut lost, true) {
                    console::error(&error);
                    console::note("the session continues; a viewer that connects later shows it");
                }
            }
        }
        let since = Instant::now();
        while since.elapsed() < RECONNECT && !session.is_closed() {
            std::thread::sleep(POLL);
        }
    }
}

/// Records the finished states of a session until it is closed, and calls `connected` after the first.
fn follow(session: &Session, sinks: &SinkArgs, connected: &mut dyn FnMut()) -> anyhow::Result<RecordSummary> {
    let mut recorder: Option<Recorder> = None;
    let (mut serial, mut last, mut index) = (0, 0, 0);
    let mut flushed = Instant::now();
    while !session.is_closed() {
        let now = session.newer_than(serial, POLL);
        serial = now.serial;
        let Some(finished) = now.finished.as_ref().filter(|f| f.state > last && f.state == now.state) else {
            if let Some(recorder) = recorder.as_mut().filter(|_| flushed.elapsed() > RECONNECT) {
                recorder.flush()?;
                flushed = Instant::now();
            }
            continue;
        };
        last = finished.state;
        let job = Job { accuracy: Against::None, ..(*now.job).clone() };
        let measured = job.measure(&finished.loaded_scene.input.scene, &finished.drape, None, &mut unobserved)?;
        let mut solved = Solved::of_session(&job, finished, measured)?;
        let recorder = match &mut recorder {
            Some(recorder) => recorder,
            none => none.insert(solved.open(sinks)?),
        };
        solved.record(recorder, index)?;
        if index == 0 {
            connected();
        }
        index += 1;
    }
    Ok(recorder.map(Recorder::finish).transpose()?.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_solve_continues_the_numbers_of_the_first() {
        let mut recorder = Recorder::open(RecordOptions::default()).unwrap();
        let mut log = IterationLog::new(Some(&mut recorder));
        let step = |iteration| Step {
            iteration,
            energy: 1.0,
            residual_over_weight: 0.1,
            contacts: 0,
            positions: &[],
            at_rest: false,
        };
        // A rejected trial is reported with the number of the iteration that replaces it.
        for iteration in [0, 1, 1, 2, 0, 1] {
            log.add(&step(iteration)).unwrap();
        }
        log.add(&Step { at_rest: true, ..step(1) }).unwrap();
        assert_eq!(log.finish().unwrap(), 5);
    }
}
