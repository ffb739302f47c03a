//! Solids as fields: negative inside, positive outside, near the surface the distance in metres.
//!
//! A swept superellipse has at coordinate t along its axis the section (|u−c_u|/a)ⁿ + (|v−c_v|/b)ⁿ = 1, b being b₋ for
//! v < c_v and b₊ for v > c_v. With r the left side to the power 1/n and ρ the distance from the section's centre, ρ (1 − 1/r) is the
//! distance along the ray from the centre; divided by the length of its gradient it is the distance to first order.
//! An ellipsoid is |p/r| (|p/r| − 1) / |p/r²| (I. Quilez). Solids are joined by the smooth minimum of [`Jet`].
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, b₋, b₊ | half breadth, half depths to the negative and positive side of v | m |
//! | n | exponent, 2 for an ellipse | – |
//!
//! Limits: away from the surface the value is only of the right sign and order, not the distance.

use glam::DVec3;

use super::jet::Jet;
use super::profile::Profile;

/// Anything with a signed field.
pub(crate) trait Solid: Sync {
    /// The field and its gradient at `p`, m.
    fn at(&self, p: DVec3) -> Jet;

    /// A lower bound of the distance to `p`, cheaper than the field, m.
    fn at_least(&self, p: DVec3) -> f64 {
        let _ = p;
        0.0
    }

    /// `field` joined with this solid over the width `k`, the solid left out where it is too far to matter: where its
    /// least distance is over one and a half times what could, for the field is a distance only to first order.
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

/// The box of the stations' sections in the sweep's frame, with a tenth more for what the curve does between them.
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
            // Near the axis the quotient below is undefined; all that matters there is that it is inside.
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
}
