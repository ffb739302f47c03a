//! Implicit solids: fields that are negative inside, positive outside, and near the surface the distance in metres.
//!
//! A swept superellipse has at coordinate t along its axis the section (|u−c_u|/a)ⁿ + (|v−c_v|/b)ⁿ = 1, with b = b₋ for v < c_v and
//! b₊ for v > c_v. With r the left-hand side to the power 1/n and ρ the distance from the section's centre, ρ (1 − 1/r) is the
//! distance along the ray from the centre; divided by the length of its gradient it is the distance to first order.
//! An ellipsoid is |p/r| (|p/r| − 1) / |p/r²| (I. Quilez). Solids are joined by the smooth minimum of [`Jet`].
//!
//! The sizes of the sections are a [`Profile`]: between stations s_i < s_{i+1} each channel is the cubic Hermite polynomial with
//! the values of the two stations and the tangents of the parabola through three neighbouring stations (Bessel's; de Boor, "A
//! Practical Guide to Splines", ch. IV), so the curve is C¹ and reproduces parabolas. Beyond the ends it is constant.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, b₋, b₊ | half breadth, half depths to the negative and positive side of v | m |
//! | n | exponent, 2 for an ellipse | – |
//!
//! Limits: away from the surface the value has the right sign and order of magnitude only.

use glam::DVec3;

use super::jet::Jet;

/// One segment: its start and the four coefficients of each channel.
#[derive(Debug, Clone)]
struct Segment<const K: usize> {
    start: f64,
    coefficients: [[f64; 4]; K],
}

/// K channels as smooth functions of one coordinate.
#[derive(Debug, Clone)]
pub(crate) struct Profile<const K: usize> {
    segments: Vec<Segment<K>>,
    first: f64,
    last: f64,
}

impl<const K: usize> Profile<K> {
    /// The curve through `stations` (coordinate, values); coordinates must ascend. Fewer than two stations make a
    /// constant.
    pub(crate) fn new(stations: &[(f64, [f64; K])]) -> Self {
        let n = stations.len();
        let slope = |i: usize, c: usize| -> f64 {
            (stations[i + 1].1[c] - stations[i].1[c]) / (stations[i + 1].0 - stations[i].0)
        };
        let tangent = |i: usize, c: usize| -> f64 {
            if n < 2 {
                0.0
            } else if i == 0 {
                slope(0, c)
            } else if i == n - 1 {
                slope(n - 2, c)
            } else {
                let (before, after) = (stations[i].0 - stations[i - 1].0, stations[i + 1].0 - stations[i].0);
                (slope(i - 1, c) * after + slope(i, c) * before) / (before + after)
            }
        };
        let segments = (0..n.saturating_sub(1))
            .map(|i| {
                let h = stations[i + 1].0 - stations[i].0;
                let coefficients = std::array::from_fn(|c| {
                    let (p, s, m0, m1) = (stations[i].1[c], slope(i, c), tangent(i, c), tangent(i + 1, c));
                    [p, m0, (3.0 * s - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * s) / (h * h)]
                });
                Segment { start: stations[i].0, coefficients }
            })
            .collect();
        Self { segments, first: stations.first().map_or(0.0, |s| s.0), last: stations.last().map_or(0.0, |s| s.0) }
    }

    /// Whether each station's coordinate is above the one before.
    fn ascends(&self) -> bool {
        let starts = self.segments.iter().map(|segment| segment.start);
        starts.chain([self.last]).is_sorted_by(|a, b| a < b)
    }

    /// First and last coordinate.
    pub(crate) fn range(&self) -> (f64, f64) {
        (self.first, self.last)
    }

    /// All channels at `s`, with gradients.
    pub(crate) fn at(&self, s: Jet) -> [Jet; K] {
        let clamped = s.value.clamp(self.first, self.last);
        let slope = if clamped == s.value { s.gradient } else { DVec3::ZERO };
        let index = self.segments.partition_point(|g| g.start <= clamped).saturating_sub(1);
        let Some(segment) = self.segments.get(index) else { return [Jet::constant(0.0); K] };
        let x = clamped - segment.start;
        std::array::from_fn(|c| {
            let [p0, p1, p2, p3] = segment.coefficients[c];
            Jet::new(p0 + x * (p1 + x * (p2 + x * p3)), slope * (p1 + x * (2.0 * p2 + x * 3.0 * p3)))
        })
    }

    /// All channels at `s`.
    pub(crate) fn values(&self, s: f64) -> [f64; K] {
        self.at(Jet::constant(s)).map(|j| j.value)
    }
}

/// A solid given by a signed field.
pub(crate) trait Solid: Sync {
    /// The field and its gradient at `p`, m.
    fn at(&self, p: DVec3) -> Jet;

    /// A lower bound of the distance to `p`, cheaper than the field, m.
    fn at_least(&self, p: DVec3) -> f64 {
        let _ = p;
        0.0
    }

