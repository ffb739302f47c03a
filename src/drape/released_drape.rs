//! Releases edges that are held only until the garment is near rest: it then stays up or slides.
//!
//! A skirt's waist is held while the cloth falls into its folds, as a dresser would. Friction and the shape of the hips
//! decide whether it stays up: near rest, the steps continue with nothing held. If the cloth rests and its waist has sunk little, this
//! is the drape; if it slides, it is brought to rest held, and a warning says so.
//!
//! A large garment is released on its coarser cloths ([`Levels`]), from the coarsest to the finest; where it comes from PARTs, they have rested
//! held before ([`approach`](super::approach)). If it slides on one of them, it is not released at full resolution; otherwise full resolution
//! begins where they rest released, with nothing held.

use std::ops::ControlFlow;

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::levels::{Levels, cloth_of};
use super::release::Release;
use super::settings::{Refine, Settings};
use super::stages::{StartsFrom, refine_from};
use crate::mechanics::energy::Cloth;
use crate::mechanics::newton::SolveError;
use crate::mechanics::refine::{self, Observer, Record, RefineOptions, Refined, Step, Stop};
use crate::scene::Scene;

/// A waist that sinks farther than this slides, m: from the waist to the hips it is twice as far.
const MAX_SINK_M: f64 = 0.1;

/// Residual over weight below which the edges of a garment without coarser cloth are released. An asymmetric circle skirt in cotton (15,493 vertices)
/// took 111 steps where it first rested held, and 50, 35 and 41 if released at 0.01, 0.03 and 0.1, before it began released.
const RELEASE_RESIDUAL: f64 = 0.03;

/// Steps it may take to rest after that. Heuristic: skirts and trousers of 10,000 to 26,000 vertices in cotton take 26 to 84 at full resolution.
const MAX_RELEASED_STEPS: usize = 160;

/// A drape, after the release of its held edges if the scene asks for it.
pub(crate) struct ReleasedDrape {
    /// The cloth with nothing held, where it stays up so or its release was interrupted.
    pub(crate) cloth: Option<Cloth>,
    /// Where the steps ended.
    pub(crate) refined: Refined,
    /// Positions with the edges held, m: a start for the same garment in another fabric or by another table.
    pub(crate) held_positions: Vec<DVec3>,
    /// Result of the release; `None` where nothing is released.
    pub(crate) release: Option<Release>,
}

/// Steps at full resolution, with a release of the held edges where the scene asks for it. `ground` has the distances of the garment as placed.
pub(crate) fn settle_and_release(
    scene: &Scene,
    settings: &Settings,
    levels: &Levels,
    ground: Option<&Distances>,
    start: (Vec<DVec3>, StartsFrom),
    observer: Observer<'_>,
) -> Result<ReleasedDrape, DrapeError> {
    let cloth = &levels.cloth;
    let settle =
        |start, until, observer: Observer<'_>| refine_from(scene, settings, cloth, ground, start, until, observer);
    let held_drape = |refined: Refined, release| {
        Ok(ReleasedDrape { cloth: None, held_positions: refined.positions.clone(), refined, release })
    };
    if !scene.releases_held || scene.held.is_empty() || settings.refine != Refine::Converged {
        return held_drape(settle(start, None, observer)?, None);
    }
    let (start, from) = start;
    let (near_rest, reached) = match release_when_coarse(scene, settings, levels, &start, observer)? {
        CoarseRelease::Slides { sank_m } => {
            let rested = settle((start, StartsFrom::Parts), None, observer)?;
            return held_drape(rested, Some(Release::Slides { sank_m, is_coarse: true }));
        }
        CoarseRelease::Stays(reached) => (None, reached),
        CoarseRelease::Absent => {
            let near_rest = settle((start.clone(), from), Some(RELEASE_RESIDUAL), observer)?;
            if near_rest.stop != Stop::Converged {
                return held_drape(near_rest, None);
            }
            let reached = near_rest.positions.clone();
            (Some(near_rest), reached)
        }
    };
    let (held_positions, from) = match &near_rest {
        Some(near_rest) => (near_rest.positions.clone(), StartsFrom::Rest),
        None => (start, StartsFrom::Parts),
    };
    let steps_before = near_rest.as_ref().map_or(0, |near_rest| near_rest.steps);
    let free = cloth_of(scene, settings, &[])?;
    let mut contacts = free.contacts(&scene.body, &reached);
    if let Some(near_rest) = &near_rest {
        contacts.stiffen(near_rest.contact_stiffness / contacts.stiffness());
        contacts.update(&reached);
        contacts.refresh(&reached);
    }
    let sank = |x: &[DVec3]| mean_sink(&cloth.held, &held_positions, x);
    let mut stopped = false;
    let released = refine::refine_with(&free, contacts, reached, &released_steps(settings), &mut |step| {
        if sank(step.positions) > MAX_SINK_M {
            return ControlFlow::Break(());
        }
        let flow = observer(&Step { iteration: steps_before + step.iteration, ..*step });
        stopped |= flow.is_break();
        flow
    })?;
    let sank_m = sank(&released.positions);
    let after_all = |later| match near_rest {
        Some(near_rest) => after(near_rest, later),
        None => later,
    };
    if stopped || (released.stop == Stop::Converged && sank_m <= MAX_SINK_M) {
        let release = (!stopped).then_some(Release::Stays { sank_m });
        return Ok(ReleasedDrape { cloth: Some(free), refined: after_all(released), held_positions, release });
    }
    let rested = settle((held_positions, from), None, &mut |step: &Step<'_>| {
        observer(&Step { iteration: steps_before + step.iteration, ..*step })
    })?;
    let release =
        if sank_m > MAX_SINK_M { Release::Slides { sank_m, is_coarse: false } } else { Release::Unsettled { sank_m } };
    held_drape(after_all(rested), Some(release))
}

