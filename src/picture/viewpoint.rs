//! Directions from which a picture shows the body.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use crate::base::math;

/// Elevation of the eye for the named directions, degrees: necklines and hems show a little of their inside.
const ELEVATION_DEG: f64 = 6.0;

/// The side of the body that is seen, or the direction to the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Viewpoint {
    /// From the front.
    Front,
    /// From the wearer's left.
    Side,
    /// From behind.
    Back,
    /// The panels of a sewing pattern laid out, without the body.
    Flat,
    /// From this direction, z up.
    From(DVec3),
}

impl Viewpoint {
    /// Unit vector from the body to the eye, where the body looks along −y turned by `facing` (radians).
    pub(crate) fn toward(self, facing: f64) -> DVec3 {
        let flat = match self {
            Self::Front | Self::Flat => DVec3::NEG_Y,
            Self::Side => DVec3::X,
            Self::Back => DVec3::Y,
            Self::From(direction) => return direction,
        };
        let (sin, cos) = math::sin_cos(facing);
        let (up, along) = math::sin_cos(ELEVATION_DEG.to_radians());
        DVec3::new(along * (cos * flat.x - sin * flat.y), along * (sin * flat.x + cos * flat.y), up)
    }
}

impl fmt::Display for Viewpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Front => f.write_str("front"),
            Self::Side => f.write_str("side"),
            Self::Back => f.write_str("back"),
            Self::Flat => f.write_str("flat"),
            Self::From(DVec3 { x, y, z }) => write!(f, "{x},{y},{z}"),
        }
    }
}

impl FromStr for Viewpoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let direction = || {
            let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
            let [x, y, z] = numbers[..] else { return None };
            let direction = DVec3::new(x, y, z);
            (direction.is_finite() && direction.length() > 0.0).then_some(Self::From(direction))
        };
        match text {
            "front" => Ok(Self::Front),
            "side" => Ok(Self::Side),
            "back" => Ok(Self::Back),
            "flat" => Ok(Self::Flat),
            _ => direction().ok_or_else(|| {
                format!(
                    "found `{text}`, expected front, side, back, flat (the panels of a pattern), or the direction to the eye as X,Y,Z with z up, such as 1,-2,0.5"
                )
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_turn_with_the_body() {
        let quarter = std::f64::consts::FRAC_PI_2;
        for (view, facing, expected) in [
            (Viewpoint::Front, 0.0, DVec3::NEG_Y),
            (Viewpoint::Side, 0.0, DVec3::X),
            // A body that looks along +x.
            (Viewpoint::Front, quarter, DVec3::X),
            (Viewpoint::Back, quarter, DVec3::NEG_X),
        ] {
            let toward = view.toward(facing);
            assert!((toward.length() - 1.0).abs() < 1e-12 && toward.dot(expected) > 0.99, "{view} {facing}: {toward}");
        }
    }

    #[test]
    fn names_and_directions_are_parsed() {
        assert_eq!("1,-2,0.5".parse(), Ok(Viewpoint::From(DVec3::new(1.0, -2.0, 0.5))));
        assert_eq!("back".parse(), Ok(Viewpoint::Back));
        for wrong in ["left", "1,2", "0,0,0", "1,2,nan", ""] {
            assert!(wrong.parse::<Viewpoint>().unwrap_err().contains("1,-2,0.5"), "{wrong}");
        }
    }
}
