//! A value with its gradient, carried through arithmetic (forward-mode differentiation).
//!
//! For f and g with gradients ∇f, ∇g: (f g)' = f ∇g + g ∇f, √f' = ∇f / (2√f), |f|ⁿ' = n |f|ⁿ⁻¹ sign(f) ∇f. Lengths are
//! metres, so the gradient of a distance has no unit. Source: Griewank, Walther, "Evaluating Derivatives", 2nd ed., ch. 3.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

use crate::base::math;

/// A scalar function's value and gradient at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Jet {
    /// The value.
    pub value: f64,
    /// Its gradient with respect to position.
    pub gradient: DVec3,
}

impl Jet {
    /// A value with its gradient.
    pub(crate) fn new(value: f64, gradient: DVec3) -> Self {
        Self { value, gradient }
    }

    /// A value that does not depend on position.
    pub(crate) fn constant(value: f64) -> Self {
        Self { value, gradient: DVec3::ZERO }
    }

    /// √f; zero, with zero gradient, where f is not positive.
    pub(crate) fn sqrt(self) -> Self {
        if self.value <= 0.0 {
            return Self::constant(0.0);
        }
        let root = self.value.sqrt();
        Self { value: root, gradient: self.gradient * (0.5 / root) }
    }

    /// |f|ⁿ for n > 1.
    pub(crate) fn abs_powf(self, n: f64) -> Self {
        let size = self.value.abs();
        if size < 1e-12 {
            return Self::constant(0.0);
        }
        let value = math::powf(size, n);
        Self { value, gradient: self.gradient * (n * value / self.value) }
    }

    /// f / g.
    pub(crate) fn over(self, g: Self) -> Self {
        let value = self.value / g.value;
        Self { value, gradient: (self.gradient - value * g.gradient) / g.value }
    }

    /// f² .
    pub(crate) fn square(self) -> Self {
        self * self
    }

    /// f / |∇f|, with the direction of ∇f: to first order the distance to f = 0. The change of |∇f| is left out of the
    /// gradient, which is exact on f = 0 and wrong by O(f) away from it.
    pub(crate) fn to_distance(self) -> Self {
        let slope = self.gradient.length();
        if slope < 1e-9 {
            return self;
        }
        Self { value: self.value / slope, gradient: self.gradient / slope }
    }

    /// Smooth minimum over the width k: min(a, b) − k h³/6 with h = max(0, 1 − |a − b|/k). C², exact where |a − b| > k
    /// (I. Quilez, "Smooth minimum", cubic form).
    pub(crate) fn smooth_min(self, other: Self, k: f64) -> Self {
        let (low, high) = if self.value <= other.value { (self, other) } else { (other, self) };
        let h = 1.0 - (high.value - low.value) / k;
        if h <= 0.0 {
            return low;
        }
        let share = 0.5 * h * h;
        Self { value: low.value - k * h * h * h / 6.0, gradient: low.gradient * (1.0 - share) + high.gradient * share }
    }

    /// Smooth maximum, the mirror of [`smooth_min`](Self::smooth_min).
    pub(crate) fn smooth_max(self, other: Self, k: f64) -> Self {
        -(-self).smooth_min(-other, k)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, gradient: self.gradient + o.gradient }
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, gradient: self.gradient }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, gradient: self.gradient - o.gradient }
    }
}

impl Sub<f64> for Jet {
    type Output = Self;
    fn sub(self, o: f64) -> Self {
        Self { value: self.value - o, gradient: self.gradient }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { value: self.value * o.value, gradient: self.value * o.gradient + o.value * self.gradient }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self { value: self.value * o, gradient: self.gradient * o }
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, gradient: -self.gradient }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gradient of an expression against central differences.
    fn agrees(f: impl Fn(DVec3) -> Jet, at: DVec3) {
        let h = 1e-6;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let slope = (f(at + h * axis).value - f(at - h * axis).value) / (2.0 * h);
            assert!((slope - f(at).gradient.dot(axis)).abs() < 1e-7, "{slope} {:?}", f(at).gradient);
        }
    }

    #[test]
    fn gradients_agree_with_differences() {
        let x = |p: DVec3| Jet::new(p.x, DVec3::X);
        let y = |p: DVec3| Jet::new(p.y, DVec3::Y);
        let at = DVec3::new(0.3, -0.7, 0.2);
        agrees(|p| (x(p).square() + y(p).square()).sqrt(), at);
        agrees(|p| y(p).abs_powf(2.4), at);
        agrees(|p| x(p).over(y(p)), at);
        agrees(|p| x(p).smooth_min(y(p) + 0.9, 0.5), at);
        agrees(|p| x(p).smooth_max(y(p) + 0.9, 0.5), at);
    }

    #[test]
    fn the_smooth_minimum_is_exact_away_from_the_joint_and_lower_at_it() {
        let (a, b) = (Jet::constant(1.0), Jet::constant(3.0));
        assert_eq!(a.smooth_min(b, 1.0), a);
        assert!((a.smooth_min(a, 0.6).value - 0.9).abs() < 1e-15);
    }
}
