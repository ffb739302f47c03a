//! The edges of a panel: lines, Béziers of second and third order, arcs.
//!
//! | kind | p(t), 0 ≤ t ≤ 1 |
//! |---|---|
//! | line | a + t (b − a) |
//! | quadratic | (1−t)² a + 2 t (1−t) c + t² b |
//! | cubic | (1−t)³ a + 3 t (1−t)² c + 3 t² (1−t) d + t³ b |
//! | arc | m + r (cos φ, sin φ), φ = φ₀ + t Δφ |
//! | polyline | the point at the share t of its length |
//!
//! Béziers are kurbo's: their lengths, the points at given lengths, and their areas. kurbo approximates arcs by Béziers, so arcs
//! are exact here. All in metres.

use std::sync::Arc;

use glam::DVec2;
use kurbo::{CubicBez, Line, ParamCurve, ParamCurveArclen, ParamCurveArea, PathSeg, Point, QuadBez};

use crate::base::math;

/// Absolute error of lengths and of points at a length, m: a millionth of a micrometre.
const ACCURACY: f64 = 1e-12;

/// A curve in the plane of its panel, m.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs, reason = "the table above says what each field is")]
pub enum Curve {
    /// A straight edge.
    Line { a: DVec2, b: DVec2 },
    /// A Bézier with one control point.
    Quadratic { a: DVec2, c: DVec2, b: DVec2 },
    /// A Bézier with two control points.
    Cubic { a: DVec2, c: DVec2, d: DVec2, b: DVec2 },
    /// An arc of a circle; `turn` (radians) is positive counter-clockwise.
    Arc { a: DVec2, b: DVec2, centre: DVec2, radius: f64, from: f64, turn: f64 },
    /// Points joined by lines, two at least; t is the share of the length.
    Polyline { points: Arc<[DVec2]> },
}

impl Curve {
    /// The arc from `a` to `b` of this radius, as in SVG but with y up: the longer one if `large`, counter-clockwise (bulging to
    /// the right of a → b) if `right`. `None` where the radius is shorter than half the distance.
    pub(crate) fn arc(a: DVec2, b: DVec2, radius: f64, large: bool, right: bool) -> Option<Self> {
        let half = 0.5 * (b - a);
        // Files round the radius of a half circle.
        let short = half.length() - radius;
        if !(short <= 1e-4 * radius && radius > 0.0 && half.length() > 0.0) {
            return None;
        }
        let radius = radius.max(half.length());
        let height = (radius * radius - half.length_squared()).max(0.0).sqrt();
        let side = if right == large { -1.0 } else { 1.0 };
        let centre = a + half + half.perp().normalize() * side * height;
        let from = math::angle(a - centre);
        let mut turn = math::angle(b - centre) - from;
        if right && turn <= 0.0 {
            turn += std::f64::consts::TAU;
        } else if !right && turn >= 0.0 {
            turn -= std::f64::consts::TAU;
        }
        Some(Self::Arc { a, b, centre, radius, from, turn })
    }

    /// Its first point.
    pub(crate) fn start(&self) -> DVec2 {
        match self {
            Self::Line { a, .. } | Self::Quadratic { a, .. } | Self::Cubic { a, .. } | Self::Arc { a, .. } => *a,
            Self::Polyline { points } => points[0],
        }
    }

    /// Its last point.
    pub(crate) fn end(&self) -> DVec2 {
        match self {
            Self::Line { b, .. } | Self::Quadratic { b, .. } | Self::Cubic { b, .. } | Self::Arc { b, .. } => *b,
            Self::Polyline { points } => points[points.len() - 1],
        }
    }

    /// p(t); the ends are exact.
    pub(crate) fn at(&self, t: f64) -> DVec2 {
        match self {
            _ if t <= 0.0 => self.start(),
            _ if t >= 1.0 => self.end(),
            Self::Arc { centre, radius, from, turn, .. } => *centre + *radius * math::unit(from + t * turn),
            Self::Polyline { points } => {
                let mut left = t * self.length();
                for side in points.windows(2) {
                    let length = side[0].distance(side[1]);
                    if left <= length && length > 0.0 {
                        return side[0].lerp(side[1], left / length);
                    }
                    left -= length;
                }
                self.end()
            }
            _ => vector(self.segment().eval(t)),
        }
    }

    /// The curve as kurbo's; an arc, which kurbo only approximates, and a polyline as their chords.
    fn segment(&self) -> PathSeg {
        match *self {
            Self::Quadratic { a, c, b } => QuadBez::new(point(a), point(c), point(b)).into(),
            Self::Cubic { a, c, d, b } => CubicBez::new(point(a), point(c), point(d), point(b)).into(),
            _ => Line::new(point(self.start()), point(self.end())).into(),
        }
    }

    /// Length, m.
    pub(crate) fn length(&self) -> f64 {
        match self {
            Self::Line { a, b } => a.distance(*b),
            Self::Arc { radius, turn, .. } => radius * turn.abs(),
            Self::Polyline { points } => points.windows(2).map(|side| side[0].distance(side[1])).sum(),
            _ => self.segment().arclen(ACCURACY),
        }
    }

