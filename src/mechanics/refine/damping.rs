//! Levenberg's damping ε from step to step.
//!
//! ε falls while whole steps succeed, and grows where the line search cuts a step short (Levenberg 1944, Marquardt 1963). Its unit is g/L,
//! the square of the frequency at which a garment of length L swings: cloth with this damping moves by about L in a step under its own weight.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ε | damping | 1/s² |
//! | g | gravitational acceleration, [`GRAVITY`] | m/s² |
//! | L | longest side of the box about the start | m |

use glam::DVec3;

use super::softening::extent;
use crate::GRAVITY;
use crate::mechanics::energy::Cloth;
use crate::mechanics::solver_options::NewtonOptions;

/// The damping of one solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Damping {
    options: NewtonOptions,
    /// g/L, 1/s².
    unit: f64,
}

impl Damping {
    /// For a solve of `cloth` from `start`, m.
    pub(super) fn new(cloth: &Cloth, start: &[DVec3]) -> Self {
        Self { options: cloth.solver.newton, unit: GRAVITY / extent(start) }
    }

    /// The damping to begin with, from a drape that rested or from any other start; 1/s².
    pub(super) fn initial(&self, from_rest: bool) -> f64 {
        if from_rest { self.least() } else { self.unit * self.options.damping }
    }

    /// The least damping, 1/s².
    pub(super) fn least(&self) -> f64 {
        self.unit * self.options.min_damping
    }

    /// The damping after a step of which this share was taken, 1/s².
    pub(super) fn after_step(&self, damping: f64, share: f64) -> f64 {
        let options = &self.options;
        if share >= 1.0 {
            (damping / options.damping_factor).max(self.least())
        } else if share < options.short_step {
            damping * options.damping_factor
        } else {
            damping
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_falls_with_whole_steps_to_its_least_and_grows_with_short_ones() {
        let damping = Damping { options: NewtonOptions::default(), unit: 10.0 };
        let first = damping.initial(false);
        let after = |value, share| damping.after_step(value, share);
        let short = damping.options.short_step;
        assert!(after(first, 1.0) < first && after(first, 0.5 * short) > first && after(first, 2.0 * short) == first);
        assert_eq!(after(damping.least(), 1.0), damping.least());
        assert!(damping.initial(true) < first);
    }
}
