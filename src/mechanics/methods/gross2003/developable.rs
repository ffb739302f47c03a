//! Developable surfaces that bound a part of the body: cones and cylinders over a convex curve, and their unrolling.
//!
//! With an axis through the part, local coordinates (x, y) across it and z along it, a taper c and s(z) = 1 − c z, the surface is
//! (s(z) b, z) over the points b of a closed convex polygon: a cone with its apex on the axis at z = 1/c, a cylinder for c = 0. The
//! polygon is the convex hull of the part's points projected from the apex, (x, y)/s(z), grown by a clearance, so the surface bounds
//! the part by construction. It consists of plane facets and is unrolled facet by facet: the distance to the apex is kept and the angles
//! at the apex are summed; on a cylinder z is kept and the sides are summed. So unrolling is an exact isometry: of straight lines within
//! a facet, of paths on the surface across facets.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c | taper | 1/m |
//! | Ω | sum of angles or sides from the first corner of the polygon | rad or m |
//!
//! Source: Groß, Fuhrmann, Luckas 2003 lay pieces on developable bounding surfaces, cones and cylinders. Convex hulls as their sections
//! instead of circles are our reading, and bound a trunk more closely.

use glam::{DMat3, DVec2, DVec3};

use crate::base::math;
use crate::base::quantiles::extremes;
use crate::body::girth::hull;

/// Smallest taper of a cone, 1/m: its apex is ten kilometres away. A smaller one makes a cylinder.
const MIN_TAPER: f64 = 1e-4;
/// Smallest ratio of the polygon at an end to that in the middle; it limits the taper. A heuristic.
const MIN_END_RATIO: f64 = 0.2;
/// Tapers tried on either side of zero. A heuristic.
const TAPERS: i32 = 14;

/// A cone or cylinder over a convex polygon.
#[derive(Debug, Clone)]
pub struct Developable {
    origin: DVec3,
    /// Rotation from the world to the frame.
    turn: DMat3,
    taper: f64,
    /// The polygon at z = 0, counter-clockwise, m.
    base: Vec<DVec2>,
    /// Angle about the axis from the first corner to each corner, ascending.
    angles: Vec<f64>,
    /// Ω at each corner, and at the first one after a full turn.
    arcs: Vec<f64>,
    /// Ends along the axis, m.
    pub ends: [f64; 2],
}

impl Developable {
    /// The surface about `axis` that bounds `points` (m, world) with a clearance (m), with the taper that fits `placed` best by least
    /// squares. `None` where no surface bounds the points.
    #[must_use]
    pub fn around(points: &[DVec3], axis: DVec3, placed: &[DVec3], clearance: f64) -> Option<Self> {
        let origin = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        let x = if axis.z.abs() > 0.9 { DVec3::X } else { axis.cross(DVec3::Y).normalize_or(DVec3::X) };
        let x = (x - axis * axis.dot(x)).normalize_or(axis.any_orthonormal_vector());
        let turn = DMat3::from_cols(x, axis.cross(x), axis).transpose();
        let local = |p: &DVec3| turn * (*p - origin);
        let (own, cloth): (Vec<DVec3>, Vec<DVec3>) =
            (points.iter().map(local).collect(), placed.iter().map(local).collect());
        let (low, high) = extremes(own.iter().chain(&cloth).map(|p| p.z));
        let reach = low.abs().max(high.abs());
        let most = (1.0 - MIN_END_RATIO) / reach.max(1e-3);
        let mut best: Option<(f64, Self)> = None;
        for step in -TAPERS..=TAPERS {
            let taper = most * f64::from(step) / f64::from(TAPERS);
            let Some(found) = Self::with_taper(&own, taper, clearance, origin, turn, [low, high]) else { continue };
            let off: f64 = cloth.iter().map(|p| found.radial_distance(*p).powi(2)).sum();
            if best.as_ref().is_none_or(|(least, _)| off < *least) {
                best = Some((off, found));
            }
        }
        best.map(|(_, found)| found)
    }

    /// The surface with this taper (1/m) that bounds points given in the frame (m).
    pub(crate) fn with_taper(
        local: &[DVec3],
        taper: f64,
        clearance: f64,
        origin: DVec3,
        turn: DMat3,
        ends: [f64; 2],
    ) -> Option<Self> {
        let taper = if taper.abs() < MIN_TAPER { 0.0 } else { taper };
        let projected: Vec<DVec2> = local.iter().map(|p| p.truncate() / (1.0 - taper * p.z)).collect();
        // The clearance at the narrowest end and for the slant, projected from the apex.
        let narrow = ends.map(|z| 1.0 - taper * z).into_iter().fold(f64::INFINITY, f64::min);
        let corners = hull(projected);
        let widest = corners.iter().map(|b| b.length()).fold(0.0, f64::max);
        let grown = clearance / narrow * (1.0 + (taper * widest).powi(2)).sqrt();
        let around = |b: &DVec2| {
            let b = *b;
            // A polygon of 16 sides around the disc of the clearance.
            let reach = grown / math::cos(std::f64::consts::PI / 16.0);
            (0..16).map(move |k| b + reach * math::unit(std::f64::consts::TAU * f64::from(k) / 16.0))
        };
        let base = hull(corners.iter().flat_map(around).collect());
        let holds_axis = (0..base.len()).all(|i| base[i].perp_dot(base[(i + 1) % base.len()]) > 0.0);
        if base.len() < 3 || !holds_axis || narrow <= 0.0 {
            return None;
        }
        let angles = base.iter().map(|&b| angle_between(base[0], b)).collect();
        let mut arcs = vec![0.0];
        for i in 0..base.len() {
            let (a, b) = (base[i], base[(i + 1) % base.len()]);
            arcs.push(arcs[i] + along(taper, a, b));
        }
        Some(Self { origin, turn, taper, base, angles, arcs, ends })
    }

