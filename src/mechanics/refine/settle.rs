//! The loop of a refinement: see [the module](super).

use glam::DVec3;

use super::cycle_damping::CycleDamping;
use super::damping::Damping;
use super::face_contact_phase::FaceContactPhase;
use super::rest_phase::{RestPhase, Verdict};
use super::softening::softened;
use super::stall::StallDetection;
use super::types::{Observer, RefineOptions, Refined, Step, Stop};
use crate::mechanics::energy::{Cloth, Contacts, FaceUpdate};
use crate::mechanics::newton::{FullSpace, NewtonState, Record, SolveError, Solver};

/// Where a solve stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Steps with capped stiffness, or without self-contact, follow.
    Softened,
    /// Steps with the true stiffness follow.
    Descent,
    /// The residual is under the tolerance.
    Equilibrium,
    /// The solve has ended.
    Ended(Stop),
}

/// The most steps of a run.
pub(super) fn step_limit(cloth: &Cloth, options: &RefineOptions) -> usize {
    let most = cloth.solver.newton.max_steps;
    options.max_steps.map_or(most, |asked| asked.min(most))
}

/// A solve in progress.
struct Settling<'c, 'b, 'o> {
    /// The cloth with its true stiffness.
    cloth: &'c Cloth,
    options: &'o RefineOptions,
    observer: Observer<'o>,
    descent: NewtonState<'c, 'b>,
    tangent: FullSpace,
    history: Vec<Record>,
    iteration: usize,
    limit: usize,
    /// Steps rejected one after the other.
    rejected: usize,
    damping: Damping,
    /// Residual over weight of an equilibrium, and the smaller one that still follows.
    tolerance: f64,
    continued_to: Option<f64>,
    /// Whether the steps are those of the softened or the freed cloth.
    soft: bool,
    /// Whether the cloth has no self-contact yet.
    freed: bool,
    /// Whether the start of an energy is still to be relaxed.
    fresh: bool,
    rest: RestPhase,
    faces: FaceContactPhase,
    cycles: CycleDamping,
    stall: StallDetection,
}

/// Settles `cloth` from `start`; `freed` cloth has no self-contact until it is near rest.
pub(super) fn settle(
    cloth: &Cloth,
    mut contacts: Contacts<'_>,
    start: Vec<DVec3>,
    freed: bool,
    options: &RefineOptions,
    observer: Observer<'_>,
) -> Result<Refined, SolveError> {
    let newton = &cloth.solver.newton;
    let limit = step_limit(cloth, options);
    if options.self_contact && limit > 0 {
        contacts.proximity = Some(cloth.proximity()).filter(|_| !freed);
        contacts.update(&start);
        contacts.refresh(&start);
    }
    let damping = Damping::new(cloth, &start);
    let mut descent = NewtonState::new(cloth, contacts, start, damping.initial(options.from_rest));
    let softened = softened(cloth, &descent.x, descent.residual);
    if let Some(softened) = &softened {
        descent.cloth = softened;
        descent.evaluate();
    }
    let soft = freed || softened.is_some();
    let settling = Settling {
        cloth,
        options,
        observer,
        history: vec![descent.record(0, None, soft)],
        descent,
        tangent: FullSpace::default(),
        iteration: 0,
        limit,
        rejected: 0,
        damping,
        tolerance: newton.tolerance,
        continued_to: options.continued_to,
        soft,
        freed,
        fresh: true,
        rest: RestPhase::default(),
        faces: FaceContactPhase::default(),
        cycles: CycleDamping::default(),
        stall: StallDetection::default(),
    };
    settling.run()
}

