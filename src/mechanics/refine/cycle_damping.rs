//! Damping of cycles.
//!
//! Normals of gaps and anchors of friction are constant during a step and renewed after it, and the set of gaps changes discontinuously, so
//! two states may each lead to the other. Where the renewal is continuous, half steps converge to the mean of both (Krasnoselskii's
//! iteration, 1955). Where it is not, gaps are under-relaxed ([`Proximity`](crate::mechanics::energy::Proximity)). A cycle is detected by
//! consecutive steps that oppose each other, or by a few steps that end near where they began, in either case without a smaller residual.

use glam::DVec3;

use crate::mechanics::newton::NewtonState;
use crate::mechanics::solver_options::{CycleOptions, SolverOptions};

/// Detects cycles and damps them.
#[derive(Debug)]
pub(super) struct CycleDamping {
    /// Residual over weight, the least so far.
    least: f64,
    /// Consecutive opposing steps since then.
    opposing: usize,
    /// Share of its stiffness that a gap gains or loses.
    under_relaxation: f64,
    /// Where the round began, where the last step ended, and how many steps and how far it is by now (‖Δx‖₂, m).
    from: Vec<DVec3>,
    last: Vec<DVec3>,
    steps: usize,
    travelled: f64,
}

impl Default for CycleDamping {
    fn default() -> Self {
        let (from, last) = (Vec::new(), Vec::new());
        Self { least: f64::INFINITY, opposing: 0, under_relaxation: 1.0, from, last, steps: 0, travelled: 0.0 }
    }
}

impl CycleDamping {
    /// Accounts for a step, which opposes the previous one or does not.
    pub(super) fn after_step(&mut self, descent: &mut NewtonState<'_, '_>, opposes: bool) {
        let SolverOptions { cycles: options, newton, .. } = &descent.cloth.solver;
        self.opposing = if opposes { self.opposing + 1 } else { 0 };
        let residual = descent.residual;
        if residual < options.progress_ratio * self.least || residual > options.max_residual {
            (self.least, self.opposing) = (residual, 0);
            descent.step_share = (2.0 * descent.step_share).min(1.0);
            self.from.clear();
            return;
        }
        let returns = self.returns(&descent.x, options);
        let most = if residual < newton.near_rest { options.max_opposing } else { options.max_opposing_far };
        if returns || self.opposing >= most {
            self.opposing = 0;
            self.from.clear();
            self.damp(descent);
        }
    }

    /// Restarts with whole steps and without under-relaxation.
    pub(super) fn reset(&mut self, descent: &mut NewtonState<'_, '_>) {
        *self = Self::default();
        descent.step_share = 1.0;
        if let Some(proximity) = &mut descent.contacts.proximity {
            proximity.set_under_relaxation(1.0);
        }
    }

    /// Whether the last steps together returned to where they began.
    fn returns(&mut self, x: &[DVec3], options: &CycleOptions) -> bool {
        if self.from.is_empty() {
            (self.steps, self.travelled) = (0, 0.0);
            self.from.extend_from_slice(x);
        } else {
            self.steps += 1;
            self.travelled += distance(x, &self.last);
        }
        self.last.clear();
        self.last.extend_from_slice(x);
        if self.steps < options.window {
            return false;
        }
        let returns = distance(x, &self.from) < options.return_share * self.travelled;
        self.from.clear();
        returns
    }

    /// Shortens steps; if they are shortest already, under-relaxes the gaps, with whole steps again.
    fn damp(&mut self, descent: &mut NewtonState<'_, '_>) {
        let options = &descent.cloth.solver.cycles;
        if descent.step_share > options.min_step_share && self.under_relaxation == 1.0 {
            descent.step_share *= 0.5;
        } else if let Some(proximity) = &mut descent.contacts.proximity {
            self.under_relaxation = (0.5 * self.under_relaxation).max(options.min_under_relaxation);
            proximity.set_under_relaxation(self.under_relaxation);
            descent.step_share = 1.0;
        }
    }
}

/// ‖a − b‖₂, m.
fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum::<f64>().sqrt()
}
