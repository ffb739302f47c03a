//! A garment after every stage, and its recording: one step of the timeline with all stages, fit and folds, and the iterations of the
//! solver; and the recording of a session, one step for each finished state.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::Job;
use crate::drape::{Drape, Refine, unobserved};
use crate::mechanics::folded_surface::FoldedSurface;
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
    /// States of the solver by iteration.
    pub(super) iterations: BTreeMap<usize, Iteration>,
    pub(super) summary: Summary,
}

/// The cloth at one iteration of the solver.
pub(super) struct Iteration {
    /// J.
    pub(super) energy: f64,
    pub(super) residual_over_weight: f64,
    /// Positions, m; present in some iterations only.
    pub(super) positions: Option<Vec<DVec3>>,
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
        Ok(Self { loaded, drape, measured, folded, iterations: BTreeMap::new(), summary })
    }

    /// Opens a recording of this garment. With `live`, further steps follow, whose meshes may differ.
    pub(super) fn open(&self, sinks: &SinkArgs, iterations: bool, live: bool) -> Result<Recorder, RecordError> {
        let overlays = self.overlays();
        let layers = &self.loaded.scene.layers;
        let layered = layers.len() > 1;
        let fit = overlays.iter().map(|overlay| overlay.name).filter(|name| *name != "error");
        Recorder::open(RecordOptions {
            sinks: sinks.sinks(&self.loaded.garment_name),
            name: self.loaded.garment_name.clone(),
            layout: Layout {
                several_tables: live,
                follow: live,
                iterations: iterations && self.iterations.len() > 1,
                error: self.measured.evaluation.is_some(),
                pattern: self.loaded.tailored.is_some(),
                outfit: if layered { layers.clone() } else { Vec::new() },
                wrinkles: self.measured.evaluation.is_some(),
                fit: fit.map(str::to_owned).collect(),
                opens_on: if layered { Tab::Outfit } else { Tab::Stages },
                ..Layout::default()
            },
            replaceable: live,
            front: sinks.seen_from.direction(),
        })
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

    /// Logs step `index`, with the iterations of the solver if `iterations` is set.
    pub(super) fn record(&mut self, recorder: &mut Recorder, index: i64, iterations: bool) -> anyhow::Result<()> {
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
        if iterations {
            for (iteration, state) in &self.iterations {
                let iteration = i64::try_from(*iteration).unwrap_or(i64::MAX);
                let Iteration { energy, residual_over_weight, positions } = state;
                recorder.iteration(iteration, *energy, *residual_over_weight, positions.as_deref())?;
            }
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
            none => none.insert(solved.open(sinks, false, true)?),
        };
        solved.record(recorder, index, false)?;
        if index == 0 {
            connected();
        }
        index += 1;
    }
    Ok(recorder.map(Recorder::finish).transpose()?.unwrap_or_default())
}
