//! Gravity: E = Σ m_i g z_i.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | m_i | mass of vertex i: areal density times a third of its triangles' rest areas | kg |
//! | g | gravitational acceleration, [`GRAVITY`] | m/s² |
//!
//! Heights count from the origin, so the energy's zero is arbitrary; its Hessian is zero.

use glam::DVec3;

use crate::GRAVITY;

/// Potential energy, J.
#[must_use]
pub fn energy(masses: &[f64], x: &[DVec3]) -> f64 {
    GRAVITY * masses.iter().zip(x).map(|(m, p)| m * p.z).sum::<f64>()
}

/// Adds the gradient, N.
pub fn add_gradient(masses: &[f64], gradient: &mut [DVec3]) {
    for (g, m) in gradient.iter_mut().zip(masses) {
        g.z += m * GRAVITY;
    }
}
