//! Releases edges that are held only until the garment is near rest: it then stays up or slides.
//!
//! A skirt's waist is held while the cloth falls into its folds, as a dresser would. Friction and the shape of the hips
//! decide whether it stays up: near rest, the steps continue with nothing held. If the cloth rests and its waist has sunk little, this
//! is the drape; if it slides, it is brought to rest held, and a warning says so. A large garment is released on its coarsest cloth first
//! ([`Levels`]), at its rest there: if it slides, it is not released at full resolution.

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

/// Residual over weight below which the edges are released. An asymmetric circle skirt in cotton (15,493 vertices) takes 111 steps where it first
/// rests held, and 50, 35 and 41 if released at 0.01, 0.03 and 0.1.
const RELEASE_RESIDUAL: f64 = 0.03;

/// Steps it may take to rest after that. Heuristic: skirts of 10,000 to 26,000 vertices in cotton take 35 to 91 in all.
const MAX_RELEASED_STEPS: usize = 160;

/// A drape, after the release of its held edges if the scene asks for it.
pub(crate) struct ReleasedDrape {
    /// The cloth with nothing held, where it stays up so.
    pub(crate) cloth: Option<Cloth>,
    /// The drape at rest.
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
    let asked = scene.releases_held && !scene.held.is_empty() && settings.refine == Refine::Converged;
    let slid = if asked { slides_when_coarse(scene, settings, levels, &start.0, observer)? } else { None };
    let releases = asked && slid.is_none();
    let until = releases.then_some(RELEASE_RESIDUAL);
    let held = refine_from(scene, settings, cloth, ground, start, until, observer)?;
    let held_positions = held.positions.clone();
    if !releases || held.stop != Stop::Converged {
        let release = slid.map(|sank_m| Release::Slides { sank_m, is_coarse: true });
        return Ok(ReleasedDrape { cloth: None, refined: held, held_positions, release });
    }
    let free = cloth_of(scene, settings, &[])?;
    let mut contacts = free.contacts(&scene.body, &held.positions);
    contacts.stiffen(held.contact_stiffness / contacts.stiffness());
    contacts.update(&held.positions);
    contacts.refresh(&held.positions);
    let sank = |x: &[DVec3]| mean_sink(&cloth.held, &held_positions, x);
    let options = released_steps(settings);
    let mut stopped = false;
    let released = refine::refine_with(&free, contacts, held.positions.clone(), &options, &mut |step| {
        if sank(step.positions) > MAX_SINK_M {
            return ControlFlow::Break(());
        }
        let flow = observer(&Step { iteration: held.steps + step.iteration, ..*step });
        stopped |= flow.is_break();
        flow
    })?;
    let sank_m = sank(&released.positions);
    if released.stop == Stop::Converged && sank_m <= MAX_SINK_M {
        let (cloth, refined) = (Some(free), after(held, released));
        return Ok(ReleasedDrape { cloth, refined, held_positions, release: Some(Release::Stays { sank_m }) });
    }
    if stopped {
        let refined = Refined { stop: Stop::Interrupted, ..held };
        return Ok(ReleasedDrape { cloth: None, refined, held_positions, release: None });
    }
    let start = (held_positions, StartsFrom::Rest);
    let rested = refine_from(scene, settings, cloth, ground, start, None, &mut |step| {
        observer(&Step { iteration: held.steps + step.iteration, ..*step })
    })?;
    let held_positions = rested.positions.clone();
    let release = Some(Release::Slides { sank_m, is_coarse: false });
    Ok(ReleasedDrape { cloth: None, refined: after(held, rested), held_positions, release })
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

/// How far the waist has sunk, m, if the garment's coarsest cloth slides when released from `start`, the positions of the full garment, m;
/// `None` if it stays up, or if the garment has no coarser cloth. `observer` receives the steps as step 0.
fn slides_when_coarse(
    scene: &Scene,
    settings: &Settings,
    levels: &Levels,
    start: &[DVec3],
    observer: Observer<'_>,
) -> Result<Option<f64>, SolveError> {
    let number = levels.coarser(scene).len();
    let Some(level) = levels.coarser(scene).last() else { return Ok(None) };
    let (held, from) = (&level.cloth().held, levels.restrict(number, start));
    let Some(free) = level.released(&levels.cloth) else { return Ok(None) };
    let contacts = free.contacts(&scene.body, &from);
    let mut slides = None;
    refine::refine_with(&free, contacts, from.clone(), &released_steps(settings), &mut |step| {
        let sank_m = mean_sink(held, &from, step.positions);
        if sank_m > MAX_SINK_M {
            slides = Some(sank_m);
            return ControlFlow::Break(());
        }
        observer(&Step { iteration: 0, positions: start, at_rest: false, ..*step })
    })?;
    Ok(slides)
}

/// The end of `second`, with the steps of `first` before it.
fn after(first: Refined, second: Refined) -> Refined {
    let mut history = first.history;
    let later = |r: &Record| Record { iteration: first.steps + r.iteration, ..*r };
    history.extend(second.history.iter().skip(1).map(later));
    Refined { steps: first.steps + second.steps, history, ..second }
}
