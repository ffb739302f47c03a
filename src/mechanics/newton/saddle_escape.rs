//! Check of an equilibrium: does the next Newton step still move the cloth, and is there a direction in which the energy decreases?
//!
//! The residual is also small at a saddle point, and where cloth slides slowly along a flat direction; the projected Hessian of Newton's
//! steps contains neither. An equilibrium is therefore judged before it is accepted, by the criteria of a certificate
//! ([`rest`](crate::mechanics::rest)). Where the energy has unstable modes, the cloth moves along each of them to the side with the
//! larger decrease, as long as the energy falls, and is relaxed. The next step costs a factorisation, the modes some forty solves with
//! it: together one to two Newton steps.
//!
//! Limits: contacts are constant, so a direction that lifts cloth off the body is not found.

use glam::DVec3;

use super::factor::SolveError;
use super::full_space::FullSpace;
use super::state::NewtonState;
use crate::mechanics::energy::{Proximity, StepCheck};
use crate::mechanics::reactions::Forces;
use crate::mechanics::rest::{Criterion, Linearised, coupled_by};
use crate::mechanics::solver_options::SolverOptions;

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RestCheck {
    /// Every criterion of rest passes.
    Rests,
    /// This criterion does not.
    Fails(Criterion),
    /// The equilibrium was unstable, and the cloth has left it.
    Escaped,
}

/// Checks the equilibrium of `state`, with the layout and the solver of its `tangent`. Unstable modes are searched if all else passes, or in any
/// case if `always_search`. The cloth leaves an unstable equilibrium and is relaxed.
pub(crate) fn check_rest(
    state: &mut NewtonState<'_, '_>,
    tangent: &mut FullSpace,
    always_search: bool,
) -> Result<RestCheck, SolveError> {
    let first_failed = |criteria: &[Criterion]| criteria.iter().find(|criterion| !criterion.passes).copied();
    let forces = Forces::on(state.cloth, state.contacts.body(), &state.x);
    let unbalanced = first_failed(&Criterion::of_forces(&forces, state.cloth));
    if let Some(unbalanced) = unbalanced.filter(|_| !always_search) {
        return Ok(RestCheck::Fails(unbalanced));
    }
    // The gaps as well, so that the steps that follow need no other layout.
    let gaps = || state.contacts.proximity.iter().flat_map(Proximity::pairs);
    tangent.couple(state.cloth, &state.x, || gaps().chain(coupled_by(&forces)));
    let linearised = Linearised::new(state.cloth, &forces, &state.x, tangent)?;
    let failed = unbalanced.or(first_failed(&Criterion::of_step(&linearised.step)));
    if let Some(failed) = failed.filter(|_| !always_search) {
        return Ok(RestCheck::Fails(failed));
    }
    let curvature = linearised.curvature();
    let stable = Criterion::of_curvature(&curvature);
    if !stable.passes && escape(state, &curvature.modes) {
        return Ok(RestCheck::Escaped);
    }
    Ok(failed.or(first_failed(&[stable])).map_or(RestCheck::Rests, RestCheck::Fails))
}

/// Moves along each of these directions; returns whether the energy decreased along one.
fn escape(state: &mut NewtonState<'_, '_>, directions: &[Vec<DVec3>]) -> bool {
    let mut escaped = false;
    for direction in directions {
        let [one, other] = [1.0, -1.0].map(|side| lowest_along(state, direction, side));
        let (_, t) = if other.0 < one.0 { other } else { one };
        let mut to: Vec<DVec3> = state.x.iter().zip(direction).map(|(x, z)| *x + *z * t).collect();
        // A long move of which parts are held back is not the one whose energy was found lower.
        let taken = |check| matches!(check, None | Some(StepCheck::Clear | StepCheck::Cut));
        if t != 0.0 && taken(state.contacts.check_step(&state.x, &mut to)) {
            state.x = to;
            escaped = true;
        }
        state.contacts.update(&state.x);
        state.evaluate();
    }
    if escaped {
        state.contacts.refresh(&state.x);
        state.extrapolation.reset();
        state.relax(|| ());
    }
    escaped
}

/// The lowest energy (J) at 1, 2, 4, ... times the shortest move to one side, as long as it falls, and its step length.
fn lowest_along(state: &mut NewtonState<'_, '_>, direction: &[DVec3], side: f64) -> (f64, f64) {
    let NewtonState { cloth, contacts, x, trial, trial_gradient, scratch, energy, .. } = state;
    let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
    let SolverOptions { rest_check, newton, .. } = &cloth.solver;
    let (mut far, limit) = (rest_check.shortest_escape_m, newton.longest_move_m);
    let mut best = (*energy, 0.0);
    while far < limit {
        let t = side * far / longest;
        trial.clear();
        trial.extend(x.iter().zip(direction).map(|(x, z)| *x + *z * t));
        let there = cloth.evaluate_at(trial, contacts, trial_gradient, scratch);
        if there.is_nan() || there >= best.0 {
            break;
        }
        best = (there, t);
        far *= 2.0;
    }
    best
}
