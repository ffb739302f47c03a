//! The work on the newest state, piece by piece: whoever drives it may look up between two pieces, and a step within a piece
//! looks whether a newer state has come.

mod outfit;
mod rest;
mod stages;

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::results::{AtRest, LoadedScene, Preview, Segmented};
use super::state::{Desk, ms_since};
use super::{EditError, Session};
use crate::base::error_text::said;
use crate::drape::{Levels, Model, Refine, Settings, StageTwo, approach};
use crate::garment::MeshCache;
use crate::garment::fabric::Fabric;
use crate::mechanics::refine::Step;
use crate::parts::Parts;
use crate::scene::Scene;
use crate::study::job::Job;

/// The refusal of an edit whose computation panicked. The panic's own message goes to the terminal alone: it may quote a file.
const PANICKED: &str = "computing this edit failed by a fault of the program, and the last good state stands; please report the edit with the \
     message that the program printed";

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
    sectioned: Option<Arc<Segmented>>,
    rest: Option<Arc<AtRest>>,
}

/// A piece of work on a state whose PARTs are known.
#[derive(Clone, Copy)]
struct Piece<'a> {
    session: &'a Session,
    target: &'a Target,
    sectioned: &'a Segmented,
}

impl<'a> Piece<'a> {
    fn settings(self) -> &'a Settings {
        &self.target.job.settings
    }

    fn ground(self) -> &'a Arc<LoadedScene> {
        &self.sectioned.ground
    }

    fn scene(self) -> &'a Scene {
        &self.ground().loaded.scene
    }

    /// Whether a step is the last one.
    fn ask(self) -> ControlFlow<()> {
        if self.session.overtaken(self.target.state) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Makes something known of the state, if it is still the newest.
    fn publish(self, add: impl FnOnce(&mut Desk)) {
        self.session.publish(self.target.state, add);
    }

    /// These PARTs at `positions` (m) after so many milliseconds of steps: cold, not done, and nothing told of it yet.
    fn preview(self, parts: Arc<Parts>, positions: Vec<DVec3>, ms: f64) -> Preview {
        Preview {
            state: self.target.state,
            ground: Arc::clone(self.ground()),
            warm: false,
            done: false,
            parts,
            outcomes: Arc::default(),
            positions: Arc::new(positions),
            ms,
            after_ms: ms_since(self.target.accepted),
            warnings: Vec::new(),
        }
    }
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
        let outcome = catch_unwind(AssertUnwindSafe(|| rayon::scope(|_| self.piece(session, &target))));
        let refused = match outcome {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some((said(&error, "; because "), matches!(error, EditError::Scene(_)))),
            Err(_) => {
                // Whatever the panic left half done is computed anew.
                (self.cloth, self.preview, self.rest, self.done) = (None, None, None, Done::default());
                Some((PANICKED.to_owned(), false))
            }
        };
        if let Some((sentence, scene)) = refused
            && !session.overtaken(target.state)
        {
            session.publish(target.state, |desk| desk.refuse(target.state, sentence, scene));
        }
        true
    }

    fn piece(&mut self, session: &Session, target: &Target) -> Result<(), EditError> {
        let Some(sectioned) = &target.sectioned else { return self.load(session, target) };
        let piece = Piece { session, target, sectioned };
        let settings = piece.settings();
        if piece.scene().layers.len() > 1 {
            return self.outfit(piece);
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
        if let (Some(levels), Model::Coupled(options), false) = (&levels, &settings.model, self.done.warmed) {
            self.done.warmed = true;
            let Some(start) = before else { return Ok(()) };
            let rest_follows = at_rest.is_some() && target.rest.is_none();
            return self.go_on(piece, levels, options, (&start, rest_follows));
        }
        let to_rest = levels.as_ref().filter(|_| target.rest.is_none() && self.done.rested.is_none());
        if let (Some(levels), Some(start)) = (to_rest, at_rest) {
            return self.settle(piece, levels, start.to_vec(), true);
        }
        let Some((stage, _)) = &self.done.two_stages else { return self.two_stages(piece, levels.as_deref()) };
        if let Some(levels) = to_rest {
            let asked = || piece.ask();
            let surface = &sectioned.ground.distances.surface;
            let told = &mut |_: &Step<'_>| asked();
            let (parts, positions) = (&stage.parts, &stage.positions);
            let start = approach(piece.scene(), settings, levels, surface, parts, positions, (&asked, told));
            return self.settle(piece, levels, start, false);
        }
        self.finish(piece, levels.as_deref());
        Ok(())
    }
}
