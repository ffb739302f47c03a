//! All stages in order, each timed: distance → PARTs → mechanics → draped garment.
//!
//! [`drape`] is the whole two-stage model; it reads as the paper's sections do. What it is given ([`Scene`], [`Settings`])
//! is plain data, and so is what it returns ([`Drape`]): recording, printing and comparing are other people's work.

mod error;
mod let_go;
mod levels;
mod parts;
mod settings;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::distance::SurfacePoint;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::fit::{Fit, fit};
use crate::mechanics::folds::{Folds, folds};
use crate::mechanics::refine::{self, Observer, RefineOptions, Refined, Stop};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::parts::Parts;
use crate::range_table::RangeTable;
pub use crate::scene::Scene;
pub use error::DrapeError;
pub use let_go::LetGo;
use levels::Levels;
use parts::{approach, stage_one, stage_two};
pub use settings::{DEFAULT_EXTENTS_CM, Model, Refine, Settings};

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
    /// Pairs of triangles of the displaced garment that cross: cloth through cloth, which no model here prevents.
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
    let began = Instant::now();
    let mut times = StageTimes::default();
    let needs_cloth = matches!(settings.model, Model::Coupled(_)) || settings.refine != Refine::Steps(0);
    let StageTimes { distance: distance_time, segment: segment_time, .. } = &mut times;
    let (first, cloth) = rayon::join(
        || -> Result<_, DrapeError> {
            let surface = timed(distance_time, || scene.body.nearest_all(&scene.garment.positions));
            // Equation (1) takes the distance without its sign: a vertex inside is as far from the surface as one outside.
            let distance: Vec<f64> = surface.iter().map(|s| s.signed_distance.abs()).collect();
            let table = settings.table.resolve(&distance)?;
            let parts = timed(segment_time, || stage_one(scene, settings.min_part, &table, &distance));
            Ok((surface, distance, table, parts))
        },
        || {
            let began = Instant::now();
            let cloth = needs_cloth.then(|| Levels::new(scene, &settings.fabric)).transpose();
            cloth.map(|cloth| (cloth, began.elapsed()))
        },
    );
    let (surface, distance, table, parts) = first?;
    let (cloth, cloth_time) = cloth?;
    let mut warnings = unassigned_warning(&parts);
    let level_part_count = parts.len();
    let stage = timed(&mut times.mechanics, || stage_two(scene, settings, &surface, parts, cloth.as_ref()));
    times.mechanics += cloth_time;
    let stage = stage?;
    warnings.extend(stage.warnings);
    let preview_folds = match settings.model {
        Model::Coupled(_) => cloth.as_ref().map(|levels| folds(&levels.cloth, &stage.positions)),
        Model::Paper(_) => None,
    };
    let refined =
        timed(&mut times.refine, || refine_further(scene, settings, cloth, &stage.parts, &stage.positions, observer))?;
    if settings.refine == Refine::Steps(0) {
        times.refine = Duration::ZERO;
    }
    let (positions, state, let_go) = match refined {
        None => (stage.positions.clone(), None, None),
        Some((cloth, refined, let_go)) => {
            let contacts = met(&cloth, scene, settings.refine, &refined.positions);
            let fit = fit(&cloth, contacts, &refined.positions, refined.contact_stiffness);
            let Refined { positions, energy, residual_over_weight, steps, history, stop, .. } = refined;
            (positions, Some(ClothState { energy, residual_over_weight, steps, stop, history, fit }), let_go)
        }
    };
    warnings.extend(state.as_ref().and_then(|s| unsettled_warning(settings.refine, s)));
    if let Some(slides @ LetGo::Slides { .. }) = &let_go {
        warnings.push(format!("the garment {slides}"));
    }
    if let (Some((low, _)), true) = (scene.body.mesh().bounds(), state.is_some())
        && positions.iter().all(|x| x.z < low.z)
    {
        warnings.push("the garment has fallen off the body; hold an edge of it (--hold), or place it better".into());
    }
    let inside =
        scene.body.nearest_all(&positions).into_iter().map(|s| -s.signed_distance).filter(|&depth| depth > 0.0);
    let (penetrating_vertices, penetration) = inside.fold((0, 0.0_f64), |(n, deepest), d| (n + 1, deepest.max(d)));
    let self_intersecting_pairs = self_intersecting_pairs(&scene.garment.with_positions(positions.clone())).len();
    times.total = began.elapsed();
    Ok(Drape {
        surface,
        distance,
        table,
        parts: stage.parts,
        level_part_count,
        outcomes: stage.outcomes,
        preview: stage.positions,
        folds: preview_folds,
        state,
        let_go,
        self_intersecting_pairs,
        positions,
        penetrating_vertices,
        penetration,
        times,
        warnings,
    })
}

/// Steps at full resolution. None are done for [`Refine::Steps`]`(0)`, but the coupled model's energy and residual are told.
fn refine_further(
    scene: &Scene,
    settings: &Settings,
    levels: Option<Levels>,
    parts: &Parts,
    start: &[DVec3],
    observer: Observer<'_>,
) -> Result<Option<(Cloth, Refined, Option<LetGo>)>, DrapeError> {
    let Some(levels) = levels else { return Ok(None) };
    let max_steps = match settings.refine {
        Refine::Steps(n) => Some(n),
        Refine::Converged => None,
    };
    let start = approach(scene, settings, &levels, parts, start);
    let options = RefineOptions { max_steps, ..RefineOptions::default() };
    let floor = scene.body.mesh().bounds().map_or(f64::NEG_INFINITY, |(low, _)| low.z);
    let contacts = met(&levels.cloth, scene, settings.refine, &start);
    let refined = refine::refine_with(&levels.cloth, contacts, start, &options, &mut |step| {
        // What has fallen past the feet meets nothing any more, and would fall for ever.
        if step.positions.iter().all(|x| x.z < floor) { ControlFlow::Break(()) } else { observer(step) }
    })?;
    if scene.let_go && !scene.held.is_empty() && settings.refine == Refine::Converged && refined.stop == Stop::Converged
    {
        let (cloth, refined, outcome) = let_go::let_go(scene, &settings.fabric, (levels.cloth, refined), observer)?;
        return Ok(Some((cloth, refined, Some(outcome))));
    }
    Ok(Some((levels.cloth, refined, None)))
}

/// What the cloth meets at `x`: by planes where no step is taken, which need no more.
fn met<'b>(cloth: &Cloth, scene: &'b Scene, refine: Refine, x: &[DVec3]) -> Contacts<'b> {
    if refine == Refine::Steps(0) { cloth.contacts_by_planes(&scene.body, x) } else { cloth.contacts(&scene.body, x) }
}

fn unsettled_warning(asked: Refine, state: &ClothState) -> Option<String> {
    let unsettled = asked == Refine::Converged && matches!(state.stop, Stop::Stalled | Stop::StepsDone);
    unsettled.then(|| {
        format!(
            "the drape has not settled: after {} steps the residual is {:.1e} of the weight, expected under 1e-3",
            state.steps, state.residual_over_weight
        )
    })
}

fn unassigned_warning(parts: &Parts) -> Vec<String> {
    if parts.unassigned == 0 {
        return Vec::new();
    }
    vec![format!("{} vertices lie in no level of the range table: widen its first or last row", parts.unassigned)]
}

fn timed<T>(slot: &mut Duration, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = work();
    *slot = start.elapsed();
    out
}