    /// `count` + 1 points at equal arc lengths, both ends included.
    pub(crate) fn divided(&self, count: usize) -> Vec<DVec2> {
        let length = self.length();
        let parameter = |share: f64| match self {
            Self::Line { .. } | Self::Arc { .. } | Self::Polyline { .. } => share,
            _ if share == 1.0 => 1.0,
            _ => self.segment().inv_arclen(share * length, ACCURACY),
        };
        (0..=count).map(|i| self.at(parameter(i as f64 / count as f64))).collect()
    }

    /// ½ ∫ p × dp along it. The edges of a loop add up to its area, m², positive counter-clockwise.
    pub(crate) fn area(&self) -> f64 {
        match self {
            Self::Arc { centre, radius, turn, a, b, .. } => 0.5 * (centre.perp_dot(*b - *a) + radius * radius * turn),
            Self::Polyline { points } => points.windows(2).map(|side| 0.5 * side[0].perp_dot(side[1])).sum(),
            _ => self.segment().signed_area(),
        }
    }
}

fn point(p: DVec2) -> Point {
    Point::new(p.x, p.y)
}

fn vector(p: Point) -> DVec2 {
    DVec2::new(p.x, p.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    const A: DVec2 = DVec2::new(1.0, 0.0);
    const B: DVec2 = DVec2::new(0.0, 1.0);

    #[test]
    fn arcs_have_the_requested_direction_and_length() {
        for (large, right, length, middle) in [
            // Of the unit circle about 0 and the one about (1, 1).
            (false, true, FRAC_PI_2, DVec2::splat(0.5_f64.sqrt())),
            (false, false, FRAC_PI_2, DVec2::splat(1.0 - 0.5_f64.sqrt())),
            (true, false, 3.0 * FRAC_PI_2, -DVec2::splat(0.5_f64.sqrt())),
            (true, true, 3.0 * FRAC_PI_2, DVec2::splat(1.0 + 0.5_f64.sqrt())),
        ] {
            let arc = Curve::arc(A, B, 1.0, large, right).unwrap();
            assert!((arc.length() - length).abs() < 1e-12, "{large} {right}: {}", arc.length());
            assert!(arc.at(0.5).distance(middle) < 1e-12, "{large} {right}: {}", arc.at(0.5));
            assert!((arc.at(1e-12).distance(A) + arc.at(1.0 - 1e-12).distance(B)) < 1e-9);
        }
        assert!(Curve::arc(A, -A, 0.9, false, true).is_none());
        assert!(Curve::arc(A, A, 1.0, false, true).is_none());
        assert!((Curve::arc(A, -A, 0.99999, false, true).unwrap().length() - PI).abs() < 1e-12);
    }

    #[test]
    fn a_parabola_has_its_closed_form_length_and_is_divided_into_equal_parts() {
        // y = x² from −1 to 1: length √5 + ½ asinh 2.
        let parabola = Curve::Quadratic { a: DVec2::new(-1.0, 1.0), c: DVec2::new(0.0, -1.0), b: DVec2::new(1.0, 1.0) };
        let exact = 5.0_f64.sqrt() + 0.5 * 2.0_f64.asinh();
        assert!((parabola.length() - exact).abs() < 1e-12, "{}", parabola.length());
        let to = |x: f64| 0.5 * x * (1.0 + 4.0 * x * x).sqrt() + 0.25 * (2.0 * x).asinh();
        for (i, p) in parabola.divided(7).iter().enumerate() {
            assert!((p.y - p.x * p.x).abs() < 1e-14);
            assert!((to(p.x) - to(-1.0) - exact * i as f64 / 7.0).abs() < 1e-11, "{p}");
        }
    }

    #[test]
    fn a_polyline_is_divided_by_length_and_not_by_points() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 2.0]].map(DVec2::from_array);
        let line = Curve::Polyline { points: points.into() };
        assert_eq!((line.length(), line.start(), line.end()), (3.0, points[0], points[3]));
        assert_eq!(line.divided(3), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0]].map(DVec2::from_array));
        let back = Curve::Line { a: points[3], b: points[0] };
        assert_eq!(line.area() + back.area(), 1.0);
    }

    #[test]
    fn loops_have_their_area() {
        let circle = [Curve::arc(A, -A, 1.0, false, true).unwrap(), Curve::arc(-A, A, 1.0, false, true).unwrap()];
        assert!((circle.iter().map(Curve::area).sum::<f64>() - PI).abs() < 1e-12);
        let line = Curve::Line { a: B, b: A };
        let cubic = Curve::Cubic { a: A, c: DVec2::new(2.0, 2.0), d: DVec2::new(-1.0, 3.0), b: B };
        let fine = cubic.divided(4000);
        let polygon: f64 = fine.windows(2).map(|p| 0.5 * p[0].perp_dot(p[1])).sum();
        assert!((cubic.area() + line.area() - polygon - 0.5 * B.perp_dot(A)).abs() < 1e-6);
    }
}
