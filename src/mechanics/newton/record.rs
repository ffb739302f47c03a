//! What is told of a step.

use super::{Advance, NewtonState};

/// One line of the history.
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
    /// Whether the energy is that of the softened cloth.
    pub softened: bool,
}

impl NewtonState<'_, '_> {
    /// A line of the history, after `advance`.
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
