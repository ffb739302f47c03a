//! Newton's method with a line search, Levenberg's damping and relaxed steps: one loop for the whole cloth and for its PARTs.
//!
//! An iteration takes a step d from its [`Tangent`], which solves (H + ε M) d = −∇E in the coordinates it has: all vertices
//! ([`Whole`]), or the motions of the PARTs ([`coupled`](super::coupled)). It goes along d as far as Armijo's condition
//! allows, so the energy never rises; ε (Levenberg, Marquardt) falls while whole steps succeed and grows where they do not.
//!
//! **Steps are relaxed.** A step also stretches what it turns, and carries vertices into the body that did not touch before.
//! Both are local and stiff, so a trial that fails for them is first relaxed by a few iterations without a factorisation
//! (`relax.rs`) and judged again, and every step that is taken is relaxed as well.
//!
//! When to stop, and what to change between iterations, is the caller's: [`refine`](super::refine) goes on to a residual,
//! [`coupled`](super::coupled) until its steps are short.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d | step | m |
//! | t | step length, at most 1, or 2 where steps go on alike | – |
//! | ε | damping | 1/s² |
//! | M | lumped masses | kg |

mod dense;
mod extrapolation;
mod factor;
mod full_space;
mod record;
pub(crate) mod relax;
mod saddle_escape;
mod soa;
mod solver;
mod start;
mod substitute;
mod subtrees;
mod supernodes;
mod symbolic;
mod vectors;

use glam::{DMat3, DVec3};

use super::energy::proximity::StepCheck;
use super::energy::{Cloth, Contacts, Scratch};
use extrapolation::Onward;
pub(crate) use full_space::Whole;
pub use record::Record;
use relax::Relaxation;
pub(crate) use saddle_escape::Rest;
pub use solver::{SolveError, Solver};

/// Armijo's constant: the share of the predicted decrease that a step must bring.
const ARMIJO: f64 = 1e-4;

/// Shorter steps than this are rounding.
const SHORTEST_STEP: f64 = 1e-6;

/// Lengths of a step that are tried relaxed; what is shorter is cut for another reason.
const RELAXED_TRIALS: usize = 2;

/// Lengths of a step that are refused for what crosses where they end relaxed; what is shorter is taken as it is. A cloth that begins far
/// from its rest shape is carried as far by its relaxation however short the step.
const RELAXED_CROSSINGS: usize = 8;

/// Where a step is taken from.
pub(crate) struct State<'a> {
    pub(crate) cloth: &'a Cloth,
    pub(crate) x: &'a [DVec3],
    pub(crate) contacts: &'a Contacts<'a>,
    pub(crate) gradient: &'a [DVec3],
    /// ε, 1/s².
    pub(crate) damping: f64,
}

/// Coordinates to take Newton steps in, and the Hessian in them.
pub(crate) trait Tangent {
    /// The step of every vertex, m, zero where held, and every free vertex's own block of a positive H + ε M, N/m.
    fn step(&mut self, here: &State<'_>, d: &mut Vec<DVec3>, own: &mut Vec<DMat3>) -> Result<(), SolveError>;

    /// After a step that led nowhere: whether there is another Hessian left to try.
    fn pause(&mut self) -> bool;
}

/// How boldly to go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepLimits {
    /// Longest move of a vertex in one step, m.
    pub(crate) longest_move_m: f64,
    /// Iterations of a relaxation after a step.
    pub(crate) relaxing: usize,
    /// Iterations for a trial that failed: it has further to go, and a step cut short costs another factorisation.
    pub(crate) relaxing_trial: usize,
}

/// What an iteration did.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Advance {
    /// Whether a step was taken.
    pub(crate) accepted: bool,
    /// Its length t over the longest that was tried.
    pub(crate) share: f64,
    /// Its length t; over one where it goes on like the one before.
    pub(crate) step_length: f64,
    /// Largest move of a vertex, m.
    pub(crate) largest_move_m: f64,
    /// Whether all moved back by and large, against the step before.
    pub(crate) back: bool,
}

/// A cloth on its way down.
pub(crate) struct NewtonState<'c, 'b> {
    /// The energy that falls.
    pub(crate) cloth: &'c Cloth,
    /// What is touched at `x`.
    pub(crate) contacts: Contacts<'b>,
    /// Positions, m.
    pub(crate) x: Vec<DVec3>,
    /// E at `x`, J.
    pub(crate) energy: f64,
    /// ‖∇E‖₂ over the weight at `x`.
    pub(crate) residual: f64,
    /// ε, 1/s².
    pub(crate) damping: f64,
    /// Share that is gone of every step: less than all where what stays as it is between steps makes them go to and fro.
    pub(crate) stride: f64,
    gradient: Vec<DVec3>,
    relaxation: Relaxation,
    blocks: Vec<DMat3>,
    direction: Vec<DVec3>,
    trial: Vec<DVec3>,
    trial_gradient: Vec<DVec3>,
    /// Times its length that a step may go where it goes on like the one before (`onward.rs`).
    pub(crate) farthest: f64,
    onward: Onward,
    scratch: Scratch,
}

