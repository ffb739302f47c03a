//! All stages in order, each timed: distance → PARTs → mechanics → draped garment.
//!
//! [`drape`] is the whole two-stage model; it reads as the paper's sections do. What it is given ([`Scene`], [`Settings`])
//! is plain data, and so is what it returns ([`Drape`]): recording, printing and comparing are other people's work.

mod error;
mod layers;
mod levels;
mod nested_iteration;
mod parts;
mod release;
mod settings;
mod stages;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::body::distance::SurfacePoint;
use crate::mechanics::fit::Fit;
use crate::mechanics::folds::Folds;
use crate::mechanics::refine::{self, Observer, Stop};
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
pub use crate::scene::Scene;
pub use error::DrapeError;
pub(crate) use levels::Levels;
pub(crate) use nested_iteration::approach;
pub(crate) use parts::{ENOUGH, StageTwo, stage_one, stage_two, told};
pub use release::LetGo;
pub(crate) use release::{Released, let_go};
pub use settings::{DEFAULT_EXTENTS_CM, Model, Refine, Settings};
pub(crate) use stages::{Distances, Made, StartsFrom, folds_of, refine_from, settled};

/// How long each stage took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StageTimes {
    /// Closest points on the body.
    pub distance: Duration,
    /// Equation (1): levels to connected PARTs.
    pub segment: Duration,
    /// Stage two.
    pub mechanics: Duration,
    /// Newton steps at full resolution, and what of setting them up is not done beside stage two; zero where none are asked
    /// for, though the preview's energy and residual are still measured.
    pub refine: Duration,
    /// All of it, start to end; more than the sum by what lies between.
    pub total: Duration,
}

impl StageTimes {
    /// What lies between the stages.
    #[must_use]
    pub(crate) fn other(self) -> Duration {
        self.total.saturating_sub(self.distance + self.segment + self.mechanics + self.refine)
    }
}

/// The outcome of stage two for one PART.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartOutcome {
    /// Resultant force F, N.
    pub force_n: DVec3,
    /// Displacement D, m.
    pub displacement: DVec3,
    /// Whether the body carries it.
    pub contact: bool,
}

/// Where the cloth stands at full resolution.
#[derive(Debug, Clone)]
pub struct ClothState {
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over free vertices, over the garment's weight.
    pub residual_over_weight: f64,
    /// Newton steps done.
    pub steps: usize,
    /// Why they ended.
    pub stop: Stop,
    /// Every step, the start first.
    pub history: Vec<refine::Record>,
    /// Strain and pressure.
    pub fit: Fit,
}

/// What came out, stage by stage.
#[derive(Debug, Clone)]
pub struct Drape {
    /// Closest points on the body, per garment vertex, before draping.
    pub surface: Vec<SurfacePoint>,
    /// Unsigned distances to the body, m.
    pub distance: Vec<f64>,
    /// The range table of stage one, with the rows that its rule made for this garment.
    pub table: RangeTable,
    /// The PARTs of stage one; cut to an extent where the model does so.
    pub parts: Parts,
    /// How many PARTs the range table alone made.
    pub level_part_count: usize,
    /// Stage two, per PART.
    pub outcomes: Vec<PartOutcome>,
    /// The garment after stage two, before any step at full resolution, m.
    pub preview: Vec<DVec3>,
    /// Cloth that the preview has no room for, and folds of PARTs do not show; the coupled model's alone.
    pub folds: Option<Folds>,
    /// The displaced garment, m.
    pub positions: Vec<DVec3>,
    /// The cloth at full resolution; the equations of the paper alone need none.
    pub state: Option<ClothState>,
    /// What came of letting go what was held until it rested.
    pub let_go: Option<LetGo>,
    /// Pairs of triangles of the displaced garment that cross: steps at full resolution keep cloth off cloth, PARTs alone do not.
    pub self_intersecting_pairs: usize,
    /// Vertices of the displaced garment inside the body.
    pub penetrating_vertices: usize,
    /// How deep the deepest of them is, m.
    pub penetration: f64,
    /// Stage times.
    pub times: StageTimes,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Runs both stages, then as many steps at full resolution as the settings ask for; `observer` is told of each and may end
/// them.
///
/// # Errors
/// [`DrapeError`] where a constant of the fabric or an option cannot be used.
pub fn drape(scene: &Scene, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    // In the pool: hundreds of short joins follow, and each from outside it would put the caller to sleep and wake it.
    rayon::scope(|_| stages(scene, settings, observer))
}

/// An observer for who does not look.
pub fn unobserved(_: &refine::Step<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn stages(scene: &Scene, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    if scene.layers.len() > 1 {
        return layers::in_order(scene, settings, observer);
    }
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
    let made = Made { ground, table, level_part_count, stage, folds, state, let_go };
    let mut drape = made.judged(scene, settings, times);
    drape.times.total = began.elapsed();
    Ok(drape)
}

/// Whether any of it needs the cloth at full resolution.
fn needs_cloth(settings: &Settings) -> bool {
    matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0)
}

/// What stage two and the steps after it make of the PARTs.
struct Moved {
    stage: StageTwo,
    folds: Option<Folds>,
    state: Option<(Vec<DVec3>, ClothState)>,
    let_go: Option<LetGo>,
}

/// Stage two, and as many steps at full resolution as the settings ask for.
fn moved(
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
    let Released { cloth, refined, let_go } = timed(&mut times.refine, || {
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

fn timed<T>(slot: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = work();
    *slot = start.elapsed();
    out
}
