//! The state of a Newton minimisation, and one iteration of it: Newton step, line search, relaxation, collision check.

use glam::{DMat3, DVec3};

use super::extrapolation::Extrapolation;
use super::factor::SolveError;
use super::full_space::{FullSpace, State};
use super::relax::{ARMIJO, Relaxation};
use crate::mechanics::energy::{Cloth, Contacts, Scratch, StepCheck};
use crate::mechanics::linear_algebra::{dot, norm};
use crate::mechanics::solver_options::SolverOptions;

/// Step length below which the line search ends: rounding.
const MIN_STEP_LENGTH: f64 = 1e-6;

/// Trials of a line search that the check of the step may reject, after which shorter ones are not relaxed: relaxation moves tangled cloth
/// by millimetres however short the trial, so that each would be rejected.
const MAX_REJECTED: usize = 8;

/// Result of an iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Advance {
    /// Whether a step was taken.
    pub(crate) accepted: bool,
    /// Its length t over the longest that was tried; zero if none was taken.
    pub(crate) share: f64,
    /// Its length t; over one where it goes on like the one before.
    pub(crate) step_length: f64,
    /// Largest move of a vertex, m.
    pub(crate) largest_move_m: f64,
}

/// One step of the history.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Steps done.
    pub iteration: usize,
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over the weight.
    pub residual_over_weight: f64,
    /// Step length t of the line search.
    pub step_length: f64,
    /// Largest move of a vertex, m.
    pub largest_move_m: f64,
    /// Damping ε, 1/s².
    pub damping: f64,
    /// Whether the energy is that of the softened cloth, or of cloth without self-contact.
    pub softened: bool,
}

/// The state of a minimisation.
pub(crate) struct NewtonState<'c, 'b> {
    /// The energy that falls.
    pub(crate) cloth: &'c Cloth,
    /// The contacts at `x`.
    pub(crate) contacts: Contacts<'b>,
    /// Positions, m.
    pub(crate) x: Vec<DVec3>,
    /// E at `x`, J.
    pub(crate) energy: f64,
    /// ‖∇E‖₂ over the weight at `x`.
    pub(crate) residual: f64,
    /// ε, 1/s².
    pub(crate) damping: f64,
    /// Share of every step that is taken: under one where lagged quantities make the steps cycle.
    pub(crate) step_share: f64,
    pub(super) gradient: Vec<DVec3>,
    relaxation: Relaxation,
    blocks: Vec<DMat3>,
    pub(super) direction: Vec<DVec3>,
    pub(super) trial: Vec<DVec3>,
    pub(super) trial_gradient: Vec<DVec3>,
    pub(super) extrapolation: Extrapolation,
    pub(super) scratch: Scratch,
}

impl<'c, 'b> NewtonState<'c, 'b> {
    /// Starts at `x`, where `contacts` are up to date.
    pub(crate) fn new(cloth: &'c Cloth, contacts: Contacts<'b>, x: Vec<DVec3>, damping: f64) -> Self {
        let mut state = Self {
            cloth,
            contacts,
            trial: x.clone(),
            x,
            energy: 0.0,
            residual: 0.0,
            damping,
            step_share: 1.0,
            gradient: Vec::new(),
            relaxation: Relaxation::default(),
            blocks: Vec::new(),
            direction: Vec::new(),
            trial_gradient: Vec::new(),
            extrapolation: Extrapolation::default(),
            scratch: Scratch::default(),
        };
        state.evaluate();
        state
    }

    /// Evaluates energy and residual, after positions, contacts or the cloth have changed.
    pub(crate) fn evaluate(&mut self) {
        let Self { cloth, x, contacts, gradient, scratch, .. } = self;
        self.energy = cloth.evaluate(x, contacts, gradient, scratch);
        self.residual = norm(&self.gradient) / self.cloth.weight;
    }

    /// Relaxes the start itself, `beside` something else, by a Hessian's own blocks.
    pub(crate) fn relax<T: Send>(&mut self, beside: impl FnOnce() -> T + Send) -> T {
        self.cloth.diagonal_blocks(&self.x, &self.contacts, self.damping, &mut self.blocks);
        self.relaxation.prepare(self.cloth, &self.contacts, &self.blocks);
        let Self { cloth, contacts, x, relaxation, trial, .. } = self;
        trial.clone_from(x);
        let iterations = cloth.solver.relaxation.iterations;
        let (_, out) = rayon::join(|| relaxation.run(cloth, contacts, x, iterations), beside);
        match contacts.check_step(trial, x) {
            None | Some(StepCheck::Clear) => {}
            Some(StepCheck::Cut) => contacts.update(x),
            Some(check) => {
                contacts.update(x);
                let falls = check == StepCheck::HeldBack
                    && cloth.evaluate(x, contacts, &mut self.trial_gradient, &mut self.scratch) <= self.energy;
                if !falls {
                    x.clone_from(trial);
                    contacts.update(x);
                }
            }
        }
        self.contacts.refresh(&self.x);
        self.evaluate();
        out
    }