    /// A point of the world in the frame, m.
    fn local(&self, x: DVec3) -> DVec3 {
        self.turn * (x - self.origin)
    }

    /// The facet in a direction across the axis, and the point of the polygon there.
    fn facet_at(&self, p: DVec2) -> (usize, DVec2) {
        let n = self.base.len();
        let angle = angle_between(self.base[0], p);
        let i = self.angles.partition_point(|&a| a <= angle).max(1) - 1;
        let (a, b) = (self.base[i], self.base[(i + 1) % n]);
        let side = b - a;
        // t p = a + u side.
        let t = a.perp_dot(side) / p.perp_dot(side);
        (i, p * t)
    }

    /// Distance from the surface along the radius of a point given in the frame, m; negative inside.
    fn radial_distance(&self, p: DVec3) -> f64 {
        let flat = p.truncate();
        if flat.length_squared() < 1e-18 {
            return -self.base.iter().map(|b| b.length()).fold(f64::INFINITY, f64::min);
        }
        flat.length() - self.facet_at(flat).1.length() * (1.0 - self.taper * p.z)
    }

    /// Distance from the surface along the radius of a point of the world, m; negative inside.
    #[must_use]
    pub fn outside(&self, x: DVec3) -> f64 {
        self.radial_distance(self.local(x))
    }

    /// Ω at the radial projection of a point of the world.
    pub(super) fn arc_at(&self, x: DVec3) -> f64 {
        let p = self.local(x).truncate();
        let (i, b) = self.facet_at(if p.length_squared() > 0.0 { p } else { DVec2::X });
        self.arcs[i] + along(self.taper, self.base[i], b)
    }

    /// The radial projection of `x` on the surface unrolled from Ω = `origin` to both sides, m: to the right as
    /// seen from outside, and up the axis.
    pub(crate) fn unrolled(&self, x: DVec3, origin: f64) -> DVec2 {
        let p = self.local(x);
        let whole = self.arcs[self.base.len()];
        let arc = self.arc_at(x) - origin;
        let arc = arc - whole * (arc / whole).round();
        if self.taper == 0.0 {
            return DVec2::new(arc, p.z);
        }
        let (_, b) = self.facet_at(if p.truncate().length_squared() > 0.0 { p.truncate() } else { DVec2::X });
        let (height, s) = (1.0 / self.taper, 1.0 - self.taper * p.z);
        let r = b.extend(-height).length() * s;
        let (sin, cos) = math::sin_cos(arc);
        DVec2::new(r * sin, height - height.signum() * r * cos)
    }

    /// The point of the world to which a flat point (m) is rolled.
    pub(crate) fn rolled(&self, flat: DVec2, origin: f64) -> DVec3 {
        let n = self.base.len();
        let height = if self.taper == 0.0 { 0.0 } else { 1.0 / self.taper };
        let from_apex = DVec2::new(flat.x, (height - flat.y) * height.signum());
        let arc = if self.taper == 0.0 { flat.x } else { math::atan2(from_apex.x, from_apex.y) };
        let arc = (origin + arc).rem_euclid(self.arcs[self.base.len()]);
        let i = (self.arcs.partition_point(|&a| a <= arc).max(1) - 1).min(n - 1);
        let (a, b, rest) = (self.base[i], self.base[(i + 1) % n], arc - self.arcs[i]);
        let local = if self.taper == 0.0 {
            (a + (b - a).normalize_or_zero() * rest).extend(flat.y)
        } else {
            let [a, b] = [a, b].map(|p| p.extend(-height));
            let along = a.normalize_or_zero();
            let across = (b - along * along.dot(b)).normalize_or_zero();
            let (sin, cos) = math::sin_cos(rest);
            DVec3::Z * height + (along * cos + across * sin) * from_apex.length()
        };
        self.origin + self.turn.transpose() * local
    }

    /// The polygon at five heights and rulings of the surface as lines, m.
    pub(crate) fn outline(&self) -> Vec<Vec<DVec3>> {
        let back = self.turn.transpose();
        let at = |b: DVec2, z: f64| self.origin + back * (b * (1.0 - self.taper * z)).extend(z);
        let height = |k: i32| self.ends[0] + (self.ends[1] - self.ends[0]) * f64::from(k) / 4.0;
        let ring = |k: i32| self.base.iter().chain(self.base.first()).map(|b| at(*b, height(k))).collect();
        let every = self.base.len().div_ceil(16).max(1);
        let rulings = self.base.iter().step_by(every).map(|b| vec![at(*b, self.ends[0]), at(*b, self.ends[1])]);
        (0..=4).map(ring).chain(rulings).collect()
    }
}

