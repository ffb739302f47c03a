//! Cloth of masses and constraints: steps in time without stiff forces.
//!
//! A step predicts x* = x + h v − h² g, applies bending, sweeps over the edges, correcting each to its length, then moves vertices
//! inside the body out along its normal, applies friction, and takes v = (x* − x)/h for the new velocity. An edge longer than
//! (1 + τ₊) L is shortened to that length by moving its ends, each in proportion to the other's mass, and one shorter than (1 − τ₋) L is
//! lengthened; in between cloth stretches freely. Bending springs between the far corners of two triangles are soft constraints, each
//! solved implicitly by itself: λ = h² k C/(1 + h² k w), w = 1/m_a + 1/m_b.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | time step | s |
//! | L | rest length | m |
//! | τ₊, τ₋ | band of strains in which an edge is not corrected | – |
//! | k, C | stiffness and elongation of a bending spring | N/m, m |
//!
//! Source: Fuhrmann, Groß, Luckas: "Interactive animation of cloth including self collision detection", WSCG 2003, for constraints in
//! place of stiff forces, with Provot 1995 and Jakobsen 2001; the implicit bending spring after Macklin and others: "XPBD", MIG 2016.
//! The band is our reading. Limits: within it cloth has no stiffness at all, and beyond it no elasticity; no shear stiffness.

use glam::DVec3;

use crate::GRAVITY;
use crate::base::math;
use crate::mechanics::energy::{Cloth, Contacts};
use crate::mechanics::methods::method::{find_velocities, rms_speed};
use crate::mechanics::methods::spring_list::Spring;

/// Time step, damping and constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VerletSettings {
    /// Time step h, s.
    pub step_s: f64,
    /// Damping by the air, 1/s.
    pub damping_per_s: f64,
    /// Sweeps over the edges in a step.
    pub sweeps: usize,
    /// The band [τ₊, τ₋].
    pub band: [f64; 2],
}

/// The state of the cloth.
pub(crate) struct Sheet<'b> {
    /// Positions, m.
    pub x: Vec<DVec3>,
    /// Velocities, m/s.
    pub v: Vec<DVec3>,
    /// Inverse masses, 1/kg; 0 for held vertices.
    weights: Vec<f64>,
    edges: Vec<Spring>,
    bends: Vec<Spring>,
    body: Contacts<'b>,
    friction: f64,
    /// Corrections of edges so far.
    pub corrections: u64,
}

impl<'b> Sheet<'b> {
    /// Cloth at rest at `x` (m), with [`inverse_masses`] and structural and bending springs.
    pub(crate) fn new(
        x: Vec<DVec3>,
        weights: Vec<f64>,
        [edges, bends]: [Vec<Spring>; 2],
        body: Contacts<'b>,
        friction: f64,
    ) -> Self {
        Self { v: vec![DVec3::ZERO; x.len()], x, weights, edges, bends, body, friction, corrections: 0 }
    }

    /// One step; `pull` acts after every sweep, on positions and inverse masses.
    pub(crate) fn step(
        &mut self,
        settings: &VerletSettings,
        gravity: bool,
        mut pull: impl FnMut(&mut [DVec3], &[f64]),
    ) {
        let h = settings.step_s;
        let from = self.x.clone();
        let decay = math::exp(-settings.damping_per_s * h);
        let fall = if gravity { GRAVITY * h } else { 0.0 };
        for ((x, v), weight) in self.x.iter_mut().zip(&mut self.v).zip(&self.weights) {
            if *weight > 0.0 {
                v.z -= fall;
                *v *= decay;
                *x += *v * h;
            }
        }
        self.bend(h);
        for sweep in 0..settings.sweeps {
            self.sweep(settings.band);
            pull(&mut self.x, &self.weights);
            // Halfway as well as at the end: a vertex pulled into the body must not pull its neighbours after it.
            if sweep + 1 == settings.sweeps || 2 * (sweep + 1) == settings.sweeps {
                self.resolve_contacts(&from);
            }
        }
        find_velocities(&mut self.v, [&from, &self.x], h, self.body.touches());
    }

    /// Applies every bending spring once.
    fn bend(&mut self, h: f64) {
        for s in &self.bends {
            let [a, b] = s.ends.map(|v| v as usize);
            let w = self.weights[a] + self.weights[b];
            let along = self.x[b] - self.x[a];
            let length = along.length();
            if w == 0.0 || length < 1e-9 {
                continue;
            }
            let stiff = h * h * s.stiffness;
            let impulse = along / length * (stiff * (length - s.rest) / (1.0 + stiff * w));
            self.x[a] += impulse * self.weights[a];
            self.x[b] -= impulse * self.weights[b];
        }
    }