impl<'c, 'b> NewtonState<'c, 'b> {
    /// Starts at `x`, where `contacts` are up to date.
    pub(crate) fn new(cloth: &'c Cloth, contacts: Contacts<'b>, x: Vec<DVec3>, damping: f64) -> Self {
        let mut descent = Self {
            cloth,
            contacts,
            trial: x.clone(),
            x,
            energy: 0.0,
            residual: 0.0,
            damping,
            stride: 1.0,
            gradient: Vec::new(),
            relaxation: Relaxation::default(),
            blocks: Vec::new(),
            direction: Vec::new(),
            trial_gradient: Vec::new(),
            farthest: 1.0,
            onward: Onward::default(),
            scratch: Scratch::default(),
        };
        descent.evaluate();
        descent
    }

    /// The same with relaxations that end where the last iterations brought less than this share of what all brought.
    pub(crate) fn relaxed_to(mut self, share: f64) -> Self {
        self.relaxation.ending = share;
        self
    }

    /// Where it is.
    pub(crate) fn state(&self) -> State<'_> {
        let Self { cloth, x, contacts, gradient, damping, .. } = self;
        State { cloth, x, contacts, gradient, damping: *damping }
    }

    /// Takes energy and residual anew, after positions, contacts or the cloth have changed.
    pub(crate) fn evaluate(&mut self) {
        let Self { cloth, x, contacts, gradient, scratch, .. } = self;
        self.energy = cloth.evaluate(x, contacts, gradient, scratch);
        self.residual = norm(&self.gradient) / self.cloth.weight;
    }

    /// Relaxes the start itself, `beside` something else, by a Hessian's own blocks.
    pub(crate) fn relax<T: Send>(&mut self, iterations: usize, beside: impl FnOnce() -> T + Send) -> T {
        self.cloth.own_blocks(&self.x, &self.contacts, self.damping, &mut self.blocks);
        self.relaxation.prepare(self.cloth, &self.contacts, &self.blocks);
        let Self { cloth, contacts, x, relaxation, trial, .. } = self;
        trial.clone_from(x);
        let (_, out) = rayon::join(|| relaxation.run(cloth, contacts, x, iterations), beside);
        match contacts.proximity.as_mut().map(|p| p.look(trial, x)) {
            None | Some(StepCheck::Clear) => {}
            Some(StepCheck::Cut) => contacts.update(x),
            Some(StepCheck::Crosses) => {
                x.clone_from(trial);
                contacts.update(x);
            }
        }
        self.contacts.refresh(&self.x);
        self.evaluate();
        out
    }

    /// One iteration. The damping is the caller's to change afterwards.
    pub(crate) fn advance(&mut self, tangent: &mut dyn Tangent, pace: StepLimits) -> Result<Advance, SolveError> {
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
            stride,
            farthest,
            onward,
            ..
        } = self;
        let cloth = *cloth;
        relaxation.prepare(cloth, contacts, &self.blocks);
        let slope = dot(gradient, direction);
        let longest = direction.iter().map(|d| d.length()).fold(0.0, f64::max);
        let first = (pace.longest_move_m / longest).min(1.0);
        let mut t = (first * onward.reach(direction, *farthest)).min(pace.longest_move_m / longest);
        let (mut relaxed, mut crossed) = (0, 0);
        let accepted = loop {
            trial.clear();
            trial.extend(x.iter().zip(&*direction).map(|(x, d)| *x + *d * t));
            contacts.update(trial);
            let most = *energy + ARMIJO * t * slope;
            let mut falls = cloth.evaluate(trial, contacts, trial_gradient, scratch) <= most;
            if !falls {
                relaxed += usize::from(t <= first);
                falls = relaxed <= RELAXED_TRIALS
                    && crossed < RELAXED_CROSSINGS
                    && pace.relaxing_trial > 0
                    && relaxation.run(cloth, contacts, trial, pace.relaxing_trial) <= most;
            }
            if falls {
                if crossed < RELAXED_CROSSINGS {
                    relaxation.run(cloth, contacts, trial, pace.relaxing);
                }
                if *stride < 1.0 {
                    trial.iter_mut().zip(&*x).for_each(|(to, from)| *to = from.lerp(*to, *stride));
                    contacts.update(trial);
                }
                match contacts.proximity.as_mut().map(|p| p.look(x, trial)) {
                    None | Some(StepCheck::Clear) => break true,
                    Some(StepCheck::Cut) => {
                        contacts.update(trial);
                        break true;
                    }
                    Some(StepCheck::Crosses) => crossed += 1,
                }
            }
            t = if t > first { first } else { 0.5 * t };
            // Also where t is not a number: nothing pulls any more.
            if t.is_nan() || t < SHORTEST_STEP {
                break false;
            }
        };
        onward.keep(direction, if accepted { t } else { 0.0 });
        let mut largest_move_m = 0.0;
        let mut back = false;
        if accepted {
            std::mem::swap(x, trial);
            largest_move_m = x.iter().zip(&*trial).map(|(x, before)| x.distance(*before)).fold(0.0, f64::max);
            back = onward.back(x.iter().zip(&*trial).map(|(x, before)| *x - *before).collect());
        } else {
            contacts.update(x);
        }
        self.contacts.refresh(&self.x);
        self.evaluate();
        Ok(Advance { accepted, share: (t / first).min(1.0), step_length: t, largest_move_m, back })
    }
}

/// ‖a‖₂.
pub(super) fn norm(a: &[DVec3]) -> f64 {
    a.iter().map(|a| a.length_squared()).sum::<f64>().sqrt()
}

/// a · b.
pub(crate) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
