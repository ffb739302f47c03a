//! The unit and the up axis of a mesh file: how its numbers become metres with z up.
//!
//! An OBJ file states neither. Both are options, or guessed for each file by itself. A body is taken to be 0.5 to 2.5 m tall, which leaves at most one of metre,
//! decimetre, centimetre and millimetre; inch and foot overlap with these and are never guessed. Up is the axis along
//! which a body is tall and its upper and lower half differ. The left and the right of a body are alike, so a T pose as
//! wide as it is tall is recognised. A garment is in the frame in which it lies about the body, with a preference for the
//! body's own frame.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::box_about;
use super::error::MeshError;
use crate::base::serde_name;

/// Height of a body, m: from a toddler's torso form to a tall adult in heels.
const BODY_HEIGHT: std::ops::RangeInclusive<f64> = 0.5..=2.5;
/// Units that a guess chooses among.
const GUESSED_UNITS: [Unit; 4] = [Unit::M, Unit::Dm, Unit::Cm, Unit::Mm];
/// An axis may be up if the body is at least this share as long along it as along its longest: an arm span is rarely
/// more than 1.1 of the stature.
const TALL_ENOUGH: f64 = 0.8;

/// Least and greatest length of a garment in the lengths of its body: in the body's own frame (a bracelet, a train) and in any
/// other (a sock, a wide skirt laid flat).
const OWN_LENGTHS: std::ops::RangeInclusive<f64> = 0.03..=3.0;
const OTHER_LENGTHS: std::ops::RangeInclusive<f64> = 0.1..=1.3;
/// Weights of a frame with the body's unit and with its up axis; heavier ones keep more garments in the body's frame. Heuristics:
/// with these, `tests/import/frames.rs` finds five garments in all of twelve frames about four bodies.
const SAME_UNIT: f64 = 4.0;
const SAME_UP: f64 = 1.5;
/// A garment with a box nearer than this to the body's, m, counts as overlapping it by [`LEAST_OVERLAP`]: a cloth above the head.
const NEAR_BOX: f64 = 0.3;
const LEAST_OVERLAP: f64 = 1e-3;
/// Vertices that are tried in a frame.
const TRIED: usize = 400;

/// Length of one unit in the file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metre.
    #[default]
    M,
    /// Decimetre.
    Dm,
    /// Centimetre.
    Cm,
    /// Millimetre.
    Mm,
    /// Inch, 25.4 mm.
    In,
    /// Foot, 304.8 mm.
    Ft,
}

impl Unit {
    /// Metres in one unit.
    pub(crate) fn metres(self) -> f64 {
        [1.0, 0.1, 0.01, 0.001, 0.0254, 0.3048][self as usize]
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for Unit {
    type Err = MeshError;

    fn from_str(text: &str) -> Result<Self, MeshError> {
        named(text, "unit", "one of m, dm, cm, mm, in, ft")
    }
}

/// The value that a word names, in capitals or not.
fn named<T: DeserializeOwned>(text: &str, what: &'static str, expected: &'static str) -> Result<T, MeshError> {
    let unknown = || MeshError::UnknownName { what, found: text.to_owned(), expected };
    serde_name::parse(&text.trim().to_ascii_lowercase()).ok_or_else(unknown)
}

/// The axis of the file that points against gravity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
    #[default]
    Z,
}

impl Axis {
    pub(super) fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for Axis {
    type Err = MeshError;

    fn from_str(text: &str) -> Result<Self, MeshError> {
        named(text, "up axis", "x, y or z")
    }
}

/// The horizontal direction that a body faces, as an axis of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "each is named as its axis")]
pub enum Front {
    #[serde(rename = "x")]
    X,
    #[serde(rename = "-x")]
    MinusX,
    #[serde(rename = "y")]
    Y,
    #[serde(rename = "-y")]
    MinusY,
    #[serde(rename = "z")]
    Z,
    #[serde(rename = "-z")]
    MinusZ,
}

impl Front {
    /// The direction in the file.
    pub(crate) fn direction(self) -> DVec3 {
        match self {
            Self::X => DVec3::X,
            Self::MinusX => DVec3::NEG_X,
            Self::Y => DVec3::Y,
            Self::MinusY => DVec3::NEG_Y,
            Self::Z => DVec3::Z,
            Self::MinusZ => DVec3::NEG_Z,
        }
    }
}

impl fmt::Display for Front {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for Front {
    type Err = MeshError;

