//! Check of an equilibrium: does the next Newton step still move the cloth, and is there a direction in which the energy decreases?
//!
//! The residual is also small at a saddle point, and where cloth slides slowly along a flat direction; the projected Hessian of Newton's
//! steps contains neither. An equilibrium is therefore checked before it is accepted. The projected Hessian with little damping gives the
//! next step. Lanczos' method with its factor ([`curvature`](crate::mechanics::curvature)) gives the directions in which the energy decreases.
//! The cloth moves along each of them to the side with the larger decrease, as long as the energy falls, and is relaxed. The next step costs a
//! factorisation, the directions some twenty to forty solves with it: together one to two Newton steps.
//!
//! Limits: contacts are constant, so a direction that lifts cloth off the body is not found; after a few checks the state is accepted.

use glam::DVec3;

use super::factor::SolveError;
use super::full_space::FullSpace;
use super::state::{NewtonState, State};
use crate::mechanics::curvature::{HessianOperator, LANCZOS_DAMPING, LanczosOptions, MAX_LANCZOS_STEPS};
use crate::mechanics::energy::{HessianKind, StepCheck};

/// λ below which the cloth leaves an equilibrium: over a hundred times the rounding of single precision.
const UNSTABLE_CURVATURE: f64 = -1e-3;

/// A vertex counts as moving if the next Newton step would displace it by more than this, in m.
const MOVING_M: f64 = 1e-3;

/// Largest share of moving vertices in an equilibrium: four fifths of what a certificate allows.
const MAX_MOVING_SHARE: f64 = 0.012;

/// Shortest and longest move of a vertex along an unstable direction, m: a wrinkle buckles by tenths of a millimetre, a skirt swings by
/// centimetres.
const ESCAPE_RANGE_M: [f64; 2] = [2e-5, 0.03];

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RestCheck {
    /// A minimum in which hardly anything moves.
    Stable,
    /// The next step still moves the cloth.
    Moving,
    /// The equilibrium was unstable, and the cloth has left it.
    Escaped,
}

/// Checks the equilibrium of `state`. Unstable directions are searched if the next step is small, or in any case if `always_search`. The
/// cloth leaves an unstable equilibrium, with this many iterations of relaxation.
pub(crate) fn check_rest(
    state: &mut NewtonState<'_, '_>,
    tangent: &mut FullSpace,
    always_search: bool,
    relaxing: usize,
) -> Result<RestCheck, SolveError> {
    let here = State { damping: LANCZOS_DAMPING, ..state.state() };
    tangent.couple(&here);
    tangent.solve(&here, HessianKind::Projected)?;
    let moving = tangent.unknowns.iter().filter(|d| d.length() > MOVING_M).count() as f64 / here.x.len() as f64;
    let moves = moving > MAX_MOVING_SHARE;
    if moves && !always_search {
        return Ok(RestCheck::Moving);
    }
    let directions = unstable_directions(tangent, &here);
    Ok(if escape(state, &directions, relaxing) {
        RestCheck::Escaped
    } else if moves {
        RestCheck::Moving
    } else {
        RestCheck::Stable
    })
}

/// Directions in which the energy decreases, by the factor of the last solve.
fn unstable_directions(tangent: &mut FullSpace, here: &State<'_>) -> Vec<Vec<DVec3>> {
    let State { cloth, x, contacts, .. } = *here;
    let Some(mut solver) = tangent.solver.take() else { return Vec::new() };
    let layout = tangent.layout(cloth);
    let hessian = HessianOperator { cloth, layout, x, contacts: cloth.contact_blocks(layout, x, contacts) };
    let options = LanczosOptions { max_steps: MAX_LANCZOS_STEPS, decisive: Some(UNSTABLE_CURVATURE) };
    let ritz = hessian.lanczos(options, &mut solver);
    let unstable = ritz.vectors.iter().zip(&ritz.values).filter(|(_, l)| **l < UNSTABLE_CURVATURE);
    let directions = unstable.map(|(z, _)| hessian.scatter(z)).collect();
    tangent.solver = Some(solver);
    directions
}

/// Moves along each of these directions; returns whether the energy decreased along one.
fn escape(state: &mut NewtonState<'_, '_>, directions: &[Vec<DVec3>], relaxing: usize) -> bool {
    let mut escaped = false;
    for direction in directions {
        let [one, other] = [1.0, -1.0].map(|side| lowest_along(state, direction, side));
        let (_, t) = if other.0 < one.0 { other } else { one };
        let mut to: Vec<DVec3> = state.x.iter().zip(direction).map(|(x, z)| *x + *z * t).collect();
        let proximity = state.contacts.proximity.as_mut();
        if t != 0.0 && proximity.is_none_or(|p| p.check_step(&state.x, &mut to) != StepCheck::Crosses) {
            state.x = to;
            escaped = true;
        }
        state.contacts.update(&state.x);
        state.evaluate();
    }
    if escaped {
        state.contacts.refresh(&state.x);
        state.extrapolation.reset();
        state.relax(relaxing, || ());
    }
    escaped
}

/// The lowest energy (J) at 1, 2, 4, ... times the shortest move to one side, as long as it falls, and its step length.
fn lowest_along(state: &mut NewtonState<'_, '_>, direction: &[DVec3], side: f64) -> (f64, f64) {
    let NewtonState { cloth, contacts, x, trial, trial_gradient, scratch, energy, .. } = state;
    let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
    let [mut far, limit] = ESCAPE_RANGE_M;
    let mut best = (*energy, 0.0);
    while far < limit {
        let t = side * far / longest;
        trial.clear();
        trial.extend(x.iter().zip(direction).map(|(x, z)| *x + *z * t));
        contacts.update(trial);
        let there = cloth.evaluate(trial, contacts, trial_gradient, scratch);
        if there.is_nan() || there >= best.0 {
            break;
        }
        best = (there, t);
        far *= 2.0;
    }
    best
}