    /// One iteration. The damping is the caller's to change afterwards.
    pub(crate) fn advance(&mut self, tangent: &mut FullSpace) -> Result<Advance, SolveError> {
        let Self { cloth, x, contacts, gradient, direction, blocks, damping, .. } = self;
        tangent.step(&State { cloth, x, contacts, gradient, damping: *damping }, direction, blocks)?;
        let Self {
            cloth,
            contacts,
            x,
            relaxation,
            direction,
            trial,
            gradient,
            energy,
            trial_gradient,
            scratch,
            step_share,
            extrapolation,
            ..
        } = self;
        let cloth = *cloth;
        let SolverOptions { newton, relaxation: relaxing, .. } = &cloth.solver;
        relaxation.prepare(cloth, contacts, &self.blocks);
        let slope = dot(gradient, direction);
        let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
        let first = (newton.longest_move_m / longest).min(1.0);
        let mut t = (first
            * extrapolation.factor(direction, newton.max_extrapolation.max(1.0), newton.continues_cosine))
        .min(newton.longest_move_m / longest);
        let (mut relaxed, mut rejected) = (0, 0);
        let accepted = loop {
            trial.clear();
            trial.extend(x.iter().zip(&*direction).map(|(x, d)| *x + *d * t));
            let bound = *energy + ARMIJO * t * slope;
            let mut falls = cloth.evaluate_at(trial, contacts, trial_gradient, scratch) <= bound;
            if !falls {
                relaxed += usize::from(t <= first);
                falls = relaxed <= relaxing.max_trials
                    && rejected < MAX_REJECTED
                    && relaxing.trial_iterations > 0
                    && relaxation.run(cloth, contacts, trial, relaxing.trial_iterations) <= bound;
            }
            if falls {
                if rejected < MAX_REJECTED {
                    relaxation.run(cloth, contacts, trial, relaxing.iterations);
                }
                if *step_share < 1.0 {
                    trial.iter_mut().zip(&*x).for_each(|(to, from)| *to = from.lerp(*to, *step_share));
                    contacts.update(trial);
                }
                match contacts.check_step(x, trial) {
                    None | Some(StepCheck::Clear) => break true,
                    Some(StepCheck::Cut) => {
                        contacts.update(trial);
                        break true;
                    }
                    Some(StepCheck::HeldBack) => {
                        if cloth.evaluate_at(trial, contacts, trial_gradient, scratch) <= bound {
                            break true;
                        }
                        rejected += 1;
                    }
                    Some(StepCheck::Crosses) => rejected += 1,
                }
            }
            t = if t > first { first } else { 0.5 * t };
            // t is NaN where the direction is zero.
            if t.is_nan() || t < MIN_STEP_LENGTH {
                break false;
            }
        };
        extrapolation.store_step(direction, if accepted { t } else { 0.0 });
        let (mut share, mut largest_move_m) = (0.0, 0.0);
        if accepted {
            share = (t / first).min(1.0);
            std::mem::swap(x, trial);
            largest_move_m = x.iter().zip(&*trial).map(|(x, before)| x.distance(*before)).fold(0.0, f64::max);
        } else {
            contacts.update(x);
        }
        self.contacts.refresh(&self.x);
        self.evaluate();
        Ok(Advance { accepted, share, step_length: t, largest_move_m })
    }

    /// Begins contact of the cloth with itself.
    pub(crate) fn begin_self_contact(&mut self) {
        let Self { cloth, contacts, x, .. } = self;
        contacts.proximity = Some(cloth.proximity());
        contacts.update(x);
        contacts.refresh(x);
        self.evaluate();
    }

    /// Pairs of triangles that intersect.
    pub(crate) fn crossings(&mut self) -> usize {
        let Self { contacts, x, .. } = self;
        contacts.proximity.as_mut().map_or(0, |proximity| proximity.crossings(x))
    }

    /// The record of the step `advance`.
    pub(crate) fn record(&self, iteration: usize, advance: Option<Advance>, softened: bool) -> Record {
        Record {
            iteration,
            energy: self.energy,
            residual_over_weight: self.residual,
            step_length: advance.map_or(0.0, |a| a.step_length),
            largest_move_m: advance.map_or(0.0, |a| a.largest_move_m),
            damping: self.damping,
            softened,
        }
    }
}
