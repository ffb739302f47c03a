//! A garment's surface before it is clipped: an offset surface of the body joined with the tubes of skirt, bodice and sleeves.
//!
//! The sections of the tubes are superellipses around the body's breadth and depths at each height, widened until their girth
//! is the body's plus the ease; below the hip they widen evenly by the flare. Where the body is nearer than [`CLEARANCE`], the
//! surface follows it smoothly at that distance, so no part of the garment is inside the body.

use glam::DVec3;

use super::spec::{GarmentSpec, Sleeves, Support};
use crate::base::math;
use crate::body::anatomy::{Anatomy, underbust_height};
use crate::body::dress_form::{DressForm, ray};
use crate::body::jet::Jet;
use crate::body::solid::{Profile, Section, Sided, Solid, Sweep};

/// Least distance between the undraped garment and the body, m. The field is wrong by up to a third at the shoulders, and the
/// mesh's chords are nearer than the surface, so that 3 mm remain everywhere.
pub(super) const CLEARANCE: f64 = 0.006;
/// Width of the smooth joint of body and tubes, m. A heuristic.
const BLEND: f64 = 0.015;
/// Exponent of the tubes' sections, near an ellipse.
const EXPONENT: f64 = 2.2;
/// Length of the tubes beyond their last opening, m, so that the opening cuts the tube and not its end.
const OVERLAP: f64 = 0.08;

/// The uncut surface of a garment.
#[derive(Debug, Clone)]
pub(super) struct Cloth<'a> {
    under: Under<'a>,
    tube: Sweep,
    sleeve: Option<Sweep>,
    /// Height of the hem, m.
    pub(super) hem: f64,
    /// Height of the upper edge or of the shoulder at the neckline, m.
    pub(super) top: f64,
}

/// The part of the form under a garment, without the head.
#[derive(Debug, Clone)]
struct Under<'a> {
    form: &'a Anatomy,
    arms: bool,
}

impl Solid for Under<'_> {
    fn at(&self, p: DVec3) -> Jet {
        if self.arms { self.form.below_the_head(p) } else { self.form.torso_and_legs(p) }
    }
}

impl Solid for Cloth<'_> {
    fn at(&self, p: DVec3) -> Jet {
        let mut cloth = self.tube.at(p);
        if let Some(sleeve) = &self.sleeve {
            cloth = Sided::new(sleeve, p.x).join(cloth, p, 0.05);
        }
        cloth.smooth_min(self.under.at(p) - CLEARANCE, BLEND)
    }
}

