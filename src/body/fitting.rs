//! Makes the form's girths those that were asked for.
//!
//! A girth is where a plane cuts the solid: rays from the section's centre are followed to the surface by Newton's
//! method on the field, and the tape's length is the perimeter of the convex hull of where they end. Each girth has one factor on its radius, corrected by
//! asked/found until all agree; neighbouring girths hardly influence each other, so a few rounds do. The mesh's chords are a little
//! shorter than the solid's curves, so the same correction is made once more with girths measured on the mesh ([`body`](super::body)).

use glam::{DVec2, DVec3};

use super::anatomy::{Anatomy, Factors, ankle_height, calf_height, thigh_height, underbust_height};
use super::girth::{Plane, hull_length};
use super::measures::Measures;
use super::solid::{Solid, Sweep};

/// Rays of a girth: their polygon in a circle is short by (π/N)²/6 = 0.04 %.
const RAYS: usize = 64;
/// Rounds of correction; the error shrinks about tenfold in each.
const ROUNDS: usize = 7;

/// A girth of the body: where it is taken, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GirthMark {
    /// The measurement's name, as in [`BodySpec`](super::BodySpec) without `_cm`.
    pub name: &'static str,
    /// Where it is taken; the origin is the section's centre.
    pub plane: Plane,
    /// What was asked, m.
    pub asked: f64,
}

/// Every girth of the form, trunk first, then limbs downward; limbs are the left ones.
pub(crate) fn girth_marks(m: &Measures, form: &Anatomy) -> [GirthMark; 11] {
    let across = |name, sweep: &Sweep, at: f64, normal, asked| {
        let plane = Plane { origin: sweep.centre(at), normal };
        GirthMark { name, plane, asked }
    };
    let trunk = |name, z, asked| across(name, &form.trunk, z, DVec3::Z, asked);
    let leg = |name, z, asked| across(name, &form.leg, z, DVec3::Z, asked);
    let arm = |name, t, asked| across(name, &form.arm, t, form.arm.direction(), asked);
    [
        trunk("bust", m.bust_height, m.bust),
        trunk("underbust", underbust_height(m), m.underbust),
        trunk("waist", m.waist_height, m.waist),
        trunk("hip", m.hip_height, m.hip),
        across("neck", &form.neck, form.neck_at, form.neck.direction(), m.neck),
        leg("thigh", thigh_height(m), m.thigh),
        leg("knee", m.knee_height, m.knee),
        leg("calf", calf_height(m), m.calf),
        leg("ankle", ankle_height(m), m.ankle),
        arm("biceps", form.biceps_at, m.biceps),
        arm("wrist", form.wrist_at, m.wrist),
    ]
}

/// The tape girth of a solid where `plane` cuts it around its origin, m.
pub(crate) fn solid_girth(solid: &dyn Solid, plane: Plane, guess: f64) -> f64 {
    let [u, v] = plane.axes();
    let points = (0..RAYS)
        .map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / RAYS as f64).sin_cos();
            DVec2::new(cos, sin) * ray(solid, plane.origin, cos * u + sin * v, guess)
        })
        .collect();
    hull_length(points)
}

/// Distance from `origin`, inside, along `direction` to the surface, m.
pub(crate) fn ray(solid: &dyn Solid, origin: DVec3, direction: DVec3, guess: f64) -> f64 {
    let mut r = guess;
    // Newton with steps of at most a third of the guess, so that one bad slope does not throw it onto another limb.
    for _ in 0..40 {
        let at = solid.at(origin + r * direction);
        let slope = at.gradient.dot(direction).max(0.25);
        let step = (-at.value / slope).clamp(-0.3 * guess, 0.3 * guess);
        r = (r + step).max(0.1 * guess);
        if step.abs() < 1e-6 {
            break;
        }
    }
    r
}

/// The factors at which the solid has the girths asked for, scaled by `bias` (1 for the solid's own girths).
pub(crate) fn fit(m: &Measures, bias: &Factors) -> Factors {
    let mut factors = [1.0; 11];
    for _ in 0..ROUNDS {
        let form = Anatomy::new(m, &factors);
        let marks = girth_marks(m, &form);
        for ((factor, mark), bias) in factors.iter_mut().zip(&marks).zip(bias) {
            let found = solid_girth(&form, mark.plane, 0.8 * mark.asked / std::f64::consts::TAU);
            *factor *= (bias * mark.asked / found).clamp(0.7, 1.4);
        }
    }
    factors
}