/// Options of the steps after a release.
fn released_steps(settings: &Settings) -> RefineOptions {
    let self_contact = settings.self_contact;
    RefineOptions { max_steps: Some(MAX_RELEASED_STEPS), self_contact, ..RefineOptions::default() }
}

/// How far the vertices that were `held` are lower on average at `after` than at `before`, m.
fn mean_sink(held: &[bool], before: &[DVec3], after: &[DVec3]) -> f64 {
    let sinks = || before.iter().zip(after).zip(held).filter(|(_, held)| **held).map(|((a, b), _)| a.z - b.z);
    sinks().sum::<f64>() / sinks().count().max(1) as f64
}

/// Result of a release on coarser cloth.
enum CoarseRelease {
    /// The garment has no coarser cloth.
    Absent,
    /// It slides; how far its waist had sunk when that was clear, m.
    Slides { sank_m: f64 },
    /// It stays up, and the full garment is here then, m.
    Stays(Vec<DVec3>),
}

/// Releases the garment on its coarser cloths, from the coarsest to the finest, beginning at `start`, the positions of the full garment, m.
/// `observer` receives the steps as step 0.
fn release_when_coarse(
    scene: &Scene,
    settings: &Settings,
    levels: &Levels,
    start: &[DVec3],
    observer: Observer<'_>,
) -> Result<CoarseRelease, SolveError> {
    let coarser = levels.coarser(scene);
    let mut reached = start.to_vec();
    for number in (1..=coarser.len()).rev() {
        let level = &coarser[number - 1];
        let Some(free) = level.released(&levels.cloth) else { return Ok(CoarseRelease::Absent) };
        let (held, before, from) =
            (&level.cloth().held, levels.restrict(number, start), levels.restrict(number, &reached));
        let contacts = free.contacts(&scene.body, &from);
        let mut slides = None;
        // Whether the coarse equilibrium lasts is not checked: its folds are not those of the full garment.
        let options = RefineOptions { lasting: false, ..released_steps(settings) };
        let rested = refine::refine_with(&free, contacts, from, &options, &mut |step| {
            let sank_m = mean_sink(held, &before, step.positions);
            if sank_m > MAX_SINK_M {
                slides = Some(sank_m);
                return ControlFlow::Break(());
            }
            observer(&Step { iteration: 0, positions: start, at_rest: false, ..*step })
        })?;
        if let Some(sank_m) = slides {
            return Ok(CoarseRelease::Slides { sank_m });
        }
        reached = levels.prolong(number, &reached, rested.positions);
    }
    Ok(if coarser.is_empty() { CoarseRelease::Absent } else { CoarseRelease::Stays(reached) })
}

/// The end of `second`, with the steps of `first` before it.
fn after(first: Refined, second: Refined) -> Refined {
    let mut history = first.history;
    let later = |r: &Record| Record { iteration: first.steps + r.iteration, ..*r };
    history.extend(second.history.iter().skip(1).map(later));
    Refined { steps: first.steps + second.steps, history, ..second }
}
