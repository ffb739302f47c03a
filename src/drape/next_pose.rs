//! A drape carried to another pose of its body, and settled there.
//!
//! The garment was at rest before, so it starts from where it was carried ([`Scene::in_pose`]) with Newton's method at full resolution:
//! neither stage runs again. Its PARTs are those of the first pose; the force on each is the sum of the body's reactions on its vertices.
//!
//! Cloth that intersects itself where it was carried (under arms that are lowered at once) is slow to untangle. Such a garment first rests on
//! the body half-way between the two poses, each of whose vertices is the mean of both, and is carried on from there; so again, up to
//! [`MAX_HALVINGS`] times.
//!
//! Limits: the cloth forgets friction from before the motion; between the poses every vertex of the body moves straight on.

use std::time::Instant;

use glam::DVec3;

use super::distances::Distances;
use super::error::DrapeError;
use super::levels::cloth_of;
use super::parts::StageTwo;
use super::release::Release;
use super::result::{Drape, PartOutcome, StageTimes};
use super::settings::Settings;
use super::stages::{StageResults, StartsFrom, refine_from, settled};
use crate::base::pool::within_awake_pool;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::refine::Observer;
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::parts::UNASSIGNED;
use crate::scene::Scene;

/// How often a motion is halved at most.
const MAX_HALVINGS: usize = 2;

/// The drape of `scene`, to which the garment was carried ([`Scene::in_pose`]) from `last`, a scene and its drape. The steps are those of
/// all poses on the way.
///
/// # Errors
/// [`DrapeError`] where a constant of the fabric cannot be used.
pub fn next_pose(
    last: (&Scene, &Drape),
    scene: &Scene,
    settings: &Settings,
    observer: Observer<'_>,
) -> Result<Drape, DrapeError> {
    within_awake_pool(|| follow(last, scene, settings, observer, MAX_HALVINGS))
}

/// [`next_pose`] with at most this many halvings.
fn follow(
    last: (&Scene, &Drape),
    scene: &Scene,
    settings: &Settings,
    observer: Observer<'_>,
    halvings: usize,
) -> Result<Drape, DrapeError> {
    let began = Instant::now();
    let (from, before) = last;
    let tangled = || self_intersecting_pairs(&scene.garment).len() > before.self_intersecting_pairs;
    let half_way =
        if halvings > 0 && settings.self_contact && tangled() { from.body.half_way(&scene.body) } else { None };
    let Some(body) = half_way else {
        return settle(scene, scene.garment.positions.clone(), settings, before, observer);
    };
    let half = from.in_pose(body, &before.positions);
    let rest = follow(last, &half, settings, observer, halvings - 1)?;
    let start = half.in_pose(scene.body.clone(), &rest.positions).garment.positions;
    let mut drape = settle(scene, start, settings, before, observer)?;
    if let (Some(state), Some(earlier)) = (&mut drape.state, &rest.state) {
        state.steps += earlier.steps;
    }
    drape.times.refine += rest.times.total;
    drape.times.total = began.elapsed();
    Ok(drape)
}

/// Settles the garment from `start` (m), with `before` for its PARTs.
fn settle(
    scene: &Scene,
    start: Vec<DVec3>,
    settings: &Settings,
    before: &Drape,
    observer: Observer<'_>,
) -> Result<Drape, DrapeError> {
    let began = Instant::now();
    let ground = Distances::of(scene)?;
    let distance = began.elapsed();
    // An edge that stayed up after its release in the first pose is not held again.
    let released = matches!(before.release, Some(Release::Stays { .. }));
    let held: &[u32] = if released { &[] } else { &scene.held };
    let cloth = cloth_of(scene, settings, held)?;
    let carried = scene.garment.positions.clone();
    let refined = refine_from(scene, settings, &cloth, Some(&ground), (start, StartsFrom::Rest), None, observer)?;
    let (positions, state) = settled(scene, settings, &cloth, Some(&ground), refined);
    let forces = reactions(&cloth, &positions, &state.fit.pressure_kpa);
    let mut outcomes: Vec<PartOutcome> = Vec::with_capacity(before.parts.len());
    for part in &before.parts.parts {
        let all = || part.vertices.iter().map(|&v| v as usize);
        let force_n = all().map(|v| forces[v]).sum();
        let moved = all().map(|v| positions[v] - carried[v]).sum::<DVec3>();
        let contact = all().any(|v| state.fit.pressure_kpa[v] > 0.0);
        outcomes.push(PartOutcome { force_n, displacement: moved / part.vertices.len().max(1) as f64, contact });
    }
    debug_assert!(before.parts.part_of_vertex.iter().all(|&p| p == UNASSIGNED || (p as usize) < outcomes.len()));
    let stage = StageTwo { parts: before.parts.clone(), outcomes, positions: carried, warnings: Vec::new() };
    let made = StageResults {
        ground,
        table: before.table.clone(),
        level_part_count: before.level_part_count,
        stage,
        folds: None,
        state: Some((positions, state)),
        release: before.release,
    };
    let refine = began.elapsed() - distance;
    let times = StageTimes { distance, refine, ..StageTimes::default() };
    let mut drape = made.judged(scene, settings, times);
    drape.times.total = began.elapsed();
    Ok(drape)
}

/// Force of the body on each vertex in contact where the cloth rests, friction included, N: the gradient of the cloth's own
/// energy, which contact balances.
pub(crate) fn reactions(cloth: &Cloth, positions: &[DVec3], pressure_kpa: &[f64]) -> Vec<DVec3> {
    let mut gradient = Vec::new();
    cloth.gradient(positions, &Contacts::none(), &mut gradient);
    let carried = cloth.held.iter().zip(pressure_kpa).map(|(held, kpa)| !held && *kpa > 0.0);
    gradient.iter().zip(carried).map(|(g, carried)| if carried { *g } else { DVec3::ZERO }).collect()
}
