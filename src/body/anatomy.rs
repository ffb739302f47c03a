//! The dress form as a solid: trunk, bust, seat, neck, head, arms, hands, legs and feet, smoothly joined.
//!
//! Sections are superellipses whose half axes are a girth's radius R = girth/2π times a share for breadth and for depth in front
//! and behind. The shares come from ANSUR II breadths and depths (women, regressed to European size 38: chest 26.0 × 22.5, waist
//! 25.8 × 17.0, hip 33.5 × 20.9 cm). Arms taper to the elbow, legs have a knee and a calf that sits behind. What has no
//! measurement (head, hands, feet, the curve of the back) is drawn by eye and proportional to stature: a foot of 25 cm and a hand of
//! 18 cm at 1.68 m. One factor per girth ([`Factors`]) corrects the radius by measuring, see
//! [`dress_form`](super::dress_form). All lengths in metres.
//!
//! The figure stands on z = 0, looks along −y, its left is +x, and its arms hang 40° off the vertical.

use glam::DVec3;

use super::jet::Jet;
use super::measures::Measures;
use super::solid::{Ellipsoid, Section, Sided, Solid, Sweep};

use crate::base::math;

/// Correction factor of each girth's radius, initially 1, in the order of [`girth_marks`](super::dress_form::girth_marks): bust,
/// underbust, waist, hip, neck, thigh, knee, calf, ankle, biceps, wrist.
pub(crate) type Factors = [f64; 11];

/// Angle of the arms from the vertical, radians: room for a sleeve under the arm, as dress forms and A poses have it.
const ARM_ANGLE: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Half the gap between the thighs where they are closest, m; the mesh needs it to separate them.
const THIGH_GAP: f64 = 0.012;

/// The parts of the figure. Limbs are the left ones; the right ones are their mirror images.
#[derive(Debug, Clone)]
pub(crate) struct Anatomy {
    /// From the crotch to the base of the neck.
    pub trunk: Sweep,
    /// The left breast.
    pub breast: Ellipsoid,
    /// The left half of the seat.
    pub buttock: Ellipsoid,
    /// From between the shoulders into the head.
    pub neck: Sweep,
    cranium: Ellipsoid,
    jaw: Ellipsoid,
    /// From inside the shoulder to the finger tips.
    pub arm: Sweep,
    /// From inside the hip to the sole.
    pub leg: Sweep,
    foot: Sweep,
    /// Coordinate of the wrist along the arm's axis, m.
    pub wrist_at: f64,
    /// Coordinate of the biceps girth along the arm's axis, m.
    pub biceps_at: f64,
    /// Coordinate of the girth along the neck's axis, m.
    pub neck_at: f64,
}

fn radius(girth: f64, factor: f64) -> f64 {
    girth * factor / std::f64::consts::TAU
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

impl Anatomy {
    /// The figure for these measurements, m, and corrections.
    pub(crate) fn new(m: &Measures, f: &Factors) -> Self {
        let k = m.scale();
        let [of_bust, _, _, of_hip, ..] = *f;
        let hip = radius(m.hip, of_hip);
        let bust = radius(m.bust, of_bust);
        let (trunk, chest_front) = trunk(m, f);
        // Bust less underbust, relative to the 13 cm of the default body.
        let cup = ((m.bust - m.underbust) / 0.13).clamp(0.25, 2.2);
        let (swell, protrusion) = (math::powf(cup, 0.35), 0.031 * math::powf(cup, 0.8));
        let breast_radii = DVec3::new(0.062, 0.060, 0.070) * swell * (bust / 0.14).sqrt();
        let breast = Ellipsoid {
            centre: DVec3::new(0.50 * bust, breast_radii.y - chest_front - protrusion, m.bust_height),
            radii: breast_radii,
            lean: 0.25,
        };
        let seat = hip / 0.1528;
        let buttock = Ellipsoid {
            centre: DVec3::new(0.076 * seat, 0.036 * seat, m.hip_height + 0.040 * k),
            // Its lower end is a little above the crotch, so that the seat does not close the gap between the legs.
            radii: DVec3::new(0.076 * seat, 0.079 * seat, m.hip_height - m.crotch_height + 0.055 * k),
            lean: -0.3,
        };
        let (arm, wrist_at, biceps_at) = arm(m, f);
        let (leg, foot) = leg(m, f);
        let (neck, neck_at) = neck(m, f);
        let top = m.stature;
        let nape = neck.centre(0.17 * k).y;
        let cranium = Ellipsoid {
            centre: DVec3::new(0.0, nape + 0.008 * k, top - 0.098 * k),
            radii: DVec3::new(0.074, 0.094, 0.098) * k,
            lean: 0.0,
        };
        let jaw = Ellipsoid {
            centre: DVec3::new(0.0, nape - 0.034 * k, top - 0.157 * k),
            radii: DVec3::new(0.053, 0.060, 0.062) * k,
            lean: 0.12,
        };
        Self { trunk, breast, buttock, neck, cranium, jaw, arm, leg, foot, wrist_at, biceps_at, neck_at }
    }

    /// Trunk, bust, seat and neck.
    pub(crate) fn torso(&self, p: DVec3) -> Jet {
        let mut field = self.trunk.at(p);
        for side in [1.0, -1.0] {
            field = Sided::new(&self.breast, side).join(field, p, 0.075);
            field = Sided::new(&self.buttock, side).join(field, p, 0.07);
        }
        self.neck.join(field, p, 0.06)
    }

    /// Trunk, neck and legs.
    pub(crate) fn torso_and_legs(&self, p: DVec3) -> Jet {
        Legs(self).join(self.torso(p), p, 0.05)
    }

    /// Everything but the head.
    pub(crate) fn below_the_head(&self, p: DVec3) -> Jet {
        Sided::new(&self.arm, p.x).join(self.torso_and_legs(p), p, 0.065)
    }
}

/// Both legs with their feet, flat on the floor.
struct Legs<'a>(&'a Anatomy);