    /// `field` joined with this solid over the width `k`. The solid is skipped where it is too far to matter, with a margin of one
    /// half, since the field is a distance only to first order.
    fn join(&self, field: Jet, p: DVec3, k: f64) -> Jet {
        if self.at_least(p) > 1.5 * (field.value.max(0.0) + k) { field } else { field.smooth_min(self.at(p), k) }
    }
}

/// Distance of `p` to the box from `low` to `high`, 0 inside, m.
fn box_distance(p: DVec3, low: DVec3, high: DVec3) -> f64 {
    (low - p).max(p - high).max(DVec3::ZERO).length()
}

/// The channels of a sweep's profile: c_u, c_v, a, b₋, b₊, m.
pub(crate) type Section = [f64; 5];

/// A superellipse swept along a straight axis, its ends rounded.
#[derive(Debug, Clone)]
pub(crate) struct Sweep {
    origin: DVec3,
    axes: [DVec3; 3],
    exponent: f64,
    profile: Profile<5>,
    rounding: [f64; 2],
    box_low: DVec3,
    box_high: DVec3,
}

/// The box of the stations' sections in the sweep's frame, a tenth larger to contain the curve between them.
fn section_box(stations: &[(f64, Section)]) -> (DVec3, DVec3) {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for &(t, [cu, cv, a, below, above]) in stations {
        low = low.min(DVec3::new(cu - 1.1 * a, cv - 1.1 * below, t));
        high = high.max(DVec3::new(cu + 1.1 * a, cv + 1.1 * above, t));
    }
    (low, high)
}

impl Sweep {
    /// A sweep from stations (t, section) along `axes[2]` from `origin`, with sections in `axes[0]` (u) and `axes[1]` (v);
    /// `rounding` are the radii of its lower and upper end, m.
    pub(crate) fn new(
        origin: DVec3,
        axes: [DVec3; 3],
        exponent: f64,
        stations: &[(f64, Section)],
        rounding: [f64; 2],
    ) -> Self {
        let (box_low, box_high) = section_box(stations);
        Self { origin, axes, exponent, profile: Profile::new(stations), rounding, box_low, box_high }
    }

    /// Upright: u is x, v is y and t is z.
    pub(crate) fn upright(exponent: f64, stations: &[(f64, Section)], rounding: [f64; 2]) -> Self {
        Self::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], exponent, stations, rounding)
    }

    /// A sweep along the same axis with other sections.
    pub(crate) fn with_stations(&self, stations: &[(f64, Section)], rounding: [f64; 2]) -> Self {
        Self::new(self.origin, self.axes, self.exponent, stations, rounding)
    }

    /// The coordinate of `p` along the axis, m.
    pub(crate) fn along(&self, p: DVec3) -> f64 {
        (p - self.origin).dot(self.axes[2])
    }

    /// The point of the axis at coordinate `t`, at the section's centre.
    pub(crate) fn centre(&self, t: f64) -> DVec3 {
        let [cu, cv, ..] = self.profile.values(t);
        self.origin + cu * self.axes[0] + cv * self.axes[1] + t * self.axes[2]
    }

    /// First and last coordinate of the stations, m.
    pub(crate) fn range(&self) -> (f64, f64) {
        self.profile.range()
    }

    /// Whether its stations ascend: the curve through them is a function of the coordinate only then.
    pub(super) fn ascends(&self) -> bool {
        self.profile.ascends()
    }

    /// Direction of the axis.
    pub(crate) fn direction(&self) -> DVec3 {
        self.axes[2]
    }

    /// The section's sizes at coordinate `t`.
    pub(crate) fn section(&self, t: f64) -> Section {
        self.profile.values(t)
    }
}

impl Solid for Sweep {
    fn at(&self, p: DVec3) -> Jet {
        let local = p - self.origin;
        let [u, v, t] = self.axes.map(|axis| Jet::new(local.dot(axis), axis));
        let [cu, cv, a, below, above] = self.profile.at(t);
        let (u, v) = (u - cu, v - cv);
        let b = if v.value < 0.0 { below } else { above };
        let (x, y) = (u.over(a), v.over(b));
        let r = if self.exponent == 2.0 {
            (x.square() + y.square()).sqrt()
        } else {
            let n = self.exponent;
            (x.abs_powf(n) + y.abs_powf(n)).abs_powf(1.0 / n)
        };
        let side = if r.value < 0.05 {
            // Near the axis the quotient below is undefined; any inside value will do.
            Jet::constant(-0.9 * a.value.min(b.value))
        } else {
            let rho = (u.square() + v.square()).sqrt();
            (rho - rho.over(r)).to_distance()
        };
        let (first, last) = self.profile.range();
        let low = Jet::constant(first) - t;
        let high = t - last;
        side.smooth_max(low, 3.0 * self.rounding[0]).smooth_max(high, 3.0 * self.rounding[1])
    }

