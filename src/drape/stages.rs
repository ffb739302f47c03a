//! Stages of a drape, for [`drape()`](super::drape) and for the session, which computes them one at a time.

use std::ops::ControlFlow;

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::levels::Levels;
use super::parts::StageTwo;
use super::release::Release;
use super::result::{ClothState, Drape, StageTimes};
use super::settings::{Model, Refine, Settings};
use crate::body::distance::SurfacePoint;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::fit::{CRUSHED_SHARE, fit};
use crate::mechanics::folded_surface::FoldableCloth;
use crate::mechanics::folds::{Folds, folds};
use crate::mechanics::refine::{self, Observer, RefineOptions, Refined, Stop};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::scene::Scene;

/// Cloth that the PARTs have no room for, and the data for drawing it; the coupled model's alone.
pub(crate) fn folds_of(
    settings: &Settings,
    levels: Option<&Levels>,
    stage: &StageTwo,
) -> Option<(Folds, Option<FoldableCloth>)> {
    match settings.model {
        Model::Coupled(_) => levels.map(|Levels { cloth, .. }| (folds(cloth, &stage.positions), Some(cloth.into()))),
        Model::Paper(_) => None,
    }
}

/// The start of the steps at full resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StartsFrom {
    /// Stage two of the garment as placed.
    Parts,
    /// A drape of the same garment that rested, in another fabric or by another table.
    Rest,
}

/// Steps at full resolution, to a rest or `until` the residual over weight is so small. [`Refine::Steps`]`(0)` takes none, but measures the
/// coupled model's energy and residual.
pub(crate) fn refine_from(
    scene: &Scene,
    settings: &Settings,
    cloth: &Cloth,
    ground: Option<&Distances>,
    (start, from): (Vec<DVec3>, StartsFrom),
    until: Option<f64>,
    observer: Observer<'_>,
) -> Result<Refined, DrapeError> {
    let max_steps = match settings.refine {
        Refine::Steps(n) => Some(n),
        Refine::Converged => None,
    };
    let from_rest = from == StartsFrom::Rest;
    let self_contact = settings.self_contact;
    let options = RefineOptions { max_steps, from_rest, self_contact, until, ..RefineOptions::default() };
    let contacts = contacts_at(cloth, scene, settings.refine, ground, &start);
    let refined = refine::refine_with(cloth, contacts, start, &options, &mut |step| {
        if scene.fallen(step.positions).is_some() { ControlFlow::Break(()) } else { observer(step) }
    })?;
    Ok(refined)
}

/// Where the steps ended, and how the cloth fits there.
pub(crate) fn settled(
    scene: &Scene,
    settings: &Settings,
    cloth: &Cloth,
    ground: Option<&Distances>,
    refined: Refined,
) -> (Vec<DVec3>, ClothState) {
    let contacts = contacts_at(cloth, scene, settings.refine, ground, &refined.positions);
    let fit = fit(cloth, contacts, &refined.positions, refined.contact_stiffness);
    let Refined { positions, energy, residual_over_weight, steps, history, stop, .. } = refined;
    (positions, ClothState { energy, residual_over_weight, steps, stop, history, fit })
}

/// The results of all stages.
pub(crate) struct StageResults {
    pub(crate) ground: Distances,
    pub(crate) table: RangeTable,
    pub(crate) level_part_count: usize,
    pub(crate) stage: StageTwo,
    pub(crate) folds: Option<(Folds, Option<FoldableCloth>)>,
    pub(crate) state: Option<(Vec<DVec3>, ClothState)>,
    pub(crate) release: Option<Release>,
}

