//! Cylinders and elliptic cylinders fitted to a slice by least squares.
//!
//! In the slice's plane, about points p with weights w (a triangle's area at its centroid):
//!
//! - circle: min Σ w (x² + y² + c x + d y + e)² (Kåsa: "A circle fitting procedure and its error analysis", IEEE Trans. Instrum. Meas. 25, 1976);
//! - ellipse along the principal axes of the points: min Σ w (A x² + B y² + C x + D y − 1)².
//!
//! Where the fit is no ellipse, or its half axes differ from the spread of the points by more than a factor of 2, the slice is open
//! or lopsided (a shoulder, a crotch), and its moments replace the fit: half axes √2 σ about the mean, which are exact for a full
//! ring.
//!
//! ε is such that the quadric bounds its slice: with ρ(p) = |((x/a), (y/b))|, 1 + ε = max ρ over the corners of the
//! slice's triangles + o/min(a, b), o the cloth's offset. ρ is convex, so its maximum over a triangle is at a
//! corner; it grows by at most 1/min(a, b) a metre, so every contact is within the quadric.

use glam::DVec2;

use crate::base::math;

/// An ellipse in the plane of a slice, and the factor by which it must grow to bound the slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quadric {
    /// Centre, m.
    pub centre: DVec2,
    /// Unit vector along the first half axis.
    pub axis: DVec2,
    /// Half axes a and b, m; equal for a cylinder.
    pub half: DVec2,
    /// (1 + ε)².
    pub bound: f64,
    /// Whether least squares gave no ellipse and the moments replace it.
    pub by_moments: bool,
}

impl Quadric {
    /// ρ², which is 1 on the quadric.
    #[inline]
    pub(crate) fn level(&self, p: DVec2) -> f64 {
        let q = p - self.centre;
        let (x, y) = (q.dot(self.axis) / self.half.x, self.axis.perp_dot(q) / self.half.y);
        x * x + y * y
    }

    /// Fits points with weights; `round` for a cylinder. `None` for fewer than three points.
    pub(crate) fn fit(points: &[(DVec2, f64)], round: bool) -> Option<Self> {
        let weight: f64 = points.iter().map(|p| p.1).sum();
        if points.len() < 3 || weight <= 0.0 {
            return None;
        }
        let mean = points.iter().map(|(p, w)| *p * *w).sum::<DVec2>() / weight;
        let second = |f: fn(DVec2) -> f64| points.iter().map(|(p, w)| f(*p - mean) * w).sum::<f64>() / weight;
        let (xx, xy, yy) = (second(|p| p.x * p.x), second(|p| p.x * p.y), second(|p| p.y * p.y));
        let axis = if round { DVec2::X } else { math::unit(0.5 * math::atan2(2.0 * xy, xx - yy)) };
        let spread = |a: DVec2| (2.0 * (xx * a.x * a.x + 2.0 * xy * a.x * a.y + yy * a.y * a.y)).max(0.0).sqrt();
        let mut half = DVec2::new(spread(axis), spread(axis.perp()));
        if round {
            half = DVec2::splat((0.5 * half.length_squared()).sqrt());
        }
        let size = half.max_element();
        if size.is_nan() || size <= 0.0 {
            return None;
        }
        half = half.max(DVec2::splat(1e-3 * size));
        // Scaled to about 1, so that the normal equations are well conditioned.
        let scaled: Vec<(DVec2, f64)> = points
            .iter()
            .map(|&(p, w)| (DVec2::new((p - mean).dot(axis), axis.perp_dot(p - mean)) / size, w / weight))
            .collect();
        let found = if round { circle(&scaled) } else { ellipse(&scaled) };
        let sound = |(centre, found): &(DVec2, DVec2)| {
            let ratio = *found * size / half;
            centre.length() < 1.0 && (0.5..=2.0).contains(&ratio.x) && (0.5..=2.0).contains(&ratio.y)
        };
        Some(match found.filter(sound) {
            Some((centre, found)) => {
                let centre = mean + size * (axis * centre.x + axis.perp() * centre.y);
                Self { centre, axis, half: found * size, bound: 1.0, by_moments: false }
            }
            None => Self { centre: mean, axis, half, bound: 1.0, by_moments: true },
        })
    }

    /// Sets ε so that `corners` and all points within `offset` (m) of them lie inside.
    pub(crate) fn enclose(&mut self, corners: impl Iterator<Item = DVec2>, offset: f64) {
        let farthest = corners.map(|p| self.level(p)).fold(0.0, f64::max).sqrt();
        self.bound = (farthest + offset / self.half.min_element()).powi(2);
    }

    /// The ellipse at 1 + ε as a closed line of points in the plane.
    pub(crate) fn outline(&self) -> impl Iterator<Item = DVec2> + '_ {
        let grown = self.half * self.bound.sqrt();
        (0..=32).map(move |i| {
            let (sin, cos) = math::sin_cos(std::f64::consts::TAU * f64::from(i) / 32.0);
            self.centre + self.axis * (grown.x * cos) + self.axis.perp() * (grown.y * sin)
        })
    }
}

