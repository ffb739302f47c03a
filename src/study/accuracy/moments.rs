//! Squared error of the best motion of a piece of cloth, from sums over its vertices.
//!
//! With u the displacements and x the positions of n vertices, ū and x̄ their means, d = x − x̄ and c = u − ū,
//!
//! ```text
//! translation: e = Σ|c|²
//! affine:      e = min over A of Σ|c − A d|² + λ|A|² = Σ|c|² − tr R N⁻¹ Rᵀ,   R = Σ c dᵀ,   N = Σ d dᵀ + λ
//! ```
//!
//! so that e follows from sums.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u, x | displacement and position before it | m |
//! | A | displacement gradient | – |
//! | λ | ridge: a share of Σ\|d\|² | m² |
//! | e | squared error | m² |
//!
//! Source: textbook least squares. Limits: as in the coupled model, a piece of at most three vertices translates
//! only; differences of sums lose digits far from the origin, so `x` and `u` are taken relative to their mean.

use std::ops::AddAssign;

use glam::{DMat3, DVec3};

use crate::mechanics::coupled::Motion;
use crate::mechanics::energy::membrane::outer;

/// Ridge λ relative to Σ|d|². It regularises the direction normal to a flat piece; larger values would bias the others.
const RIDGE: f64 = 1e-9;

/// A piece of at most this many vertices translates only, as in [`Motions`](crate::mechanics::coupled::Motions).
const SMALL: f64 = 3.0;

/// Sums over the vertices of a piece: 1, x, u, |u|², x xᵀ (its upper half), u xᵀ.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Moments([f64; 23]);

impl AddAssign<&Moments> for Moments {
    fn add_assign(&mut self, other: &Moments) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a += b);
    }
}

impl Moments {
    /// The sums of one vertex.
    pub(crate) fn of(x: DVec3, u: DVec3) -> Self {
        #[rustfmt::skip]
        let sums = [
            1.0, x.x, x.y, x.z, u.x, u.y, u.z, u.length_squared(),
            x.x * x.x, x.x * x.y, x.x * x.z, x.y * x.y, x.y * x.z, x.z * x.z,
            u.x * x.x, u.y * x.x, u.z * x.x, u.x * x.y, u.y * x.y, u.z * x.y, u.x * x.z, u.y * x.z, u.z * x.z,
        ];
        Self(sums)
    }

    /// The sums of each vertex, relative to the mean of all these vertices.
    pub(crate) fn of_each(vertices: &[u32], x: &[DVec3], u: &[DVec3]) -> Vec<Self> {
        let mean =
            |of: &[DVec3]| vertices.iter().map(|&v| of[v as usize]).sum::<DVec3>() / vertices.len().max(1) as f64;
        let (x0, u0) = (mean(x), mean(u));
        vertices.iter().map(|&v| Self::of(x[v as usize] - x0, u[v as usize] - u0)).collect()
    }

    /// The squared error e of the best motion, m²; 0 for a single vertex.
    pub(crate) fn error(&self, motion: Motion) -> f64 {
        let [n, x0, x1, x2, u0, u1, u2, uu, xx, xy, xz, yy, yz, zz, ref ux @ ..] = self.0;
        if n <= 1.0 {
            return 0.0;
        }
        let (x, u) = (DVec3::new(x0, x1, x2), DVec3::new(u0, u1, u2));
        let (middle, mean) = (x / n, u / n);
        let spread = (uu - u.dot(mean)).max(0.0);
        if motion == Motion::Translation || n <= SMALL {
            return spread;
        }
        let normal = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]) - outer(x, middle);
        let right = DMat3::from_cols_array(ux) - outer(u, middle);
        let ridge = RIDGE * (normal.x_axis.x + normal.y_axis.y + normal.z_axis.z);
        if ridge <= 0.0 {
            return spread;
        }
        // N = L D Lᵀ and R = Y Lᵀ. The factorisation is accurate for flat pieces, for which the inverse of N is not.
        let n = (normal + DMat3::from_diagonal(DVec3::splat(ridge))).to_cols_array_2d();
        let d0 = n[0][0];
        let (l10, l20) = (n[0][1] / d0, n[0][2] / d0);
        let d1 = n[1][1] - l10 * l10 * d0;
        let l21 = (n[1][2] - l10 * l20 * d0) / d1;
        let d2 = n[2][2] - l20 * l20 * d0 - l21 * l21 * d1;
        let y0 = right.x_axis;
        let y1 = right.y_axis - y0 * l10;
        let y2 = right.z_axis - y0 * l20 - y1 * l21;
        let represented = y0.length_squared() / d0 + y1.length_squared() / d1 + y2.length_squared() / d2;
        // The pivots of a piece without extent are rounding errors.
        if represented.is_finite() { (spread - represented).clamp(0.0, spread) } else { spread }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_affine_map_has_no_affine_error() {
        let x: Vec<DVec3> =
            (0..40).map(|i| DVec3::new(f64::from(i % 7), f64::from(i / 7), f64::from(i * i % 5))).collect();
        let map = DMat3::from_cols(DVec3::new(0.3, -1.0, 0.2), DVec3::new(0.1, 0.7, 2.0), DVec3::new(-0.4, 0.5, 0.6));
        let u: Vec<DVec3> =
            x.iter().enumerate().map(|(i, x)| map * *x + if i < 30 { DVec3::ONE } else { DVec3::NEG_ONE }).collect();
        let all: Vec<u32> = (0..40).collect();
        let each = Moments::of_each(&all, &x, &u);
        let mut sums = Moments::default();
        each.iter().for_each(|m| sums += m);
        // The jump between the two halves remains.
        let jump = sums.error(Motion::Affine);
        assert!(jump > 10.0 && jump < 0.5 * sums.error(Motion::Translation), "{jump}");
        let mut first = Moments::default();
        each[..30].iter().for_each(|m| first += m);
        assert!(first.error(Motion::Affine) < 1e-6 * first.error(Motion::Translation));
        let mut three = Moments::default();
        each[..3].iter().for_each(|m| three += m);
        assert_eq!(three.error(Motion::Affine), three.error(Motion::Translation));
        assert!(three.error(Motion::Affine) > 0.0);
    }
}
