//! Panels moved from the placement in the file to this body.
//!
//! A pattern is placed for one body. For another one the garment moves up or down until its shoulder seams (or its waist, where
//! it has none) are at the body's, sleeves turn to the slope of the arms, and all panels turn to the body's front.

use glam::{DVec2, DVec3};

use super::landmarks::Landmarks;
use crate::base::math;
use crate::garment::pattern::{EdgeAt, PatternPanel, SewingPattern};

/// Height of a waist above the body's smallest girth, m, as GarmentCode has it on its own body.
const ABOVE_WAIST: f64 = -0.022;

/// Largest distance of a shoulder seam below the armpits, m; a seam below that is the side of a circle skirt.
const MAX_BELOW_ARMPITS: f64 = 0.1;

/// Smallest shift, m, and turn of the sleeves, radians, that are applied; below, the file's placement is more accurate than the
/// landmarks.
const MIN_SHIFT: f64 = 0.02;
const MIN_TURN: f64 = 0.05;

/// Least turn of a sleeve's plane about the front axis, radians.
const MIN_SLEEVE_TURN: f64 = 0.15;

/// The moves of the panels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Arranged {
    /// Upwards, m.
    pub raised: f64,
    /// Sleeves, downwards, radians.
    pub sleeves: f64,
    /// All of it about the vertical, radians.
    pub turned: f64,
}

/// For each panel that is a sleeve, its angle below the horizontal, radians.
fn sleeves(pattern: &SewingPattern) -> Vec<Option<f64>> {
    let of = |panel: &PatternPanel| {
        let along = panel.rotation * DVec3::X;
        let fall = math::atan2(along.z.abs(), math::hypot(along.x, along.y));
        // A hood's panels are turned about the vertical, which leaves their x level.
        (fall > MIN_SLEEVE_TURN).then_some(fall)
    };
    pattern.panels.iter().map(of).collect()
}

/// Mean of the placed points of an edge, m, and their greatest height.
fn placed(pattern: &SewingPattern, at: EdgeAt) -> (DVec3, f64) {
    let points = pattern.edge(at).curve.divided(8);
    let placed: Vec<DVec3> = points.iter().map(|p| pattern.panels[at.panel].place(*p)).collect();
    let top = placed.iter().fold(f64::NEG_INFINITY, |top, p| top.max(p.z));
    (placed.iter().sum::<DVec3>() / placed.len() as f64, top)
}

/// Height of the neck end of the pattern's shoulder seams, m. They are at most [`MAX_BELOW_ARMPITS`] below the armpits.
fn shoulder_height(pattern: &SewingPattern, sleeves: &[Option<f64>], armpit_z: f64) -> Option<f64> {
    // Shoulder seams join front and back, neither of them a sleeve, and run across the body more than down it.
    let mut shoulder_z: Option<f64> = None;
    for stitch in &pattern.stitches {
        let [a, b] = stitch.sides;
        let (front, back) = (placed(pattern, a), placed(pattern, b));
        let faces = |i: usize| sleeves[i].is_none() && (pattern.panels[i].rotation * DVec3::Z).y.abs() > 0.9;
        let span = pattern.edge(a).curve.end() - pattern.edge(a).curve.start();
        if faces(a.panel) && faces(b.panel) && front.0.y * back.0.y < 0.0 && span.x.abs() > span.y.abs() {
            let top = 0.5 * (front.1 + back.1);
            shoulder_z = Some(shoulder_z.map_or(top, |z| z.max(top)));
        }
    }
    shoulder_z.filter(|z| *z > armpit_z - MAX_BELOW_ARMPITS)
}

/// Height of the pattern's waist, m: edges labelled `lower_interface`, or the top of a garment without shoulders.
fn waist_height(pattern: &SewingPattern) -> f64 {
    let mut waist = Vec::new();
    let mut top = f64::NEG_INFINITY;
    for (panel, of) in pattern.panels.iter().enumerate() {
        for (edge, e) in of.edges.iter().enumerate() {
            let (mean, highest) = placed(pattern, EdgeAt { panel, edge });
            top = top.max(highest);
            if e.label.as_deref() == Some("lower_interface") {
                waist.push(mean.z);
            }
        }
    }
    if waist.is_empty() { top } else { waist.iter().sum::<f64>() / waist.len() as f64 }
}

/// Moves the panels to a body; returns the moves and whether the garment has shoulder seams.
///
/// Shoulder seams are placed at the shoulder's neck end, so that the garment comes down on its shoulders. GarmentCode's placement
/// on its own body is 3.8 cm lower, and six patterns closed from there are stretched half as much again.
pub(super) fn arrange(pattern: &mut SewingPattern, body: &Landmarks) -> (Arranged, bool) {
    let armpit_z = body.armpit_z.or(body.shoulder_z).unwrap_or(f64::INFINITY);
    let sleeves = sleeves(pattern);
    let shoulder_z = shoulder_height(pattern, &sleeves, armpit_z);
    let falls: Vec<f64> = sleeves.into_iter().flatten().collect();
    let mut done = Arranged::default();
    let raised = match (shoulder_z, body.shoulder_z, body.waist_z) {
        (Some(own), Some(shoulder), _) => shoulder - own,
        (None, _, Some(waist)) => waist + ABOVE_WAIST - waist_height(pattern),
        _ => 0.0,
    };
    if raised.abs() > MIN_SHIFT {
        done.raised = raised;
    }
    // Without sleeves the mean is not a number, and nothing turns.
    let turn = body.arm_fall.map_or(0.0, |arms| arms - falls.iter().sum::<f64>() / falls.len() as f64);
    if turn.abs() > MIN_TURN {
        done.sleeves = turn;
        turn_sleeves(pattern, turn);
    }
    done.turned = body.facing;
    let turn = math::rotation(DVec3::Z, body.facing);
    for panel in &mut pattern.panels {
        panel.rotation = turn * panel.rotation;
        panel.translation = turn * panel.translation + body.middle.extend(done.raised);
    }
    (done, shoulder_z.is_some())
}

/// Turns each side's sleeves downwards about the middle of the edges that join them to the bodice.
fn turn_sleeves(pattern: &mut SewingPattern, down: f64) {
    let is_sleeve: Vec<bool> = sleeves(pattern).iter().map(Option::is_some).collect();
    let mut pivots = [(DVec2::ZERO, 0.0); 2];
    let side = |x: f64| usize::from(x > 0.0);
    for stitch in &pattern.stitches {
        let [a, b] = stitch.sides;
        if is_sleeve[a.panel] == is_sleeve[b.panel] {
            continue;
        }
        let at = if is_sleeve[a.panel] { a } else { b };
        let (mean, _) = placed(pattern, at);
        let pivot = &mut pivots[side(mean.x)];
        pivot.0 += DVec2::new(mean.x, mean.z);
        pivot.1 += 1.0;
    }
    for (panel, _) in pattern.panels.iter_mut().zip(is_sleeve).filter(|(_, sleeve)| *sleeve) {
        let (sum, count) = pivots[side(panel.translation.x)];
        if count == 0.0 {
            continue;
        }
        let pivot = DVec3::new(sum.x / count, 0.0, sum.y / count);
        // About y: the left arm (+x) goes down by a positive turn.
        let turn = math::rotation(DVec3::Y, if panel.translation.x > 0.0 { down } else { -down });
        panel.rotation = turn * panel.rotation;
        panel.translation = turn * (panel.translation - pivot) + pivot;
    }
}
