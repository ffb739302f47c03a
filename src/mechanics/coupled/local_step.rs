//! The local step of stage two: the deformation gradient nearest to a given one at least energy, in closed form.
//!
//! Z = argmin ψ(Z) + w/2 |Z − F|²,  ψ = Σᵢ ½ k(θᵢ) (σᵢ − 1)² where σᵢ > 1, ½ k_c (σᵢ − 1)² where σᵢ < 1.
//!
//! ψ depends on the singular values σᵢ of F alone, so Z has the singular vectors of F and the values (k + w σ)/(k + w). With
//! C = FᵀF, Z = F M, where M is the symmetric function of C with these ratios.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F, Z | deformation gradients, columns along weft and warp | – |
//! | k(θ) | stiffness of a uniaxial pull: 1/k = c⁴/k_u + s⁴/k_v + s²c² (1/μ − 2ν/√(k_u k_v)) | N/m |
//! | k_c | stiffness under compression | N/m |
//! | w | penalty | N/m |
//!
//! Source: the relaxed energy of tension field theory (Pipkin 1986) in its principal directions; the off-axis compliance of an
//! orthotropic lamina (Jones: "Mechanics of Composite Materials"). Limits: under biaxial tension Poisson's ratio has no effect, and θ is
//! taken from F, so that with unequal stiffness Z is a minimum to first order in the anisotropy.

use glam::DVec3;

use crate::garment::fabric::Fabric;
use crate::mechanics::energy::membrane::Stiffness;

/// Square of the least singular value: a triangle without any extent keeps a direction.
const MIN_SQUARE: f64 = 1e-12;

/// Stiffness of a triangle in tension and under compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TensionField {
    /// 1/k_u, 1/k_v, and 1/μ − 2ν/√(k_u k_v), m/N.
    compliance: [f64; 3],
    /// k_c, N/m.
    compression: f64,
}

impl TensionField {
    pub(super) fn new(fabric: &Fabric, stiffness: &Stiffness, compression: f64) -> Self {
        let (k_u, k_v) = (fabric.stretch_weft_n_per_m, fabric.stretch_warp_n_per_m);
        let off_axis =
            stiffness.shear.max(f64::MIN_POSITIVE.sqrt()).recip() - 2.0 * fabric.poisson / (k_u * k_v).sqrt();
        Self { compliance: [k_u.recip(), k_v.recip(), off_axis.max(0.0)], compression }
    }

    /// k(θ), N/m, from cos²θ.
    fn tension(&self, cos2: f64) -> f64 {
        let sin2 = 1.0 - cos2;
        let [u, v, off_axis] = self.compliance;
        (cos2 * cos2 * u + sin2 * sin2 * v + sin2 * cos2 * off_axis).recip()
    }

    /// Z of the columns of F.
    #[inline]
    pub(super) fn proximal(&self, [u, v]: [DVec3; 2], w: f64) -> [DVec3; 2] {
        let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
        let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
        let radius = (half * half + b * b).sqrt();
        let (larger, smaller) = (mean + radius, (mean - radius).max(MIN_SQUARE));
        // cos² of the angle between the weft and the direction of the larger stretch.
        let along = if radius > MIN_SQUARE { 0.5 * (1.0 + half / radius) } else { 0.5 };
        let ratio = |square: f64, cos2: f64| {
            let stretch = square.sqrt();
            let k = if stretch > 1.0 { self.tension(cos2) } else { self.compression };
            (k + w * stretch) / ((k + w) * stretch)
        };
        let (first, second) = (ratio(larger, along), ratio(smaller, 1.0 - along));
        let slope = (first - second) / (larger - smaller).max(MIN_SQUARE);
        let (uu, vv, uv) = (second + slope * (a - smaller), second + slope * (c - smaller), slope * b);
        [u * uu + v * uv, u * uv + v * vv]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn isotropic(tension: f64, compression: f64) -> TensionField {
        TensionField { compliance: [tension.recip(), tension.recip(), 2.0 * tension.recip()], compression }
    }

    /// Singular values by the eigenvalues of FᵀF.
    fn stretches([u, v]: [DVec3; 2]) -> [f64; 2] {
        let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
        let radius = (0.25 * (a - c) * (a - c) + b * b).sqrt();
        [1.0, -1.0].map(|sign| (0.5 * (a + c) + sign * radius).max(0.0).sqrt())
    }

    #[test]
    fn the_local_step_minimises_the_energy_and_the_distance_together() {
        let (k, k_c, w) = (60.0, 0.5, 2.0);
        let field = isotropic(k, k_c);
        let objective = |z: [DVec3; 2], f: [DVec3; 2]| {
            let energy = |s: f64| 0.5 * if s > 1.0 { k } else { k_c } * (s - 1.0) * (s - 1.0);
            let distance = z[0].distance_squared(f[0]) + z[1].distance_squared(f[1]);
            stretches(z).map(energy).iter().sum::<f64>() + 0.5 * w * distance
        };
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        for _ in 0..200 {
            let mut vector = || DVec3::new(random(), random(), random()) * 2.5;
            let f = [vector(), vector()];
            let z = field.proximal(f, w);
            let best = objective(z, f);
            for _ in 0..20 {
                let moved = [z[0] + 1e-3 * vector(), z[1] + 1e-3 * vector()];
                assert!(objective(moved, f) > best, "{f:?}");
            }
        }
    }

    #[test]
    fn an_off_axis_pull_has_the_compliance_of_an_orthotropic_sheet() {
        let field = TensionField { compliance: [1.0 / 40.0, 1.0 / 90.0, 1.0 / 12.0], compression: 0.0 };
        assert!((field.tension(1.0) - 40.0).abs() < 1e-12 && (field.tension(0.0) - 90.0).abs() < 1e-12);
        let bias = 0.25 / 40.0 + 0.25 / 90.0 + 0.25 / 12.0;
        assert!((field.tension(0.5) * bias - 1.0).abs() < 1e-12);
        // Pulled by 10 % along the bias alone: what is left is w/(k + w) of the strain.
        let half = 0.5 * 0.1;
        let f = [DVec3::new(1.0 + half, half, 0.0), DVec3::new(half, 1.0 + half, 0.0)];
        let w = 3.0;
        let [larger, smaller] = stretches(field.proximal(f, w));
        assert!((larger - 1.0 - 0.1 * w / (1.0 / bias + w)).abs() < 1e-12, "{larger}");
        assert!((smaller - 1.0).abs() < 1e-12);
    }
}
