//! How a step goes on from the one before: like it, and then farther, or back against it.
//!
//! Down a long valley the model is stiffer than the energy, and step after step goes the same way by the same length. With k the
//! stiffness along it and k_m the model's, the next step is ρ = 1 − t k/k_m of the last, which went t of its length, so the bottom is
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

use super::{dot, norm};

/// A step goes on like the one before where its cosine with it is over this.
const ALIKE: f64 = 0.8;

/// A step goes back where its cosine with the one before is under minus this.
const BACK: f64 = 0.3;

/// The last step.
#[derive(Debug, Clone, Default)]
pub(super) struct Onward {
    /// d, m.
    step: Vec<DVec3>,
    /// t.
    went: f64,
    /// What all was moved by, m.
    moved: Vec<DVec3>,
}

impl Onward {
    /// How much of `step` to try first, between all of it and `most` times that.
    pub(super) fn reach(&self, step: &[DVec3], most: f64) -> f64 {
        let (now, before) = (norm(step), norm(&self.step));
        let along = dot(step, &self.step);
        // Also where nothing was before.
        if along.is_nan() || along <= ALIKE * now * before {
            return 1.0;
        }
        let rho = along / (before * before);
        if rho < 1.0 { (self.went / (1.0 - rho)).clamp(1.0, most) } else { most }
    }

    /// Keeps a step, t of which was gone; 0 where none was.
    pub(super) fn keep(&mut self, step: &[DVec3], went: f64) {
        self.step.clear();
        self.step.extend_from_slice(step);
        self.went = went;
    }

    /// Keeps what all was moved by; whether that was back, by and large, against the time before.
    pub(super) fn back(&mut self, moved: Vec<DVec3>) -> bool {
        let back = dot(&moved, &self.moved) < -BACK * norm(&moved) * norm(&self.moved);
        self.moved = moved;
        back
    }

    /// What comes next does not go on from here.
    pub(super) fn forget(&mut self) {
        self.step.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_too_stiff_is_made_good_at_the_second_step() {
        // E = ½ k (x − 1)², and a model with 1.6 k: the first step leaves three eighths, the second nothing.
        let (mut x, mut onward) = (0.0, Onward::default());
        for left in [0.375, 0.0] {
            let step = [DVec3::X * ((1.0 - x) / 1.6)];
            let reach = onward.reach(&step, 2.0);
            x += step[0].x * reach;
            onward.keep(&step, reach);
            assert!((1.0 - x - left).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn what_turns_or_shrinks_is_gone_as_it_is() {
        let mut onward = Onward::default();
        assert_eq!(onward.reach(&[DVec3::X], 2.0), 1.0);
        onward.keep(&[DVec3::X], 1.0);
        assert_eq!(onward.reach(&[DVec3::Y], 2.0), 1.0);
        assert_eq!(onward.reach(&[DVec3::X * 1.1], 2.0), 2.0);
        assert!((onward.reach(&[DVec3::X * 0.25], 2.0) - 4.0 / 3.0).abs() < 1e-12);
        onward.forget();
        assert_eq!(onward.reach(&[DVec3::X], 2.0), 1.0);
        assert!(!onward.back(vec![DVec3::X]) && onward.back(vec![DVec3::NEG_X]));
    }
}
