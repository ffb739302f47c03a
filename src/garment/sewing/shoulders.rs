//! A garment mesh with open seams moved onto the shoulders and arms of this body.
//!
//! A seam that is placed inside a shoulder or an arm is closed on the side that is nearest to it, and a sleeve then hangs beside its arm. So
//! the garment is raised until its shoulders are as high as the body's; the lower of both sides decides. What is around an arm is then
//! moved perpendicular to it, in each step along it by
//!
//! f = 0 clamped to [b + g − t, a − g − u],
//!
//! or by the middle of these limits where the cloth is narrower than the arm.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, b | lower and upper side of the arm, from the line through the armpit along it | m |
//! | u, t | lower and upper end of the cloth, from the same line | m |
//! | g | distance of the cloth from the arm, [`GAP`] | m |
//!
//! Source: own. Limits: for straight arms of one slope. Cloth around an arm is what reaches across its middle, so a sleeve that is placed beside its
//! arm is left there.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::landmarks::Landmarks;
use crate::base::math;
use crate::mesh::TriMesh;

/// Where the height of a shoulder is measured: distances from the middle over that at which the arms begin. Beside the neck, its collar and a
/// hood. There twelve of GarmentCode's box meshes, one with a raised collar excepted, are 2.7 to 3.7 cm too low, on the body that they are made for.
const SHOULDER: Range<f64> = 0.7..0.9;

/// Heights by which a garment is raised, m. Cloth farther below a shoulder is not on it.
const RAISED: Range<f64> = 0.0..0.1;

/// Length of a step along the arm, m. A heuristic: a cuff is 5 to 10 cm long.
const STEP: f64 = 0.02;

/// g, m. A heuristic.
const GAP: f64 = 0.005;

/// Cloth farther below the armpit's line than this, m, is of the trunk. A heuristic.
const MAX_BELOW: f64 = 0.25;

/// Length over which the moves begin, m. A heuristic.
const FADE: f64 = 0.05;

/// An arm: coordinates along it and perpendicular to it.
struct Arm {
    middle: DVec2,
    /// Direction to the arm's side.
    out: DVec2,
    /// Distance from the middle at which it begins, m.
    from: f64,
    armpit_z: f64,
    /// Its direction, by distance aside and height.
    axis: DVec2,
}

/// A point beside the trunk: its distance aside from where the arms begin, along the arm from the armpit, and above that line, m.
struct Beside {
    aside: f64,
    along: f64,
    above: f64,
}

impl Arm {
    fn of(landmarks: &Landmarks, side: f64) -> Option<Self> {
        Some(Self {
            middle: landmarks.middle,
            out: side * math::unit(landmarks.facing),
            from: landmarks.arms_from()?,
            armpit_z: landmarks.armpit_z?,
            axis: math::unit(-landmarks.arm_fall?),
        })
    }

    fn aside(&self, x: &DVec3) -> f64 {
        (x.truncate() - self.middle).dot(self.out)
    }

    /// The largest height of points (m) at the shoulder.
    fn shoulder_z(&self, x: &[DVec3]) -> f64 {
        let on_it = x.iter().filter(|x| SHOULDER.contains(&(self.aside(x) / self.from)));
        on_it.fold(f64::NEG_INFINITY, |top, x| top.max(x.z))
    }

    /// A point (m) around the arm; `None` for one of the trunk.
    fn beside(&self, x: &DVec3) -> Option<Beside> {
        let aside = self.aside(x) - self.from;
        let from_armpit = DVec2::new(aside, x.z - self.armpit_z);
        let (along, above) = (from_armpit.dot(self.axis), self.axis.perp_dot(from_armpit));
        (aside > 0.0 && along > 0.0 && above > -MAX_BELOW).then_some(Beside { aside, along, above })
    }

