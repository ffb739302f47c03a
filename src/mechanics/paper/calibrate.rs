//! The two coefficients that the paper introduces without a value: p_f and q_f.
//!
//! **p_f** (N/m⁵). A strip of density ρ and membrane stiffness k, held at its top and hanging to length L, moves down at depth s by
//!
//! ```text
//! u(s) = ∫₀ˢ ρ g (L − r)/k dr = (ρ g/k) (L s − s²/2),     u(L) = ρ g L²/(2k)
//! ```
//!
//! (the load at depth r is the weight below it). A PART of the strip moves down by the mean of u over its
//! vertices, D̄ = (ρ g/k) c̄ with c̄ the area mean of L s − s²/2 (m²). Equation (9) gives D = F⁰/Fᵃ = ρ g A/Fᵃ, so the strip requires
//! Fᵃ = k A/c̄. Equation (2) gives Fᵃ = p_f Σ |cos γ_p| q ΔV = p_f t A w̄ with w̄ the area mean of |cos γ_p| q, hence, PART by PART,
//!
//! ```text
//! p_f = k / (t w̄ c̄)
//! ```
//!
//! and D is the closed form for any number of PARTs of the strip. Along z the factors cos γ_p and q thus only determine how a
//! PART distributes its stiffness over its vertices; along x and y Fᵃ keeps the ratio of the cosines. (With one w̄ for the whole
//! garment a tight PART, whose q is small, was a hundred times softer than a loose one, and contact moved the hip of a skirt by 4 m.) Depth s is z_top − z and L the garment's height. A PART at the top has c̄ = 0: it is held, and p_f is infinite, as for
//! a garment without height. w̄ uses the positive readings for any options, so that
//! a failing reading is visible in D; where the cloth is vertical and w̄ vanishes, the mean of q replaces it.
//!
//! **q_f** (N/m³). One scalar so that the contact PARTs carry the garment: Σ q_f cos γ_q ΔV = weight.

use super::options::{Clearance, Cosine};
use crate::body::distance::SurfacePoint;
use crate::mesh::TriMesh;
use glam::DVec3;

/// The stiffness factor of the normal `n` along each axis.
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

/// The data of the whole garment that p_f depends on.
pub(super) struct HangingStrip<'a> {
    /// The garment.
    pub(super) garment: &'a TriMesh,
    /// Unit vertex normals.
    pub(super) normals: &'a [DVec3],
    /// Barycentric vertex areas, m².
    pub(super) areas: &'a [f64],
    /// The nearest body point of each vertex.
    pub(super) surface: &'a [SurfacePoint],
    /// k at each vertex, N/m.
    pub(super) stiffness: &'a [f64],
    /// t at each vertex, m.
    pub(super) thickness_m: &'a [f64],
    /// The reading of cos(•_p).
    pub(super) cosine: Cosine,
    /// As [`PaperOptions::degenerate_below`](super::PaperOptions::degenerate_below).
    pub(super) degenerate_below: f64,
}

impl HangingStrip<'_> {
    /// p_f of a PART, N/m⁵; infinite at the top. `top_z` and `height_m` are the garment's.
    pub(super) fn line_force(&self, vertices: &[u32], top_z: f64, height_m: f64) -> f64 {
        let positive = if self.cosine == Cosine::InSurface { Cosine::InSurface } else { Cosine::Absolute };
        let (mut compliance, mut weighted, mut plain, mut area) = (0.0, 0.0, 0.0, 0.0);
        for v in vertices.iter().map(|&v| v as usize) {
            let a = self.areas[v];
            let s = top_z - self.garment.positions[v].z;
            let q = clearance(self.surface[v].signed_distance, self.thickness_m[v], Clearance::PlusThickness);
            compliance += a * (height_m * s - 0.5 * s * s);
            weighted += a * q * share(self.normals[v], positive).z;
            plain += a * q;
            area += a;
        }
        // Vertices without triangles have neither area nor force, so any value is correct.
        if area <= 0.0 {
            return 0.0;
        }
        let w = if weighted > self.degenerate_below * plain { weighted } else { plain };
        let mean = |of: &[f64]| {
            let first = of[vertices[0] as usize];
            let more = |&v: &u32| self.areas[v as usize] * (of[v as usize] - first);
            first + vertices.iter().map(more).sum::<f64>() / area
        };
        mean(self.stiffness) * area * area / (mean(self.thickness_m) * w * compliance)
    }
}