impl Solid for Legs<'_> {
    fn at(&self, p: DVec3) -> Jet {
        let one = |side: f64| {
            let limb = Sided::new(&self.0.foot, side).join(Sided::new(&self.0.leg, side).at(p), p, 0.05);
            limb.smooth_max(-Jet::new(p.z, DVec3::Z), 0.035)
        };
        let near = one(p.x);
        // The other leg matters only next to the middle.
        if p.x.abs() > 0.05 { near } else { near.smooth_min(one(-p.x), 0.03) }
    }

    fn at_least(&self, p: DVec3) -> f64 {
        let leg = &self.0.leg;
        (p.z - leg.range().1).max(0.0)
    }
}

/// The head.
struct Head<'a>(&'a Anatomy);

impl Solid for Head<'_> {
    fn at(&self, p: DVec3) -> Jet {
        self.0.cranium.at(p).smooth_min(self.0.jaw.at(p), 0.07)
    }

    fn at_least(&self, p: DVec3) -> f64 {
        // The smooth joint adds at most a sixth of its width.
        (self.0.cranium.at_least(p).min(self.0.jaw.at_least(p)) - 0.012).max(0.0)
    }
}

impl Solid for Anatomy {
    fn at(&self, p: DVec3) -> Jet {
        Head(self).join(self.below_the_head(p), p, 0.035)
    }
}

fn trunk(m: &Measures, f: &Factors) -> (Sweep, f64) {
    let k = m.scale();
    let [of_bust, of_underbust, of_waist, of_hip, of_neck, ..] = *f;
    let hip = radius(m.hip, of_hip);
    let waist = radius(m.waist, of_waist);
    let under = radius(m.underbust, of_underbust);
    let bust = radius(m.bust, of_bust);
    let chest = mix(under, bust, 0.5);
    let shoulder = shoulder_half(m);
    let neck = radius(m.neck, of_neck);
    let under_z = underbust_height(m);
    let rise = m.acromion_height - m.axilla_height;
    let top = m.cervicale_height - 0.018 * k;
    let front = 0.70 * mix(under, bust, 0.35);
    let stations: [(f64, Section); 11] = [
        (m.crotch_height + 0.036 * k, [0.0, 0.005, 0.84 * hip, 0.50 * hip, 0.54 * hip]),
        (m.hip_height + 0.02 * k, [0.0, 0.005, 1.00 * hip, 0.59 * hip, 0.62 * hip]),
        (mix(m.hip_height, m.waist_height, 0.5), {
            let r = mix(hip, waist, 0.45);
            [0.0, 0.002, 1.07 * r, 0.67 * r, 0.68 * r]
        }),
        (m.waist_height, [0.0, -0.002, 1.12 * waist, 0.74 * waist, 0.73 * waist]),
        (under_z, [0.0, 0.004, 1.09 * under, 0.78 * under, 0.82 * under]),
        (m.bust_height, [0.0, 0.008, 1.03 * mix(under, bust, 0.4), front, 0.86 * mix(under, bust, 0.4)]),
        (m.axilla_height, [0.0, 0.013, 1.10 * chest, 0.66 * chest, 0.80 * chest]),
        (m.axilla_height + 0.45 * rise, [0.0, 0.018, 0.91 * shoulder, 0.56 * chest, 0.68 * chest]),
        (m.acromion_height - 0.022 * k, [0.0, 0.022, 0.90 * shoulder, 0.44 * chest, 0.54 * chest]),
        (m.acromion_height + 0.012 * k, [0.0, 0.025, 0.66 * shoulder, 0.36 * chest, 0.44 * chest]),
        (top, [0.0, 0.027, 0.95 * neck, 0.30 * chest, 0.34 * chest]),
    ];
    (Sweep::upright(2.3, &stations, [0.025, 0.01]), front - 0.008)
}

