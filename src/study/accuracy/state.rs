//! Metrics of one state, without a reference: energy, residual, strain and penetration.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | E | energy without friction | J |
//! | r | residual force ‖∇E‖₂ over the free vertices, over the weight | – |
//! | ε | largest principal strain of a triangle, positive in elongation | – |
//!
//! Friction balances any tangential force up to μ_f N (Coulomb); the actual friction force depends on the history of the
//! motion. A state has no history, so friction is assumed to balance as much as it can: the tangential force at a touching
//! vertex is shortened by μ_f N, at most to zero. A solver that follows friction anchors may report a larger residual.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::summary::MM_PER_M;
use crate::base::quantiles::nearest_rank;
use crate::body::distance::Body;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::fit::principal_strain;
use crate::mechanics::reactions::solve_remaining_reactions;

/// Metrics of one state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// E, J.
    pub energy_j: f64,
    /// r.
    pub residual_over_weight: f64,
    /// 95th percentile over the triangles of ε.
    pub strain_p95: f64,
    /// Largest ε.
    pub strain_max: f64,
    /// Free vertices inside the body.
    pub penetrating_vertices: usize,
    /// Depth of the deepest, mm.
    pub penetration_mm: f64,
}

impl State {
    /// Metrics of `cloth` on `body` at the positions `x` (m).
    pub(crate) fn of(cloth: &Cloth, body: &Body, x: &[DVec3]) -> Self {
        let contacts = cloth.contacts(body, x);
        let mut gradient = Vec::new();
        // New contacts have anchors at `x`, so the gradient holds no friction force yet.
        let energy_j = cloth.gradient(x, &contacts, &mut gradient);
        subtract_friction(cloth, &contacts, &mut gradient);
        solve_remaining_reactions(cloth, body, &contacts, x, &mut gradient);
        let residual = gradient.iter().map(|g| g.length_squared()).sum::<f64>().sqrt();
        let known = cloth.triangles.iter().filter(|triangle| triangle.has_strain());
        let strains: Vec<f64> = known.map(|t| principal_strain(t.deformation(x))).collect();
        let (penetrating_vertices, depth) = contacts.penetration(x);
        Self {
            energy_j,
            residual_over_weight: residual / cloth.weight,
            strain_p95: nearest_rank(&strains, 0.95),
            strain_max: strains.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            penetrating_vertices,
            penetration_mm: MM_PER_M * depth,
        }
    }
}

/// Subtracts the friction force that can balance the gradient at each touching vertex.
fn subtract_friction(cloth: &Cloth, contacts: &Contacts<'_>, gradient: &mut [DVec3]) {
    for touch in contacts.touches() {
        let g = &mut gradient[touch.vertex as usize];
        // In a crease of the smoothed distance the gradient is shorter than 1, and so is the contact force.
        let (normal, slope) = (touch.normal.normalize_or_zero(), touch.normal.length().min(1.0));
        let tangential = *g - normal * normal.dot(*g);
        *g -= tangential.clamp_length_max(cloth.friction[touch.vertex as usize] * touch.force() * slope);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strains_of_a_stretch_a_turn_and_a_shear() {
        assert!((principal_strain([DVec3::X * 1.1, DVec3::Y]) - 0.1).abs() < 1e-15);
        assert!(principal_strain([DVec3::Y, DVec3::Z]).abs() < 1e-15);
        // Simple shear γ: σ = γ/2 + √(1 + γ²/4).
        let sheared = principal_strain([DVec3::X, DVec3::new(0.2, 1.0, 0.0)]);
        assert!((sheared - (0.1 + 1.01f64.sqrt() - 1.0)).abs() < 1e-15);
    }
}
