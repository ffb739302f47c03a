//! Arms with hands and legs with feet of the dress form, as swept sections.
//!
//! Half axes are shares of a girth's radius, drawn by eye so that arms taper to the elbow and legs have a knee and a calf that sits
//! behind; hands and feet, which have no measurement, grow with stature (a foot of 25 and a hand of 18 cm at 1.68 m). All lengths in
//! metres; left limbs only.

use glam::DVec3;

use super::anatomy::{Factors, ankle_height, calf_height, mix, radius, shoulder_half, thigh_height};
use super::measures::Measures;
use super::solid::{Section, Sweep};

/// Angle of the arms from the vertical, radians: enough for a sleeve under the arm, as dress forms and A poses have it.
const ARM_ANGLE: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// The left arm with its hand, and how far along its axis the wrist and the biceps girth are, m.
pub(crate) fn arm(m: &Measures, f: &Factors) -> (Sweep, f64, f64) {
    let k = m.scale();
    let [.., of_biceps, of_wrist] = *f;
    let (b, w) = (radius(m.biceps, of_biceps), radius(m.wrist, of_wrist));
    let t = DVec3::new(ARM_ANGLE.sin(), -0.07, -ARM_ANGLE.cos()).normalize();
    let u = t.cross(DVec3::Y).normalize();
    let v = u.cross(t);
    let origin = DVec3::new(shoulder_half(m) - 0.012 * k, 0.022, m.acromion - 0.038 * k);
    let wrist = m.arm_length - 0.02 * k;
    let biceps = 0.37 * wrist;
    let oval = |s: f64, thick: f64, wide: f64| (s, [0.0, 0.0, thick, wide, wide]);
    let stations = [
        oval(-0.035 * k, 0.62 * b, 0.85 * b),
        oval(0.015 * k, 0.98 * b, 1.08 * b),
        oval(0.055 * k, 1.10 * b, 1.14 * b),
        oval(0.20 * wrist, 1.04 * b, 1.06 * b),
        oval(biceps, b, b),
        oval(0.54 * wrist, 0.92 * mix(w, b, 0.62), 0.95 * mix(w, b, 0.62)),
        oval(0.66 * wrist, 0.93 * mix(w, b, 0.66), mix(w, b, 0.66)),
        oval(0.84 * wrist, 0.93 * mix(w, b, 0.28), 1.05 * mix(w, b, 0.28)),
        oval(wrist, 0.88 * w, 1.12 * w),
        oval(wrist + 0.04 * k, 0.017 * k, 0.034 * k),
        oval(wrist + 0.085 * k, 0.0155 * k, 0.040 * k),
        oval(wrist + 0.13 * k, 0.0135 * k, 0.034 * k),
        oval(wrist + 0.175 * k, 0.0115 * k, 0.023 * k),
    ];
    (Sweep::new(origin, [u, v, t], 2.0, &stations, [0.02, 0.009]), wrist, biceps)
}

/// Half the gap between the thighs where they are closest, m: what the mesh needs to keep them apart.
const THIGH_GAP: f64 = 0.012;

/// The left leg down to the ankle, and its foot.
pub(crate) fn leg(m: &Measures, f: &Factors) -> (Sweep, Sweep) {
    let k = m.scale();
    let [.., of_thigh, of_knee, of_calf, of_ankle, _, _] = *f;
    let thigh = radius(m.thigh, of_thigh);
    let knee = radius(m.knee, of_knee);
    let calf = radius(m.calf, of_calf);
    let ankle = radius(m.ankle, of_ankle);
    let inner = 0.88 * thigh + THIGH_GAP;
    let foot_x = (0.085 * k).max(1.1 * calf + 0.01);
    let knee_x = mix(inner, foot_x, 0.45).max(knee + 0.008);
    let calf_z = calf_height(m);
    let stations: [(f64, Section); 11] = [
        (0.005 * k, [foot_x, 0.02 * k, 0.95 * ankle, 1.0 * ankle, 1.15 * ankle]),
        (ankle_height(m), [foot_x, 0.019 * k, 0.93 * ankle, 1.02 * ankle, 1.12 * ankle]),
        (mix(ankle_height(m), calf_z, 0.45), {
            let r = mix(ankle, calf, 0.42);
            [foot_x, 0.020 * k, 0.97 * r, 0.95 * r, 1.06 * r]
        }),
        (calf_z, [mix(foot_x, knee_x, 0.6), 0.017 * k, 0.98 * calf, 0.92 * calf, 1.10 * calf]),
        (m.knee_height - 0.055 * k, {
            let r = mix(calf, knee, 0.5);
            [mix(foot_x, knee_x, 0.85), 0.012 * k, 0.97 * r, 0.98 * r, 1.02 * r]
        }),
        (m.knee_height, [knee_x, 0.006 * k, 0.98 * knee, 1.06 * knee, 0.98 * knee]),
        (m.knee_height + 0.07 * k, {
            let r = mix(knee, thigh, 0.33);
            [mix(knee_x, inner, 0.25), 0.005 * k, 0.96 * r, 1.04 * r, 1.03 * r]
        }),
        (mix(m.knee_height, m.crotch, 0.6), {
            let r = mix(knee, thigh, 0.72);
            [mix(knee_x, inner, 0.65), 0.003 * k, 0.92 * r, 1.06 * r, 1.08 * r]
        }),
        (thigh_height(m), [inner, 0.004 * k, 0.88 * thigh, 1.06 * thigh, 1.14 * thigh]),
        (m.crotch + 0.03 * k, [0.93 * inner, 0.004 * k, 0.89 * thigh, 1.00 * thigh, 1.06 * thigh]),
        (m.crotch + 0.13 * k, [0.88 * inner, 0.002 * k, 0.68 * thigh, 0.76 * thigh, 0.74 * thigh]),
    ];
    let leg = Sweep::upright(2.0, &stations, [0.005, 0.03]);
    // The foot points forward and 7 degrees outward.
    let t = DVec3::new(0.12, -0.993, 0.0).normalize();
    let origin = DVec3::new(foot_x, 0.022 * k, 0.012 * k);
    let step = |s: f64, half: f64, high: f64| (s * k, [0.0, 0.0, half * k, 0.03 * k, high * k]);
    let stations = [
        step(-0.045, 0.024, 0.030),
        step(-0.02, 0.031, 0.050),
        step(0.03, 0.034, 0.058),
        step(0.08, 0.040, 0.042),
        step(0.13, 0.046, 0.029),
        step(0.165, 0.044, 0.021),
        step(0.195, 0.036, 0.017),
    ];
    let foot = Sweep::new(origin, [DVec3::Z.cross(t), DVec3::Z, t], 2.2, &stations, [0.01, 0.011]);
    (leg, foot)
}
