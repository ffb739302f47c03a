//! The pipeline for one layer: distance → PARTs → mechanics → draped garment, each stage timed.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::error::DrapeError;
use super::levels::Levels;
use super::nested_iteration::approach;
use super::parts::{StageTwo, stage_one, stage_two};
use super::release::{Release, ReleasedDrape, let_go};
use super::result::{ClothState, Drape, StageTimes};
use super::settings::{Model, Refine, Settings};
use super::stages::{Distances, StageResults, StartsFrom, folds_of, refine_from, settled};
use crate::mechanics::folds::Folds;
use crate::mechanics::refine::Observer;
use crate::parts::Parts;
use crate::scene::Scene;

/// Both stages and the steps after them for a scene of one layer.
pub(super) fn drape_one(scene: &Scene, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    let began = Instant::now();
    let mut times = StageTimes::default();
    let StageTimes { distance: distance_time, segment: segment_time, .. } = &mut times;
    let (first, cloth) = rayon::join(
        || -> Result<_, DrapeError> {
            let ground = timed(distance_time, || Distances::of(scene))?;
            let table = settings.table.resolve(&ground.unsigned_m)?;
            let parts = timed(segment_time, || stage_one(scene, settings.min_part, &table, &ground.unsigned_m));
            Ok((ground, table, parts))
        },
        || {
            let began = Instant::now();
            let cloth = needs_cloth(settings).then(|| Levels::new(scene, &settings.fabric)).transpose();
            cloth.map(|cloth| (cloth, began.elapsed()))
        },
    );
    let (ground, table, parts) = first?;
    let (cloth, cloth_time) = cloth?;
    let level_part_count = parts.len();
    let Moved { stage, folds, state, let_go } =
        moved(scene, settings, &ground, parts, cloth.as_ref(), &mut times, observer)?;
    times.mechanics += cloth_time;
    let made = StageResults { ground, table, level_part_count, stage, folds, state, let_go };
    let mut drape = made.judged(scene, settings, times);
    drape.times.total = began.elapsed();
    Ok(drape)
}

/// Whether any of it needs the cloth at full resolution.
pub(super) fn needs_cloth(settings: &Settings) -> bool {
    matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0)
}

/// Result of stage two and of the steps after it.
pub(super) struct Moved {
    pub(super) stage: StageTwo,
    pub(super) folds: Option<Folds>,
    pub(super) state: Option<(Vec<DVec3>, ClothState)>,
    pub(super) let_go: Option<Release>,
}

/// Stage two, and as many steps at full resolution as the settings ask for.
pub(super) fn moved(
    scene: &Scene,
    settings: &Settings,
    ground: &Distances,
    parts: Parts,
    cloth: Option<&Levels>,
    times: &mut StageTimes,
    observer: Observer<'_>,
) -> Result<Moved, DrapeError> {
    let on = || ControlFlow::Continue(());
    let stage = timed(&mut times.mechanics, || stage_two(scene, settings, &ground.surface, parts, cloth, &on))?;
    let folds = folds_of(settings, cloth, &stage);
    let Some(levels) = cloth else { return Ok(Moved { stage, folds, state: None, let_go: None }) };
    let ReleasedDrape { cloth, refined, let_go } = timed(&mut times.refine, || {
        let start =
            approach(scene, settings, levels, &ground.surface, &stage.parts, &stage.positions, (&on, &mut *observer));
        let refined = refine_from(scene, settings, &levels.cloth, Some(ground), (start, StartsFrom::Parts), observer)?;
        let_go(scene, settings, refined, observer)
    })?;
    let cloth = cloth.as_ref().unwrap_or(&levels.cloth);
    let state = Some(settled(scene, settings, cloth, Some(ground), refined));
    if settings.refine == Refine::Steps(0) {
        times.refine = Duration::ZERO;
    }
    Ok(Moved { stage, folds, state, let_go })
}

pub(super) fn timed<T>(slot: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = work();
    *slot = start.elapsed();
    out
}
