//! The work on the newest state, piece by piece: whoever drives it may look up between two pieces, and a step within a piece
//! looks whether a newer state has come.

mod outfit;
mod rest;
mod stages;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::desk::Desk;
use super::results::{AtRest, Sectioned};
use super::{EditError, Session};
use crate::drape::{Levels, Model, Refine, StageTwo, approach};
use crate::fabric::Fabric;
use crate::job::Job;
use crate::mechanics::refine::Step;
use crate::said::said;
use crate::shapes::MeshCache;

/// What is kept between pieces.
pub struct Workshop {
    meshes: MeshCache,
    generations: u64,
    cloth: Option<Sewn>,
    /// The last preview, to go on from: of which body and garment, and where.
    preview: Option<(u64, Arc<Vec<DVec3>>)>,
    /// The last drape at full resolution, done or interrupted.
    rest: Option<(u64, Arc<Vec<DVec3>>)>,
    done: Done,
}

/// The cloth of a garment in a fabric.
struct Sewn {
    generation: u64,
    fabric: Fabric,
    levels: Arc<Levels>,
    took: Duration,
}

/// What is done of a state.
#[derive(Default)]
struct Done {
    state: u64,
    warmed: bool,
    two_stages: Option<(StageTwo, Duration)>,
    rested: Option<Duration>,
    finished: bool,
}

/// The newest state and what is there for it.
struct Target {
    state: u64,
    job: Arc<Job>,
    warm: bool,
    accepted: Instant,
    sectioned: Option<Arc<Sectioned>>,
    rest: Option<Arc<AtRest>>,
}

impl Workshop {
    /// A workshop that takes built-in meshes from `meshes` where they are there.
    #[must_use]
    pub fn new(meshes: MeshCache) -> Self {
        Self { meshes, generations: 0, cloth: None, preview: None, rest: None, done: Done::default() }
    }

    /// Whether there is work for the newest state.
    pub(super) fn is_due(&self, desk: &Desk) -> bool {
        let state = desk.view.state;
        desk.failed != Some(state) && !(self.done.state == state && self.done.finished)
    }

    /// Does the next piece of work for the newest state, and makes it known; `false` where there is none.
    pub fn advance(&mut self, session: &Session) -> bool {
        let target = {
            let desk = session.desk();
            if !self.is_due(&desk) {
                return false;
            }
            let view = &desk.view;
            Target {
                state: view.state,
                job: Arc::clone(&view.job),
                warm: desk.warm,
                accepted: desk.accepted,
                sectioned: view.sectioned.clone().filter(|s| s.state == view.state),
                rest: view.rest.clone().filter(|r| r.state == view.state && r.done),
            }
        };
        if self.done.state != target.state {
            self.done = Done { state: target.state, ..Done::default() };
        }
        // In the pool: hundreds of short joins follow.
        let outcome = rayon::scope(|_| self.piece(session, &target));
        if let Err(error) = outcome
            && !session.overtaken(target.state)
        {
            let sentence = said(&error, "; because ");
            session.publish(target.state, |desk| {
                desk.refuse(target.state, sentence, matches!(error, EditError::Scene(_)));
            });
        }
        true
    }

    fn piece(&mut self, session: &Session, target: &Target) -> Result<(), EditError> {
        let Some(sectioned) = &target.sectioned else { return self.load(session, target) };
        let settings = &target.job.settings;
        if sectioned.ground.loaded.scene.layers.len() > 1 {
            return self.outfit(session, target, sectioned);
        }
        let generation = sectioned.ground.generation;
        let needs_cloth = matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0);
        let sewn = self.cloth.as_ref().filter(|c| c.generation == generation && c.fabric == settings.fabric);
        let levels = sewn.map(|c| Arc::clone(&c.levels));
        if needs_cloth && levels.is_none() {
            return self.sew(sectioned, &settings.fabric);
        }
        if let Some(rest) = target.rest.as_ref().filter(|rest| rest.kept) {
            self.rest = Some((generation, Arc::clone(&rest.held)));
        }
        let of_this = |kept: &Option<(u64, Arc<Vec<DVec3>>)>| {
            kept.as_ref().filter(|(of, _)| target.warm && *of == generation).map(|(_, x)| Arc::clone(x))
        };
        let (before, at_rest) = (of_this(&self.preview), of_this(&self.rest));
        let at_rest = at_rest.filter(|_| settings.refine == Refine::Converged);
        match (&levels, &settings.model) {
            (Some(levels), Model::Coupled(options)) if !self.done.warmed => {
                self.done.warmed = true;
                match before {
                    Some(start) => {
                        let rest_follows = at_rest.is_some() && target.rest.is_none();
                        return self.go_on(session, target, sectioned, levels, options, (&start, rest_follows));
                    }
                    None => return Ok(()),
                }
            }
            _ => {}
        }
        if let (Some(levels), None, None) = (&levels, &target.rest, self.done.rested)
            && let Some(start) = at_rest
        {
            return self.settle(session, target, sectioned, levels, start.to_vec(), true);
        }
        let Some((stage, _)) = &self.done.two_stages else {
            return self.two_stages(session, target, sectioned, levels.as_deref());
        };
        if let (Some(levels), None, None) = (&levels, &target.rest, self.done.rested) {
            let asked = || ask(session, target.state);
            let scene = &sectioned.ground.loaded.scene;
            let surface = &sectioned.ground.distances.surface;
            let told = &mut |_: &Step<'_>| asked();
            let start = approach(scene, settings, levels, surface, &stage.parts, &stage.positions, (&asked, told));
            return self.settle(session, target, sectioned, levels, start, false);
        }
        self.finish(session, target, sectioned, levels.as_deref());
        Ok(())
    }
}

/// Whether a step is the last one.
fn ask(session: &Session, state: u64) -> ControlFlow<()> {
    if session.overtaken(state) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}
