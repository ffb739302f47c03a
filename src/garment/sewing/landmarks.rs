//! Landmarks of a standing body, found from its shape: middle, neck, bust, waist, hip, crotch, armpits and arms.
//!
//! The body is cut by horizontal planes a centimetre apart. The curve around the middle is the trunk (or the neck, or the head);
//! curves beside it above the crotch are arms. The neck is the smallest girth of the top fifth, the shoulder's neck end the first
//! height below it where the curve is [`SPREAD`] times as wide, the waist the smallest girth between crotch and armpit, hip and
//! bust the largest below and above it. Arms are straight lines through the centres of their curves. The front is perpendicular to the
//! trunk's wider direction, on the side on which each foot extends farther from its own ankle. A foot that steps ahead of the other
//! does not change it.
//!
//! Limits: for a body that stands upright with its legs apart or together and its arms free of the trunk. A landmark that is
//! not found is `None`, and nothing is moved to it.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use crate::base::math;
use crate::base::quantiles::extremes;
use crate::body::girth::{Plane, SectionLoop, section};
use crate::mesh::{TriMesh, box_about};

/// Distance between two planes, m.
const STEP: f64 = 0.01;
/// Tallest body that is searched, m; a taller one has a wrong unit and would be cut for hours.
const MAX_HEIGHT: f64 = 5.0;
/// Width of the curve at the start of the shoulder over that of the neck. A heuristic.
const SPREAD: f64 = 1.5;
/// Least girth of an arm, m; fingers have less.
const MIN_ARM_GIRTH: f64 = 0.1;
/// A garment whose top is farther below the armpits than this, m, has no shoulders to hang from.
const MIN_BELOW_ARMPITS: f64 = 0.03;

/// Least distance of an arm from the side of the trunk, m.
const MIN_BESIDE: f64 = 0.01;
/// Least number of curves of an arm.
const MIN_CURVES: usize = 6;

/// Height of a leg's curve above the ankle, and heights of the trunk's curves, as shares of the body's.
const ANKLE: f64 = 0.1;
const TRUNK: [f64; 2] = [0.52, 0.7];
/// Heights between which the crotch is searched, as shares of the body's.
const CROTCH: [f64; 2] = [0.25, 0.7];
/// Least excess of the trunk's extents in one direction over those in the other, both curves together, that excludes a front, and
/// least excess of a foot before its ankle over that behind it, as shares of the height. Heuristics: a trunk is 8 to 14 cm wider
/// than deep at each height, and a foot 8 to 12 cm longer before the ankle.
const MIN_FLATNESS: f64 = 0.03;
const MIN_TOES: f64 = 0.015;

/// Landmarks of a standing body, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Landmarks {
    /// Middle of the trunk in x and y.
    pub middle: DVec2,
    /// Angle from −y to the front, radians, a multiple of a right angle.
    pub facing: f64,
    /// Height of the shoulder's neck end.
    pub shoulder_z: Option<f64>,
    /// Height of the smallest girth of the trunk.
    pub waist_z: Option<f64>,
    /// Height of the largest girth between crotch and waist.
    pub hip_z: Option<f64>,
    /// Height of the largest girth between waist and armpits.
    pub bust_z: Option<f64>,
    /// Height of the armpits: where the arms' curves join the trunk's.
    pub armpit_z: Option<f64>,
    /// Angle of the arms below the horizontal, radians.
    pub arm_fall: Option<f64>,
    /// Heights, and half the width of the trunk at each.
    trunk: Vec<(f64, f64)>,
}

/// The curves in one plane.
struct Level {
    z: f64,
    /// The curve around the middle.
    trunk: Option<SectionLoop>,
    /// Centre of the largest curve on each side, if it is an arm.
    beside: [Option<DVec3>; 2],
}

impl Landmarks {
    /// Finds the landmarks of a body.
    #[must_use]
    pub fn of(body: &TriMesh) -> Self {
        Self::of_facing(body, None)
    }

