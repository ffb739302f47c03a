//! The pipeline for one layer: distance → PARTs → mechanics → draped garment, each stage timed. Distances and cloth, which no range
//! table changes, can be kept ([`Prepared`]).

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::levels::Levels;
use super::nested_iteration::approach;
use super::parts::{StageTwo, stage_one, stage_two};
use super::release::Release;
use super::released_drape::{ReleasedDrape, settle_and_release};
use super::result::{ClothState, Drape, StageTimes};
use super::settings::{Model, Refine, Settings};
use super::stages::{StageResults, StartsFrom, folds_of, settled};
use crate::mechanics::folded_surface::FoldableCloth;
use crate::mechanics::folds::Folds;
use crate::mechanics::refine::Observer;
use crate::parts::Parts;
use crate::scene::Scene;

/// The part of a drape that no range table changes: distances to the body, and the cloth in one fabric. Many tables of one
/// garment share it. Several layers are prepared one by one as they are draped, and have an empty one.
#[derive(Debug)]
pub struct Prepared {
    layer: Option<PreparedLayer>,
}

#[derive(Debug)]
struct PreparedLayer {
    distances: Distances,
    cloth: Option<Levels>,
    /// `distance`, `cloth` and `total` alone.
    times: StageTimes,
}

impl Prepared {
    /// Prepares `scene` for drapes by `settings`, of which the fabric counts, the model, and whether steps follow.
    ///
    /// # Errors
    /// [`DrapeError`] where a constant of the fabric cannot be used.
    pub fn new(scene: &Scene, settings: &Settings) -> Result<Self, DrapeError> {
        let layer = if scene.layers.len() > 1 { None } else { Some(PreparedLayer::new(scene, settings)?) };
        Ok(Self { layer })
    }
}

impl PreparedLayer {
    fn new(scene: &Scene, settings: &Settings) -> Result<Self, DrapeError> {
        let began = Instant::now();
        let mut times = StageTimes::default();
        let (distances, cloth) = rayon::join(
            || timed(&mut times.distance, || Distances::of(scene)),
            || needs_cloth(settings).then(|| Levels::new(scene, settings)).transpose(),
        );
        let (distances, cloth) = (distances?, cloth?);
        times.total = began.elapsed();
        times.cloth = times.total.saturating_sub(times.distance);
        Ok(Self { distances, cloth, times })
    }
}

/// Both stages and the steps after them. The times include those of the preparation.
pub(super) fn drape_prepared(
    scene: &Scene,
    prepared: &Prepared,
    settings: &Settings,
    observer: Observer<'_>,
) -> Result<Drape, DrapeError> {
    let made;
    let PreparedLayer { distances: ground, cloth, times } = match &prepared.layer {
        Some(layer) => layer,
        None => {
            made = PreparedLayer::new(scene, settings)?;
            &made
        }
    };
    let (began, mut times) = (Instant::now(), *times);
    let table = settings.table.resolve(&ground.unsigned_m)?;
    let parts = timed(&mut times.segment, || stage_one(scene, settings.min_part, &table, &ground.unsigned_m));
    let level_part_count = parts.len();
    let Moved { stage, folds, state, release } =
        moved(scene, settings, ground, parts, cloth.as_ref(), &mut times, observer)?;
    let made = StageResults { ground: ground.clone(), table, level_part_count, stage, folds, state, release };
    let mut drape = made.judged(scene, settings, times);
    drape.times.total = times.total + began.elapsed();
    Ok(drape)
}

/// Whether any of it needs the cloth at full resolution.
pub(super) fn needs_cloth(settings: &Settings) -> bool {
    matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0)
}

/// Result of stage two and of the steps after it.
pub(super) struct Moved {
    pub(super) stage: StageTwo,
    pub(super) folds: Option<(Folds, Option<FoldableCloth>)>,
    pub(super) state: Option<(Vec<DVec3>, ClothState)>,
    pub(super) release: Option<Release>,
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
    let stage = timed(&mut times.mechanics, || {
        stage_two(scene, settings, ground, parts, cloth.map(|levels| &levels.cloth), &on)
    })?;
    let folds = folds_of(settings, cloth, &stage);
    let Some(levels) = cloth else { return Ok(Moved { stage, folds, state: None, release: None }) };
    let ReleasedDrape { cloth, refined, release, .. } = timed(&mut times.refine, || {
        let start = (approach(scene, settings, levels, &stage.positions, observer), StartsFrom::Parts);
        settle_and_release(scene, settings, levels, Some(ground), start, observer)
    })?;
    let cloth = cloth.as_ref().unwrap_or(&levels.cloth);
    let state = Some(settled(scene, settings, cloth, Some(ground), refined));
    if settings.refine == Refine::Steps(0) {
        times.refine = Duration::ZERO;
    }
    Ok(Moved { stage, folds, state, release })
}

pub(super) fn timed<T>(slot: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = work();
    *slot = start.elapsed();
    out
}
