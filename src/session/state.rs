//! What a session knows, and what each edit does to it. No threads, no waiting: the state machine itself.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use super::history::History;
use super::results::{AtRest, LoadedScene, Refusal, Segmented, Snapshot, TrailPoint};
use super::{Edit, EditError};
use crate::drape::{Refine, Settings, stage_one};
use crate::parts::{Parts, UNASSIGNED};
use crate::scene::SceneSpec;
use crate::study::job::Job;

/// States that the trail remembers.
const TRAIL: usize = 300;

/// Drapes at rest that are remembered: at ten thousand vertices three lists of vectors, a quarter of a megabyte each, and what the figures tell.
const RESTS: usize = 8;

/// What is known, and what is needed to go on.
pub(super) struct Desk {
    pub(super) view: Snapshot,
    pub(super) warm: bool,
    /// When the newest state was accepted.
    pub(super) accepted: Instant,
    /// The state that failed, after which there is nothing to go back to.
    pub(super) failed: Option<u64>,
    pub(super) history: History,
    good_scene: Option<SceneSpec>,
    good_job: Option<Arc<Job>>,
    /// Body and garment while their files are read again.
    before: Option<Arc<LoadedScene>>,
    pub(super) pins_made: u64,
    /// Drapes of the body and garment at hand that came to rest, the newest last.
    rests: Vec<Arc<AtRest>>,
}

impl Desk {
    pub(super) fn new(job: Job, warm: bool) -> Self {
        let job = Arc::new(job);
        Self {
            view: Snapshot { serial: 1, state: 1, job: Arc::clone(&job), ..Snapshot::default() },
            warm,
            accepted: Instant::now(),
            failed: None,
            history: History::new(job),
            good_scene: None,
            good_job: None,
            before: None,
            pins_made: 0,
            rests: Vec::new(),
        }
    }

    /// Takes the next job, unless it is the one that stands.
    pub(super) fn take(&mut self, job: Job, gesture: Option<u64>) -> Result<u64, EditError> {
        if job == *self.view.job {
            return Ok(self.view.state);
        }
        let job = Arc::new(job);
        let state = self.stand(Arc::clone(&job))?;
        self.history.push(job, gesture);
        self.view.refused = None;
        Ok(state)
    }

    /// Takes the next job, whose body and garment are to be read again.
    pub(super) fn take_anew(&mut self, job: Job) -> Result<u64, EditError> {
        let (job, ground) = (Arc::new(job), self.view.ground.take());
        let stood = self.stand(Arc::clone(&job));
        if stood.is_err() {
            self.view.ground = ground;
        } else {
            self.history.push(job, None);
            self.view.refused = None;
            self.before = ground.or(self.before.take());
        }
        stood
    }

    /// A step back or on.
    pub(super) fn go(&mut self, by: isize) -> Result<u64, EditError> {
        let Some(job) = self.history.beside(by) else {
            let (what, expected) =
                if by < 0 { ("undo", "an edit to take back") } else { ("redo", "an edit to take on") };
            return Err(EditError::value(what, "none", expected));
        };
        let state = self.stand(job)?;
        self.history.stand(by);
        self.view.refused = None;
        Ok(state)
    }

    /// Makes `job` the newest state: what it does not touch is carried over, and stage one is done at once.
    fn stand(&mut self, job: Arc<Job>) -> Result<u64, EditError> {
        let now = Instant::now();
        let state = self.view.state + 1;
        let ground = self.view.ground.clone().filter(|ground| ground.spec == job.scene);
        let sectioned = match ground {
            Some(ground) => Some(self.section(&ground, &job, state, now)?),
            None => None,
        };
        self.view.superseded += u64::from(!self.view.idle);
        self.view.idle = false;
        self.view.state = state;
        self.view.job = job;
        self.accepted = now;
        self.failed = None;
        if let Some(sectioned) = sectioned {
            self.show(sectioned);
            self.keep_rest();
        }
        Ok(state)
    }

    /// Body and garment of `state` are there.
    pub(super) fn found_ground(&mut self, ground: Arc<LoadedScene>) -> Result<(), EditError> {
        let (job, state, accepted) = (Arc::clone(&self.view.job), self.view.state, self.accepted);
        self.view.rest = None;
        self.rests.clear();
        let sectioned = self.section(&ground, &job, state, accepted)?;
        self.good_scene = Some(ground.spec.clone());
        self.view.ground = Some(ground);
        self.before = None;
        self.view.preview = None;
        self.show(sectioned);
        Ok(())
    }

    /// The garment has come to rest, which tells the forces anew.
    pub(super) fn found_rest(&mut self, rest: Arc<AtRest>) {
        if let Some(sectioned) = &mut self.view.sectioned {
            let force_n = Arc::new(sums(&sectioned.parts, &rest.reaction_n));
            *sectioned = Arc::new(Segmented { force_n, ..Segmented::clone(sectioned) });
        }
        if rest.balanced {
            self.rests.retain(|other| other.of != rest.of);
            self.rests.push(Arc::clone(&rest));
            self.rests.drain(..self.rests.len().saturating_sub(RESTS));
        }
        self.view.rest = Some(rest);
    }

    fn show(&mut self, sectioned: Segmented) {
        let point = TrailPoint {
            state: sectioned.state,
            parts: sectioned.parts.len(),
            segment_ms: sectioned.segment_ms,
            ..TrailPoint::default()
        };
        let trail = Arc::make_mut(&mut self.view.trail);
        trail.push(point);
        trail.drain(..trail.len().saturating_sub(TRAIL));
        self.view.sectioned = Some(Arc::new(sectioned));
    }

