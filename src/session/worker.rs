//! The worker: computes the newest state in tasks. Between two tasks, and at every step within one, it checks whether a newer state
//! has replaced it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::edit::EditError;
use super::handle::Session;
use super::results::{AtRest, Finished, LoadedScene, Preview, Segmented};
use super::state::{SessionState, ms_since};
use super::task::{Refinement, Target, Task};
use crate::base::error_text::with_causes;
use crate::drape::{
    ClothState, Distances, Drape, DrapeError, Levels, Model, Refine, ReleasedDrape, Settings, StageResults, StageTimes,
    StageTwo, StartsFrom, approach, drape, folds_of, reactions, settle_and_release, settled, stage_two,
};
use crate::garment::MeshCache;
use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::CoupledError;
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::{Step, Stop};
use crate::study::accuracy;
use crate::study::metrics::Metrics;

/// The refusal of an edit whose computation panicked. The panic's own message goes to the terminal alone: it may quote a file.
const PANICKED: &str = "computing this edit failed by a fault of the program, and the last good state stands; please report the edit with the \
     message that the program printed";

/// Time without an edit before the figures of a state are computed. They take tenths of a second and cannot be broken off, so that
/// without a pause only one in ten edits of a drag would get its two stages. Heuristic: longer than between two positions of a slow mouse.
const PAUSE_BEFORE_FIGURES: Duration = Duration::from_millis(100);

/// Computes the states of a session, and keeps the data that the next state can start from.
pub struct Worker {
    meshes: MeshCache,
    generations: u64,
    cloth: Option<CachedCloth>,
    /// The last drape at full resolution, done or interrupted.
    rest: Option<WarmStart>,
    progress: Progress,
}

/// The cloth of a garment in a fabric, at all resolutions.
struct CachedCloth {
    generation: u64,
    fabric: Fabric,
    levels: Arc<Levels>,
    took: Duration,
}

/// Positions that the next computation for the same body and garment can start from.
struct WarmStart {
    generation: u64,
    positions: Arc<Vec<DVec3>>,
}

/// The computed parts of a state.
#[derive(Default)]
struct Progress {
    state: u64,
    both_stages: Option<(StageTwo, Duration)>,
    refined: Option<Duration>,
    finished: bool,
}

impl Worker {
    /// A worker that takes built-in meshes from the cache.
    #[must_use]
    pub fn new(meshes: MeshCache) -> Self {
        Self { meshes, generations: 0, cloth: None, rest: None, progress: Progress::default() }
    }

    /// Computes until the session is closed. A session has one worker.
    pub fn run(&mut self, session: &Session) {
        while !session.is_closed() {
            if !self.advance(session) {
                session.wait_while(|state| !self.is_due(state));
            }
        }
    }

    /// Runs the next task of the newest state and publishes its results; returns `false` without one.
    pub fn advance(&mut self, session: &Session) -> bool {
        let target = {
            let state = session.lock();
            if !self.is_due(&state) {
                return false;
            }
            let mut snapshot = state.snapshot.clone();
            snapshot.segmented.take_if(|segmented| segmented.state != snapshot.state);
            snapshot.rest.take_if(|rest| rest.state != snapshot.state || !rest.done);
            Target { snapshot, warm: state.warm, accepted: state.accepted }
        };
        let newest = target.snapshot.state;
        if self.progress.state != newest {
            self.progress = Progress { state: newest, ..Progress::default() };
        }
        // Inside rayon's pool, because hundreds of short joins follow.
        let outcome = catch_unwind(AssertUnwindSafe(|| rayon::scope(|_| self.next_task(session, &target))));
        let refused = match outcome {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some((with_causes(&error, "; because "), matches!(error, EditError::Scene(_)))),
            Err(_) => {
                // A panic may leave any of these half done.
                (self.cloth, self.rest, self.progress) = (None, None, Progress::default());
                Some((PANICKED.to_owned(), false))
            }
        };
        if let Some((sentence, scene)) = refused
            && !session.is_superseded(newest)
        {
            session.publish(newest, |state| state.refuse(newest, sentence, scene));
        }
        true
    }