impl StageResults {
    /// The drape, with what must be looked for in it.
    pub(crate) fn judged(self, scene: &Scene, settings: &Settings, times: StageTimes) -> Drape {
        let Self { ground, table, level_part_count, stage, folds, state, release } = self;
        let mut warnings = unassigned_warning(&stage.parts);
        warnings.extend(stage.warnings);
        let (positions, state) = match state {
            None => (stage.positions.clone(), None),
            Some((positions, state)) => (positions, Some(state)),
        };
        warnings.extend(state.as_ref().and_then(|s| unsettled_warning(settings.refine, s)));
        if let Some(held @ (Release::Slides { .. } | Release::Unsettled { .. })) = &release {
            warnings.push(format!("the garment {held}"));
        }
        warnings.extend(state.as_ref().and_then(|_| scene.fallen(&positions)));
        // PARTs alone may shorten cloth that still unfolds.
        let rests = state.as_ref().filter(|state| state.stop == Stop::Converged);
        warnings.extend(rests.and_then(|_| crushed_warning(scene.area_share(&positions))));
        let (depths, self_intersecting_pairs) = rayon::join(
            || depths(scene, &ground, &positions),
            || self_intersecting_pairs(&scene.garment.with_positions(positions.clone())).len(),
        );
        let inside = depths.into_iter().filter(|&depth| depth > 0.0);
        let (penetrating_vertices, penetration) = inside.fold((0, 0.0_f64), |(n, deepest), d| (n + 1, deepest.max(d)));
        let (folds, foldable) = folds.map_or((None, None), |(folds, foldable)| (Some(folds), foldable));
        Drape {
            surface: ground.surface,
            distance: ground.unsigned_m,
            table,
            parts: stage.parts,
            level_part_count,
            outcomes: stage.outcomes,
            preview: stage.positions,
            folds,
            foldable,
            state,
            release,
            self_intersecting_pairs,
            positions,
            penetrating_vertices,
            penetration,
            times,
            warnings,
        }
    }
}

/// The contacts of the cloth at `x`, by planes if no step is taken. `ground` are distances of the garment as placed.
fn contacts_at<'b>(
    cloth: &Cloth,
    scene: &'b Scene,
    refine: Refine,
    ground: Option<&Distances>,
    x: &[DVec3],
) -> Contacts<'b> {
    let known = ground.into_iter().flat_map(|ground| &ground.surface).map(|s| s.signed_distance);
    cloth.contacts_from_distances(&scene.body, x, refine == Refine::Steps(0), &scene.garment.positions, known)
}

/// How deep those vertices at `x` are in the body, m, that can have come to it since they were placed.
fn depths(scene: &Scene, ground: &Distances, x: &[DVec3]) -> Vec<f64> {
    let placed = scene.garment.positions.iter().zip(&ground.surface);
    let near =
        |(x, (placed, surface)): &(&DVec3, (&DVec3, &SurfacePoint))| surface.signed_distance <= x.distance(**placed);
    let near: Vec<DVec3> = x.iter().zip(placed).filter(near).map(|(x, _)| *x).collect();
    scene.body.nearest_all(&near).into_iter().map(|s| -s.signed_distance).collect()
}

fn unsettled_warning(asked: Refine, state: &ClothState) -> Option<String> {
    let reason = match state.stop {
        Stop::Unsettled(criterion) => {
            format!("it is not at rest by the criterion `{criterion}` (--certify shows its value)")
        }
        Stop::Stalled | Stop::StepsDone => {
            format!("the residual is {:.1e} of the weight, expected under 1e-3", state.residual_over_weight)
        }
        Stop::Converged | Stop::Interrupted => return None,
    };
    (asked == Refine::Converged).then(|| format!("the drape has not settled: after {} steps {reason}", state.steps))
}

/// A warning about a garment that has lost its area. Triangles bear hardly any compression, as cloth buckles before it does; a bending
/// stiffness that does not let it buckle then shortens the cloth instead of keeping it straight, at small forces.
fn crushed_warning(share: f64) -> Option<String> {
    (share < CRUSHED_SHARE).then(|| {
        format!(
            "the cloth is crushed to {:.0} % of its area: its fabric is too stiff in bending to buckle; check `bending_nm`, in N·m (the \
             built-in fabrics have 2e-6 to 1.3e-4)",
            1e2 * share
        )
    })
}

fn unassigned_warning(parts: &Parts) -> Vec<String> {
    if parts.unassigned == 0 {
        return Vec::new();
    }
    vec![format!("{} vertices lie in no level of the range table: widen its first or last row", parts.unassigned)]
}