    /// Adds to the numbers of the newest state.
    pub(super) fn add_to_trail(&mut self, add: impl FnOnce(&mut TrailPoint)) {
        let newest = self.view.state;
        if let Some(point) = Arc::make_mut(&mut self.view.trail).last_mut().filter(|point| point.state == newest) {
            add(point);
        }
    }

    /// Stage one; the PARTs at hand stay where nothing they depend on changed.
    fn section(
        &self,
        ground: &Arc<LoadedScene>,
        job: &Job,
        state: u64,
        since: Instant,
    ) -> Result<Segmented, EditError> {
        let began = Instant::now();
        let settings = &job.settings;
        let table = settings.table.resolve(ground.distance_m())?;
        let kept = self.view.sectioned.as_ref().filter(|old| {
            old.ground.generation == ground.generation && *old.table == table && old.min_part == settings.min_part
        });
        let (table, parts) = match kept {
            Some(old) => (Arc::clone(&old.table), Arc::clone(&old.parts)),
            None => {
                let parts = stage_one(&ground.loaded.scene, settings.min_part, &table, ground.distance_m());
                (Arc::new(table), Arc::new(parts))
            }
        };
        if parts.is_empty() {
            let expected = "levels that hold some of the garment: widen its first or last row";
            return Err(EditError::value("table", "none of the garment's vertices in any level", expected));
        }
        let rest = self.view.rest.as_ref().filter(|rest| rest.ground.generation == ground.generation);
        let force_n = rest.map_or_else(Vec::new, |rest| sums(&parts, &rest.reaction_n));
        Ok(Segmented {
            state,
            ground: Arc::clone(ground),
            table,
            parts,
            force_n: Arc::new(force_n),
            segment_ms: ms_since(began),
            after_ms: ms_since(since),
            min_part: settings.min_part,
        })
    }

    /// Refuses a fabric that nothing is cut from.
    pub(super) fn check_fabric(&self, edit: &Edit, job: &Job) -> Result<(), EditError> {
        let Some(ground) = self.view.ground.as_ref().filter(|ground| ground.spec == job.scene) else { return Ok(()) };
        if edit.fabric.is_none() || ground.loaded.scene.takes_the_settings_fabric() {
            return Ok(());
        }
        let found = "one for a garment whose panels all have their own";
        Err(EditError::value("fabric", found, "a change of the file that names their fabrics"))
    }

    /// Where the cloth rests does not depend on the table: an edit that touches neither garment nor fabric leaves the drape, and a fabric
    /// that it was in before hangs as it did.
    fn keep_rest(&mut self) {
        let Settings { fabric, refine, self_contact, .. } = &self.view.job.settings;
        let same = |rest: &&Arc<AtRest>| (&rest.of.0, rest.of.1, rest.of.2) == (fabric, *refine, *self_contact);
        let newest = self.view.rest.as_ref().filter(|rest| rest.done);
        let known = newest.filter(same).or_else(|| self.rests.iter().find(same));
        let Some(rest) = known.filter(|_| self.warm && *refine == Refine::Converged) else { return };
        let (state, after_ms) = (self.view.state, ms_since(self.accepted));
        self.found_rest(Arc::new(AtRest { state, kept: true, steps: 0, ms: 0.0, after_ms, ..AtRest::clone(rest) }));
    }

    /// `state` cannot be: back to the last good one. `scene` says that body or garment were to blame.
    pub(super) fn refuse(&mut self, state: u64, sentence: String, scene: bool) {
        let bad = Arc::clone(&self.view.job);
        let back = if let (true, Some(before)) = (scene, self.before.take()) {
            let scene = before.spec.clone();
            self.view.ground = Some(before);
            Some(Arc::new(Job { scene, ..Job::clone(&bad) }))
        } else if scene {
            let good = self.good_scene.clone().filter(|good| *good != bad.scene);
            good.map(|good| Arc::new(Job { scene: good, ..Job::clone(&bad) }))
        } else {
            self.good_job.clone().filter(|good| *good != bad)
        };
        let back_to = back.and_then(|back| {
            let to = self.stand(Arc::clone(&back)).ok()?;
            if scene {
                let good = &back.scene;
                self.history.mend(|job| job.scene == bad.scene, |job| Job { scene: good.clone(), ..job.clone() });
            } else {
                self.history.mend(|job| *job == *bad, |_| Job::clone(&back));
            }
            Some(to)
        });
        if back_to.is_none() {
            self.failed = Some(state);
            self.view.idle = true;
        }
        let file = bad.file_names().first().filter(|_| scene).map(|(_, name)| (*name).to_owned());
        self.view.refused = Some(Arc::new(Refusal { state, sentence, file, back_to }));
    }

    /// Nothing is left to compute for the newest state.
    pub(super) fn finish(&mut self) {
        self.good_job = Some(Arc::clone(&self.view.job));
        self.view.idle = true;
    }
}

/// Milliseconds since then.
pub(super) fn ms_since(then: Instant) -> f64 {
    then.elapsed().as_secs_f64() * 1e3
}

/// Sums over the vertices of each PART.
pub(super) fn sums(parts: &Parts, of_vertex: &[DVec3]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; parts.len()];
    for (&part, &value) in parts.part_of_vertex.iter().zip(of_vertex).filter(|(part, _)| **part != UNASSIGNED) {
        sums[part as usize] += value;
    }
    sums
}
