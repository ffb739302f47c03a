//! All stages in order, each timed: distance → PARTs → mechanics → draped garment.
//!
//! [`drape`] is the whole two-stage model; it reads as the paper's sections do. Its input ([`Scene`], [`Settings`])
//! is plain data, and so is its result ([`Drape`]); other modules record, print and compare it.

mod distances;
mod error;
mod layers;
mod levels;
mod nested_iteration;
mod next_pose;
mod parts;
mod pipeline;
mod release;
mod released_drape;
mod result;
mod settings;
mod stages;

use std::ops::ControlFlow;

use pipeline::drape_prepared;

use crate::base::pool::within_awake_pool;
use crate::mechanics::refine::{Observer, Step};
pub use crate::scene::Scene;
pub(crate) use distances::Distances;
pub use error::DrapeError;
pub(crate) use levels::Levels;
pub(crate) use nested_iteration::approach;
pub use next_pose::next_pose;
pub(crate) use next_pose::reactions;
pub(crate) use parts::{StageTwo, stage_one, stage_two};
pub use pipeline::Prepared;
pub use release::Release;
pub(crate) use released_drape::{ReleasedDrape, settle_and_release};
pub use result::{ClothState, Drape, PartOutcome, StageTimes};
pub use settings::{DEFAULT_EXTENTS_CM, Model, Refine, Settings};
pub(crate) use stages::{StageResults, StartsFrom, folds_of, settled};

/// Runs both stages, then as many steps at full resolution as the settings ask for; `observer` is called after each and may end
/// them.
///
/// # Errors
/// [`DrapeError`] where a constant of the fabric or an option cannot be used.
pub fn drape(scene: &Scene, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    // Inside the pool: each of hundreds of short joins from outside it would suspend the caller.
    within_awake_pool(|| run(scene, &Prepared::new(scene, settings)?, settings, observer))
}

/// [`drape`] with distances and cloth of earlier drapes of the same scene in the same fabric, to the same bits.
///
/// # Errors
/// As there.
pub fn drape_again(
    scene: &Scene,
    prepared: &Prepared,
    settings: &Settings,
    observer: Observer<'_>,
) -> Result<Drape, DrapeError> {
    within_awake_pool(|| run(scene, prepared, settings, observer))
}

fn run(scene: &Scene, prepared: &Prepared, settings: &Settings, observer: Observer<'_>) -> Result<Drape, DrapeError> {
    if scene.layers.len() > 1 {
        layers::in_order(scene, settings, observer)
    } else {
        drape_prepared(scene, prepared, settings, observer)
    }
}

impl Scene {
    /// Runs both stages and the refinement that the settings ask for; [`drape`] with an observer that does nothing.
    ///
    /// # Errors
    /// [`DrapeError`] where a constant of the fabric or an option cannot be used.
    pub fn drape(&self, settings: &Settings) -> Result<Drape, DrapeError> {
        drape(self, settings, &mut unobserved)
    }
}

/// An observer that does nothing.
pub fn unobserved(_: &Step<'_>) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
