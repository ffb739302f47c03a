//! The openings of a garment as implicit regions: h > 0 where cloth is removed, h approximately a distance in metres.

use glam::DVec3;

use super::cloth::{Cloth, sleeve_end};
use super::spec::{GarmentSpec, Neckline, Support};
use crate::body::anatomy::Anatomy;
use crate::body::dress_form::DressForm;
use crate::body::jet::Jet;

/// Exponent of a neckline's outline: 2 is an ellipse, more is squarer.
const NECKLINE_EXPONENT: f64 = 2.2;
/// Half the width over which a neckline's depth changes from front to back, m: half the shoulder's thickness.
const SHOULDER_HALF: f64 = 0.035;

/// Distance of an armhole from the arm where it leaves the shoulder, m.
const ARMHOLE_ROOM: f64 = 0.03;
/// Depth of an armhole below the armpit, m. Nearer to the armpit the cloth follows the arm outward, and the lip that is left stands
/// out when it hangs.
const ARMHOLE_DEPTH: f64 = 0.05;

/// One opening.
#[derive(Debug, Clone)]
pub(super) enum Opening<'a> {
    /// Everything below a height.
    Hem(f64),
    /// Everything above a height.
    Waistband(f64),
    /// Around the neck.
    Neckline { half_width: f64, front: f64, back: f64, shoulder: DVec3 },
    /// Around each arm's root, without sleeves: beyond a slanted plane, near the arm.
    Armholes { form: &'a Anatomy, point: DVec3, normal: DVec3, radius: f64 },
    /// Around each arm: beyond a distance along it, near it.
    Cuffs { form: &'a Anatomy, end: f64, radius: f64 },
}

impl<'a> Opening<'a> {
    /// All openings of a garment, in the order of their tags from 1.
    pub(super) fn all(spec: &GarmentSpec, form: &'a DressForm, cloth: &Cloth<'_>) -> Vec<Self> {
        let (m, anatomy) = (&form.measures, &form.anatomy);
        let mut openings = vec![Self::Hem(cloth.hem)];
        if spec.carried_by == Support::Waist {
            openings.push(Self::Waistband(cloth.top));
            return openings;
        }
        if let Some(Neckline { width_cm, front_depth_cm, back_depth_cm }) = spec.neckline {
            let y = anatomy.trunk.centre(m.acromion_height).y;
            openings.push(Self::Neckline {
                half_width: width_cm / 200.0,
                front: front_depth_cm / 100.0,
                back: back_depth_cm / 100.0,
                shoulder: DVec3::new(0.0, y, cloth.top),
            });
        }
        if let Some(sleeves) = &spec.sleeves {
            let end = sleeve_end(sleeves, anatomy, m.arm_length);
            // The sleeve hangs below the arm by most of its ease; past its end nothing else may be this near.
            let [.., wide] = anatomy.arm.section(end);
            let radius = wide.max(0.045) + 1.75 * sleeves.cuff_ease_cm / 100.0 / std::f64::consts::TAU + 0.03;
            openings.push(Self::Cuffs { form: anatomy, end, radius });
        } else {
            let width = spec.neckline.map_or(0.18, |n| n.width_cm / 100.0);
            let strap = spec.strap_cm.unwrap_or(4.0) / 100.0;
            let upper = DVec3::new(0.5 * width + strap, 0.0, cloth.top);
            let chest = anatomy.trunk.section(m.axilla_height)[2];
            let along = DVec3::new(chest, 0.0, m.axilla_height - ARMHOLE_DEPTH) - upper;
            let normal = DVec3::new(-along.z, 0.0, along.x).normalize();
            let root = anatomy.arm.section(0.06 * m.scale());
            let radius = root[2].max(root[3]) + ARMHOLE_ROOM;
            openings.push(Self::Armholes { form: anatomy, point: upper, normal, radius });
        }
        openings
    }

    /// Name of the group of triangles along its edge.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Hem(_) => "hem",
            Self::Waistband(_) => "waistband",
            Self::Neckline { .. } => "neckline",
            Self::Armholes { .. } => "armholes",
            Self::Cuffs { .. } => "cuffs",
        }
    }

    /// h and its gradient.
    pub(super) fn at(&self, p: DVec3) -> Jet {
        let mirror = DVec3::new(p.x.signum(), 1.0, 1.0);
        let left = p * mirror;
        match self {
            Self::Hem(z) => Jet::constant(*z) - Jet::new(p.z, DVec3::Z),
            Self::Waistband(z) => Jet::new(p.z - z, DVec3::Z),
            Self::Neckline { half_width, front, back, shoulder } => {
                // Over the shoulder the depth changes from front to back by the smooth step 3s² − 2s³.
                let s = ((p.y - shoulder.y) / (2.0 * SHOULDER_HALF) + 0.5).clamp(0.0, 1.0);
                let slope = 6.0 * s * (1.0 - s) / (2.0 * SHOULDER_HALF);
                let depth =
                    Jet::new(front + (back - front) * s * s * (3.0 - 2.0 * s), (back - front) * slope * DVec3::Y);
                let below = if p.z < shoulder.z {
                    Jet::new(shoulder.z - p.z, -DVec3::Z).over(depth)
                } else {
                    Jet::constant(0.0)
                };
                let x = Jet::new(p.x / half_width, DVec3::X / *half_width);
                let n = NECKLINE_EXPONENT;
                let r = (x.abs_powf(n) + below.abs_powf(n)).abs_powf(1.0 / n);
                (-r + 1.0) * half_width.min(front.min(*back))
            }
            Self::Armholes { form, point, normal, radius } => {
                let beyond = Jet::new((left - *point).dot(*normal), *normal * mirror);
                let off_axis = off_arm(form, left, mirror);
                -((-beyond).smooth_max(off_axis - *radius, 0.05))
            }
            Self::Cuffs { form, end, radius } => {
                let along = form.arm.along(left) - end;
                let near = -off_arm(form, left, mirror) + *radius;
                if along < near.value { Jet::new(along, form.arm.direction() * mirror) } else { near }
            }
        }
    }
}

/// Distance from the left arm's axis, m; the gradient is that of the mirrored point.
fn off_arm(form: &Anatomy, left: DVec3, mirror: DVec3) -> Jet {
    let away = left - form.arm.centre(form.arm.along(left));
    Jet::new(away.length(), away.normalize_or_zero() * mirror)
}
