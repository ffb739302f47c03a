//! The unit and the up axis of a mesh file: how its numbers become metres with z up.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::error::MeshError;
use crate::base::serde_name;

/// Length of one unit in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metre.
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
    #[must_use]
    pub(crate) fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Dm => 0.1,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
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
        let unknown = || MeshError::UnknownUnit { found: text.to_owned() };
        serde_name::parse(&text.trim().to_ascii_lowercase()).ok_or_else(unknown)
    }
}

/// The axis of the file that points against gravity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
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
        let unknown = || MeshError::UnknownAxis { found: text.to_owned() };
        serde_name::parse(&text.trim().to_ascii_lowercase()).ok_or_else(unknown)
    }
}

/// How the numbers in a file become metres with z up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Unit of the file.
    pub unit: Unit,
    /// Up axis of the file.
    pub up: Axis,
    /// Whether any of the two was guessed.
    pub guessed: bool,
    /// Why these, in plain words.
    pub reason: String,
}

impl Frame {
    /// The frame the user named.
    #[must_use]
    pub fn given(unit: Unit, up: Axis) -> Self {
        Self { unit, up, guessed: false, reason: format!("given: {unit}, {up} up") }
    }

    /// A point of the file in metres, z up; a rotation and a scaling, so that winding keeps its meaning.
    #[must_use]
    pub(crate) fn to_metres(&self, p: DVec3) -> DVec3 {
        let turned = match self.up {
            Axis::X => DVec3::new(-p.z, p.y, p.x),
            Axis::Y => DVec3::new(p.x, -p.z, p.y),
            Axis::Z => p,
        };
        turned * self.unit.metres()
    }

    /// The inverse of [`to_metres`](Self::to_metres): a point in metres, z up, in the file's own frame.
    #[must_use]
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
        let said = "furlong".parse::<Unit>().unwrap_err().to_string();
        assert!(said.contains("furlong") && said.contains("mm"), "{said}");
        assert!("w".parse::<Axis>().unwrap_err().to_string().contains("x, y or z"));
    }
}