    /// Finds the landmarks of a body that faces along `front`, found from its shape where it is not given.
    pub(super) fn of_facing(body: &TriMesh, front: Option<DVec2>) -> Self {
        let (low, high) = body.bounds().unwrap_or_default();
        let height = high.z - low.z;
        let middle = middle(body, low.z, height);
        let facing = front.map_or_else(|| facing(body, low.z, height), quarter_turn);
        // From the body's right to its left.
        let across = math::unit(facing);
        let count = if height <= MAX_HEIGHT { (height / STEP) as usize } else { 0 };
        let levels: Vec<Level> = (1..count).map(|i| level(body, low.z + STEP * i as f64, middle, across)).collect();
        let between = |from: f64, to: f64| {
            levels.iter().filter(move |l| l.z >= low.z + from * height && l.z <= low.z + to * height)
        };
        let girths = |from: f64, to: f64| between(from, to).filter_map(|l| Some((l.trunk.as_ref()?.tape_length(), l)));
        let narrowest = |from: f64, to: f64| girths(from, to).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, l)| l);
        let widest_z = |from: f64, to: f64| girths(from, to).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, l)| l.z);
        let crotch = between(CROTCH[0], CROTCH[1]).find(|l| l.trunk.is_some()).map(|l| (l.z - low.z) / height);
        let width = |l: &Level| l.trunk.as_ref().map_or(0.0, |c| extent(c, across));
        let neck = narrowest(0.78, 0.95);
        let shoulder_z = neck.and_then(|neck| {
            let wide = SPREAD * width(neck);
            levels.iter().rev().find(|l| l.z < neck.z && width(l) > wide).map(|l| l.z)
        });
        let top = shoulder_z.unwrap_or(low.z + 0.8 * height);
        let from = crotch.unwrap_or(0.45);
        let arms: Vec<&Level> =
            between(from, 1.0).filter(|l| l.z < top && l.beside.iter().all(Option::is_some)).collect();
        let armpit_z = arms.last().filter(|_| arms.len() >= MIN_CURVES).map(|l| l.z);
        let arm_fall = armpit_z.and_then(|_| arm_fall(&arms, across));
        let waist_to = armpit_z.map_or(0.7, |z| (z - low.z) / height - 0.03);
        let waist_z = narrowest(from + 0.06, waist_to).map(|l| l.z);
        let share = |z: f64| (z - low.z) / height;
        let hip_z = waist_z.and_then(|waist| widest_z(from, share(waist)));
        let bust_z = waist_z.zip(armpit_z).and_then(|(waist, armpit)| widest_z(share(waist), share(armpit)));
        let half = |l: &Level| Some((l.z, extent_from(l.trunk.as_ref()?, middle, across)));
        let trunk = levels.iter().filter(|l| l.z < armpit_z.unwrap_or(top)).filter_map(half).collect();
        Self { middle, facing, shoulder_z, waist_z, hip_z, bust_z, armpit_z, arm_fall, trunk }
    }

    /// Heights at which the trunk was found, below the armpits, m.
    pub(super) fn trunk_heights(&self) -> impl Iterator<Item = f64> + '_ {
        self.trunk.iter().map(|(z, _)| *z)
    }

    /// The trunk's curve at the height `z`, m.
    pub(super) fn trunk_at(&self, body: &TriMesh, z: f64) -> Option<SectionLoop> {
        level(body, z, self.middle, math::unit(self.facing)).trunk
    }

    /// Whether a garment with its top at this height, m, has no shoulders to hang from.
    pub(super) fn is_below_armpits(&self, top_z: f64) -> bool {
        self.below_armpits_z().is_some_and(|z| top_z <= z)
    }

    /// The greatest height at which a garment hangs below the armpits, m.
    pub(super) fn below_armpits_z(&self) -> Option<f64> {
        self.armpit_z.or(self.shoulder_z).map(|armpit| armpit - MIN_BELOW_ARMPITS)
    }

    /// Distance from the middle across the body at which the arms begin, m: half the width of the trunk below the armpits.
    pub(super) fn arms_from(&self) -> Option<f64> {
        self.armpit_z.and_then(|_| self.trunk.last()).map(|(_, half)| *half)
    }

    /// Whether a point of the body (m) is of an arm: beside the trunk, or above the armpits beyond where the arms begin.
    pub(super) fn is_of_arm(&self, p: &DVec3) -> bool {
        let (Some(armpit), Some(&(lowest, at_crotch))) = (self.armpit_z, self.trunk.first()) else { return false };
        let aside = (p.truncate() - self.middle).dot(math::unit(self.facing)).abs();
        let hips = || self.trunk.iter().fold(at_crotch, |w, (_, half)| w.max(*half));
        let at = |z: f64| self.trunk.get(((z - lowest) / STEP).round() as usize).map(|t| t.1);
        let half = if p.z >= armpit {
            self.arms_from()
        } else if p.z < lowest {
            None
        } else {
            at(p.z)
        };
        aside > half.unwrap_or_else(hips) + MIN_BESIDE
    }

    /// The body without its arms, open where they were, for garments that hang between the arms. `None` where no arms were found.
    pub(super) fn without_arms(&self, body: &TriMesh) -> Option<TriMesh> {
        let armpit = self.armpit_z?;
        let arm: Vec<bool> = body.positions.iter().map(|p| p.z < armpit && self.is_of_arm(p)).collect();
        let kept = |t: &&[u32; 3]| !t.iter().any(|&v| arm[v as usize]);
        Some(TriMesh::new(body.positions.clone(), body.triangles.iter().filter(kept).copied().collect()))
    }
}

