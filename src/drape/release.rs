//! Releases edges that are held only until the garment rests: it then stays up or slides.
//!
//! A skirt's waist is held while the cloth falls into its folds, as a dresser would. Friction and the shape of the hips
//! decide whether it stays up: the steps continue with nothing held. If the cloth rests again and its waist has sunk little, this
//! is the drape; if it slides, the held drape is kept and a warning says so.

use std::ops::ControlFlow;

use glam::DVec3;

use super::error::DrapeError;
use super::levels::cloth_of;
use super::settings::{Refine, Settings};
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::{self, Observer, Record, RefineOptions, Refined, Step, Stop};
use crate::scene::Scene;

/// A waist that sinks farther than this slides, m: from the waist to the hips it is twice as far.
const MAX_SINK_M: f64 = 0.1;

/// Steps it may take to rest again.
const MAX_RELEASED_STEPS: usize = 80;

/// Result of the release.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Release {
    /// It rests without being held.
    Stays {
        /// How far what was held has sunk, m.
        sank_m: f64,
    },
    /// It does not, and stays held.
    Slides {
        /// How far what was held had sunk when that was clear, m.
        sank_m: f64,
    },
}

impl std::fmt::Display for Release {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stays { sank_m } => {
                write!(f, "stays up by itself: its waist sank {:.1} mm when let go", 1e3 * sank_m)
            }
            Self::Slides { sank_m } => write!(
                f,
                "does not stay up by itself: let go, its waist sank {:.1} mm and went on; it is shown held. A narrower waist or \
                 a fabric of more friction would carry it",
                1e3 * sank_m
            ),
        }
    }
}

/// A drape after the release of its held edges, if the scene asks for it.
pub(crate) struct ReleasedDrape {
    /// The cloth with nothing held, where it stays up so.
    pub(crate) cloth: Option<Cloth>,
    /// The drape at rest.
    pub(crate) refined: Refined,
    /// Result of the release; `None` where nothing is released.
    pub(crate) let_go: Option<Release>,
}

/// Goes on from a held drape that rests, with nothing held, where the scene asks for it.
pub(crate) fn let_go(
    scene: &Scene,
    settings: &Settings,
    held: Refined,
    observer: Observer<'_>,
) -> Result<ReleasedDrape, DrapeError> {
    let asked = scene.releases_held && !scene.held.is_empty() && settings.refine == Refine::Converged;
    if !asked || held.stop != Stop::Converged {
        return Ok(ReleasedDrape { cloth: None, refined: held, let_go: None });
    }
    let free = cloth_of(scene, settings, &[])?;
    let mut contacts = free.contacts(&scene.body, &held.positions);
    contacts.stiffen(held.contact_stiffness / contacts.stiffness());
    contacts.update(&held.positions);
    contacts.refresh(&held.positions);
    let sank = |x: &[DVec3]| {
        let down = scene.held.iter().map(|&v| held.positions[v as usize].z - x[v as usize].z).sum::<f64>();
        down / scene.held.len().max(1) as f64
    };
    let self_contact = settings.self_contact;
    let options = RefineOptions { max_steps: Some(MAX_RELEASED_STEPS), self_contact, ..RefineOptions::default() };
    let mut stopped = false;
    let again = refine::refine_with(&free, contacts, held.positions.clone(), &options, &mut |step| {
        if sank(step.positions) > MAX_SINK_M {
            return ControlFlow::Break(());
        }
        let flow = observer(&Step { iteration: held.steps + step.iteration, ..*step });
        stopped |= flow.is_break();
        flow
    })?;
    let sank_m = sank(&again.positions);
    if again.stop == Stop::Converged && sank_m <= MAX_SINK_M {
        let later = |r: &Record| Record { iteration: held.steps + r.iteration, ..*r };
        let history = held.history.iter().copied().chain(again.history.iter().skip(1).map(later)).collect();
        let all = Refined { steps: held.steps + again.steps, history, ..again };
        return Ok(ReleasedDrape { cloth: Some(free), refined: all, let_go: Some(Release::Stays { sank_m }) });
    }
    let stop = if stopped { Stop::Interrupted } else { held.stop };
    let let_go = Some(Release::Slides { sank_m });
    Ok(ReleasedDrape { cloth: None, refined: Refined { stop, ..held }, let_go })
}
