//! Damping of cycles.
//!
//! Normals of gaps and anchors of friction are constant during a step and renewed after it, and the set of gaps changes discontinuously, so
//! two states may each lead to the other. Where the renewal is continuous, half steps converge to the mean of both (Krasnoselskii's
//! iteration, 1955). Where it is not, gaps are under-relaxed ([`Proximity`](crate::mechanics::energy::Proximity)): the plane and the stiffness of
//! a gap approach their new values by a share. A cycle is a number of steps near rest without a smaller residual whose energy goes up and down
//! more than it falls. Cloth that slides makes no progress for a while either, but its energy falls.

use crate::mechanics::newton::NewtonState;

/// Detects cycles and damps them.
#[derive(Debug)]
pub(super) struct CycleDamping {
    /// Residual over weight, the least so far.
    least: f64,
    /// The steps that may be a cycle, and the energy, J, before and after them and in total up and down.
    steps: usize,
    energies: [f64; 2],
    travelled: f64,
    /// Share of the change of a gap that is taken.
    under_relaxation: f64,
}

impl Default for CycleDamping {
    fn default() -> Self {
        Self { least: f64::INFINITY, steps: 0, energies: [f64::NAN; 2], travelled: 0.0, under_relaxation: 1.0 }
    }
}

impl CycleDamping {
    /// Accounts for a step.
    pub(super) fn after_step(&mut self, descent: &mut NewtonState<'_, '_>) {
        let options = &descent.cloth.solver.cycles;
        let (residual, energy) = (descent.residual, descent.energy);
        if residual < options.progress_ratio * self.least || residual > options.max_residual {
            self.least = residual;
            self.begin(energy);
            descent.step_share = (2.0 * descent.step_share).min(1.0);
            return;
        }
        let [before, last] = self.energies;
        self.steps += 1;
        self.travelled += (energy - last).abs();
        self.energies[1] = energy;
        if self.steps >= options.window {
            let returns = (energy - before).abs() < options.return_share * self.travelled;
            self.begin(energy);
            if returns {
                self.damp(descent);
            }
        }
    }

    /// Begins to count steps at this energy, J.
    fn begin(&mut self, energy: f64) {
        (self.steps, self.energies, self.travelled) = (0, [energy; 2], 0.0);
    }

    /// Restarts with whole steps and without under-relaxation.
    pub(super) fn reset(&mut self, descent: &mut NewtonState<'_, '_>) {
        *self = Self::default();
        descent.step_share = 1.0;
        if let Some(proximity) = &mut descent.contacts.proximity {
            proximity.set_under_relaxation(1.0);
        }
    }

    /// Shortens steps and under-relaxes the gaps.
    fn damp(&mut self, descent: &mut NewtonState<'_, '_>) {
        let options = &descent.cloth.solver.cycles;
        descent.step_share = (0.5 * descent.step_share).max(options.min_step_share);
        if let Some(proximity) = &mut descent.contacts.proximity {
            self.under_relaxation = (0.5 * self.under_relaxation).max(options.min_under_relaxation);
            proximity.set_under_relaxation(self.under_relaxation);
        }
    }
}