    /// Lower and upper end, m, of points (m) in each step.
    fn ends<'a>(&self, x: impl Iterator<Item = &'a DVec3>) -> Vec<[f64; 2]> {
        let mut ends: Vec<[f64; 2]> = Vec::new();
        for Beside { along, above, .. } in x.filter_map(|x| self.beside(x)) {
            let step = (along / STEP) as usize;
            if ends.len() <= step {
                ends.resize(step + 1, [f64::INFINITY, f64::NEG_INFINITY]);
            }
            ends[step] = [ends[step][0].min(above), ends[step][1].max(above)];
        }
        ends
    }

    /// f in the middle of each step, m; where no cloth is around the arm, that of the step before.
    fn moves(&self, arm: &[[f64; 2]], cloth: &[[f64; 2]]) -> Vec<f64> {
        let mut moves = Vec::with_capacity(cloth.len());
        for ([a, b], [u, t]) in arm.iter().zip(cloth) {
            let (least, most, middle) = (b + GAP - t, a - GAP - u, 0.5 * (a + b));
            let is_around = *u < middle && middle < *t;
            moves.push(match is_around {
                true if least < most => 0.0_f64.clamp(least, most),
                true => 0.5 * (least + most),
                false => moves.last().copied().unwrap_or(0.0),
            });
        }
        moves
    }

    /// Moves the cloth around the arm.
    fn apply(&self, moves: &[f64], x: &mut DVec3) {
        let (Some(Beside { aside, along, above }), Some(last)) = (self.beside(x), moves.len().checked_sub(1)) else {
            return;
        };
        let place = (along / STEP - 0.5).clamp(0.0, last as f64);
        let first = place as usize;
        let f = moves[first] + (place - first as f64) * (moves[(first + 1).min(last)] - moves[first]);
        let share = (aside / FADE).min(1.0) * ((above + MAX_BELOW) / FADE).min(1.0);
        let moved = share * f * self.axis.perp();
        *x += (moved.x * self.out).extend(moved.y);
    }
}

/// A garment at `x` (m), moved onto the shoulders and arms of `body`; unchanged where no arms were found.
pub(super) fn moved_onto(x: &[DVec3], body: &TriMesh, landmarks: &Landmarks) -> Vec<DVec3> {
    let arms: Vec<Arm> = [-1.0, 1.0].iter().filter_map(|side| Arm::of(landmarks, *side)).collect();
    let below = arms.iter().map(|arm| arm.shoulder_z(&body.positions) - arm.shoulder_z(x));
    let raised = below.min_by(f64::total_cmp).filter(|raised| RAISED.contains(raised)).unwrap_or(0.0);
    let mut x: Vec<DVec3> = x.iter().map(|x| *x + raised * DVec3::Z).collect();
    for arm in &arms {
        let of_body = arm.ends(body.positions.iter().filter(|x| landmarks.is_of_arm(x)));
        let moves = arm.moves(&of_body, &arm.ends(x.iter()));
        x.iter_mut().for_each(|x| arm.apply(&moves, x));
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_garment_below_the_shoulders_with_sleeves_below_the_arms_is_moved_onto_both() {
        let body = crate::SceneSpec::new("form", "pullover-1@2000").load().unwrap().scene.body;
        let body = body.mesh();
        let landmarks = Landmarks::of(body);
        // A garment as tight as skin, 3 cm too low, beyond the elbow by another 2 cm perpendicular to the arm.
        let lowered = |x: &DVec3| {
            let arm = Arm::of(&landmarks, x.x.signum()).unwrap();
            let low = arm.beside(x).map_or(0.0, |at| (0.02 * (at.along - 0.1) / 0.1).clamp(0.0, 0.02));
            let moved = -low * arm.axis.perp();
            *x + (moved.x * arm.out).extend(moved.y - 0.03)
        };
        let garment: Vec<DVec3> = body.positions.iter().map(lowered).collect();
        let x = moved_onto(&garment, body, &landmarks);
        let mut on_arms = 0;
        for (x, own) in x.iter().zip(&body.positions) {
            let arm = Arm::of(&landmarks, own.x.signum()).unwrap();
            let off = x.distance(*own);
            match arm.beside(own) {
                Some(at) if at.along > 0.25 && landmarks.is_of_arm(own) => {
                    on_arms += 1;
                    // Cloth that is wide enough is moved just past the arm.
                    assert!(off < GAP + 1e-3, "{own}: {off}");
                }
                None => assert!(off < 1e-6, "{own}: {off}"),
                Some(_) => {}
            }
        }
        assert!(on_arms > 100, "{on_arms}");
    }

    #[test]
    fn cloth_that_does_not_reach_across_the_arm_is_left() {
        let landmarks =
            Landmarks::of(crate::SceneSpec::new("form", "pullover-1@2000").load().unwrap().scene.body.mesh());
        let arm = Arm::of(&landmarks, 1.0).unwrap();
        let of_arm = [[-0.04, 0.04]; 3];
        assert_eq!(arm.moves(&of_arm, &[[-0.3, -0.1]; 3]), [0.0; 3]);
        let moves = arm.moves(&of_arm, &[[-0.02, 0.1], [-0.3, -0.1], [-0.1, 0.06]]);
        assert!((moves[0] + 0.025).abs() < 1e-12 && moves[1] == moves[0] && moves[2] == 0.0, "{moves:?}");
    }
}