impl Settling<'_, '_, '_> {
    fn run(mut self) -> Result<Refined, SolveError> {
        let mut state = self.seen();
        let stop = loop {
            state = match state {
                State::Softened | State::Descent => self.step()?,
                State::Equilibrium => self.check_equilibrium()?,
                State::Ended(stop) => break stop,
            };
        };
        if self.soft {
            self.harden();
        }
        let Self { mut descent, history, iteration, .. } = self;
        Ok(Refined {
            crossings: descent.crossings(),
            energy: descent.energy,
            residual_over_weight: descent.residual,
            steps: iteration,
            history,
            stop,
            contact_stiffness: descent.contacts.stiffness(),
            positions: descent.x,
        })
    }

    /// The damping to begin an energy with, 1/s².
    fn initial_damping(&self) -> f64 {
        self.damping.initial(self.options.from_rest)
    }

    /// Gives the cloth its true stiffness and its self-contact.
    fn harden(&mut self) {
        self.soft = false;
        self.descent.cloth = self.cloth;
        if std::mem::take(&mut self.freed) {
            self.descent.begin_self_contact();
        } else {
            self.descent.evaluate();
        }
    }

    /// Shows the cloth to the observer; the state that it is in.
    fn seen(&mut self) -> State {
        if self.observe(false) {
            State::Ended(Stop::Interrupted)
        } else if self.soft {
            State::Softened
        } else if self.options.until.is_some_and(|until| self.descent.residual < until) {
            State::Ended(Stop::Converged)
        } else if self.descent.residual < self.tolerance {
            State::Equilibrium
        } else {
            State::Descent
        }
    }

    /// Shows the cloth to the observer; returns whether it ends the run.
    fn observe(&mut self, at_rest: bool) -> bool {
        let NewtonState { energy, residual, contacts, x, .. } = &self.descent;
        let step = Step {
            iteration: self.iteration,
            energy: *energy,
            residual_over_weight: *residual,
            contacts: contacts.touches().len(),
            positions: x,
            at_rest,
        };
        (self.observer)(&step).is_break()
    }

    /// Forces balance: keeps the body out of the cloth, and ends where the equilibrium lasts.
    fn check_equilibrium(&mut self) -> Result<State, SolveError> {
        if !self.descent.contacts.resolve_penetrations(&self.descent.x) {
            let update = if self.options.self_contact {
                self.faces.at_equilibrium(&mut self.descent, self.iteration)
            } else {
                FaceUpdate::Unchanged
            };
            if update != FaceUpdate::Unchanged {
                self.cycles.reset(&mut self.descent);
            }
            let lasting = self.options.lasting && self.cloth.solver.rest_check.max_checks > 0;
            match update {
                FaceUpdate::Places => {}
                FaceUpdate::Moved => self.descent.damping = self.initial_damping(),
                FaceUpdate::Unchanged if !lasting || self.iteration >= self.limit => {
                    return Ok(State::Ended(Stop::Converged));
                }
                FaceUpdate::Unchanged => {
                    if let Some(stop) = self.check_rest()? {
                        return Ok(State::Ended(stop));
                    }
                }
            }
        }
        self.descent.contacts.update(&self.descent.x);
        self.descent.contacts.refresh(&self.descent.x);
        self.descent.evaluate();
        self.stall = StallDetection::default();
        Ok(State::Descent)
    }

    /// Checks whether the equilibrium lasts; `None` where the solve goes on.
    fn check_rest(&mut self) -> Result<Option<Stop>, SolveError> {
        if self.rest.is_first() && self.observe(true) {
            return Ok(Some(Stop::Interrupted));
        }
        let ended = match self.rest.check(&mut self.descent, &mut self.tangent)? {
            Verdict::Rests => Some(Stop::Converged),
            Verdict::Unsettled(criterion) => Some(Stop::Unsettled(criterion)),
            Verdict::GoesOn { escaped } => {
                if escaped {
                    self.cycles.reset(&mut self.descent);
                }
                None
            }
        };
        self.descent.damping = self.damping.least();
        // An end may be continued to a smaller residual, once.
        match (ended, self.continued_to.take_if(|_| ended.is_some())) {
            (Some(_), Some(smaller)) => self.tolerance = smaller,
            (ended, _) => return Ok(ended),
        }
        Ok(None)
    }

    /// One step, with what comes before and after it.
    fn step(&mut self) -> Result<State, SolveError> {
        if self.iteration >= self.limit {
            return Ok(State::Ended(Stop::StepsDone));
        }
        if self.faces.before_step(&mut self.descent, self.iteration, !self.soft && self.options.self_contact) {
            self.stall = StallDetection::default();
        }
        if std::mem::take(&mut self.fresh) {
            let (analysed, cloth) = (self.tangent.solver.take(), self.cloth);
            let solver = self.descent.relax(|| analysed.unwrap_or_else(|| Solver::new(cloth.pattern())));
            self.tangent.solver = Some(solver);
        }
        let advance = self.descent.advance(&mut self.tangent)?;
        self.iteration += usize::from(advance.accepted);
        if advance.accepted {
            self.rejected = 0;
        } else {
            self.rejected += 1;
            self.tangent.project_next();
        }
        let stalled = self.stall.after_step(&self.descent);
        let hardens = self.soft && (stalled || self.descent.residual < self.cloth.solver.softening.tolerance);
        if hardens {
            self.fresh = true;
            self.descent.damping = self.initial_damping();
            self.harden();
            self.stall = StallDetection::default();
        } else {
            self.descent.damping = self.damping.after_step(self.descent.damping, advance.share);
        }
        self.cycles.after_step(&mut self.descent);
        if advance.accepted {
            self.history.push(self.descent.record(self.iteration, Some(advance), self.soft));
        }
        Ok(match self.seen() {
            State::Descent if stalled && !hardens => State::Ended(Stop::Stalled),
            State::Equilibrium if self.rejected >= self.cloth.solver.newton.stall_steps => State::Ended(Stop::Stalled),
            state => state,
        })
    }
}
