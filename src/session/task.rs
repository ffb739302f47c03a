//! A task of the worker: the state that it computes, and the results that are published on the way.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use super::handle::Session;
use super::results::{AtRest, LoadedScene, Preview, RestInputs, Segmented, Snapshot};
use super::state::{SessionState, ms_since};
use crate::drape::{Drape, Settings};
use crate::mechanics::coupled::Motion;
use crate::parts::Parts;
use crate::scene::Scene;
use crate::study::accuracy::representable::representable;

/// The newest state. Its snapshot has stage one and the drape at rest of this state only.
pub(super) struct Target {
    pub(super) snapshot: Snapshot,
    pub(super) warm: bool,
    pub(super) accepted: Instant,
}

/// A part of the computation of a state whose PARTs are known.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) session: &'a Session,
    pub(super) target: &'a Target,
    pub(super) segmented: &'a Segmented,
}

impl<'a> Task<'a> {
    pub(super) fn settings(self) -> &'a Settings {
        &self.target.snapshot.job.settings
    }

    pub(super) fn loaded_scene(self) -> &'a Arc<LoadedScene> {
        &self.segmented.loaded_scene
    }

    pub(super) fn scene(self) -> &'a Scene {
        &self.loaded_scene().input.scene
    }

    /// Breaks once the state is no longer the newest.
    pub(super) fn check(self) -> ControlFlow<()> {
        if self.session.is_superseded(self.target.snapshot.state) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Publishes a result of the state, if it is still the newest.
    pub(super) fn publish(self, add: impl FnOnce(&mut SessionState)) {
        self.session.publish(self.target.snapshot.state, add);
    }

    /// A preview that is not done, of `parts` at `positions` (m) after `ms` milliseconds.
    pub(super) fn preview(self, parts: Arc<Parts>, positions: Vec<DVec3>, ms: f64) -> Preview {
        Preview {
            state: self.target.snapshot.state,
            loaded_scene: Arc::clone(self.loaded_scene()),
            done: false,
            parts,
            outcomes: Arc::default(),
            positions: Arc::new(positions),
            ms,
            after_ms: ms_since(self.target.accepted),
            warnings: Vec::new(),
        }
    }

    /// Least RMS distance from the drape at rest, mm, that the PARTs' maps could reach.
    pub(super) fn bound_mm(self, drape: &Drape) -> f64 {
        let scene = self.scene();
        let placed = &scene.garment.positions;
        let best = representable(&scene.topology, &drape.parts, &scene.is_held(), placed, &drape.positions);
        match self.settings().model.motion() {
            Motion::Affine => best.blended_affine_rms_mm,
            Motion::Translation => best.blended_translation_rms_mm,
        }
    }
}

/// A computation at full resolution.
pub(super) struct Refinement<'a> {
    pub(super) task: Task<'a>,
    pub(super) warm: bool,
    pub(super) began: Instant,
}

impl Refinement<'_> {
    /// The garment after `steps` steps, not yet at rest.
    pub(super) fn at(&self, positions: &[DVec3], residual_over_weight: f64, steps: usize) -> AtRest {
        let Self { task, warm, began } = *self;
        AtRest {
            state: task.target.snapshot.state,
            loaded_scene: Arc::clone(task.loaded_scene()),
            done: false,
            balanced: false,
            reused: false,
            warm,
            positions: Arc::new(positions.to_vec()),
            residual_over_weight,
            steps,
            ms: ms_since(began),
            after_ms: ms_since(task.target.accepted),
            reaction_n: Arc::default(),
            cloth_state: None,
            release: None,
            inputs: RestInputs::of(task.settings()),
            held_positions: Arc::default(),
        }
    }
}