    fn at_least(&self, p: DVec3) -> f64 {
        let local = p - self.origin;
        let [u, v, t] = self.axes.map(|axis| local.dot(axis));
        box_distance(DVec3::new(u, v, t), self.box_low, self.box_high)
    }
}

/// An ellipsoid along given axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ellipsoid {
    /// Its centre, m.
    pub centre: DVec3,
    /// Half axes along x, y, z, m.
    pub radii: DVec3,
    /// Lean of the z axis towards y: y is measured from centre.y + lean (z − centre.z).
    pub lean: f64,
}

impl Solid for Ellipsoid {
    fn at(&self, p: DVec3) -> Jet {
        let d = p - self.centre;
        let x = Jet::new(d.x, DVec3::X) * (1.0 / self.radii.x);
        let y = Jet::new(d.y - self.lean * d.z, DVec3::new(0.0, 1.0, -self.lean)) * (1.0 / self.radii.y);
        let z = Jet::new(d.z, DVec3::Z) * (1.0 / self.radii.z);
        let r = (x.square() + y.square() + z.square()).sqrt();
        if r.value < 0.05 {
            return Jet::constant(-0.9 * self.radii.min_element());
        }
        let rho2 = Jet::new(d.length_squared(), 2.0 * d);
        let rho = rho2.sqrt();
        (rho - rho.over(r)).to_distance()
    }

    fn at_least(&self, p: DVec3) -> f64 {
        // Leaning moves the ends by lean × height.
        let half = self.radii + DVec3::new(0.0, self.lean.abs() * self.radii.z, 0.0);
        box_distance(p, self.centre - half, self.centre + half)
    }
}

/// A part of the left side, or its mirror image on the right.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sided<'a, S> {
    part: &'a S,
    mirror: DVec3,
}

impl<'a, S: Solid> Sided<'a, S> {
    /// The part itself for a `side` that is not negative, else its mirror image in x = 0.
    pub(crate) fn new(part: &'a S, side: f64) -> Self {
        Self { part, mirror: DVec3::new(if side < 0.0 { -1.0 } else { 1.0 }, 1.0, 1.0) }
    }
}

impl<S: Solid> Solid for Sided<'_, S> {
    fn at(&self, p: DVec3) -> Jet {
        let jet = self.part.at(p * self.mirror);
        Jet::new(jet.value, jet.gradient * self.mirror)
    }

    fn at_least(&self, p: DVec3) -> f64 {
        self.part.at_least(p * self.mirror)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_sweep_is_a_cylinder() {
        let section = [0.0, 0.0, 0.1, 0.1, 0.1];
        let cylinder = Sweep::upright(2.0, &[(0.0, section), (1.0, section)], [0.01, 0.01]);
        let at = cylinder.at(DVec3::new(0.12, 0.16, 0.5));
        assert!((at.value - 0.1).abs() < 1e-12);
        assert!((at.gradient - DVec3::new(0.6, 0.8, 0.0)).length() < 1e-12);
        assert!((cylinder.at(DVec3::new(0.0, 0.0, 1.2)).value - 0.2).abs() < 1e-12);
        assert!(cylinder.at(DVec3::new(0.0, 0.0, 0.5)).value < 0.0);
    }

    #[test]
    fn a_cone_s_field_is_a_distance_to_first_order() {
        let stations = [(0.0, [0.0, 0.0, 0.3, 0.3, 0.3]), (0.3, [0.0, 0.0, 0.0, 0.0, 0.0].map(|_: f64| 1e-9))];
        let cone = Sweep::upright(2.0, &stations, [0.001, 0.001]);
        // Half way up a cone of 45 degrees, 0.01 outside it horizontally.
        let at = cone.at(DVec3::new(0.16, 0.0, 0.15));
        assert!((at.value - 0.01 / 2f64.sqrt()).abs() < 1e-4, "{}", at.value);
    }

    #[test]
    fn an_ellipsoid_vanishes_on_its_surface() {
        let e = Ellipsoid { centre: DVec3::ZERO, radii: DVec3::new(0.1, 0.2, 0.3), lean: 0.2 };
        for p in [DVec3::new(0.1, 0.0, 0.0), DVec3::new(0.0, 0.2, 0.0), DVec3::new(0.0, 0.06, 0.3)] {
            assert!(e.at(p).value.abs() < 1e-12);
        }
    }

    #[test]
    fn profiles_reproduce_parabolas_inside_and_are_constant_beyond() {
        let stations: Vec<(f64, [f64; 1])> = [0.0, 1.0, 2.5, 3.0, 4.0].iter().map(|&s| (s, [s * s])).collect();
        let profile = Profile::new(&stations);
        assert!((profile.values(1.7)[0] - 1.7 * 1.7).abs() < 1e-12);
        assert!((profile.values(2.8)[0] - 2.8 * 2.8).abs() < 1e-12);
        assert_eq!(profile.values(9.0), [16.0]);
        assert_eq!(profile.values(-1.0), [0.0]);
    }
}
