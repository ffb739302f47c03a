//! Extrapolation of a step that goes on like the one before.
//!
//! Down a long valley the model is stiffer than the energy, and step after step goes the same way by the same length. With k the
//! stiffness along it and k_m the model's, the next step is ρ = 1 − t k/k_m of the last, which taken t of its length, so the bottom is
//! t/(1 − ρ) = k_m/k steps off (Aitken's extrapolation, along d):
//!
//! ρ = d·d′/|d′|²,  t ← min(t/(1 − ρ), most).
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d, d′ | this step, and the one before | m |
//! | t | share of a step that is gone | – |
//!
//! Limits: a valley of cloth is curved, and more than twice a step stretches what it turns.

use glam::DVec3;

use crate::mechanics::linear_algebra::{dot, norm};

/// The last step.
#[derive(Debug, Clone, Default)]
pub(super) struct Extrapolation {
    /// d, m.
    step: Vec<DVec3>,
    /// t.
    taken: f64,
}

impl Extrapolation {
    /// The factor on `step` that is tried first, between 1 and `max`. A step continues the previous one if the cosine between them is larger
    /// than `continues_cosine`.
    pub(super) fn factor(&self, step: &[DVec3], max: f64, continues_cosine: f64) -> f64 {
        let (now, before) = (norm(step), norm(&self.step));
        let along = dot(step, &self.step);
        // NaN where there is no previous step.
        if along.is_nan() || along <= continues_cosine * now * before {
            return 1.0;
        }
        let rho = along / (before * before);
        if rho < 1.0 { (self.taken / (1.0 - rho)).clamp(1.0, max) } else { max }
    }

    /// Stores a step, of which the share t was taken; 0 for a rejected one.
    pub(super) fn store_step(&mut self, step: &[DVec3], taken: f64) {
        self.step.clear();
        self.step.extend_from_slice(step);
        self.taken = taken;
    }

    /// Forgets the previous step.
    pub(super) fn reset(&mut self) {
        self.step.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrapolation_corrects_a_stiff_model_at_the_second_step() {
        // E = ½ k (x − 1)², and a model with 1.6 k: the first step leaves three eighths, the second nothing.
        let (mut x, mut extrapolation) = (0.0, Extrapolation::default());
        for left in [0.375, 0.0] {
            let step = [DVec3::X * ((1.0 - x) / 1.6)];
            let factor = extrapolation.factor(&step, 2.0, 0.8);
            x += step[0].x * factor;
            extrapolation.store_step(&step, factor);
            assert!((1.0 - x - left).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn steps_that_turn_or_shrink_are_not_extrapolated() {
        let mut extrapolation = Extrapolation::default();
        assert_eq!(extrapolation.factor(&[DVec3::X], 2.0, 0.8), 1.0);
        extrapolation.store_step(&[DVec3::X], 1.0);
        assert_eq!(extrapolation.factor(&[DVec3::Y], 2.0, 0.8), 1.0);
        assert_eq!(extrapolation.factor(&[DVec3::X * 1.1], 2.0, 0.8), 2.0);
        assert!((extrapolation.factor(&[DVec3::X * 0.25], 2.0, 0.8) - 4.0 / 3.0).abs() < 1e-12);
        extrapolation.reset();
        assert_eq!(extrapolation.factor(&[DVec3::X], 2.0, 0.8), 1.0);
    }
}
