//! A guess at the unit and the up axis of somebody else's mesh.
//!
//! A file says neither, so both are flags, or guessed from the body and applied to body and garment alike: they share a
//! frame or they would not fit each other. The guess takes a body to be 0.5 to 2.5 m tall, which leaves at most one of
//! metre, decimetre, centimetre and millimetre; inch and foot are never guessed, as they overlap with these. Up is the axis along
//! which a body is tall and its upper and lower half differ; left and right of a body are alike, so that a T pose as
//! wide as it is tall is told apart.

use glam::DVec3;

use super::bounds;
use super::frame::{Axis, Frame, Unit};

/// The tallest and the smallest body the guess believes in, m: a toddler's torso form to a tall adult in heels.
const BODY_HEIGHT: std::ops::RangeInclusive<f64> = 0.5..=2.5;
/// An axis may be up if the body is at least this share as long along it as along its longest: an arm span is rarely
/// more than 1.1 of the stature.
const TALL_ENOUGH: f64 = 0.8;

/// Unit and up axis of a body from its vertices as they stand in the file; what the caller names is not guessed.
///
/// # Errors
/// The height found and the tallest axis, where no unit makes it a body's.
pub(super) fn guess_frame(raw: &[DVec3], unit: Option<Unit>, up: Option<Axis>) -> Result<Frame, f64> {
    if let (Some(unit), Some(up)) = (unit, up) {
        return Ok(given(raw, unit, up));
    }
    let Some((lo, hi)) = bounds(raw) else { return Err(0.0) };
    let extent = (hi - lo).to_array();
    let up_found = up.unwrap_or_else(|| guess_up(raw, lo, hi));
    let height = extent[up_found.index()];
    let unit_found = match unit {
        Some(unit) => unit,
        None => unit_of_a_body(height).ok_or(height)?,
    };
    let tall = height * unit_found.metres();
    let axis = if up.is_some() { "given" } else { "guessed" };
    let scale = if unit.is_some() { "given" } else { "guessed" };
    let reason = format!(
        "the body is {height:.4} units along {up_found} (up, {axis}), {tall:.2} m in {unit_found} ({scale}, a body being \
         0.5 to 2.5 m tall)"
    );
    Ok(Frame { unit: unit_found, up: up_found, guessed: true, reason })
}

/// The unit in which a body of this height, as it stands in the file, is as tall as one.
fn unit_of_a_body(height: f64) -> Option<Unit> {
    [Unit::M, Unit::Dm, Unit::Cm, Unit::Mm].into_iter().find(|unit| BODY_HEIGHT.contains(&(height * unit.metres())))
}

/// Both are given and taken as they are; where another unit would make it a body's, that is said.
fn given(raw: &[DVec3], unit: Unit, up: Axis) -> Frame {
    let mut frame = Frame::given(unit, up);
    let height = bounds(raw).map_or(0.0, |(lo, hi)| (hi - lo)[up.index()]);
    let tall = height * unit.metres();
    if let Some(other) = unit_of_a_body(height).filter(|_| !BODY_HEIGHT.contains(&tall)) {
        let would = height * other.metres();
        frame.reason += &format!("; the body is {tall:.2} m tall in that, and would be {would:.2} m in {other}");
    }
    frame
}

/// Unit and up axis of a garment from its vertices as they stand in the file, where the body is known in metres, z up
/// (a built-in one): the frame that puts the garment's box best onto the body's.
pub(super) fn guess_frame_around(
    raw: &[DVec3],
    body: (DVec3, DVec3),
    unit: Option<Unit>,
    up: Option<Axis>,
) -> Option<Frame> {
    if let (Some(unit), Some(up)) = (unit, up) {
        return Some(Frame::given(unit, up));
    }
    let units = unit.map_or_else(|| vec![Unit::M, Unit::Dm, Unit::Cm, Unit::Mm], |unit| vec![unit]);
    let ups = up.map_or_else(|| vec![Axis::Z, Axis::Y], |up| vec![up]);
    let mut best: Option<(f64, Frame)> = None;
    for up in ups {
        for &unit in &units {
            let frame = Frame::given(unit, up);
            let Some(placed) = bounds(&raw.iter().map(|&p| frame.to_metres(p)).collect::<Vec<_>>()) else { continue };
            let overlap = overlap(placed, body);
            if overlap > best.as_ref().map_or(0.0, |(most, _)| *most) {
                best = Some((overlap, frame));
            }
        }
    }
    best.map(|(overlap, frame)| Frame {
        guessed: true,
        reason: format!(
            "in {}, {} up, the garment's box and the body's share {:.0} % of their volume, the most of all frames",
            frame.unit,
            frame.up,
            100.0 * overlap
        ),
        ..frame
    })
}

