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

use crate::base::simd::{Four, Lanes, Pack, Vectors, Work, run};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::membrane::Stiffness;

/// Square of the least singular value: a triangle without any extent keeps a direction.
const MIN_SQUARE: f64 = 1e-12;

/// Stiffness of four triangles in tension and under compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TensionFields {
    /// 1/k_u, 1/k_v, and 1/μ − 2ν/√(k_u k_v), m/N.
    compliance: [Four; 3],
    /// k_c, N/m.
    compression: Four,
}

impl Default for TensionFields {
    /// Of 1 N/m: for triangles that only pad.
    fn default() -> Self {
        let one = Four([1.0; 4]);
        Self { compliance: [one; 3], compression: one }
    }
}

impl TensionFields {
    /// Sets the stiffness of the i-th triangle.
    pub(super) fn set(&mut self, i: usize, fabric: &Fabric, stiffness: &Stiffness, compression: f64) {
        let (k_u, k_v) = (fabric.stretch_weft_n_per_m, fabric.stretch_warp_n_per_m);
        let off_axis =
            stiffness.shear.max(f64::MIN_POSITIVE.sqrt()).recip() - 2.0 * fabric.poisson / (k_u * k_v).sqrt();
        for (slot, value) in self.compliance.iter_mut().zip([k_u.recip(), k_v.recip(), off_axis.max(0.0)]) {
            slot.0[i] = value;
        }
        self.compression.0[i] = compression;
    }

    /// k(θ), N/m, from cos²θ.
    #[inline(always)]
    fn tension<L: Lanes>(&self, l: L, cos2: Pack<L>) -> Pack<L> {
        let one = Pack::splat(l, 1.0);
        let sin2 = one - cos2;
        let [u, v, off_axis] = [0, 1, 2].map(|k| Pack::load(l, &self.compliance[k]));
        one / (cos2 * cos2 * u + sin2 * sin2 * v + sin2 * cos2 * off_axis)
    }

    /// Z of the columns of F.
    #[inline(always)]
    pub(super) fn proximal<L: Lanes>(&self, l: L, [u, v]: [Vectors<L>; 2], w: Pack<L>) -> [Vectors<L>; 2] {
        let (one, half, least) = (Pack::splat(l, 1.0), Pack::splat(l, 0.5), Pack::splat(l, MIN_SQUARE));
        let (a, b, c) = (u.dot(u), u.dot(v), v.dot(v));
        let (mean, difference) = ((a + c) * half, (a - c) * half);
        let radius = (difference * difference + b * b).sqrt();
        let (larger, smaller) = ((mean + radius).max(least), (mean - radius).max(least));
        // cos² of the angle between the weft and the direction of the larger stretch.
        let along = (least - radius).if_negative((one + difference / radius) * half, half);
        let [first, second] = [self.ratio(l, larger, along, w), self.ratio(l, smaller, one - along, w)];
        let slope = (first - second) / (larger - smaller).max(least);
        let (uu, vv, uv) = (second + slope * (a - smaller), second + slope * (c - smaller), slope * b);
        [u * uu + v * uv, u * uv + v * vv]
    }

    /// (k + w σ)/((k + w) σ), from σ² and cos² of its direction.
    #[inline(always)]
    fn ratio<L: Lanes>(&self, l: L, square: Pack<L>, cos2: Pack<L>, w: Pack<L>) -> Pack<L> {
        let stretch = square.sqrt();
        let in_tension = Pack::splat(l, 1.0) - stretch;
        let k = in_tension.if_negative(self.tension(l, cos2), Pack::load(l, &self.compression));
        (k + w * stretch) / ((k + w) * stretch)
    }

    /// Z of one triangle.
    pub(super) fn proximal_of(&self, i: usize, f: [DVec3; 2], w: f64) -> [DVec3; 2] {
        let f = f.map(|column| column.to_array().map(|x| Four([x; 4])));
        let [u, v] = run(Proximal { fields: self, f, w });
        [u, v].map(|column| DVec3::from_array(column.map(|axis| axis.0[i])))
    }
}

/// Z of four triangles.
struct Proximal<'a> {
    fields: &'a TensionFields,
    f: [[Four; 3]; 2],
    w: f64,
}

impl Work for Proximal<'_> {
    type Output = [[Four; 3]; 2];

    #[inline(always)]
    fn with<L: Lanes>(self, l: L) -> [[Four; 3]; 2] {
        let f = [Vectors::load(l, &self.f[0]), Vectors::load(l, &self.f[1])];
        let [u, v] = self.fields.proximal(l, f, Pack::splat(l, self.w));
        [u.store(), v.store()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(compliance: [f64; 3], compression: f64) -> TensionFields {
        TensionFields { compliance: compliance.map(|c| Four([c; 4])), compression: Four([compression; 4]) }
    }

    #[test]
    fn a_triangle_without_extent_stays_without() {
        let fields = fields([1e-2, 1e-3, 1e-2], 1.0);
        assert_eq!(fields.proximal_of(0, [DVec3::ZERO; 2], 50.0), [DVec3::ZERO; 2]);
    }

    /// Singular values by the eigenvalues of FᵀF.
    fn stretches([u, v]: [DVec3; 2]) -> [f64; 2] {
        let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
        let radius = (0.25 * (a - c) * (a - c) + b * b).sqrt();
        [1.0, -1.0].map(|sign| (0.5 * (a + c) + sign * radius).max(0.0).sqrt())
    }

    #[test]
    fn the_local_step_minimises_the_energy_and_the_distance_together() {
        let (k, k_c, w) = (60.0_f64, 0.5, 2.0);
        let field = fields([k.recip(), k.recip(), 2.0 * k.recip()], k_c);
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
            let z = field.proximal_of(0, f, w);
            let best = objective(z, f);
            for _ in 0..20 {
                let moved = [z[0] + 1e-3 * vector(), z[1] + 1e-3 * vector()];
                assert!(objective(moved, f) > best, "{f:?}");
            }
        }
    }

    #[test]
    fn an_off_axis_pull_has_the_compliance_of_an_orthotropic_sheet() {
        let field = fields([1.0 / 40.0, 1.0 / 90.0, 1.0 / 12.0], 0.0);
        let w = 3.0;
        // Pulled by 10 % along a direction, w/(k + w) of the strain is left.
        let left = |f: [DVec3; 2]| (stretches(field.proximal_of(3, f, w))[0] - 1.0) / 0.1;
        assert!((left([DVec3::X * 1.1, DVec3::Y]) - w / (40.0 + w)).abs() < 1e-12);
        assert!((left([DVec3::X, DVec3::Y * 1.1]) - w / (90.0 + w)).abs() < 1e-12);
        let bias = 0.25 / 40.0 + 0.25 / 90.0 + 0.25 / 12.0;
        let half = 0.5 * 0.1;
        let f = [DVec3::new(1.0 + half, half, 0.0), DVec3::new(half, 1.0 + half, 0.0)];
        let [larger, smaller] = stretches(field.proximal_of(3, f, w));
        assert!((larger - 1.0 - 0.1 * w / (1.0 / bias + w)).abs() < 1e-12, "{larger}");
        assert!((smaller - 1.0).abs() < 1e-12);
    }
}