    /// Whether the newest state is incomplete.
    fn is_due(&self, state: &SessionState) -> bool {
        let newest = state.snapshot.state;
        state.failed != Some(newest) && !(self.progress.state == newest && self.progress.finished)
    }

    fn next_task(&mut self, session: &Session, target: &Target) -> Result<(), EditError> {
        let Some(segmented) = &target.snapshot.segmented else { return self.load(session, target) };
        let task = Task { session, target, segmented };
        let settings = task.settings();
        if task.scene().layers.len() > 1 {
            return self.drape_layers(task);
        }
        let generation = segmented.loaded_scene.generation;
        let needs_cloth = matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0);
        let cached = self.cloth.as_ref().filter(|c| c.generation == generation && c.fabric == settings.fabric);
        let levels = cached.map(|c| Arc::clone(&c.levels));
        if needs_cloth && levels.is_none() {
            return self.build_cloth(segmented, settings);
        }
        if let Some(rest) = target.snapshot.rest.as_ref().filter(|rest| rest.reused) {
            self.rest = Some(WarmStart { generation, positions: Arc::clone(&rest.held_positions) });
        }
        let usable = |start: &Option<WarmStart>| {
            let start = start.as_ref().filter(|start| target.warm && start.generation == generation);
            start.map(|start| Arc::clone(&start.positions))
        };
        let rest = usable(&self.rest).filter(|_| settings.refine == Refine::Converged);
        // Before a drape at rest: both stages take milliseconds.
        let Some((stage, _)) = &self.progress.both_stages else { return self.both_stages(task, levels.as_deref()) };
        let to_refine = levels.as_ref().filter(|_| target.snapshot.rest.is_none() && self.progress.refined.is_none());
        if let (Some(levels), Some(start)) = (to_refine, rest) {
            return self.refine(task, levels, start.to_vec(), true);
        }
        if let Some(levels) = to_refine {
            let start = approach(task.scene(), settings, levels, &stage.positions, &mut |_: &Step<'_>| task.check());
            return self.refine(task, levels, start, false);
        }
        if !session.superseded_within(target.snapshot.state, PAUSE_BEFORE_FIGURES) {
            self.finish(task, levels.as_deref());
        }
        Ok(())
    }

    /// Loads body and garment, and computes their distances and stage one.
    fn load(&mut self, session: &Session, target: &Target) -> Result<(), EditError> {
        let began = Instant::now();
        let input = target.snapshot.job.scene.load_with(&self.meshes)?;
        let (load_ms, began) = (ms_since(began), Instant::now());
        let distances = Distances::of(&input.scene)?;
        self.generations += 1;
        let loaded_scene = Arc::new(LoadedScene {
            generation: self.generations,
            spec: target.snapshot.job.scene.clone(),
            input,
            load_ms,
            distance_ms: ms_since(began),
            distances,
        });
        let mut outcome = Ok(());
        session.publish(target.snapshot.state, |state| outcome = state.set_loaded_scene(loaded_scene));
        outcome
    }

