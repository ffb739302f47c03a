//! A garment's surface before it is cut: the body at a finger's distance, joined with the tubes of skirt, bodice and sleeves.
//!
//! The tubes are superellipses around the body's own breadth and depths at each level, widened until their girth is the
//! body's plus the ease; below the hip they widen evenly by the flare. Where the body comes nearer than [`CLEARANCE`], the
//! surface follows the body at that distance instead, smoothly; so none of the garment is inside the body, by construction.

use glam::DVec3;

use super::spec::{GarmentSpec, Sleeves, Support};
use crate::shapes::anatomy::{Anatomy, underbust_height};
use crate::shapes::body::DressForm;
use crate::shapes::fitting::ray;
use crate::shapes::jet::Jet;
use crate::shapes::solid::{Section, Solid, Sweep};

/// Least distance between the undraped garment and the body, m. The field is off by up to a third at the shoulders, and a mesh's
/// chords cut corners, so that 3 mm remain everywhere.
pub(super) const CLEARANCE: f64 = 0.007;
/// Width over which body and tubes are joined, m.
const BLEND: f64 = 0.03;
/// Exponent of the tubes' sections, near an ellipse.
const EXPONENT: f64 = 2.2;
/// What the tubes extend beyond their last opening, m, so that the opening cuts them cleanly.
const BEYOND: f64 = 0.08;

/// The uncut surface of a garment.
#[derive(Debug, Clone)]
pub(super) struct Cloth<'a> {
    form: &'a Anatomy,
    tube: Sweep,
    sleeve: Option<Sweep>,
    arms: bool,
    /// Height of the hem, m.
    pub(super) hem: f64,
    /// Height of the upper edge or of the shoulder at the neckline, m.
    pub(super) top: f64,
}

/// The part of the form under a garment, without the head.
struct Under<'a> {
    form: &'a Anatomy,
    arms: bool,
}

impl Solid for Under<'_> {
    fn at(&self, p: DVec3) -> Jet {
        let trunk = self.form.torso(p).smooth_min(self.form.legs(p), 0.035);
        if self.arms { trunk.smooth_min(self.form.arms(p), 0.045) } else { trunk }
    }
}

impl Solid for Cloth<'_> {
    fn at(&self, p: DVec3) -> Jet {
        let under = Under { form: self.form, arms: self.arms }.at(p) - CLEARANCE;
        let mut cloth = self.tube.at(p);
        if let Some(sleeve) = &self.sleeve {
            let mirror = DVec3::new(p.x.signum(), 1.0, 1.0);
            let arm = sleeve.at(p * mirror);
            cloth = cloth.smooth_min(Jet::new(arm.value, arm.gradient * mirror), 0.04);
        }
        cloth.smooth_min(under, BLEND)
    }
}

impl<'a> Cloth<'a> {
    pub(super) fn new(spec: &GarmentSpec, form: &'a DressForm) -> Self {
        let (m, anatomy) = (&form.measures, &form.anatomy);
        let arms = spec.carried_by == Support::Shoulders;
        let top = match (spec.carried_by, &spec.neckline) {
            (Support::Shoulders, Some(neckline)) => shoulder_top(anatomy, neckline.width_cm / 200.0, m.acromion),
            _ => m.waist_height,
        };
        let hem = top - spec.length_cm / 100.0;
        let tube = tube(spec, form, hem);
        let sleeve = spec.sleeves.as_ref().map(|s| sleeve(s, anatomy, m.arm_length));
        Self { form: anatomy, tube, sleeve, arms, hem, top }
    }

    /// Centre of the tube at height `z`.
    pub(super) fn centre(&self, z: f64) -> DVec3 {
        self.tube.centre(z)
    }
}

/// Height of the shoulder at `x` from the middle, with the clearance, m.
fn shoulder_top(anatomy: &Anatomy, x: f64, acromion: f64) -> f64 {
    let origin = DVec3::new(x, anatomy.trunk.centre(acromion).y, acromion - 0.08);
    origin.z + ray(&Under { form: anatomy, arms: true }, origin, DVec3::Z, 0.08) + CLEARANCE
}

/// Breadth and depths of trunk and legs at height `z` around the trunk's axis: [c_u, c_v, a, b₋, b₊], m.
fn extents(anatomy: &Anatomy, z: f64, lowest: f64) -> Section {
    let z = z.max(lowest);
    let under = Under { form: anatomy, arms: false };
    let centre = anatomy.trunk.centre(z);
    let reach = |direction: DVec3| ray(&under, centre, direction, 0.11);
    // Between the breasts and between the buttocks the body is nearer than what a tape touches: look to the sides too.
    let deep = |sign: f64| {
        [0.0, 0.04, 0.07]
            .iter()
            .map(|&x| ray(&under, centre + DVec3::new(x, 0.0, 0.0), DVec3::new(0.0, sign, 0.0), 0.1))
            .fold(0.0, f64::max)
    };
    [0.0, centre.y, reach(DVec3::X), deep(-1.0), deep(1.0)]
}

