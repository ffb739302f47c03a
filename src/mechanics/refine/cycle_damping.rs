//! Steps that lead nowhere: a cloth that goes to and fro between states each of which asks for the other.
//!
//! Normals of gaps and anchors of friction stay as they are during a step and follow it, and what faces what jumps; what two states ask of
//! each other may never agree. Half the way between them, and half again, it does where what is asked follows steadily (Krasnoselskii's
//! iteration, 1955). Where it jumps, nothing is at rest but a mean of both sides, and gaps come and go by a share
//! (`energy::proximity`).
//!
//! It is told by steps back, each against the one before, or by a few steps that end near where they began, in either case without less
//! of a residual than there was before.

use glam::DVec3;

use super::settle::CLOSE;
use crate::mechanics::newton::NewtonState;

/// So many steps back near rest, or farther from it,
const NEAR: usize = 3;
const FARTHER: usize = 8;
/// without a residual less than this share of the least so far.
const LESS: f64 = 0.9;

/// Where the residual over weight is over this, no such state is what leaves it.
const FAR: f64 = 0.1;

/// So many steps go round where they end nearer to where they began than this share of the way they went.
const ROUND: usize = 8;
const NOWHERE: f64 = 0.3;

/// Least share of a step, and of a gap's stiffness.
const LEAST_STRIDE: f64 = 0.125;
const LEAST_FADE: f64 = 1.0 / 64.0;

/// What the last steps came to.
#[derive(Debug)]
pub(super) struct CycleDamping {
    /// Residual over weight, the least so far.
    least: f64,
    /// Steps back since then.
    back: usize,
    /// Share by which gaps come and go.
    fade: f64,
    /// Where the round began, where the last step ended, and how many steps and how far it is by now (‖Δx‖₂, m).
    from: Vec<DVec3>,
    last: Vec<DVec3>,
    steps: usize,
    way: f64,
}

impl Default for CycleDamping {
    fn default() -> Self {
        let (from, last) = (Vec::new(), Vec::new());
        Self { least: f64::INFINITY, back: 0, fade: 1.0, from, last, steps: 0, way: 0.0 }
    }
}

impl CycleDamping {
    /// After a step, which went `back` against the one before or not.
    pub(super) fn after(&mut self, descent: &mut NewtonState<'_, '_>, back: bool) {
        self.back = if back { self.back + 1 } else { 0 };
        let residual = descent.residual;
        if residual < LESS * self.least || residual > FAR {
            (self.least, self.back) = (residual, 0);
            descent.stride = (2.0 * descent.stride).min(1.0);
            self.from.clear();
            return;
        }
        let round = self.goes_round(&descent.x);
        if round || self.back >= if residual < CLOSE { NEAR } else { FARTHER } {
            self.back = 0;
            self.from.clear();
            self.hold_back(descent);
        }
    }

    /// From elsewhere, with whole steps and all gaps there at once.
    pub(super) fn anew(&mut self, descent: &mut NewtonState<'_, '_>) {
        *self = Self::default();
        descent.stride = 1.0;
        if let Some(itself) = &mut descent.contacts.proximity {
            itself.fade(1.0);
        }
    }

    /// Whether the last steps together led nowhere.
    fn goes_round(&mut self, x: &[DVec3]) -> bool {
        if self.from.is_empty() {
            (self.steps, self.way) = (0, 0.0);
            self.from.extend_from_slice(x);
        } else {
            self.steps += 1;
            self.way += apart(x, &self.last);
        }
        self.last.clear();
        self.last.extend_from_slice(x);
        if self.steps < ROUND {
            return false;
        }
        let nowhere = apart(x, &self.from) < NOWHERE * self.way;
        self.from.clear();
        nowhere
    }

    /// Shorter steps first, and where that does not end it, gaps that come and go slowly, with whole steps again.
    fn hold_back(&mut self, descent: &mut NewtonState<'_, '_>) {
        if descent.stride > LEAST_STRIDE && self.fade == 1.0 {
            descent.stride *= 0.5;
        } else if let Some(itself) = &mut descent.contacts.proximity {
            self.fade = (0.5 * self.fade).max(LEAST_FADE);
            itself.fade(self.fade);
            descent.stride = 1.0;
        }
    }
}

/// ‖a − b‖₂, m.
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum::<f64>().sqrt()
}
