//! Folds that no PART resolves: excess length of the cloth against its surface, and the direction of the excess.
//!
//! Where a PART is too wide to fold, tension field theory lets its cloth be compressed at almost no cost in energy. Compressed cloth
//! would lie in folds. With σ₂ the smaller singular value of the deformation gradient F of a triangle, its excess length is 1 − σ₂ where
//! positive, along F v₂ / σ₂: the direction across the folds. A vertex sums the excess times d dᵀ over its triangles, weighted by
//! rest area; the largest eigenvalue is its excess, the eigenvector its direction.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F | deformation gradient, columns along weft and warp | – |
//! | 1 − σ₂ | excess length | % in results, – inside |
//! | d | direction across the folds, without a sign | – |
//!
//! Source: own, after the wrinkle strain of tension field theory (Roddeman and others: "The wrinkling of membranes", J. Appl. Mech. 54,
//! 1987). Limits: depth and number of the folds are unknown; cloth that is held or pressed flat shows none.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::energy::Cloth;
use super::linear_algebra::eigen;
use crate::base::math;
use crate::mesh::outer;

/// Excess length per vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Folds {
    /// Excess length, percent.
    pub excess_percent: Vec<f64>,
    /// Unit direction across the folds; zero where there is no excess.
    pub across: Vec<DVec3>,
}

/// The folds of `cloth` at `x` (m).
pub(crate) fn folds(cloth: &Cloth, x: &[DVec3]) -> Folds {
    let mut sum = vec![DMat3::ZERO; x.len()];
    let mut area = vec![0.0; x.len()];
    for triangle in cloth.triangles.iter().filter(|t| t.has_strain()) {
        let (excess, across) = excess(triangle.deformation(x));
        let tensor = outer(across, across) * (excess * triangle.area);
        for v in triangle.vertices.map(|v| v as usize) {
            sum[v] += tensor;
            area[v] += triangle.area;
        }
    }
    let of_vertex = |(tensor, area): (&DMat3, &f64)| -> (f64, DVec3) {
        if *area <= 0.0 || *tensor == DMat3::ZERO {
            return (0.0, DVec3::ZERO);
        }
        let (values, vectors) = eigen(*tensor * area.recip());
        let largest = (0..3).fold(0, |best, k| if values[k] > values[best] { k } else { best });
        (100.0 * values[largest].max(0.0), vectors[largest])
    };
    let (excess_percent, across) = sum.par_iter().zip(&area).with_min_len(256).map(of_vertex).unzip();
    Folds { excess_percent, across }
}

/// 1 − σ₂, at least zero, and its unit direction in space.
fn excess([fu, fv]: [DVec3; 2]) -> (f64, DVec3) {
    let (excess, v2) = compression([fu, fv]);
    let across = (fu * v2.x + fv * v2.y).normalize_or_zero();
    (excess, if across == DVec3::ZERO { fu.normalize_or_zero() } else { across })
}

/// 1 − σ₂, at least zero, and v₂ in the rest shape: the weft for equal compression in every direction.
pub(super) fn compression([fu, fv]: [DVec3; 2]) -> (f64, DVec2) {
    let (a, b, c) = (fu.length_squared(), fv.length_squared(), fu.dot(fv));
    let least = (0.5 * (a + b) - math::hypot(0.5 * (a - b), c)).max(0.0);
    // (C − σ₂²) v₂ = 0 for C = [[a, c], [c, b]]; the longer of the two rows is better conditioned.
    let (p, q) = if math::hypot(a - least, c) >= math::hypot(c, b - least) { (-c, a - least) } else { (b - least, -c) };
    ((1.0 - least.sqrt()).max(0.0), DVec2::new(p, q).try_normalize().unwrap_or(DVec2::X))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excess_is_one_minus_the_smaller_singular_value_along_its_direction() {
        let (none, _) = excess([DVec3::X * 1.02, DVec3::Y]);
        assert!(none < 1e-12);
        let (excess_along, across) = excess([DVec3::X * 1.1, DVec3::Z * 0.7]);
        assert!((excess_along - 0.3).abs() < 1e-12 && across.dot(DVec3::Z).abs() > 1.0 - 1e-12);
        // At 45 degrees to the grain: F v = 0.8 v for v = (1, 1)/√2, and (1, −1)/√2 keeps its length.
        let turned = excess([DVec3::new(0.9, -0.1, 0.0), DVec3::new(-0.1, 0.9, 0.0)]);
        assert!((turned.0 - 0.2).abs() < 1e-12);
        assert!(turned.1.dot(DVec3::new(1.0, 1.0, 0.0).normalize()).abs() > 1.0 - 1e-12);
    }
}
