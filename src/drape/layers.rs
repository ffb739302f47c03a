//! Garments worn over each other, draped in the order in which they are put on.
//!
//! Stage one cuts all of them at once, by one table. Then each garment goes through stage two and to rest over the body and what lies
//! below it, which stands still meanwhile; and at the end all of them go to rest together, the inner ones under the weight of the outer,
//! cloth against cloth with its friction ([`proximity`](crate::mechanics::energy::proximity)).
//!
//! Limits: PARTs of an outer garment meet what is below at their vertices alone; the steps at the end mend what that leaves.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::levels::{Levels, cloth_of};
use super::parts::{StageTwo, stage_one};
use super::pipeline::{Moved, moved, needs_cloth, timed};
use super::result::{Drape, PartOutcome, StageTimes};
use super::settings::Settings;
use super::stages::{StageResults, StartsFrom, refine_from, settled};
use crate::mechanics::folds::Folds;
use crate::mechanics::refine::{Observer, Record, Step};
use crate::mesh::Topology;
use crate::parts::{Parts, UNASSIGNED};
use crate::scene::{Layer, Scene};

/// Steps that a garment takes by itself at most: what is below stands still meanwhile, so rest is not to be had yet.
const MAX_STEPS_ALONE: usize = 30;

/// The garments draped so far.
struct LayerState<'a> {
    scene: &'a Scene,
    /// Where they are, m: as placed, if nothing was done with them yet.
    positions: Vec<DVec3>,
    /// Result of stage two of each garment.
    stages: Vec<StageTwo>,
    folds: Vec<Folds>,
    /// Every step at full resolution.
    history: Vec<Record>,
    stopped: bool,
}

/// Drapes the garments of `scene` inner to outer, then all of them together.
pub(super) fn in_order(scene: &Scene, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    let began = Instant::now();
    let mut times = StageTimes::default();
    let ground = timed(&mut times.distance, || Distances::of(scene))?;
    let table = settings.table.resolve(&ground.unsigned_m)?;
    let parts = timed(&mut times.segment, || stage_one(scene, settings.min_part, &table, &ground.unsigned_m));
    let mut worn = LayerState {
        scene,
        positions: scene.garment.positions.clone(),
        stages: Vec::new(),
        folds: Vec::new(),
        history: Vec::new(),
        stopped: false,
    };
    let mut before = Vec::new();
    for k in 0..scene.layers.len() {
        let alone = scene.layer_scene(k, &worn.positions)?;
        before.clone_from(&worn.positions);
        before[scene.layers[k].vertices.clone()].copy_from_slice(&alone.garment.positions);
        worn.put_on(k, &alone, settings, &parts, &mut times, observer)?;
    }
    let mut state = None;
    if needs_cloth(settings) {
        let refining = Instant::now();
        // Nothing crosses with all below the last as they lie, and that one as it was put over them.
        let cloth = cloth_of(scene, settings, &scene.held)?.clear_at(before);
        let (steps, stopped) = (worn.history.last().map_or(0, |r| r.iteration), worn.stopped);
        let start = scene.lift_layers(worn.positions.clone());
        let refined = refine_from(scene, settings, &cloth, None, (start, StartsFrom::Parts), None, &mut |step| {
            if stopped {
                return ControlFlow::Break(());
            }
            observer(&Step { iteration: steps + step.iteration, ..*step })
        })?;
        let (positions, mut reached) = settled(scene, settings, &cloth, None, refined);
        worn.append_history(&reached.history);
        (reached.steps, reached.history) = (steps + reached.steps, std::mem::take(&mut worn.history));
        state = Some((positions, reached));
        times.refine += refining.elapsed();
    }
    let folds = worn.all_folds().map(|folds| (folds, None));
    let made = StageResults {
        ground,
        table,
        level_part_count: parts.len(),
        stage: worn.joined(&parts),
        folds,
        state,
        release: None,
    };
    let mut drape = made.judged(scene, settings, times);
    drape.times.total = began.elapsed();
    Ok(drape)
}

