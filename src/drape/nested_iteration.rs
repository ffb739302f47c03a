//! The way from PARTs to full resolution: for a large garment its rest on coarser cloth.
//!
//! A garment whose coarser ones ([`Levels`]) still have some thousand vertices is brought to rest
//! on those first, from the coarsest to the finest, so that full resolution begins near a rest that lasts: nested iteration. A step costs a
//! little more than in proportion to the vertices, and how far cloth goes does not shrink with them.
//!
//! Source: nested iteration (Hackbusch: "Multi-Grid Methods and Applications", 1985). Limits: a coarse cloth is stiffer in its folds, so the
//! finer one still makes its own; a stiff fabric takes half its steps for that.

use glam::DVec3;

use super::levels::Levels;
use super::settings::{Model, Refine, Settings};
use crate::mechanics::coupled::is_flat;
use crate::mechanics::refine::{self, Observer, RefineOptions, Step, Stop};
use crate::scene::Scene;

/// The start of the steps at full resolution: stage two's positions, or for a large garment its rest on coarser cloth. A garment that stage
/// two lets fall off the body starts as placed: it may stay on by shorter steps. So does one laid flat: it has far to go, and its PARTs
/// pierce the corners of what they fall on. `observer` receives the steps on coarser garments as step 0
/// of the full garment.
pub(crate) fn approach(
    scene: &Scene,
    settings: &Settings,
    levels: &Levels,
    preview: &[DVec3],
    observer: Observer<'_>,
) -> Vec<DVec3> {
    let as_placed = settings.refine != Refine::Steps(0) && (is_flat(&scene.garment) || scene.fallen(preview).is_some());
    let start = if as_placed { &scene.garment.positions } else { preview };
    if settings.refine != Refine::Converged || !matches!(settings.model, Model::Coupled(_)) {
        return start.to_vec();
    }
    let Scene { garment: mesh, body, .. } = scene;
    let options = settings.solver.nested_iteration;
    let coarsest = levels.coarser(scene).len();
    let self_contact = settings.self_contact;
    // Whether the coarse equilibrium lasts is not checked: its folds are not those of the full garment.
    let max_steps = Some(options.max_steps);
    let at_most = RefineOptions { max_steps, self_contact, lasting: false, ..RefineOptions::default() };
    let mut reached = start.to_vec();
    for number in (1..=coarsest).rev() {
        let cloth = levels.coarser(scene)[number - 1].cloth();
        let from = levels.restrict(number, &reached);
        let contacts = cloth.contacts(body, &from);
        let rested = refine::refine_with(cloth, contacts, from, &at_most, &mut |step| {
            observer(&Step { iteration: 0, positions: start, at_rest: false, ..*step })
        });
        let Ok(rested) = rested else { return start.to_vec() };
        if rested.stop == Stop::Interrupted {
            return start.to_vec();
        }
        let mut prolonged = levels.prolong(number, &reached, rested.positions);
        // The coarse cloth turns about its held vertices, and takes those between them along.
        scene.held.iter().map(|&v| v as usize).for_each(|v| prolonged[v] = mesh.positions[v]);
        reached = prolonged;
    }
    reached
}
