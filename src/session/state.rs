//! The state machine of a session: its results, and the effect of each edit on them. No threads, no waiting.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use super::edit::{Edit, EditError};
use super::results::{AtRest, LoadedScene, Pin, Refusal, RestInputs, Segmented, Snapshot, TrailPoint};
use crate::drape::{Model, Refine, stage_one};
use crate::parts::{Parts, UNASSIGNED};
use crate::scene::{Scene, SceneSpec};
use crate::study::job::Job;

/// Points of the trail.
const MAX_TRAIL: usize = 300;

/// Drapes at rest that can be reused. At 10,000 vertices each has three lists of vectors of a quarter of a megabyte, and its [`ClothState`](crate::drape::ClothState).
const MAX_RESTS: usize = 8;

/// States that can be pinned.
const MAX_PINS: usize = 8;

/// Jobs that can be undone.
const MAX_JOBS: usize = 200;

/// The results so far, and the data that later edits need.
pub(super) struct SessionState {
    pub(super) snapshot: Snapshot,
    pub(super) warm: bool,
    /// When the newest state was accepted.
    pub(super) accepted: Instant,
    /// The state that failed without a good one to return to.
    pub(super) failed: Option<u64>,
    history: History,
    last_good_scene: Option<SceneSpec>,
    last_good_job: Option<Arc<Job>>,
    /// Body and garment while their files are read again.
    before_reload: Option<Arc<LoadedScene>>,
    last_pin_id: u64,
    /// Converged drapes of the current body and garment, the newest last.
    rests: Vec<Arc<AtRest>>,
}

impl SessionState {
    pub(super) fn new(job: Job, warm: bool) -> Self {
        let job = Arc::new(job);
        Self {
            snapshot: Snapshot { serial: 1, state: 1, job: Arc::clone(&job), ..Snapshot::default() },
            warm,
            accepted: Instant::now(),
            failed: None,
            history: History { jobs: vec![job], current: 0, gesture: None },
            last_good_scene: None,
            last_good_job: None,
            before_reload: None,
            last_pin_id: 0,
            rests: Vec::new(),
        }
    }

    /// Makes `job` the newest state, unless it is already.
    pub(super) fn submit(&mut self, job: Job, gesture: Option<u64>) -> Result<u64, EditError> {
        if job == *self.snapshot.job {
            return Ok(self.snapshot.state);
        }
        let job = Arc::new(job);
        let state = self.enter(Arc::clone(&job))?;
        self.history.push(job, gesture);
        self.snapshot.refused = None;
        Ok(state)
    }

    /// Makes `job` the newest state, and has its body and garment read again.
    pub(super) fn reload(&mut self, job: Job) -> Result<u64, EditError> {
        let (job, loaded_scene) = (Arc::new(job), self.snapshot.loaded_scene.take());
        let entered = self.enter(Arc::clone(&job));
        if entered.is_err() {
            self.snapshot.loaded_scene = loaded_scene;
        } else {
            self.history.push(job, None);
            self.snapshot.refused = None;
            self.before_reload = loaded_scene.or(self.before_reload.take());
        }
        entered
    }

    /// Undoes (`by` = −1) or redoes (1) an edit.
    pub(super) fn step_history(&mut self, by: isize) -> Result<u64, EditError> {
        let Some(job) = self.history.peek(by) else {
            let (what, expected) =
                if by < 0 { ("undo", "an edit to undo") } else { ("redo", "an edit that was undone") };
            return Err(EditError::value(what, "none", expected));
        };
        let state = self.enter(job)?;
        self.history.move_by(by);
        self.snapshot.refused = None;
        Ok(state)
    }

