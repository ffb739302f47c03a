//! Body and garment, cloth, and the two stages: warm, and from the undraped garment.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use super::{Piece, Sewn, Target, Workshop};
use crate::drape::{Distances, DrapeError, ENOUGH, Levels, stage_two, told};
use crate::garment::fabric::Fabric;
use crate::mechanics::coupled::{self, CoupledError, CoupledOptions, Garment, Hints, Onlooker};
use crate::parts::Parts;
use crate::scene::Scene;
use crate::session::results::{LoadedScene, Preview, Segmented};
use crate::session::state::{ms_since, sums};
use crate::session::{EditError, Session};

/// Steps of a preview that goes on from the one before.
const WARM_STEPS: usize = 6;

/// Steps of its first glance.
const GLANCE_STEPS: usize = 2;

impl Workshop {
    pub(super) fn load(&mut self, session: &Session, target: &Target) -> Result<(), EditError> {
        let began = Instant::now();
        let loaded = target.job.scene.load_with(&self.meshes)?;
        let (load_ms, began) = (ms_since(began), Instant::now());
        let distances = Distances::of(&loaded.scene)?;
        self.generations += 1;
        let ground = Arc::new(LoadedScene {
            generation: self.generations,
            spec: target.job.scene.clone(),
            loaded,
            load_ms,
            distance_ms: ms_since(began),
            distances,
        });
        let mut found = Ok(());
        session.publish(target.state, |desk| found = desk.found_ground(ground));
        found
    }

    pub(super) fn sew(&mut self, sectioned: &Segmented, fabric: &Fabric) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, generation) = (&sectioned.ground.loaded.scene, sectioned.ground.generation);
        let levels = match self.cloth.take().filter(|sewn| sewn.generation == generation) {
            Some(sewn) => sewn.levels.recut(scene, fabric),
            None => Levels::new(scene, fabric),
        };
        let (levels, fabric) = (levels.map_err(DrapeError::from)?, fabric.clone());
        self.cloth = Some(Sewn { generation, fabric, levels: Arc::new(levels), took: began.elapsed() });
        Ok(())
    }

    /// Stage two from the preview before, shown step by step.
    pub(super) fn go_on(
        &mut self,
        piece: Piece<'_>,
        levels: &Levels,
        options: &CoupledOptions,
        (start, rest_follows): (&[DVec3], bool),
    ) -> Result<(), EditError> {
        let began = Instant::now();
        let (scene, generation, whole) = (piece.scene(), piece.ground().generation, &piece.sectioned.parts);
        let parts = match options.extents_m.last() {
            None => Arc::clone(whole),
            Some(&finest) => Arc::new(whole.cut_to_extent(&scene.garment, &scene.topology, finest)),
        };
        let preview = |positions: &[DVec3]| Preview {
            warm: true,
            ..piece.preview(Arc::clone(&parts), positions.to_vec(), ms_since(began))
        };
        let garment = Garment { mesh: &scene.garment, topology: &scene.topology, cloth: &levels.cloth };
        let mut reached = start.to_vec();
        if let Some(glance) = glance(scene, levels, &parts, start, options, &mut |_| piece.ask()) {
            reached = glance;
            let shown = Arc::new(preview(&reached));
            piece.publish(|desk| desk.view.preview = Some(shown));
            if rest_follows {
                self.preview = Some((generation, Arc::new(reached)));
                return Ok(());
            }
        }
        let start = reached.clone();
        let max_steps = if rest_follows { GLANCE_STEPS } else { WARM_STEPS };
        let few = CoupledOptions { max_steps, ..options.clone() };
        let solved = coupled::solve_given(&garment, &scene.body, &parts, &start, Hints::default(), &few, &mut |x| {
            reached.clear();
            reached.extend_from_slice(x);
            let step = Arc::new(preview(x));
            piece.publish(|desk| desk.view.preview = Some(step));
            piece.ask()
        });
        let mut solved = match solved {
            Ok(solved) => solved,
            Err(CoupledError::Interrupted) => {
                self.preview = Some((generation, Arc::new(reached)));
                return Ok(());
            }
            Err(error) => return Err(DrapeError::from(error).into()),
        };
        // The displacement of a PART counts from the garment as placed.
        let placed = &scene.garment.positions;
        let moved: Vec<DVec3> = solved.positions.iter().zip(placed).map(|(x, before)| *x - *before).collect();
        for ((part, result), sum) in parts.parts.iter().zip(&mut solved.parts).zip(sums(&parts, &moved)) {
            result.displacement = sum / part.vertices.len() as f64;
        }
        let outcomes = Arc::new(solved.parts.iter().map(told).collect());
        let shown = Arc::new(Preview { done: true, outcomes, ..preview(&solved.positions) });
        self.preview = Some((generation, Arc::clone(&shown.positions)));
        piece.publish(|desk| desk.view.preview = Some(shown));
        Ok(())
    }

    /// Both stages from the undraped garment, as `run` does it.
    pub(super) fn two_stages(&mut self, piece: Piece<'_>, levels: Option<&Levels>) -> Result<(), EditError> {
        let began = Instant::now();
        let surface = &piece.ground().distances.surface;
        let parts = (*piece.sectioned.parts).clone();
        let stage = match stage_two(piece.scene(), piece.settings(), surface, parts, levels, &|| piece.ask()) {
            Ok(stage) => stage,
            Err(DrapeError::Coupled(CoupledError::Interrupted)) => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        let took = began.elapsed();
        let preview = Arc::new(Preview {
            done: true,
            outcomes: Arc::new(stage.outcomes.clone()),
            warnings: stage.warnings.clone(),
            ..piece.preview(Arc::new(stage.parts.clone()), stage.positions.clone(), took.as_secs_f64() * 1e3)
        });
        self.preview = Some((piece.ground().generation, Arc::clone(&preview.positions)));
        self.done.two_stages = Some((stage, took));
        piece.publish(|desk| {
            desk.add_to_trail(|point| point.two_stages_ms = Some(preview.ms));
            desk.view.preview = Some(preview);
        });
        Ok(())
    }
}

/// Two steps on a cloth of a quarter of the vertices, which take a quarter of the time; none where the PARTs are too fine for it.
fn glance(
    scene: &Scene,
    levels: &Levels,
    parts: &Parts,
    start: &[DVec3],
    options: &CoupledOptions,
    onlooker: Onlooker<'_>,
) -> Option<Vec<DVec3>> {
    let level = levels.coarser.first().filter(|level| level.mesh().vertex_count() >= ENOUGH * parts.len())?;
    let two = CoupledOptions { max_steps: GLANCE_STEPS, ..options.clone() };
    let coarse = levels.restrict(1, start);
    let parts = levels.parts(1, parts);
    let solved = coupled::solve_given(&level.garment(), &scene.body, &parts, &coarse, Hints::default(), &two, onlooker);
    solved.ok().map(|solved| levels.prolong(1, start, solved.positions))
}
