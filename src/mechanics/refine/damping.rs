//! Levenberg's damping ε from step to step.
//!
//! ε falls while whole steps succeed, faster near rest, where only the softest directions are left, and grows where the line search cuts a
//! step short (Levenberg 1944, Marquardt 1963).

use crate::mechanics::solver_options::NewtonOptions;

/// The damping after a step of which this share was taken, with this residual over weight after it; 1/s².
pub(super) fn after_step(options: &NewtonOptions, damping: f64, share: f64, residual: f64) -> f64 {
    if share >= 1.0 {
        let near_rest = residual < options.near_rest;
        let less = if near_rest { options.damping_decrease_near_rest } else { options.damping_decrease };
        (damping * less).max(options.min_damping)
    } else if share < options.short_step {
        (damping * options.damping_increase).min(options.max_damping)
    } else {
        damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_falls_with_whole_steps_grows_with_short_ones_and_keeps_its_bounds() {
        let options = NewtonOptions::default();
        let after = |damping, share, residual| after_step(&options, damping, share, residual);
        assert!(after(100.0, 1.0, 1.0) < 100.0 && after(100.0, 1.0, 1e-4) < after(100.0, 1.0, 1.0));
        assert!(after(100.0, 0.1, 1.0) > 100.0 && after(100.0, 0.6, 1.0) == 100.0);
        assert_eq!(after(options.min_damping, 1.0, 1e-4), options.min_damping);
        assert_eq!(after(options.max_damping, 0.1, 1.0), options.max_damping);
    }
}
