//! The two coefficients that the paper names and gives no value for: p_f and q_f.
//!
//! **p_f** (N/m⁵). A strip of density ρ and membrane stiffness k, held at its top and hanging to length L, sinks at depth s by
//!
//! ```text
//! u(s) = ∫₀ˢ ρ g (L − r)/k dr = (ρ g/k) (L s − s²/2),     u(L) = ρ g L²/(2k)
//! ```
//!
//! (the load at depth r is what hangs below it). The PART that covers some of the strip sinks by the mean of u over its
//! vertices, D̄ = (ρ g/k) c̄ with c̄ the area mean of L s − s²/2 (m²). Equation (9) gives D = F⁰/Fᵃ = ρ g A/Fᵃ, so the strip asks for
//! Fᵃ = k A/c̄. Equation (2) gives Fᵃ = p_f Σ |cos γ_p| q ΔV = p_f t A w̄ with w̄ the area mean of |cos γ_p| q over the PART, hence
//!
//! ```text
//! p_f = k / (t m c̄),     m = area mean of |cos γ_p| q over the whole garment
//! ```
//!
//! with m in place of w̄: p_f is a field of the garment, as in Table 1, not a figure that cancels the factors cos and q; these
//! stay as weights relative to the garment's mean, and where they are uniform D is the closed form exactly, however
//! many PARTs the strip is cut into. Depth s is z_top − z and L the garment's height. A PART at the very top has c̄ = 0: it
//! is held, p_f is infinite; so is a garment without height, which has nothing that hangs. m uses positive readings whatever the options say, so that a failing reading shows in D.
//!
//! **q_f** (N/m³). One scalar so that the contact PARTs carry the garment: Σ q_f cos γ_q ΔV = weight.

use super::options::{Clearance, Cosine};
use crate::distance::SurfacePoint;
use crate::mesh::TriMesh;
use glam::DVec3;

/// The part of `n` that counts towards stiffness, axis by axis.
pub(super) fn share(n: DVec3, reading: Cosine) -> DVec3 {
    match reading {
        Cosine::Absolute => n.abs(),
        Cosine::Signed => n,
        Cosine::InSurface => (DVec3::ONE - n * n).max(DVec3::ZERO).map(f64::sqrt),
    }
}

/// The factor q of a vertex, m.
pub(super) fn clearance(signed_distance: f64, thickness_m: f64, reading: Clearance) -> f64 {
    match reading {
        Clearance::PlusThickness => signed_distance.max(0.0) + thickness_m,
        Clearance::Literal => signed_distance,
    }
}

/// What p_f needs to know of the whole garment.
pub(super) struct HangingStrip {
    top_z: f64,
    height_m: f64,
    /// k/(t m), N/m³.
    scale: f64,
    /// Whether m vanished, so that the mean of q alone stands in.
    pub(super) vertical: bool,
}

impl HangingStrip {
    /// Reads height and mean weight m off the garment.
    pub(super) fn new(
        garment: &TriMesh,
        normals: &[DVec3],
        areas: &[f64],
        surface: &[SurfacePoint],
        (stiffness_n_per_m, thickness_m): (f64, f64),
        (cosine, degenerate_below): (Cosine, f64),
    ) -> Self {
        let (lo, hi) = garment.bounds().unwrap_or_default();
        let positive = if cosine == Cosine::InSurface { Cosine::InSurface } else { Cosine::Absolute };
        let (mut weighted, mut plain, mut area) = (0.0, 0.0, 0.0);
        for ((&n, &a), s) in normals.iter().zip(areas).zip(surface) {
            let q = clearance(s.signed_distance, thickness_m, Clearance::PlusThickness);
            weighted += a * q * share(n, positive).z;
            plain += a * q;
            area += a;
        }
        let vertical = weighted <= degenerate_below * plain;
        let m = if vertical { plain } else { weighted } / area;
        Self { top_z: hi.z, height_m: hi.z - lo.z, scale: stiffness_n_per_m / (thickness_m * m), vertical }
    }

    /// L s − s²/2 at height z, m².
    fn compliance(&self, z: f64) -> f64 {
        let s = self.top_z - z;
        self.height_m * s - 0.5 * s * s
    }

    /// p_f of a PART, N/m⁵; infinite at the very top.
    pub(super) fn line_force(&self, garment: &TriMesh, areas: &[f64], vertices: &[u32]) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for &v in vertices {
            sum += areas[v as usize] * self.compliance(garment.positions[v as usize].z);
            area += areas[v as usize];
        }
        // A PART of vertices without triangles has no area and no force either; any value does.
        if area > 0.0 { self.scale * area / sum } else { 0.0 }
    }
}