    /// Corrects every edge once.
    fn sweep(&mut self, [stretch, compression]: [f64; 2]) {
        for s in &self.edges {
            let [a, b] = s.ends.map(|v| v as usize);
            let along = self.x[b] - self.x[a];
            let squared = along.length_squared();
            let (longest, shortest) = (s.rest * (1.0 + stretch), s.rest * (1.0 - compression));
            let w = self.weights[a] + self.weights[b];
            let target = if squared > longest * longest {
                longest
            } else if squared < shortest * shortest {
                shortest
            } else {
                continue;
            };
            if w == 0.0 || squared < 1e-18 {
                continue;
            }
            let correction = along * ((1.0 - target / squared.sqrt()) / w);
            self.x[a] += correction * self.weights[a];
            self.x[b] -= correction * self.weights[b];
            self.corrections += 1;
        }
    }

    /// Moves vertices out of the body, with Coulomb's friction on their displacement since `from`.
    fn resolve_contacts(&mut self, from: &[DVec3]) {
        self.body.update(&self.x);
        for t in self.body.touches() {
            let v = t.vertex as usize;
            if self.weights[v] == 0.0 {
                continue;
            }
            self.x[v] += t.normal * t.depth;
            let slid = self.x[v] - from[v];
            let slid = slid - t.normal * t.normal.dot(slid);
            self.x[v] -= slid.clamp_length_max(self.friction * t.depth);
        }
    }

    /// RMS speed of the free vertices, m/s.
    pub(crate) fn rms_speed(&self) -> f64 {
        rms_speed(self.v.iter().zip(&self.weights).filter(|(_, w)| **w > 0.0).map(|(v, _)| v))
    }
}

/// The inverse mass of each vertex, 1/kg; 0 where it is held.
pub(super) fn inverse_masses(cloth: &Cloth) -> Vec<f64> {
    cloth.masses.iter().zip(&cloth.held).map(|(m, held)| if *held { 0.0 } else { 1.0 / m }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: VerletSettings = VerletSettings { step_s: 0.01, damping_per_s: 2.0, sweeps: 60, band: [0.0, 0.0] };

    fn chain(n: u32, length: f64) -> Vec<Spring> {
        (1..n).map(|i| Spring { ends: [i - 1, i], rest: length, stiffness: 0.0 }).collect()
    }

    #[test]
    fn a_released_chain_hangs_down_at_its_length() {
        let n = 12;
        let start = (0..n).map(|i| DVec3::X * 0.05 * f64::from(i)).collect();
        let mut weights = vec![100.0; n as usize];
        weights[0] = 0.0;
        let mut sheet = Sheet::new(start, weights, [chain(n, 0.05), Vec::new()], Contacts::none(), 0.3);
        (0..2000).for_each(|_| sheet.step(&SETTINGS, true, |_, _| ()));
        assert!(sheet.rms_speed() < 1e-3, "{}", sheet.rms_speed());
        for (i, x) in (0..n).zip(&sheet.x) {
            let exact = DVec3::NEG_Z * 0.05 * f64::from(i);
            assert!(x.distance(exact) < 0.03 * 0.55, "{i}: {x} expected {exact}");
        }
    }

    #[test]
    fn an_edge_is_corrected_only_outside_its_band_and_by_mass() {
        let stretched = |by: f64| {
            let x = vec![DVec3::ZERO, DVec3::X * 0.1 * (1.0 + by)];
            let mut sheet =
                Sheet::new(x, vec![1.0 / 0.01, 1.0 / 0.03], [chain(2, 0.1), Vec::new()], Contacts::none(), 0.0);
            sheet.sweep([0.03, 0.05]);
            sheet.x
        };
        let within = stretched(0.02);
        assert_eq!(within[1].x - within[0].x, 0.1 * 1.02);
        for (by, goal) in [(0.10, 0.103), (-0.2, 0.095)] {
            let x = stretched(by);
            assert!((x[1].x - x[0].x - goal).abs() < 1e-12, "{by}");
            // The centre of mass stays.
            assert!((0.01 * x[0].x + 0.03 * x[1].x - 0.03 * 0.1 * (1.0 + by)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_bending_spring_step_is_that_of_backward_euler() {
        // (m/h² + k) d = k C for a spring to a held end.
        let x = vec![DVec3::ZERO, DVec3::X * 0.12];
        let spring = vec![Spring { ends: [0, 1], rest: 0.1, stiffness: 5.0 }];
        let mut sheet = Sheet::new(x, vec![0.0, 1.0 / 0.01], [Vec::new(), spring], Contacts::none(), 0.0);
        sheet.bend(0.01);
        let exact = 5.0 * 0.02 / (0.01 / 1e-4 + 5.0);
        assert!((0.12 - sheet.x[1].x - exact).abs() < 1e-12);
    }
}