/// Ω from a corner of the polygon to a point of its side: an angle at the apex, or a length on a cylinder.
fn along(taper: f64, a: DVec2, b: DVec2) -> f64 {
    if taper == 0.0 {
        return a.distance(b);
    }
    let [a, b] = [a, b].map(|p| p.extend(-1.0 / taper));
    math::atan2(a.cross(b).length(), a.dot(b))
}

/// Angle from `a` to `b` counter-clockwise, 0 to 2π.
fn angle_between(a: DVec2, b: DVec2) -> f64 {
    let angle = math::atan2(a.perp_dot(b), a.dot(b));
    if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rings of a circular cone of this radius at z = 0 and taper.
    fn rings(radius: f64, taper: f64) -> Vec<DVec3> {
        let ring = |z: f64| {
            (0..720).map(move |k| {
                (DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 720.0) * radius * (1.0 - taper * z)).extend(z)
            })
        };
        [-0.3, 0.0, 0.3].into_iter().flat_map(ring).collect()
    }

    #[test]
    fn a_round_cone_unrolls_to_its_sector() {
        for taper in [0.0, 0.8, -1.1_f64] {
            let cone =
                Developable::with_taper(&rings(0.2, taper), taper, 0.0, DVec3::ZERO, DMat3::IDENTITY, [-0.3, 0.3])
                    .unwrap();
            // The whole angle is 2π sin α, of a cylinder the girth.
            let exact = if taper == 0.0 { 0.2 } else { 0.2 / 0.2f64.hypot(1.0 / taper) } * std::f64::consts::TAU;
            let found = cone.arcs[cone.base.len()];
            assert!((found / exact - 1.0).abs() < 1e-4, "{taper}: {found} expected {exact}");
        }
    }

    #[test]
    fn rolling_undoes_unrolling_and_keeps_lengths() {
        for taper in [0.0, 0.8, -1.1] {
            let cone =
                Developable::with_taper(&rings(0.2, taper), taper, 0.01, DVec3::ZERO, DMat3::IDENTITY, [-0.3, 0.3])
                    .unwrap();
            let origin = cone.arc_at(DVec3::new(0.3, -0.4, 0.0));
            let spots: Vec<DVec2> = (-4..=4)
                .flat_map(|i| (-4..=4).map(move |j| DVec2::new(0.05 * f64::from(i), 0.06 * f64::from(j))))
                .collect();
            for &flat in &spots {
                let there = cone.rolled(flat, origin);
                assert!(cone.outside(there).abs() < 1e-12, "{taper}: off the surface by {}", cone.outside(there));
                assert!(cone.unrolled(there, origin).distance(flat) < 1e-12, "{taper}: {flat}");
                // Short segments keep their length: within a facet exactly, across an edge to second order.
                for by in [DVec2::X, DVec2::Y, DVec2::new(0.6, 0.8)] {
                    let length = there.distance(cone.rolled(flat + by * 1e-5, origin)) / 1e-5;
                    assert!((length - 1.0).abs() < 1e-3, "{taper}: {flat} {length}");
                }
                for &other in &spots {
                    let chord = there.distance(cone.rolled(other, origin));
                    assert!(chord <= flat.distance(other) + 1e-12);
                }
            }
            // Right is right as seen from outside, and up is up.
            let at = |x: f64, y: f64| cone.rolled(DVec2::new(x, y), origin);
            let outward = (at(0.0, 0.0) * DVec3::new(1.0, 1.0, 0.0)).normalize();
            assert!((at(0.01, 0.0) - at(0.0, 0.0)).cross(at(0.0, 0.01) - at(0.0, 0.0)).dot(outward) > 0.0);
            assert!(at(0.0, 0.01).z > at(0.0, 0.0).z);
        }
    }

    #[test]
    fn the_surface_bounds_its_points_by_the_clearance() {
        // Like a trunk: shifted ellipses.
        let ring = |z: f64| {
            (0..90).map(move |k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 90.0).sin_cos();
                DVec3::new((0.17 - 0.1 * z) * cos, 0.1 * sin + 0.08 * z, 1.0 + z)
            })
        };
        let points: Vec<DVec3> = (0..12).flat_map(|k| ring(0.05 * f64::from(k))).collect();
        let placed: Vec<DVec3> = points.iter().map(|p| DVec3::new(1.2 * p.x, 1.2 * p.y, p.z)).collect();
        let found = Developable::around(&points, DVec3::Z, &placed, 0.01).unwrap();
        let nearest = points.iter().map(|p| -found.outside(*p)).fold(f64::INFINITY, f64::min);
        assert!((0.0099..0.03).contains(&nearest), "{nearest}");
        assert!(found.taper > 0.1, "{}", found.taper);
    }
}
