//! Detects a solve that makes no progress.
//!
//! Cloth that is strained far beyond what fabrics bear, because a garment is too small or caught, may have no state that its contacts leave
//! unchanged. Normals, anchors and gaps are renewed after every step, and the solve cycles: far from rest, where cycles are not damped
//! ([`cycle_damping`](super::cycle_damping)), or in spite of the damping. Such a solve ends as [`Stop::Stalled`](super::Stop).
//!
//! A step is progress if the residual has halved, or the energy has fallen by the work of a tolerated residual over the longest step,
//! since the last progress. The count restarts at an equilibrium and where contact places are added or removed.

use crate::mechanics::newton::NewtonState;

/// The last progress of a solve.
#[derive(Debug)]
pub(super) struct StallDetection {
    /// Residual over weight, and energy, J.
    residual: f64,
    energy: f64,
    steps: usize,
}

impl Default for StallDetection {
    fn default() -> Self {
        Self { residual: f64::INFINITY, energy: f64::INFINITY, steps: 0 }
    }
}

impl StallDetection {
    /// Accounts for a step; returns whether the solve has stalled.
    pub(super) fn after_step(&mut self, descent: &NewtonState<'_, '_>) -> bool {
        let options = &descent.cloth.solver.newton;
        // The work of a residual that is tolerated, over the longest step.
        let fall = descent.cloth.weight * options.tolerance * options.longest_move_m;
        self.account(descent.residual, descent.energy, fall);
        self.steps >= options.stall_steps
    }

    fn account(&mut self, residual: f64, energy: f64, fall: f64) {
        if residual < 0.5 * self.residual || energy < self.energy - fall {
            *self = Self { residual: residual.min(self.residual), energy, steps: 0 };
        } else {
            self.steps += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps_without_progress(states: impl IntoIterator<Item = [f64; 2]>) -> usize {
        let mut detection = StallDetection::default();
        states.into_iter().for_each(|[residual, energy]| detection.account(residual, energy, 1e-3));
        detection.steps
    }

    #[test]
    fn a_cycle_far_from_rest_is_no_progress() {
        let cycle = |n: usize| (0..n).map(|i| [13.0 + (i % 3) as f64, 2.0 + 5e-4 * (i % 4) as f64]);
        assert_eq!(steps_without_progress(cycle(100)), 99);
    }

    #[test]
    fn falling_energy_and_falling_residual_are_progress() {
        assert_eq!(steps_without_progress((0..100).map(|i| [1.0, -2e-3 * f64::from(i)])), 0);
        assert!(steps_without_progress((0..100).map(|i| [0.95_f64.powi(i), 1.0])) < 15);
    }
}