    /// Builds the cloth in this fabric. In another fabric of the same garment only the fabric's constants change.
    fn build_cloth(&mut self, segmented: &Segmented, settings: &Settings) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, generation) = (&segmented.loaded_scene.input.scene, segmented.loaded_scene.generation);
        let levels = match self.cloth.take().filter(|cached| cached.generation == generation) {
            Some(cached) => cached.levels.recut(scene, settings),
            None => Levels::new(scene, settings),
        };
        let (levels, fabric) = (levels.map_err(DrapeError::from)?, settings.fabric.clone());
        self.cloth = Some(CachedCloth { generation, fabric, levels: Arc::new(levels), took: began.elapsed() });
        Ok(())
    }

    /// Both stages from the undraped garment, as `run` computes them.
    fn both_stages(&mut self, task: Task<'_>, levels: Option<&Levels>) -> Result<(), EditError> {
        let began = Instant::now();
        let ground = &task.loaded_scene().distances;
        let parts = (*task.segmented.table_parts).clone();
        let cloth = levels.map(|levels| &levels.cloth);
        let stage = match stage_two(task.scene(), task.settings(), ground, parts, cloth, &|| task.check()) {
            Ok(stage) => stage,
            Err(DrapeError::Coupled(CoupledError::Interrupted)) => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        let took = began.elapsed();
        let preview = Arc::new(Preview {
            done: true,
            outcomes: Arc::new(stage.outcomes.clone()),
            warnings: stage.warnings.clone(),
            ..task.preview(Arc::new(stage.parts.clone()), stage.positions.clone(), 1e3 * took.as_secs_f64())
        });
        self.progress.both_stages = Some((stage, took));
        task.publish(|state| {
            state.update_trail(|point| point.two_stages_ms = Some(preview.ms));
            state.snapshot.preview = Some(preview);
        });
        Ok(())
    }

    /// Newton steps at full resolution from `start`, published at every step.
    fn refine(&mut self, task: Task<'_>, levels: &Levels, start: Vec<DVec3>, warm: bool) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, settings) = (task.scene(), task.settings());
        let distances = Some(&task.loaded_scene().distances);
        let refinement = Refinement { task, warm, began };
        let from = if warm { StartsFrom::Rest } else { StartsFrom::Parts };
        let mut balanced = false;
        let mut observer = |step: &Step<'_>| {
            // A garment whose edges are released may balance held, which does not count.
            balanced |= step.at_rest && !scene.releases_held;
            if step.iteration > 0 || balanced {
                let at = refinement.at(step.positions, step.residual_over_weight, step.iteration);
                let rest = Arc::new(AtRest { balanced, ..at });
                task.publish(|state| state.snapshot.rest = Some(rest));
            }
            task.check()
        };
        let drape = settle_and_release(scene, settings, levels, distances, (start, from), &mut observer)?;
        let ReleasedDrape { cloth, refined, held_positions, release } = drape;
        let (held_positions, generation) = (Arc::new(held_positions), task.loaded_scene().generation);
        self.rest = Some(WarmStart { generation, positions: Arc::clone(&held_positions) });
        // A drape that falls off the body is interrupted, too, and published.
        if refined.stop == Stop::Interrupted && task.check().is_break() {
            return Ok(());
        }
        let took = began.elapsed();
        let cloth = cloth.as_ref().unwrap_or(&levels.cloth);
        let (positions, cloth_state) = settled(scene, settings, cloth, distances, refined);
        let rest = at_rest(&refinement, cloth, &positions, &cloth_state);
        let rest = Arc::new(AtRest { release, held_positions, ms: 1e3 * took.as_secs_f64(), ..rest });
        self.progress.refined = Some(took);
        task.publish(|state| publish_rest(state, rest));
        Ok(())
    }

    /// Drapes several layers in one task, since each layer waits for those below it.
    fn drape_layers(&mut self, task: Task<'_>) -> Result<(), EditError> {
        let (scene, settings) = (task.scene(), task.settings());
        let refinement = Refinement { task, warm: false, began: Instant::now() };
        let drape = drape(scene, settings, &mut |step| {
            let rest = Arc::new(refinement.at(step.positions, step.residual_over_weight, step.iteration));
            task.publish(|state| state.snapshot.rest = Some(rest));
            task.check()
        })?;
        let interrupted = drape.state.as_ref().is_some_and(|state| state.stop == Stop::Interrupted);
        if interrupted && task.check().is_break() {
            return Ok(());
        }
        let ms = 1e3 * (drape.times.total - drape.times.refine).as_secs_f64();
        let preview = Arc::new(Preview {
            done: true,
            outcomes: Arc::new(drape.outcomes.clone()),
            ..task.preview(Arc::new(drape.parts.clone()), drape.preview.clone(), ms)
        });
        let rest = drape.state.as_ref().map(|cloth_state| -> Result<_, EditError> {
            let fabrics = scene.fabrics(&settings.fabric);
            let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabrics, &scene.held)
                .map_err(DrapeError::from)?;
            Ok(Arc::new(at_rest(&refinement, &cloth, &drape.positions, cloth_state)))
        });
        let rest = rest.transpose()?;
        task.publish(|state| {
            state.update_trail(|point| point.two_stages_ms = Some(preview.ms));
            state.snapshot.preview = Some(preview);
            rest.into_iter().for_each(|rest| publish_rest(state, rest));
        });
        self.publish_finished(task, drape);
        Ok(())
    }

    /// Assembles the whole drape of the state from the results of its tasks.
    fn finish(&mut self, task: Task<'_>, levels: Option<&Levels>) {
        let Some((stage, took)) = self.progress.both_stages.take() else { return };
        let (loaded_scene, segmented, rest) = (task.loaded_scene(), task.segmented, task.target.snapshot.rest.as_ref());
        let ms = |ms: f64| Duration::from_secs_f64(1e-3 * ms);
        let cloth_time = self.cloth.as_ref().map_or(Duration::ZERO, |cached| cached.took);
        let mut times = StageTimes {
            distance: ms(loaded_scene.distance_ms),
            segment: ms(segmented.segment_ms),
            cloth: cloth_time,
            mechanics: took,
            refine: self.progress.refined.unwrap_or_default(),
            total: Duration::ZERO,
        };
        times.total = times.distance + times.segment + times.cloth + times.mechanics + times.refine;
        let state = rest.and_then(|rest| {
            let cloth_state: &ClothState = rest.cloth_state.as_deref()?;
            Some((rest.positions.to_vec(), ClothState { steps: rest.steps, ..cloth_state.clone() }))
        });
        let made = StageResults {
            ground: loaded_scene.distances.clone(),
            table: (*segmented.table).clone(),
            level_part_count: segmented.table_parts.len(),
            folds: folds_of(task.settings(), levels, &stage),
            stage,
            state,
            release: rest.and_then(|rest| rest.release),
        };
        self.publish_finished(task, made.judged(task.scene(), task.settings(), times));
    }

    /// Publishes the whole drape of the state with its metrics.
    fn publish_finished(&mut self, task: Task<'_>, drape: Drape) {
        let metrics = Metrics::of(task.scene(), &drape);
        let refined = drape.state.is_some() && task.settings().refine != Refine::Steps(0);
        let preview_error_mm = refined.then(|| accuracy::rms_mm(&drape.preview, &drape.positions));
        let bound_mm = refined.then(|| task.bound_mm(&drape)).filter(|mm| mm.is_finite());
        let (state, loaded_scene) = (task.target.snapshot.state, Arc::clone(task.loaded_scene()));
        let finished = Finished { state, loaded_scene, drape, metrics, preview_error_mm, bound_mm };
        self.progress.finished = true;
        task.publish(|state| {
            state.update_trail(|point| (point.preview_error_mm, point.bound_mm) = (preview_error_mm, bound_mm));
            state.snapshot.finished = Some(Arc::new(finished));
            state.finish();
        });
    }
}

/// The end of a computation at full resolution.
fn at_rest(refinement: &Refinement<'_>, cloth: &Cloth, positions: &[DVec3], cloth_state: &ClothState) -> AtRest {
    AtRest {
        done: true,
        balanced: cloth_state.stop == Stop::Converged,
        reaction_n: Arc::new(reactions(cloth, positions, &cloth_state.fit.pressure_kpa)),
        cloth_state: Some(Arc::new(cloth_state.clone())),
        ..refinement.at(positions, cloth_state.residual_over_weight, cloth_state.steps)
    }
}

fn publish_rest(state: &mut SessionState, rest: Arc<AtRest>) {
    state.update_trail(|point| point.rest_ms = Some(rest.ms));
    state.set_rest(rest);
}