/// Weighted least squares of rows·c = b.
fn least_squares<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64, f64)>) -> Option<[f64; N]> {
    let (mut normal, mut side) = ([[0.0; N]; N], [0.0; N]);
    for (row, b, w) in rows {
        for i in 0..N {
            side[i] += w * row[i] * b;
            for j in 0..N {
                normal[i][j] += w * row[i] * row[j];
            }
        }
    }
    // Gauss's elimination with row pivots.
    for k in 0..N {
        let pivot = (k..N).fold(k, |best, i| if normal[i][k].abs() > normal[best][k].abs() { i } else { best });
        normal.swap(k, pivot);
        side.swap(k, pivot);
        for i in k + 1..N {
            let share = normal[i][k] / normal[k][k];
            let above = normal[k];
            normal[i].iter_mut().zip(above).for_each(|(entry, above)| *entry -= share * above);
            side[i] -= share * side[k];
        }
    }
    let mut c = [0.0; N];
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|j| normal[i][j] * c[j]).sum();
        c[i] = (side[i] - known) / normal[i][i];
    }
    c.iter().all(|c| c.is_finite()).then_some(c)
}

/// Centre, and the radius as both half axes.
fn circle(points: &[(DVec2, f64)]) -> Option<(DVec2, DVec2)> {
    let [c, d, e] = least_squares(points.iter().map(|(p, w)| ([p.x, p.y, 1.0], -p.length_squared(), *w)))?;
    let centre = DVec2::new(-0.5 * c, -0.5 * d);
    let squared = centre.length_squared() - e;
    (squared > 0.0).then(|| (centre, DVec2::splat(squared.sqrt())))
}

/// Centre and half axes.
fn ellipse(points: &[(DVec2, f64)]) -> Option<(DVec2, DVec2)> {
    let [a, b, c, d] = least_squares(points.iter().map(|(p, w)| ([p.x * p.x, p.y * p.y, p.x, p.y], 1.0, *w)))?;
    let centre = DVec2::new(-0.5 * c / a, -0.5 * d / b);
    // A (x − x₀)² + B (y − y₀)² = 1 + A x₀² + B y₀².
    let right = 1.0 + a * centre.x * centre.x + b * centre.y * centre.y;
    let half = DVec2::new(right / a, right / b);
    (half.min_element() > 0.0).then(|| (centre, DVec2::new(half.x.sqrt(), half.y.sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(centre: DVec2, turn: f64, half: DVec2, share: f64) -> Vec<(DVec2, f64)> {
        (0..60)
            .map(|i| {
                let (sin, cos) = (share * std::f64::consts::TAU * f64::from(i) / 60.0).sin_cos();
                (centre + DVec2::from_angle(turn).rotate(DVec2::new(half.x * cos, half.y * sin)), 1.0)
            })
            .collect()
    }

    #[test]
    fn points_on_an_ellipse_give_it_back() {
        let (centre, half) = (DVec2::new(0.3, -0.1), DVec2::new(0.16, 0.1));
        let found = Quadric::fit(&ring(centre, 0.7, half, 1.0), false).unwrap();
        assert!(!found.by_moments);
        assert!(found.centre.distance(centre) < 1e-9 && found.half.distance(half) < 1e-9, "{found:?}");
        assert!(found.axis.perp_dot(DVec2::from_angle(0.7)).abs() < 1e-9);
        // Three quarters of a circle suffice.
        let found = Quadric::fit(&ring(centre, 0.0, DVec2::splat(0.05), 0.75), true).unwrap();
        assert!(found.centre.distance(centre) < 1e-9 && (found.half.x - 0.05).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn points_without_an_ellipse_are_fitted_by_moments_and_bounded() {
        let line: Vec<(DVec2, f64)> = (0..9).map(|i| (DVec2::new(f64::from(i), 0.0), 1.0)).collect();
        let mut found = Quadric::fit(&line, false).unwrap();
        assert!(found.by_moments);
        found.enclose(line.iter().map(|p| p.0), 0.5);
        assert!(line.iter().all(|(p, _)| found.level(*p) < found.bound));
        assert!(Quadric::fit(&line[..2], true).is_none());
    }

    #[test]
    fn nothing_within_the_offset_is_outside() {
        let points = ring(DVec2::ZERO, 0.3, DVec2::new(0.16, 0.1), 0.6);
        let mut found = Quadric::fit(&points, true).unwrap();
        found.enclose(points.iter().map(|p| p.0), 0.01);
        for (p, _) in &points {
            for i in 0..16 {
                let near = *p + 0.0099 * DVec2::from_angle(f64::from(i));
                assert!(found.level(near) < found.bound);
            }
        }
    }
}