impl LayerState<'_> {
    /// Stage two and the steps after it for one garment.
    fn put_on(
        &mut self,
        k: usize,
        alone: &Scene,
        settings: &Settings,
        parts: &Parts,
        times: &mut StageTimes,
        observer: Observer<'_>,
    ) -> Result<(), DrapeError> {
        let layer = &self.scene.layers[k];
        let mut own = StageTimes::default();
        let levels = timed(&mut own.cloth, || needs_cloth(settings).then(|| Levels::new(alone, settings)).transpose())?;
        times.cloth += own.cloth;
        let ground = Distances::to_body(alone);
        let steps = self.history.last().map_or(0, |r| r.iteration);
        let mut all = self.positions.clone();
        let stopped = &mut self.stopped;
        let mut observe = |step: &Step<'_>| {
            all[layer.vertices.clone()].copy_from_slice(step.positions);
            let flow = observer(&Step { iteration: steps + step.iteration, positions: &all, ..*step });
            *stopped |= flow.is_break();
            if *stopped || step.iteration >= MAX_STEPS_ALONE { ControlFlow::Break(()) } else { flow }
        };
        let parts = share(parts, layer, &alone.topology);
        let Moved { stage, folds, state, .. } =
            moved(alone, settings, &ground, parts, levels.as_ref(), &mut own, &mut observe)?;
        times.mechanics += own.mechanics;
        times.refine += own.refine;
        let reached = state.as_ref().map_or(&stage.positions, |(positions, _)| positions);
        self.positions[layer.vertices.clone()].copy_from_slice(reached);
        if let Some((_, state)) = &state {
            self.append_history(&state.history);
        }
        self.stages.push(stage);
        self.folds.extend(folds.map(|(folds, _)| folds));
        Ok(())
    }

    /// More steps, after those that were.
    fn append_history(&mut self, history: &[Record]) {
        let steps = self.history.last().map_or(0, |r| r.iteration);
        let again = usize::from(!self.history.is_empty());
        self.history.extend(history.iter().skip(again).map(|r| Record { iteration: steps + r.iteration, ..*r }));
    }

    /// The folds of all of them, if there are.
    fn all_folds(&mut self) -> Option<Folds> {
        let all = std::mem::take(&mut self.folds);
        (!all.is_empty()).then(|| Folds {
            excess_percent: all.iter().flat_map(|f| f.excess_percent.iter().copied()).collect(),
            across: all.iter().flat_map(|f| f.across.iter().copied()).collect(),
        })
    }

    /// Stage two of all of them: PARTs in one list, by level as always, each with what came of it.
    fn joined(self, of_table: &Parts) -> StageTwo {
        let mut label = Vec::with_capacity(self.positions.len());
        let mut all = Vec::new();
        for stage in &self.stages {
            let first = all.len() as u32;
            let number = |&p: &u32| if p == UNASSIGNED { UNASSIGNED } else { first + p };
            label.extend(stage.parts.part_of_vertex.iter().map(number));
            all.extend(stage.parts.parts.iter().map(|part| part.level).zip(stage.outcomes.iter().copied()));
        }
        let Parts { own_extent, hole_vertices, .. } = of_table;
        let level = |label: u32| all[label as usize].0;
        let parts = Parts::from_labels(&self.scene.topology, &label, level, own_extent.clone(), *hole_vertices);
        let positions: Vec<DVec3> = self.stages.iter().flat_map(|stage| stage.positions.iter().copied()).collect();
        let placed = &self.scene.garment.positions;
        let outcome = |vertices: &[u32]| {
            let moved = vertices.iter().map(|&v| positions[v as usize] - placed[v as usize]).sum::<DVec3>();
            let (_, outcome) = all[label[vertices[0] as usize] as usize];
            // From how it was placed, not from how it was put over the others.
            PartOutcome { displacement: moved / vertices.len() as f64, ..outcome }
        };
        let outcomes = parts.parts.iter().map(|part| outcome(&part.vertices)).collect();
        let named = |(layer, stage): (&Layer, &StageTwo)| {
            stage.warnings.iter().map(|warning| format!("{}: {warning}", layer.name)).collect::<Vec<_>>()
        };
        let warnings = self.scene.layers.iter().zip(&self.stages).flat_map(named).collect();
        StageTwo { parts, outcomes, positions, warnings }
    }
}

/// The PARTs of one of the garments, by its own vertex numbers.
fn share(parts: &Parts, layer: &Layer, topology: &Topology) -> Parts {
    let label = &parts.part_of_vertex[layer.vertices.clone()];
    let level = |label: u32| parts.parts[label as usize].level;
    Parts::from_labels(topology, label, level, parts.own_extent.clone(), parts.hole_vertices)
}