    /// Makes `job` the newest state: keeps the results that it does not affect, and computes stage one.
    fn enter(&mut self, job: Arc<Job>) -> Result<u64, EditError> {
        let now = Instant::now();
        let state = self.snapshot.state + 1;
        let loaded_scene = self.snapshot.loaded_scene.clone().filter(|scene| scene.spec == job.scene);
        let segmented = loaded_scene.map(|scene| self.segment(&scene, &job, state, now)).transpose()?;
        self.snapshot.superseded += u64::from(!self.snapshot.idle);
        self.snapshot.idle = false;
        self.snapshot.state = state;
        self.snapshot.job = job;
        self.accepted = now;
        self.failed = None;
        if let Some(segmented) = segmented {
            self.set_segmented(segmented);
            self.reuse_rest();
        }
        Ok(state)
    }

    /// Sets body and garment of the newest state, and computes stage one.
    pub(super) fn set_loaded_scene(&mut self, scene: Arc<LoadedScene>) -> Result<(), EditError> {
        let (job, state, accepted) = (Arc::clone(&self.snapshot.job), self.snapshot.state, self.accepted);
        self.snapshot.rest = None;
        self.rests.clear();
        let segmented = self.segment(&scene, &job, state, accepted)?;
        self.last_good_scene = Some(scene.spec.clone());
        self.snapshot.loaded_scene = Some(scene);
        self.before_reload = None;
        self.snapshot.preview = None;
        self.set_segmented(segmented);
        Ok(())
    }

    /// Sets the drape at rest, and the PARTs' forces in it.
    pub(super) fn set_rest(&mut self, rest: Arc<AtRest>) {
        if let Some(segmented) = &mut self.snapshot.segmented {
            let force_n = Arc::new(sum_by_part(&segmented.parts, &rest.reaction_n));
            *segmented = Arc::new(Segmented { force_n, ..Segmented::clone(segmented) });
        }
        if rest.balanced {
            self.rests.retain(|other| other.inputs != rest.inputs);
            self.rests.push(Arc::clone(&rest));
            self.rests.drain(..self.rests.len().saturating_sub(MAX_RESTS));
        }
        self.snapshot.rest = Some(rest);
    }

    fn set_segmented(&mut self, segmented: Segmented) {
        let point = TrailPoint {
            state: segmented.state,
            parts: segmented.parts.len(),
            segment_ms: segmented.segment_ms,
            ..TrailPoint::default()
        };
        let trail = Arc::make_mut(&mut self.snapshot.trail);
        trail.push(point);
        trail.drain(..trail.len().saturating_sub(MAX_TRAIL));
        self.snapshot.segmented = Some(Arc::new(segmented));
    }

    /// Changes the trail's point of the newest state.
    pub(super) fn update_trail(&mut self, update: impl FnOnce(&mut TrailPoint)) {
        let newest = self.snapshot.state;
        if let Some(point) = Arc::make_mut(&mut self.snapshot.trail).last_mut().filter(|point| point.state == newest) {
            update(point);
        }
    }

    /// Stage one. Keeps the current PARTs if scene, table and smallest PART are the same.
    fn segment(&self, scene: &Arc<LoadedScene>, job: &Job, state: u64, since: Instant) -> Result<Segmented, EditError> {
        let began = Instant::now();
        let settings = &job.settings;
        let table = settings.table.resolve(scene.distances_m())?;
        let kept = self.snapshot.segmented.as_ref().filter(|old| {
            old.loaded_scene.generation == scene.generation && *old.table == table && old.min_part == settings.min_part
        });
        let (table, table_parts) = match kept {
            Some(old) => (Arc::clone(&old.table), Arc::clone(&old.table_parts)),
            None => {
                let parts = stage_one(&scene.input.scene, settings.min_part, &table, scene.distances_m());
                (Arc::new(table), Arc::new(parts))
            }
        };
        if table_parts.is_empty() {
            let expected = "levels that hold some of the garment: widen its first or last row";
            return Err(EditError::value("table", "none of the garment's vertices in any level", expected));
        }
        let extent_m = match &settings.model {
            Model::Coupled(options) => options.extents_m.last().copied(),
            Model::Paper(_) => None,
        };
        let parts = match (kept, extent_m) {
            (Some(old), _) if old.extent_m == extent_m => Arc::clone(&old.parts),
            (_, None) => Arc::clone(&table_parts),
            (_, Some(extent_m)) => {
                let Scene { garment, topology, .. } = &scene.input.scene;
                Arc::new(table_parts.cut_to_extent(garment, topology, extent_m))
            }
        };
        let rest = self.snapshot.rest.as_ref().filter(|rest| rest.loaded_scene.generation == scene.generation);
        let force_n = rest.map_or_else(Vec::new, |rest| sum_by_part(&parts, &rest.reaction_n));
        Ok(Segmented {
            state,
            loaded_scene: Arc::clone(scene),
            table,
            parts,
            table_parts,
            force_n: Arc::new(force_n),
            segment_ms: ms_since(began),
            after_ms: ms_since(since),
            min_part: settings.min_part,
            extent_m,
        })
    }