    fn from_str(text: &str) -> Result<Self, MeshError> {
        named(text, "front", "x, -x, y, -y, z or -z, an axis of the body's file")
    }
}

/// How the numbers in a file become metres with z up.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Unit of the file.
    pub unit: Unit,
    /// Up axis of the file.
    pub up: Axis,
    /// Whether any of the two was guessed.
    pub guessed: bool,
    /// Grounds for both, as a sentence.
    pub reason: String,
}

impl Frame {
    /// The frame the user named.
    #[must_use]
    pub fn given(unit: Unit, up: Axis) -> Self {
        Self { unit, up, guessed: false, reason: format!("given: {unit}, {up} up") }
    }

    /// A point of the file in metres, z up; a rotation and a scaling, so that winding keeps its meaning.
    pub(crate) fn to_metres(&self, p: DVec3) -> DVec3 {
        let turned = match self.up {
            Axis::X => DVec3::new(-p.z, p.y, p.x),
            Axis::Y => DVec3::new(p.x, -p.z, p.y),
            Axis::Z => p,
        };
        turned * self.unit.metres()
    }

    /// The inverse of [`to_metres`](Self::to_metres): a point in metres, z up, in the file's own frame.
    pub(crate) fn to_file(&self, p: DVec3) -> DVec3 {
        // Divided, not multiplied by the inverse: 0.17 m is 1.7 dm, not 1.7000000000000002.
        let p = p / self.unit.metres();
        match self.up {
            Axis::X => DVec3::new(p.z, p.y, -p.x),
            Axis::Y => DVec3::new(p.x, p.z, -p.y),
            Axis::Z => p,
        }
    }
}

/// Unit and up axis of a body from its vertices `raw` in the file's frame; a given unit or axis is not guessed. Those that the
/// format prescribes count if the body is of a body's height in them.
///
/// # Errors
/// The height in units of the file, where it is a body's in no unit.
pub(super) fn guess_frame(
    raw: &[DVec3],
    unit: Option<Unit>,
    up: Option<Axis>,
    declared: Option<Declared>,
) -> Result<Frame, f64> {
    if let (Some(unit), Some(up)) = (unit, up) {
        return Ok(given(raw, unit, up));
    }
    let (lo, hi) = box_about(raw.iter().copied());
    let extent = (hi - lo).to_array();
    if let (Some(declared), None, None) = (declared, unit, up) {
        let tall = extent[declared.up.index()] * declared.unit.metres();
        if BODY_HEIGHT.contains(&tall) {
            let reason = format!("{}, in which the body is {tall:.2} m tall", declared.reason());
            return Ok(Frame { reason, ..declared.frame() });
        }
    }
    let up_found = up.unwrap_or_else(|| guess_up(raw, lo, hi));
    let height = extent[up_found.index()];
    let unit_found = unit.or_else(|| unit_of_a_body(height)).ok_or(height)?;
    let tall = height * unit_found.metres();
    let axis = if up.is_some() { "given" } else { "guessed" };
    let scale = if unit.is_some() { "given" } else { "guessed" };
    let reason = format!(
        "the body is {height:.4} units along {up_found} (up, {axis}), {tall:.2} m in {unit_found} ({scale}, a body being \
         0.5 to 2.5 m tall)"
    );
    Ok(Frame { unit: unit_found, up: up_found, guessed: true, reason })
}

/// The unit in which a body of this height (in units of the file) is 0.5 to 2.5 m tall.
fn unit_of_a_body(height: f64) -> Option<Unit> {
    GUESSED_UNITS.into_iter().find(|unit| BODY_HEIGHT.contains(&(height * unit.metres())))
}

/// The given frame. Its reason names another unit, if the body has a body's height in that one alone.
fn given(raw: &[DVec3], unit: Unit, up: Axis) -> Frame {
    let mut frame = Frame::given(unit, up);
    let (lo, hi) = box_about(raw.iter().copied());
    let height = (hi - lo)[up.index()];
    let tall = height * unit.metres();
    if let Some(other) = unit_of_a_body(height).filter(|_| !BODY_HEIGHT.contains(&tall)) {
        let would = height * other.metres();
        frame.reason += &format!("; the body is {tall:.2} m tall in that, and would be {would:.2} m in {other}");
    }
    frame
}

/// Unit and up axis of a garment from its vertices `raw` in the file's frame, for a body within these bounds (m, z up):
/// the frame in which the boxes of garment and body share the largest part of their volume. The frame that the format prescribes
/// weighs [`SAME_UNIT`] times [`SAME_UP`] as much.
pub(super) fn guess_frame_around(
    raw: &[DVec3],
    body: (DVec3, DVec3),
    unit: Option<Unit>,
    up: Option<Axis>,
    declared: Option<Declared>,
) -> Option<Frame> {
    if let (Some(unit), Some(up)) = (unit, up) {
        return Some(Frame::given(unit, up));
    }
    let units = unit.map_or(GUESSED_UNITS.to_vec(), |unit| vec![unit]);
    let ups = up.map_or(vec![Axis::Z, Axis::Y], |up| vec![up]);
    let mut best = (0.0, None);
    for frame in ups.iter().flat_map(|&up| units.iter().map(move |&unit| Frame::given(unit, up))) {
        let overlap = overlap(box_about(raw.iter().map(|&p| frame.to_metres(p))), body);
        let is_declared = declared.is_some_and(|declared| (declared.unit, declared.up) == (frame.unit, frame.up));
        let score = if is_declared { SAME_UNIT * SAME_UP * overlap } else { overlap };
        if score > best.0 {
            best = (score, Some((frame, overlap)));
        }
    }
    let (frame, overlap) = best.1?;
    if let Some(declared) = declared.filter(|declared| (declared.unit, declared.up) == (frame.unit, frame.up)) {
        return Some(Frame { reason: declared.reason(), ..declared.frame() });
    }
    let overlap = 100.0 * overlap;
    let reason = format!(
        "in {}, {} up, the garment's box and the body's share {overlap:.0} % of their volume, the most of all frames",
        frame.unit, frame.up
    );
    Some(Frame { guessed: true, reason, ..frame })
}

/// Unit and up axis of a garment from its vertices `raw` in the file's frame, for a body within the bounds `body` (m, z up).
/// `own` is the frame of the body, or the one that the garment's format prescribes, and `its_name` says which. `closeness` of points (m, z up) about the body is 1 where they lie on it, and near 0 where they are far from it
/// or deep inside.
///
/// A frame scores the shared volume of both boxes times that closeness, weighted by [`SAME_UNIT`] and [`SAME_UP`]. Without a score in
/// any frame the garment is in its own, if it is of a garment's size there. `None` where it is not.
pub(super) fn guess_frame_worn(
    raw: &[DVec3],
    (own, its_name): (&Frame, &str),
    body: (DVec3, DVec3),
    closeness: &dyn Fn(&[DVec3]) -> f64,
    (unit, up): (Option<Unit>, Option<Axis>),
) -> Option<Frame> {
    if let (Some(unit), Some(up)) = (unit, up) {
        return Some(Frame::given(unit, up));
    }
    let (low, high) = box_about(raw.iter().copied());
    let tried: Vec<DVec3> = raw.iter().step_by(raw.len().div_ceil(TRIED).max(1)).copied().collect();
    let (mut best, mut in_own) = ((0.0, None), (0.0, None));
    let units = unit.map_or_else(|| GUESSED_UNITS.iter().copied().chain([own.unit]).collect(), |unit| vec![unit]);
    let ups = up.map_or_else(|| vec![own.up, Axis::Y, Axis::Z, Axis::X], |up| vec![up]);
    for frame in ups.iter().flat_map(|&up| units.iter().map(move |&unit| Frame::given(unit, up))) {
        let corners = box_about([low, high].map(|p| frame.to_metres(p)));
        let length = (corners.1 - corners.0).max_element() / (body.1 - body.0).max_element();
        let is_own = frame.unit == unit.unwrap_or(own.unit) && frame.up == up.unwrap_or(own.up);
        if !(if is_own { OWN_LENGTHS } else { OTHER_LENGTHS }).contains(&length) {
            continue;
        }
        let gap = (corners.0 - body.1).max(body.0 - corners.1).max(DVec3::ZERO).length();
        let least = if gap < NEAR_BOX { LEAST_OVERLAP } else { 0.0 };
        let mut score = overlap(corners, body).max(least);
        let mut close = 0.0;
        if score > 0.0 {
            close = closeness(&tried.iter().map(|&p| frame.to_metres(p)).collect::<Vec<_>>());
            score *= close;
        }
        score *= if frame.unit == own.unit { SAME_UNIT } else { 1.0 };
        score *= if frame.up == own.up { SAME_UP } else { 1.0 };
        if is_own {
            in_own = (close, Some(frame.clone()));
        }
        if score > best.0 {
            best = (score, Some((frame, close)));
        }
    }
    match (best.1, in_own) {
        (Some((frame, close)), (own_close, _)) if (frame.unit, frame.up) != (own.unit, own.up) => {
            let reason = format!(
                "in {}, {} up, the garment lies closest about the body ({:.0} of 100; {:.0} in {}, {} up, {its_name})",
                frame.unit,
                frame.up,
                100.0 * close,
                100.0 * own_close,
                own.unit,
                own.up
            );
            Some(Frame { guessed: true, reason, ..frame })
        }
        (best, (_, in_own)) => {
            let frame = best.map(|(frame, _)| frame).or(in_own)?;
            let is_own = (frame.unit, frame.up) == (own.unit, own.up);
            let reason = if is_own { its_name.to_owned() } else { format!("as given, otherwise {its_name}") };
            Some(Frame { guessed: own.guessed, reason, ..frame })
        }
    }
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

/// The unit and the up axis that a format prescribes. Many files break the rule, so both are tried first and not taken for granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Declared {
    /// The format, as messages name it.
    pub(super) format: &'static str,
    pub(super) unit: Unit,
    pub(super) up: Axis,
}

impl Declared {
    pub(super) fn frame(self) -> Frame {
        Frame { guessed: true, ..Frame::given(self.unit, self.up) }
    }