/// Height at which two legs join, m: the lowest curve around the middle of a body that stands on two. `None` for a body without legs, with
/// legs that touch, or too tall to be searched.
pub(crate) fn crotch_z(body: &TriMesh) -> Option<f64> {
    let (low, high) = body.bounds()?;
    let height = high.z - low.z;
    if height > MAX_HEIGHT {
        return None;
    }
    let (middle, [from, to]) = (middle(body, low.z, height), CROTCH.map(|share| low.z + share * height));
    let across = math::unit(facing(body, low.z, height));
    let level_at = |z: f64| level(body, z, middle, across);
    let on_two_legs = |level: Level| level.trunk.is_none() && level.beside.iter().all(Option::is_some);
    let mut heights = (1..).map(|i| from + STEP * f64::from(i)).take_while(|z| *z <= to);
    if on_two_legs(level_at(from)) { heights.find(|&z| level_at(z).trunk.is_some()) } else { None }
}

/// Centre of the largest curve a little above half the height, in x and y.
fn middle(body: &TriMesh, low: f64, height: f64) -> DVec2 {
    let curves = section(body, Plane::horizontal(low + 0.6 * height));
    let largest = curves.into_iter().filter(|c| c.closed).max_by(|a, b| a.length().total_cmp(&b.length()));
    let box_of = |c: SectionLoop| {
        let (low, high) = box_about(c.points);
        (0.5 * (low + high)).truncate()
    };
    largest.map_or(DVec2::ZERO, box_of)
}