/// Height of the underbust girth, m: a third of the way from the bust to the waist.
pub(crate) fn underbust_height(m: &Measures) -> f64 {
    mix(m.bust_height, m.waist_height, 0.36)
}

/// Half the distance between the ends of the shoulders, m: half the neck's base plus the shoulder, seen from the front.
fn shoulder_half(m: &Measures) -> f64 {
    // The shoulder slopes by 22 degrees or so, and starts where the neck's base is 1.15 times the middle's girth.
    let by_length = 0.927 * m.shoulder_length + 1.15 * m.neck / std::f64::consts::TAU;
    // With narrower shoulders the arms of a wide chest would start inside it.
    by_length.max(0.5 * (m.bust + m.underbust) / std::f64::consts::TAU + 0.045)
}

fn neck(m: &Measures, f: &Factors) -> (Sweep, f64) {
    let k = m.scale();
    let r = radius(m.neck, f[4]);
    let lean: f64 = 0.24;
    let (sin, cos) = math::sin_cos(lean);
    let axes = [DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos)];
    let ring = |share: f64| [0.0, 0.0, 0.97 * share * r, 1.03 * share * r, 1.03 * share * r];
    let at = 0.073 * k;
    let stations = [
        (-0.03 * k, ring(1.3)),
        (0.0, ring(1.2)),
        (0.035 * k, ring(1.06)),
        (at, ring(1.0)),
        (0.12 * k, ring(1.0)),
        (0.18 * k, ring(0.9)),
    ];
    (Sweep::new(DVec3::new(0.0, 0.027, m.cervicale_height - 0.072 * k), axes, 2.0, &stations, [0.01, 0.02]), at)
}

/// Height of the thigh girth, m: the first at which the legs are apart.
pub(crate) fn thigh_height(m: &Measures) -> f64 {
    m.crotch_height - 0.035 * m.scale()
}

/// Height of the calf girth, m: the EU 38 column has none; 0.72 of the knee's is usual.
pub(crate) fn calf_height(m: &Measures) -> f64 {
    0.72 * m.knee_height
}

/// Height of the ankle girth, m, above the foot.
pub(crate) fn ankle_height(m: &Measures) -> f64 {
    0.115 * m.scale()
}

/// The left arm with its hand, and the coordinates of the wrist and the biceps girth along its axis, m.
fn arm(m: &Measures, f: &Factors) -> (Sweep, f64, f64) {
    let k = m.scale();
    let [.., of_biceps, of_wrist] = *f;
    let (b, w) = (radius(m.biceps, of_biceps), radius(m.wrist, of_wrist));
    let t = DVec3::new(math::sin(ARM_ANGLE), -0.07, -math::cos(ARM_ANGLE)).normalize();
    let u = t.cross(DVec3::Y).normalize();
    let v = u.cross(t);
    let origin = DVec3::new(shoulder_half(m) - 0.012 * k, 0.022, m.acromion_height - 0.038 * k);
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

/// The left leg down to the ankle, and its foot.
fn leg(m: &Measures, f: &Factors) -> (Sweep, Sweep) {
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
        (mix(m.knee_height, m.crotch_height, 0.6), {
            let r = mix(knee, thigh, 0.72);
            [mix(knee_x, inner, 0.65), 0.003 * k, 0.92 * r, 1.06 * r, 1.08 * r]
        }),
        (thigh_height(m), [inner, 0.004 * k, 0.88 * thigh, 1.06 * thigh, 1.14 * thigh]),
        (m.crotch_height + 0.03 * k, [0.93 * inner, 0.004 * k, 0.89 * thigh, 1.00 * thigh, 1.06 * thigh]),
        (m.crotch_height + 0.13 * k, [0.88 * inner, 0.002 * k, 0.68 * thigh, 0.76 * thigh, 0.74 * thigh]),
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