    /// Refuses an edit of the fabric where every panel already has one.
    pub(super) fn check_fabric(&self, edit: &Edit, job: &Job) -> Result<(), EditError> {
        let loaded_scene = self.snapshot.loaded_scene.as_ref().filter(|scene| scene.spec == job.scene);
        if edit.fabric.is_none() || loaded_scene.is_none_or(|scene| scene.input.scene.takes_the_settings_fabric()) {
            return Ok(());
        }
        let found = "one for a garment whose panels all have their own";
        Err(EditError::value("fabric", found, "a change of the file that names their fabrics"))
    }

    /// Reuses the current drape at rest if the edit changed neither garment nor fabric, or an earlier one in the same fabric. A rest
    /// does not depend on the table.
    fn reuse_rest(&mut self) {
        let inputs = RestInputs::of(&self.snapshot.job.settings);
        let newest = self.snapshot.rest.as_ref().filter(|rest| rest.done);
        let same = newest.into_iter().chain(&self.rests).find(|rest| rest.inputs == inputs);
        let Some(rest) = same.filter(|_| self.warm && inputs.refine == Refine::Converged) else { return };
        let (state, after_ms) = (self.snapshot.state, ms_since(self.accepted));
        self.set_rest(Arc::new(AtRest { state, reused: true, steps: 0, ms: 0.0, after_ms, ..AtRest::clone(rest) }));
    }

    /// Refuses `state` and returns to the last good one. `scene`: body or garment are the cause.
    pub(super) fn refuse(&mut self, state: u64, sentence: String, scene: bool) {
        let bad = Arc::clone(&self.snapshot.job);
        let before_reload = self.before_reload.take();
        let with_scene = |scene: SceneSpec| Arc::new(Job { scene, ..Job::clone(&bad) });
        let good = if !scene {
            self.last_good_job.clone().filter(|good| *good != bad)
        } else if let Some(before) = before_reload {
            let spec = before.spec.clone();
            self.snapshot.loaded_scene = Some(before);
            Some(with_scene(spec))
        } else {
            self.last_good_scene.clone().filter(|good| *good != bad.scene).map(with_scene)
        };
        let back_to = good.and_then(|good| {
            let to = self.enter(Arc::clone(&good)).ok()?;
            if scene {
                let spec = &good.scene;
                self.history.replace(|job| job.scene == bad.scene, |job| Job { scene: spec.clone(), ..job.clone() });
            } else {
                self.history.replace(|job| *job == *bad, |_| Job::clone(&good));
            }
            Some(to)
        });
        if back_to.is_none() {
            self.failed = Some(state);
            self.snapshot.idle = true;
        }
        let file = bad.file_names().first().filter(|_| scene).map(|(_, name)| (*name).to_owned());
        self.snapshot.refused = Some(Arc::new(Refusal { state, sentence, file, back_to }));
    }

    /// Marks the newest state as complete.
    pub(super) fn finish(&mut self) {
        self.last_good_job = Some(Arc::clone(&self.snapshot.job));
        self.snapshot.idle = true;
    }

    /// Numbers a change for the clients.
    pub(super) fn count_change(&mut self) {
        self.snapshot.serial += 1;
        (self.snapshot.undo, self.snapshot.redo) = self.history.depth();
    }