impl<'a> Cloth<'a> {
    pub(super) fn new(spec: &GarmentSpec, form: &'a DressForm) -> Self {
        let (m, anatomy) = (&form.measures, &form.anatomy);
        let arms = spec.carried_by == Support::Shoulders;
        let top = match (spec.carried_by, &spec.neckline) {
            (Support::Shoulders, Some(neckline)) => shoulder_top(anatomy, neckline.width_cm / 200.0, m.acromion_height),
            _ => m.waist_height,
        };
        let hem = top - spec.length_cm / 100.0;
        let tube = tube(spec, form, hem);
        let sleeve = spec.sleeves.as_ref().map(|s| sleeve(s, anatomy, m.arm_length));
        Self { under: Under { form: anatomy, arms }, tube, sleeve, hem, top }
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
    // A tape spans the hollows between the breasts and between the buttocks, so the depth is the greatest of three.
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
        let (s, c) = math::sin_cos(angle);
        let b = if s < 0.0 { front } else { back };
        glam::DVec2::new(
            a * c.signum() * math::powf(c.abs(), 2.0 / EXPONENT),
            b * s.signum() * math::powf(s.abs(), 2.0 / EXPONENT),
        )
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

/// The section scaled until the body at height `z` lies inside it with the clearance.
fn around(section: Section, anatomy: &Anatomy, z: f64) -> Section {
    let [cu, cv, a, front, back] = section;
    let under = Under { form: anatomy, arms: false };
    let centre = anatomy.trunk.centre(z);
    let mut scale: f64 = 1.0;
    for i in 0..24 {
        let (sin, cos) = math::sin_cos(std::f64::consts::TAU * f64::from(i) / 24.0);
        let r = CLEARANCE + ray(&under, centre, DVec3::new(cos, sin, 0.0), 0.11);
        let (x, y) = (r * cos - cu, centre.y + r * sin - cv);
        let b = if y < 0.0 { front } else { back };
        let level = math::powf((x / a).abs(), EXPONENT) + math::powf((y / b).abs(), EXPONENT);
        scale = scale.max(math::powf(level, 1.0 / EXPONENT));
    }
    [cu, cv, scale * a, scale * front, scale * back]
}

/// Stations of a skirt from beyond the hem up to just below `from` at height `z0`. Its girth grows linearly by the flare, and
/// the hem is rounder with more flare.
fn skirt(from: Section, z0: f64, hem: f64, flare: f64) -> Vec<(f64, Section)> {
    let round = (perimeter(from) + flare) / std::f64::consts::TAU;
    // A flare of 60 cm makes the hem a circle; with less it keeps part of the body's oval.
    let roundness = (flare / 0.6).min(1.0);
    let low = hem - OVERLAP;
    (0..5)
        .map(|i| {
            let z = low + (z0 - low) * f64::from(i) / 5.0;
            let t = (z0 - z) / (z0 - hem);
            let part = |i: usize| {
                let oval = from[i] + flare / std::f64::consts::TAU;
                from[i] + t * (oval + roundness * (round - oval) - from[i])
            };
            (z, [0.0, from[1], part(2), part(3), part(4)])
        })
        .collect()
}

/// Skirt and bodice: from beyond the hem up to the armpits, or to above the waist.
fn tube(spec: &GarmentSpec, form: &DressForm, hem: f64) -> Sweep {
    let (m, anatomy) = (&form.measures, &form.anatomy);
    let ease = &spec.ease;
    let section = |z: f64, girth: f64| with_girth(extents(anatomy, z, m.crotch_height + 0.03), girth);
    let flare = spec.flare_cm / 100.0;
    let waist = section(m.waist_height, m.waist + ease.waist_cm / 100.0);
    // Hip and seat stay inside, so that the cloth falls over them.
    let hip = around(section(m.hip_height, m.hip + ease.hip_cm / 100.0), anatomy, m.hip_height);
    if spec.carried_by == Support::Waist {
        // A straight line from waist to hem, except where hip or seat are wider.
        let seat_z = m.hip_height + 0.035;
        let line = skirt(waist, m.waist_height, hem, flare);
        let straight = Profile::new(&[line[0], (m.waist_height, waist)]);
        let widest = |z: f64, body: Section| -> (f64, Section) {
            let plain = straight.values(z);
            (z, std::array::from_fn(|i| if i < 2 { plain[i] } else { plain[i].max(body[i]) }))
        };
        let (_, seat) = widest(seat_z, around(hip, anatomy, seat_z));
        let grown = perimeter(seat) - perimeter(waist);
        let mut stations = skirt(seat, seat_z, hem, (flare - grown).max(0.0));
        // The high hip is a little over half the way from the hip up to the waist.
        let high = m.hip_height + (m.waist_height - m.hip_height) * 0.6;
        stations.extend([(seat_z, seat), widest(high, around(straight.values(high), anatomy, high))]);
        stations.extend([(m.waist_height, waist), (m.waist_height + 0.04, waist)]);
        return Sweep::upright(EXPONENT, &stations, [0.005, 0.005]);
    }
    let mut stations = if hem < m.hip_height - 0.10 {
        skirt(hip, m.hip_height - 0.02, hem, flare)
    } else {
        vec![(hem.min(m.hip_height) - OVERLAP, hip)]
    };
    let under_z = underbust_height(m);
    let bust = section(m.bust_height, m.bust + ease.bust_cm / 100.0);
    let mut underbust = section(under_z, m.underbust + 0.5 * (ease.bust_cm + ease.waist_cm) / 100.0);
    // Cloth hangs from the bust: below it the tube narrows only part of the way.
    underbust[3] = underbust[3].max(0.5 * (underbust[3] + bust[3]));
    let axilla_z = m.axilla_height - 0.01;
    let axilla = section(
        axilla_z,
        0.5 * (m.bust + m.underbust) + (ease.bust_cm + if spec.sleeves.is_some() { 4.0 } else { 0.0 }) / 100.0,
    );
    stations.extend([
        (m.hip_height, hip),
        (m.waist_height, waist),
        (under_z, underbust),
        (m.bust_height, bust),
        (axilla_z, axilla),
        (axilla_z + 0.035, widened(axilla, -0.006)),
    ]);
    Sweep::upright(EXPONENT, &stations, [0.005, 0.02])
}

/// The left sleeve.
fn sleeve(s: &Sleeves, anatomy: &Anatomy, arm_length: f64) -> Sweep {
    let end = sleeve_end(s, anatomy, arm_length);
    let (upper, lower) = (s.ease_cm / 100.0 / std::f64::consts::TAU, s.cuff_ease_cm / 100.0 / std::f64::consts::TAU);
    let stations: Vec<(f64, Section)> = (0..10)
        .map(|i| {
            let t = 0.03 + (end + OVERLAP - 0.03) * f64::from(i) / 9.0;
            // Past the wrist the sleeve does not widen with the hand.
            let [cu, cv, a, below, above] = anatomy.arm.section(t.min(anatomy.wrist_at));
            let by = upper + (lower - upper) * (t / end).min(1.0);
            let round = 0.5 * (a + 0.5 * (below + above));
            let soft = |r: f64| 0.5 * (r + round) + by;
            // It touches the arm on top and hangs below it, so that its head is close to the shoulder.
            (t, [cu - 0.75 * (by - CLEARANCE), cv, soft(a), soft(below), soft(above)])
        })
        .collect();
    anatomy.arm.with_stations(&stations, [0.01, 0.005])
}

/// Coordinate along the arm's axis at which a sleeve ends, m.
pub(super) fn sleeve_end(s: &Sleeves, anatomy: &Anatomy, arm_length: f64) -> f64 {
    anatomy.wrist_at - (1.0 - s.length) * arm_length
}
