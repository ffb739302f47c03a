//! Whether a rest lasts: what the next step would still move, and the ways on which the energy falls.
//!
//! A residual is small on a saddle, too, and where cloth slides slowly down a way that is nearly flat; the Hessians that steps are taken
//! with have their negative part cut off and see neither. So a rest is looked at before it is called one. The positive Hessian, hardly
//! damped, tells what the next step would move. Lanczos' method with its factor ([`curvature`](crate::mechanics::curvature)) tells the
//! ways on which the energy falls; the cloth goes along each of them to the side where it falls more, as far as it falls, and is
//! relaxed. A look costs a factorisation, and the ways out some twenty to forty solves with it: together one to two steps.
//!
//! Limits: contacts are taken as they are, so a way that lifts cloth off the body is not seen; a few looks, and what is then left is left.

use glam::DVec3;

use super::{NewtonState, SolveError, State, Whole};
use crate::mechanics::curvature::{Curved, DAMPING, STEPS, Until};
use crate::mechanics::energy::proximity::StepCheck;

/// λ under which a way leads out: over a hundred times what single precision makes of none.
const LEADS_OUT: f64 = -1e-3;

/// Longest move of a vertex in the next step that is none, m, and the share of the vertices that may have a longer one: four fifths of
/// what a certificate allows.
const MOVES: f64 = 1e-3;
const STILL_MOVING: f64 = 0.012;

/// Longest moves of a vertex on a way out, m: a wrinkle buckles by tenths of a millimetre, a skirt swings by centimetres.
const NEAREST: f64 = 2e-5;
const FARTHEST: f64 = 0.03;

/// What a look at a rest has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rest {
    /// A minimum, and hardly anything moves.
    Lasts,
    /// The next step still moves it.
    Moves,
    /// It was none, and the cloth has left it.
    Left,
}

impl NewtonState<'_, '_> {
    /// Looks at the rest that is reached, for ways out also where it still moves if that is `stubborn`; leaves it if it can, relaxed by so
    /// many iterations.
    pub(crate) fn look(&mut self, tangent: &mut Whole, stubborn: bool, relaxing: usize) -> Result<Rest, SolveError> {
        let here = State { damping: DAMPING, ..self.state() };
        let moves = tangent.still_moving(&here)? > STILL_MOVING;
        if moves && !stubborn {
            return Ok(Rest::Moves);
        }
        let ways = tangent.ways_out(&here);
        let left = self.leave(&ways, relaxing);
        Ok(if left {
            Rest::Left
        } else if moves {
            Rest::Moves
        } else {
            Rest::Lasts
        })
    }

    /// Goes along each of these ways; whether any led down.
    fn leave(&mut self, ways: &[Vec<DVec3>], relaxing: usize) -> bool {
        let mut left = false;
        for way in ways {
            let [one, other] = [1.0, -1.0].map(|side| self.along(way, side));
            let (_, t) = if other.0 < one.0 { other } else { one };
            let mut to: Vec<DVec3> = self.x.iter().zip(way).map(|(x, z)| *x + *z * t).collect();
            let itself = self.contacts.proximity.as_mut();
            if t != 0.0 && itself.is_none_or(|p| p.look(&self.x, &mut to) != StepCheck::Crosses) {
                self.x = to;
                left = true;
            }
            self.contacts.update(&self.x);
            self.evaluate();
        }
        if left {
            self.contacts.refresh(&self.x);
            self.onward.forget();
            self.relax(relaxing, || ());
        }
        left
    }

    /// The lowest energy (J) among `way` taken once, twice, four times, ... to one side as long as it falls, and how often.
    fn along(&mut self, way: &[DVec3], side: f64) -> (f64, f64) {
        let Self { cloth, contacts, x, trial, trial_gradient, scratch, energy, .. } = self;
        let longest = way.iter().map(|d| d.length()).fold(0.0, f64::max);
        let (mut best, mut far) = ((*energy, 0.0), NEAREST);
        while far < FARTHEST {
            let t = side * far / longest;
            trial.clear();
            trial.extend(x.iter().zip(way).map(|(x, z)| *x + *z * t));
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
}

impl Whole {
    /// Share of the vertices that a step of the positive Hessian would still move; keeps its factor.
    fn still_moving(&mut self, here: &State<'_>) -> Result<f64, SolveError> {
        self.couple(here);
        self.solve(here, false)?;
        Ok(self.unknowns.iter().filter(|d| d.length() > MOVES).count() as f64 / here.x.len() as f64)
    }

    /// Ways on which the energy falls, told with the factor of the last solve.
    fn ways_out(&mut self, here: &State<'_>) -> Vec<Vec<DVec3>> {
        let State { cloth, x, contacts, .. } = *here;
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        let Some(solver) = &mut self.solver else { return Vec::new() };
        let curved = Curved { cloth, layout, x, held: cloth.held_in(layout, x, contacts) };
        let ritz = curved.lanczos(Until { steps: STEPS, clear: Some(LEADS_OUT) }, solver);
        let out = ritz.vectors.iter().zip(&ritz.values).filter(|(_, l)| **l < LEADS_OUT);
        out.map(|(z, _)| curved.scatter(z)).collect()
    }
}
