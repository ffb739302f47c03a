//! The drape at rest, and the whole of a state with its figures.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::{Piece, Workshop};
use crate::drape::{
    ClothState, Drape, Levels, Made, Refine, Released, Settings, StageTimes, StartsFrom, folds_of, let_go, refine_from,
    settled,
};
use crate::mechanics::coupled::Motion;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::refine::{Step, Stop};
use crate::scene::Scene;
use crate::session::EditError;
use crate::session::results::{AtRest, Finished};
use crate::session::state::ms_since;
use crate::study::accuracy::{self, representable::representable};
use crate::study::metrics::Metrics;

/// A drape on its way to rest.
pub(super) struct Way<'a> {
    pub(super) piece: Piece<'a>,
    pub(super) warm: bool,
    pub(super) began: Instant,
}

impl Way<'_> {
    /// How far it has come: nothing yet of what is told of a drape at rest.
    pub(super) fn at(&self, positions: &[DVec3], residual_over_weight: f64, steps: usize) -> AtRest {
        let Self { piece, warm, began } = *self;
        let settings = piece.settings();
        AtRest {
            state: piece.target.state,
            ground: Arc::clone(piece.ground()),
            done: false,
            balanced: false,
            kept: false,
            warm,
            positions: Arc::new(positions.to_vec()),
            residual_over_weight,
            steps,
            ms: ms_since(began),
            after_ms: ms_since(piece.target.accepted),
            reaction_n: Arc::default(),
            told: None,
            let_go: None,
            of: (settings.fabric.clone(), settings.refine, settings.self_contact),
            held: Arc::default(),
        }
    }
}

impl Workshop {
    /// Steps at full resolution from `start`, shown step by step.
    pub(super) fn settle(
        &mut self,
        piece: Piece<'_>,
        levels: &Levels,
        start: Vec<DVec3>,
        warm: bool,
    ) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, settings) = (piece.scene(), piece.settings());
        let distances = Some(&piece.ground().distances);
        let way = Way { piece, warm, began };
        let from = if warm { StartsFrom::Rest } else { StartsFrom::Parts };
        let mut balanced = false;
        let mut show = |step: &Step<'_>| {
            // What is held balances before it is let go.
            balanced |= step.at_rest && !scene.let_go;
            if step.iteration > 0 || balanced {
                let at = way.at(step.positions, step.residual_over_weight, step.iteration);
                let step = Arc::new(AtRest { balanced, ..at });
                piece.publish(|desk| desk.view.rest = Some(step));
            }
            piece.ask()
        };
        let refined = refine_from(scene, settings, &levels.cloth, distances, (start, from), &mut show)?;
        // What is held is held where it was placed: the next drape goes on from before it is let go.
        let held = Arc::new(refined.positions.clone());
        self.rest = Some((piece.ground().generation, Arc::clone(&held)));
        let Released { cloth, refined, let_go } = let_go(scene, settings, refined, &mut show)?;
        if refined.stop == Stop::Interrupted && piece.ask().is_break() {
            // A drape that falls off is interrupted too, and shown.
            return Ok(());
        }
        let took = began.elapsed();
        let cloth = cloth.as_ref().unwrap_or(&levels.cloth);
        let (positions, state) = settled(scene, settings, cloth, distances, refined);
        let rest = Arc::new(AtRest {
            done: true,
            balanced: state.stop == Stop::Converged,
            reaction_n: Arc::new(reactions(cloth, &positions, &state.fit.pressure_kpa)),
            let_go,
            held,
            ms: took.as_secs_f64() * 1e3,
            told: Some(Arc::new(state.clone())),
            ..way.at(&positions, state.residual_over_weight, state.steps)
        });
        self.done.rested = Some(took);
        piece.publish(|desk| {
            desk.add_to_trail(|point| point.rest_ms = Some(rest.ms));
            desk.found_rest(rest);
        });
        Ok(())
    }

    /// The whole drape of the state, and its figures.
    pub(super) fn finish(&mut self, piece: Piece<'_>, levels: Option<&Levels>) {
        let Some((stage, took)) = self.done.two_stages.take() else { return };
        let (ground, sectioned, rest) = (piece.ground(), piece.sectioned, piece.target.rest.as_ref());
        let ms = |ms: f64| Duration::from_secs_f64(1e-3 * ms);
        let sewing = self.cloth.as_ref().map_or(Duration::ZERO, |sewn| sewn.took);
        let mut times = StageTimes {
            distance: ms(ground.distance_ms),
            segment: ms(sectioned.segment_ms),
            mechanics: took + sewing,
            refine: self.done.rested.unwrap_or_default(),
            total: Duration::ZERO,
        };
        times.total = times.distance + times.segment + times.mechanics + times.refine;
        let state = rest.and_then(|rest| {
            let told: &ClothState = rest.told.as_deref()?;
            Some((rest.positions.to_vec(), ClothState { steps: rest.steps, ..told.clone() }))
        });
        let made = Made {
            ground: ground.distances.clone(),
            table: (*sectioned.table).clone(),
            level_part_count: sectioned.parts.len(),
            folds: folds_of(piece.settings(), levels, &stage),
            stage,
            state,
            let_go: rest.and_then(|rest| rest.let_go),
        };
        self.show(piece, made.judged(piece.scene(), piece.settings(), times));
    }

    /// A whole drape of the state, with its figures.
    pub(super) fn show(&mut self, piece: Piece<'_>, drape: Drape) {
        let (settings, scene) = (piece.settings(), piece.scene());
        let metrics = Metrics::of(scene, &drape);
        let rested = drape.state.is_some() && settings.refine != Refine::Steps(0);
        let preview_error_mm = rested.then(|| accuracy::rms_mm(&drape.preview, &drape.positions));
        let bound_mm = rested.then(|| bound(settings, scene, &drape));
        let bound_mm = bound_mm.filter(|mm| mm.is_finite());
        let (state, ground) = (piece.target.state, Arc::clone(piece.ground()));
        let finished = Finished { state, ground, drape, metrics, preview_error_mm, bound_mm };
        self.done.finished = true;
        piece.publish(|desk| {
            desk.add_to_trail(|point| {
                (point.preview_error_mm, point.bound_mm) = (preview_error_mm, bound_mm);
            });
            desk.view.finished = Some(Arc::new(finished));
            desk.finish();
        });
    }
}

/// What blended affine maps of the PARTs could hold the drape at rest to.
fn bound(settings: &Settings, scene: &Scene, drape: &Drape) -> f64 {
    let placed = &scene.garment.positions;
    let best = representable(&scene.topology, &drape.parts, &scene.is_held(), placed, &drape.positions);
    match settings.model.motion() {
        Motion::Affine => best.blended_affine_rms_mm,
        Motion::Translation => best.blended_translation_rms_mm,
    }
}

/// Force of the body on each vertex that it touches where the cloth rests, N: what its weight and the cloth pull with, friction included.
pub(super) fn reactions(cloth: &Cloth, x: &[DVec3], pressure_kpa: &[f64]) -> Vec<DVec3> {
    let mut gradient = Vec::new();
    cloth.gradient(x, &Contacts::none(), &mut gradient);
    let carried = cloth.held.iter().zip(pressure_kpa).map(|(held, kpa)| !held && *kpa > 0.0);
    gradient.iter().zip(carried).map(|(g, carried)| if carried { *g } else { DVec3::ZERO }).collect()
}