/// Perimeter of a superellipse with two depths, m.
fn perimeter([_, _, a, front, back]: Section) -> f64 {
    let point = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / 96.0;
        let (s, c) = angle.sin_cos();
        let b = if s < 0.0 { front } else { back };
        glam::DVec2::new(a * c.signum() * c.abs().powf(2.0 / EXPONENT), b * s.signum() * s.abs().powf(2.0 / EXPONENT))
    };
    (0..96).map(|i| point(i).distance(point(i + 1))).sum()
}

fn widened(section: Section, by: f64) -> Section {
    let [cu, cv, a, front, back] = section;
    [cu, cv, a + by, front + by, back + by]
}

/// The section widened evenly to a girth, but at least by the clearance.
fn with_girth(section: Section, girth: f64) -> Section {
    let mut by = 0.0;
    for _ in 0..20 {
        by += (girth - perimeter(widened(section, by))) / std::f64::consts::TAU;
    }
    widened(section, by.max(CLEARANCE))
}

/// Skirt and bodice: from beyond the hem up to the armpits, or to above the waist.
fn tube(spec: &GarmentSpec, form: &DressForm, hem: f64) -> Sweep {
    let (m, anatomy) = (&form.measures, &form.anatomy);
    let ease = &spec.ease;
    let section = |z: f64, girth: f64| with_girth(extents(anatomy, z, m.crotch + 0.03), girth);
    let flare = spec.flare_cm / 100.0;
    let waist = section(m.waist_height, m.waist + ease.waist_cm / 100.0);
    let hip = section(m.hip_height, m.hip + ease.hip_cm / 100.0);
    let mut stations: Vec<(f64, Section)> = Vec::new();
    // From `from` at `z0` the section opens linearly to a round one with the hem's girth.
    let open = |from: Section, z0: f64, stations: &mut Vec<(f64, Section)>| {
        let girth = perimeter(from) + flare;
        let round = girth / std::f64::consts::TAU;
        let low = hem - BEYOND;
        for i in 0..5 {
            let z = low + (z0 - low) * f64::from(i) / 5.0;
            let t = (z0 - z) / (z0 - hem);
            // The more flare, the rounder the hem.
            let target: [f64; 3] = if flare > 0.3 {
                [round, round, round]
            } else {
                [
                    from[2] + flare / std::f64::consts::TAU,
                    from[3] + flare / std::f64::consts::TAU,
                    from[4] + flare / std::f64::consts::TAU,
                ]
            };
            let part = |i: usize| from[i + 2] + t * (target[i] - from[i + 2]);
            stations.push((z, [0.0, from[1], part(0), part(1), part(2)]));
        }
    };
    if spec.carried_by == Support::Waist {
        open(waist, m.waist_height, &mut stations);
        stations.push((m.waist_height, waist));
        stations.push((m.waist_height + 0.04, waist));
        return Sweep::upright(EXPONENT, &stations, [0.005, 0.005]);
    }
    if hem < m.hip_height - 0.10 {
        open(hip, m.hip_height - 0.02, &mut stations);
    } else {
        stations.push((hem.min(m.hip_height) - BEYOND, hip));
    }
    let under_z = underbust_height(m);
    let bust = section(m.bust_height, m.bust + ease.bust_cm / 100.0);
    let mut underbust = section(under_z, m.underbust + 0.5 * (ease.bust_cm + ease.waist_cm) / 100.0);
    // Cloth hangs off the bust: below it, it comes back only part of the way.
    underbust[3] = underbust[3].max(0.5 * (underbust[3] + bust[3]));
    let axilla = section(m.axilla - 0.01, 0.5 * (m.bust + m.underbust) + (ease.bust_cm + 4.0) / 100.0);
    stations.extend([
        (m.hip_height, hip),
        (m.waist_height, waist),
        (under_z, underbust),
        (m.bust_height, bust),
        (m.axilla - 0.01, axilla),
        (m.axilla + 0.025, widened(axilla, -0.006)),
    ]);
    Sweep::upright(EXPONENT, &stations, [0.005, 0.02])
}

/// The left sleeve.
fn sleeve(s: &Sleeves, anatomy: &Anatomy, arm_length: f64) -> Sweep {
    let end = sleeve_end(s, anatomy, arm_length);
    let (upper, lower) = (s.ease_cm / 100.0 / std::f64::consts::TAU, s.cuff_ease_cm / 100.0 / std::f64::consts::TAU);
    let stations: Vec<(f64, Section)> = (0..10)
        .map(|i| {
            let t = 0.03 + (end + BEYOND - 0.03) * f64::from(i) / 9.0;
            // Past the wrist the sleeve does not widen with the hand.
            let [cu, cv, a, below, above] = anatomy.arm.section(t.min(anatomy.wrist_at));
            let by = upper + (lower - upper) * (t / end).min(1.0);
            let round = 0.5 * (a + 0.5 * (below + above));
            let soft = |r: f64| 0.5 * (r + round) + by;
            (t, [cu, cv, soft(a), soft(below), soft(above)])
        })
        .collect();
    anatomy.arm.with_stations(&stations, [0.01, 0.005])
}

/// Where along the arm's axis a sleeve ends, m.
pub(super) fn sleeve_end(s: &Sleeves, anatomy: &Anatomy, arm_length: f64) -> f64 {
    anatomy.wrist_at - (1.0 - s.length) * arm_length
}