fn guess_up(raw: &[DVec3], lo: DVec3, hi: DVec3) -> Axis {
    let extent = (hi - lo).to_array();
    let tallest = extent.into_iter().fold(0.0, f64::max);
    // y before z before x where they tie: the commonest first.
    [Axis::Y, Axis::Z, Axis::X]
        .into_iter()
        .filter(|axis| extent[axis.index()] >= TALL_ENOUGH * tallest)
        .map(|axis| (lopsidedness(raw, axis.index(), lo, hi), axis))
        .fold((-1.0, Axis::Y), |best, next| if next.0 > best.0 { next } else { best })
        .1
}

/// How far the heights are from their mirror image, on average, as a share of the extent: 0 for a symmetric axis.
fn lopsidedness(raw: &[DVec3], axis: usize, lo: DVec3, hi: DVec3) -> f64 {
    let (lo, hi) = (lo[axis], hi[axis]);
    let mut heights: Vec<f64> = raw.iter().map(|p| p[axis]).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let unlike: f64 = heights.iter().zip(heights.iter().rev()).map(|(up, down)| ((up - lo) - (hi - down)).abs()).sum();
    if hi > lo { unlike / ((hi - lo) * heights.len() as f64) } else { 0.0 }
}

/// Shared volume over united volume of two boxes; thin boxes are thickened to a millimetre.
fn overlap(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> f64 {
    let volume =
        |lo: DVec3, hi: DVec3| (hi - lo).max(DVec3::ZERO).to_array().iter().map(|e| e.max(1e-3)).product::<f64>();
    let (lo, hi) = (a.0.max(b.0), a.1.min(b.1));
    if lo.cmpgt(hi).any() {
        return 0.0;
    }
    let shared = volume(lo, hi);
    shared / (volume(a.0, a.1) + volume(b.0, b.1) - shared)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stick figure in a T pose, y up, `h` tall and as wide: dense at the top, as heads are, alike left and right.
    fn t_pose(h: f64) -> Vec<DVec3> {
        let mut points = Vec::new();
        for i in 0..=40 {
            let s = f64::from(i) / 40.0;
            points.push(DVec3::new(0.0, h * s, 0.1 * h * s));
            points.push(DVec3::new(h * (s - 0.5), 0.82 * h, 0.0));
        }
        points
    }

    #[test]
    fn a_t_pose_is_not_laid_on_its_side() {
        for (h, unit) in [(1.7, Unit::M), (16.8, Unit::Dm), (171.0, Unit::Cm), (1650.0, Unit::Mm)] {
            let frame = guess_frame(&t_pose(h), None, None).unwrap();
            assert_eq!((frame.unit, frame.up), (unit, Axis::Y), "{}", frame.reason);
            let z_up: Vec<_> = t_pose(h).iter().map(|p| DVec3::new(p.x, -p.z, p.y)).collect();
            assert_eq!(guess_frame(&z_up, None, None).unwrap().up, Axis::Z);
        }
    }

    #[test]
    fn what_is_given_is_not_guessed_and_the_impossible_is_refused() {
        assert_eq!(guess_frame(&t_pose(66.0), Some(Unit::In), None).unwrap().unit, Unit::In);
        assert_eq!(guess_frame(&t_pose(1.7), Some(Unit::M), Some(Axis::X)).unwrap(), Frame::given(Unit::M, Axis::X));
        // Taken as it is given, and said where another unit would make it a body.
        let tiny = guess_frame(&t_pose(16.8), Some(Unit::Cm), Some(Axis::Y)).unwrap();
        assert_eq!((tiny.unit, tiny.up), (Unit::Cm, Axis::Y));
        assert!(tiny.reason.contains("0.17 m tall in that, and would be 1.68 m in dm"), "{}", tiny.reason);
        assert!((guess_frame(&t_pose(40.0), None, None).unwrap_err() - 40.0).abs() < 1e-12);
    }

    #[test]
    fn a_garment_finds_the_frame_of_a_known_body() {
        let body = (DVec3::new(-0.3, -0.2, 0.0), DVec3::new(0.3, 0.2, 1.7));
        // A shirt in centimetres, y up.
        let shirt = [DVec3::new(-28.0, 90.0, -18.0), DVec3::new(28.0, 145.0, 18.0)];
        let frame = guess_frame_around(&shirt, body, None, None).unwrap();
        assert_eq!((frame.unit, frame.up), (Unit::Cm, Axis::Y));
    }
}
