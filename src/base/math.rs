//! Elementary functions with the same bits on every processor.
//!
//! The methods of `f64` call the C library, which selects code with or without fused operations at run time and then differs in the last bit; a
//! drape amplifies that to millimetres. These are the functions of musl, compiled into the program. Roots and the four operations are
//! exact everywhere and stay methods.

use glam::{DMat3, DVec2, DVec3};

/// sin x.
#[must_use]
pub(crate) fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// cos x.
#[must_use]
pub(crate) fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// sin x and cos x.
#[must_use]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// The angle of (x, y), −π to π.
#[must_use]
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// eˣ.
#[must_use]
pub(crate) fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// log₂ x.
#[must_use]
pub(crate) fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// xⁿ.
#[must_use]
pub(crate) fn powf(x: f64, n: f64) -> f64 {
    libm::pow(x, n)
}

/// √(x² + y²), of numbers whose squares are finite.
#[must_use]
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The unit vector at an angle.
#[must_use]
pub(crate) fn unit(angle: f64) -> DVec2 {
    let (sin, cos) = sin_cos(angle);
    DVec2::new(cos, sin)
}

/// The angle of a vector, −π to π.
#[must_use]
pub(crate) fn angle(v: DVec2) -> f64 {
    atan2(v.y, v.x)
}

/// The rotation about x, y or z by an angle.
#[must_use]
pub(crate) fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    let (sin, cos) = sin_cos(angle);
    let turned = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_agree_with_those_of_the_platform() {
        for i in -400..400 {
            let x = 0.037 * f64::from(i);
            let y = 1.3 - x;
            let pairs = [
                (sin(x), x.sin()),
                (cos(x), x.cos()),
                (atan2(y, x), y.atan2(x)),
                (exp(x), x.exp()),
                (log2(x.abs() + 0.1), (x.abs() + 0.1).log2()),
                (powf(x.abs(), 0.35), x.abs().powf(0.35)),
                (hypot(x, y), x.hypot(y)),
                (angle(unit(x)), DVec2::from_angle(x).to_angle()),
            ];
            for (k, (ours, theirs)) in pairs.into_iter().enumerate() {
                assert!((ours - theirs).abs() <= 4e-16 * theirs.abs().max(1.0), "{k} at {x}: {ours} and {theirs}");
            }
            let rotations = [
                (rotation(DVec3::X, x), DMat3::from_rotation_x(x)),
                (rotation(DVec3::Y, x), DMat3::from_rotation_y(x)),
                (rotation(DVec3::Z, x), DMat3::from_rotation_z(x)),
            ];
            assert!(rotations.iter().all(|(ours, theirs)| ours.abs_diff_eq(*theirs, 1e-15)));
        }
    }
}