    pub(super) fn reason(self) -> String {
        format!("as {} prescribes", self.format)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_turn_without_mirroring_and_back() {
        let p = DVec3::new(0.3, -1.2, 0.7);
        for up in [Axis::X, Axis::Y, Axis::Z] {
            for unit in [Unit::M, Unit::Dm, Unit::Cm, Unit::Mm, Unit::In, Unit::Ft] {
                let frame = Frame::given(unit, up);
                assert!((frame.to_file(frame.to_metres(p)) - p).length() < 1e-15);
                let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| frame.to_metres(axis) / unit.metres());
                assert!((x.cross(y) - z).length() < 1e-15, "{up} mirrors");
                assert!((frame.to_metres([DVec3::X, DVec3::Y, DVec3::Z][up.index()]).z - unit.metres()).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn names_are_read_and_unknown_ones_listed() {
        assert_eq!("CM".parse::<Unit>().unwrap(), Unit::Cm);
        assert_eq!("z".parse::<Axis>().unwrap(), Axis::Z);
        let message = "furlong".parse::<Unit>().unwrap_err().to_string();
        assert!(message.contains("furlong") && message.contains("mm"), "{message}");
        assert!("w".parse::<Axis>().unwrap_err().to_string().contains("x, y or z"));
    }

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
            let frame = guess_frame(&t_pose(h), None, None, None).unwrap();
            assert_eq!((frame.unit, frame.up), (unit, Axis::Y), "{}", frame.reason);
            let z_up: Vec<_> = t_pose(h).iter().map(|p| DVec3::new(p.x, -p.z, p.y)).collect();
            assert_eq!(guess_frame(&z_up, None, None, None).unwrap().up, Axis::Z);
        }
    }

    #[test]
    fn given_values_are_not_guessed_and_impossible_heights_are_refused() {
        assert_eq!(guess_frame(&t_pose(66.0), Some(Unit::In), None, None).unwrap().unit, Unit::In);
        assert_eq!(
            guess_frame(&t_pose(1.7), Some(Unit::M), Some(Axis::X), None).unwrap(),
            Frame::given(Unit::M, Axis::X)
        );
        // The given unit is taken, and the reason names the unit in which the height is a body's.
        let tiny = guess_frame(&t_pose(16.8), Some(Unit::Cm), Some(Axis::Y), None).unwrap();
        assert_eq!((tiny.unit, tiny.up), (Unit::Cm, Axis::Y));
        assert!(tiny.reason.contains("0.17 m tall in that, and would be 1.68 m in dm"), "{}", tiny.reason);
        assert!((guess_frame(&t_pose(40.0), None, None, None).unwrap_err() - 40.0).abs() < 1e-12);
    }

    #[test]
    fn a_garment_finds_the_frame_of_a_known_body() {
        let body = (DVec3::new(-0.3, -0.2, 0.0), DVec3::new(0.3, 0.2, 1.7));
        // A shirt in centimetres, y up.
        let shirt = [DVec3::new(-28.0, 90.0, -18.0), DVec3::new(28.0, 145.0, 18.0)];
        let frame = guess_frame_around(&shirt, body, None, None, None).unwrap();
        assert_eq!((frame.unit, frame.up), (Unit::Cm, Axis::Y));
    }
}