/// Angle from −y to the front, as the nearest quarter turn, radians.
///
/// A leg's axis is the centre of its curve above the ankle. A foot reaches some 17 cm ahead of it and 6 cm behind, in any stance.
fn facing(body: &TriMesh, low: f64, height: f64) -> f64 {
    let at = |share: f64| section(body, Plane::horizontal(low + share * height)).into_iter().filter(|c| c.closed);
    let legs: Vec<DVec2> = at(ANKLE).filter(|c| c.length() > MIN_ARM_GIRTH).map(|c| c.centre().truncate()).collect();
    let below: Vec<DVec2> =
        body.positions.iter().filter(|p| p.z < low + ANKLE * height).map(|p| p.truncate()).collect();
    // Of the trunk, at the chest and at the hips, twice the excess of its extent along y over that along x.
    let trunk = TRUNK.iter().filter_map(|&share| at(share).max_by(|a, b| a.length().total_cmp(&b.length())));
    let deeper: f64 = trunk.map(|c| extent(&c, DVec2::Y) - extent(&c, DVec2::X)).sum();
    let mut best = (MIN_TOES * height, 0.0);
    for quarter in 0..4 {
        let angle = FRAC_PI_2 * f64::from(quarter);
        let ahead = math::unit(angle).rotate(DVec2::NEG_Y);
        let across = ahead.perp();
        // Along its wider direction the trunk does not face.
        if deeper * (ahead.y.abs() - ahead.x.abs()) > MIN_FLATNESS * height {
            continue;
        }
        // Ends of each foot before and behind its leg; the leg is the one nearest across the body.
        let mut ends = vec![[0.0_f64; 2]; legs.len()];
        for p in &below {
            let side = |leg: &DVec2| (*p - *leg).dot(across).abs();
            let own = (0..legs.len()).min_by(|&i, &j| side(&legs[i]).total_cmp(&side(&legs[j])));
            if let Some(own) = own {
                let along = (*p - legs[own]).dot(ahead);
                ends[own] = [ends[own][0].max(along), ends[own][1].max(-along)];
            }
        }
        let longer = ends.iter().map(|[before, behind]| before - behind).sum::<f64>() / legs.len().max(1) as f64;
        if longer > best.0 {
            best = (longer, angle);
        }
    }
    quarter_turn(math::unit(best.1).rotate(DVec2::NEG_Y))
}

/// The angle from −y to a direction, as the nearest quarter turn, radians.
fn quarter_turn(ahead: DVec2) -> f64 {
    (math::atan2(DVec2::NEG_Y.perp_dot(ahead), DVec2::NEG_Y.dot(ahead)) / FRAC_PI_2).round() * FRAC_PI_2
}

/// Width of a curve, m.
fn extent(curve: &SectionLoop, across: DVec2) -> f64 {
    let (low, high) = extremes(curve.points.iter().map(|p| p.truncate().dot(across)));
    high - low
}

/// Distance of a curve's farther side from the middle, m.
fn extent_from(curve: &SectionLoop, middle: DVec2, across: DVec2) -> f64 {
    curve.points.iter().fold(0.0, |most: f64, p| most.max((p.truncate() - middle).dot(across).abs()))
}

fn level(body: &TriMesh, z: f64, middle: DVec2, across: DVec2) -> Level {
    let mut found = Level { z, trunk: None, beside: [None, None] };
    let mut girths = [MIN_ARM_GIRTH; 2];
    for curve in section(body, Plane::horizontal(z)).into_iter().filter(|c| c.closed) {
        let along = |p: &DVec3| (p.truncate() - middle).dot(across);
        let (low, high) = extremes(curve.points.iter().map(along));
        let length = curve.length();
        if low < 0.0 && high > 0.0 {
            if found.trunk.as_ref().is_none_or(|t| t.length() < length) {
                found.trunk = Some(curve);
            }
        } else {
            let side = usize::from(low > 0.0);
            if length > girths[side] {
                girths[side] = length;
                found.beside[side] = Some(curve.centre());
            }
        }
    }
    found
}

/// Mean angle of both arms below the horizontal, from their centres by least squares.
fn arm_fall(arms: &[&Level], across: DVec2) -> Option<f64> {
    let n = arms.len() as f64;
    let out = |l: &Level| {
        let [right, left] = l.beside;
        Some(0.5 * (left?.truncate().dot(across) - right?.truncate().dot(across)))
    };
    let points: Vec<(f64, f64)> = arms.iter().filter_map(|l| Some((out(l)?, l.z))).collect();
    let mean = points.iter().fold((0.0, 0.0), |(x, z), p| (x + p.0 / n, z + p.1 / n));
    let (mut square, mut mixed) = (0.0, 0.0);
    for (x, z) in points {
        square += (z - mean.1) * (z - mean.1);
        mixed += (x - mean.0) * (z - mean.1);
    }
    (square > 0.0).then(|| math::atan2(1.0, -mixed / square))
}