    pub(super) fn pin(&mut self, label: Option<String>) -> Result<u64, EditError> {
        let snapshot = &mut self.snapshot;
        if snapshot.pins.len() >= MAX_PINS {
            return Err(EditError::value("pin", format!("{MAX_PINS} pinned states"), "fewer; unpin one first"));
        }
        let state = snapshot.state;
        let rest = snapshot.rest.as_ref().filter(|rest| rest.state == state && rest.done);
        let preview = snapshot.preview.as_ref().filter(|preview| preview.state == state && preview.done);
        let segmented = snapshot.segmented.as_ref().filter(|segmented| segmented.state == state);
        let (Some(preview), Some(segmented)) = (preview, segmented) else {
            return Err(EditError::value("pin", format!("no drape of state {state} yet"), "one; wait a moment"));
        };
        self.last_pin_id += 1;
        let pin = Pin {
            id: self.last_pin_id,
            label: label.unwrap_or_else(|| format!("state {state}")),
            state,
            job: Arc::clone(&snapshot.job),
            positions: Arc::clone(rest.map_or(&preview.positions, |rest| &rest.positions)),
            segmented: Arc::clone(segmented),
            preview: Arc::clone(&preview.positions),
            loaded_scene: Arc::clone(&preview.loaded_scene),
            numbers: snapshot.trail.last().copied().filter(|point| point.state == state).unwrap_or_default(),
        };
        Arc::make_mut(&mut snapshot.pins).push(Arc::new(pin));
        Ok(self.last_pin_id)
    }

    pub(super) fn unpin(&mut self, id: u64) -> bool {
        let pins = Arc::make_mut(&mut self.snapshot.pins);
        let before = pins.len();
        pins.retain(|pin| pin.id != id);
        pins.len() < before
    }
}

/// Undo and redo: the jobs of a session, and the index of the current one.
#[derive(Debug)]
struct History {
    jobs: Vec<Arc<Job>>,
    current: usize,
    gesture: Option<u64>,
}

impl History {
    /// Adds the next job; those of one gesture are a single step.
    fn push(&mut self, job: Arc<Job>, gesture: Option<u64>) {
        self.jobs.truncate(self.current + 1);
        if gesture.is_some() && gesture == self.gesture && self.current > 0 {
            self.jobs[self.current] = job;
        } else {
            self.jobs.push(job);
            self.jobs.drain(..self.jobs.len().saturating_sub(MAX_JOBS));
            self.current = self.jobs.len() - 1;
        }
        self.gesture = gesture;
    }

    /// The job one step back (−1) or forward (1).
    fn peek(&self, by: isize) -> Option<Arc<Job>> {
        self.jobs.get(self.current.checked_add_signed(by)?).cloned()
    }

    fn move_by(&mut self, by: isize) {
        self.current = self.current.saturating_add_signed(by).min(self.jobs.len() - 1);
        self.gesture = None;
    }

    /// Replaces every job that failed.
    fn replace(&mut self, bad: impl Fn(&Job) -> bool, good: impl Fn(&Job) -> Job) {
        for job in self.jobs.iter_mut().filter(|job| bad(job)) {
            *job = Arc::new(good(job));
        }
        self.gesture = None;
    }

    /// How many steps can be undone and redone.
    fn depth(&self) -> (usize, usize) {
        (self.current, self.jobs.len() - 1 - self.current)
    }
}

/// Milliseconds since an instant.
pub(super) fn ms_since(instant: Instant) -> f64 {
    instant.elapsed().as_secs_f64() * 1e3
}

/// Sum of a vertex quantity over each PART.
pub(super) fn sum_by_part(parts: &Parts, of_vertex: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; parts.len()];
    for (&part, &value) in parts.part_of_vertex.iter().zip(of_vertex).filter(|(part, _)| **part != UNASSIGNED) {
        sums[part as usize] += value;
    }
    sums
}
