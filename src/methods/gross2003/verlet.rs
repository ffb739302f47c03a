//! Cloth of masses and constraints: steps in time without stiff forces.
//!
//! A step predicts x* = x + h v − h² g, bends and sweeps over the edges, correcting each to its length, then moves what is inside the
//! body out of it along its normal and holds back what slides, and takes v = (x* − x)/h for the new velocity. An edge longer than
//! (1 + τ₊) L is shortened to that by moving its ends, each by the other's share of the mass, and one shorter than (1 − τ₋) L is
//! lengthened; in between cloth stretches freely. Bending springs between the far corners of two triangles are soft constraints, each
//! solved implicitly by itself: λ = h² k C/(1 + h² k w), w = 1/m_a + 1/m_b.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | time step | s |
//! | L | rest length | m |
//! | τ₊, τ₋ | band in which an edge is left alone | – |
//! | k, C | stiffness and elongation of a bending spring | N/m, m |
//!
//! Source: Fuhrmann, Groß, Luckas: "Interactive animation of cloth including self collision detection", WSCG 2003, for constraints in
//! place of stiff forces, with Provot 1995 and Jakobsen 2001; the implicit bending spring after Macklin and others: "XPBD", MIG 2016.
//! The band is our reading. Limits: within it cloth has no stiffness at all, and beyond it no elasticity; no shear of its own.

use glam::DVec3;

use crate::GRAVITY;
use crate::mechanics::energy::Contacts;
use crate::methods::rest::{find_velocities, rms_speed};
use crate::methods::spring_list::Spring;

/// How cloth of constraints is moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tempo {
    /// Time step h, s.
    pub step_s: f64,
    /// Damping by the air, 1/s.
    pub damping_per_s: f64,
    /// Sweeps over the edges in a step.
    pub sweeps: usize,
    /// τ₊ and τ₋.
    pub band: [f64; 2],
}

/// Cloth on its way.
pub(crate) struct Sheet<'b> {
    /// Positions, m.
    pub x: Vec<DVec3>,
    /// Velocities, m/s.
    pub v: Vec<DVec3>,
    /// 1/m, 1/kg; nothing where a vertex is held.
    weights: Vec<f64>,
    edges: Vec<Spring>,
    bends: Vec<Spring>,
    body: Contacts<'b>,
    friction: f64,
    /// Edges corrected so far.
    pub corrections: u64,
}

impl<'b> Sheet<'b> {
    /// Cloth at rest at `x` (m), with `masses` (kg) and springs; no mass moves a held vertex.
    #[must_use]
    pub(crate) fn new(
        x: Vec<DVec3>,
        (masses, held): (&[f64], &[bool]),
        [edges, bends]: [Vec<Spring>; 2],
        body: Contacts<'b>,
        friction: f64,
    ) -> Self {
        let weights = masses.iter().zip(held).map(|(m, held)| if *held { 0.0 } else { 1.0 / m }).collect();
        Self { v: vec![DVec3::ZERO; x.len()], x, weights, edges, bends, body, friction, corrections: 0 }
    }

    /// One step; `pull` acts after every sweep, on positions and 1/m.
    pub(crate) fn step(&mut self, tempo: &Tempo, gravity: bool, mut pull: impl FnMut(&mut [DVec3], &[f64])) {
        let h = tempo.step_s;
        let from = self.x.clone();
        let decay = (-tempo.damping_per_s * h).exp();
        let fall = if gravity { GRAVITY * h } else { 0.0 };
        for ((x, v), weight) in self.x.iter_mut().zip(&mut self.v).zip(&self.weights) {
            if *weight > 0.0 {
                v.z -= fall;
                *v *= decay;
                *x += *v * h;
            }
        }
        self.bend(h);
        for sweep in 0..tempo.sweeps {
            self.sweep(tempo.band);
            pull(&mut self.x, &self.weights);
            // In the middle as well as at the end: what is drawn into the body must not draw all the rest after it.
            if sweep + 1 == tempo.sweeps || 2 * (sweep + 1) == tempo.sweeps {
                self.meet(&from);
            }
        }
        find_velocities(&mut self.v, [&from, &self.x], h, self.body.touches());
    }

    /// Bends once.
    fn bend(&mut self, h: f64) {
        for s in &self.bends {
            let [a, b] = s.ends.map(|v| v as usize);
            let w = self.weights[a] + self.weights[b];
            let way = self.x[b] - self.x[a];
            let length = way.length();
            if w == 0.0 || length < 1e-9 {
                continue;
            }
            let stiff = h * h * s.stiffness;
            let impulse = way / length * (stiff * (length - s.rest) / (1.0 + stiff * w));
            self.x[a] += impulse * self.weights[a];
            self.x[b] -= impulse * self.weights[b];
        }
    }

    /// Corrects every edge once.
    fn sweep(&mut self, [longer, shorter]: [f64; 2]) {
        for s in &self.edges {
            let [a, b] = s.ends.map(|v| v as usize);
            let way = self.x[b] - self.x[a];
            let squared = way.length_squared();
            let (most, least) = (s.rest * (1.0 + longer), s.rest * (1.0 - shorter));
            let w = self.weights[a] + self.weights[b];
            let goal = if squared > most * most {
                most
            } else if squared < least * least {
                least
            } else {
                continue;
            };
            if w == 0.0 || squared < 1e-18 {
                continue;
            }
            let correction = way * ((1.0 - goal / squared.sqrt()) / w);
            self.x[a] += correction * self.weights[a];
            self.x[b] -= correction * self.weights[b];
            self.corrections += 1;
        }
    }

    /// Out of the body, and Coulomb's friction on what slid since `from`.
    fn meet(&mut self, from: &[DVec3]) {
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

    /// RMS speed of what is not held, m/s.
    #[must_use]
    pub(crate) fn rms_speed(&self) -> f64 {
        rms_speed(self.v.iter().zip(&self.weights).filter(|(_, w)| **w > 0.0).map(|(v, _)| v))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEMPO: Tempo = Tempo { step_s: 0.01, damping_per_s: 2.0, sweeps: 60, band: [0.0, 0.0] };

    fn chain(n: u32, length: f64) -> Vec<Spring> {
        (1..n).map(|i| Spring { ends: [i - 1, i], rest: length, stiffness: 0.0 }).collect()
    }

    #[test]
    fn a_chain_that_is_let_go_hangs_down_at_its_length() {
        let n = 12;
        let start = (0..n).map(|i| DVec3::X * 0.05 * f64::from(i)).collect();
        let mut held = vec![false; n as usize];
        held[0] = true;
        let masses = vec![0.01; n as usize];
        let mut sheet = Sheet::new(start, (&masses, &held), [chain(n, 0.05), Vec::new()], Contacts::none(), 0.3);
        (0..2000).for_each(|_| sheet.step(&TEMPO, true, |_, _| ()));
        assert!(sheet.rms_speed() < 1e-3, "{}", sheet.rms_speed());
        for (i, x) in (0..n).zip(&sheet.x) {
            let exact = DVec3::NEG_Z * 0.05 * f64::from(i);
            assert!(x.distance(exact) < 0.03 * 0.55, "{i}: {x} expected {exact}");
        }
    }

    #[test]
    fn an_edge_within_its_band_is_left_alone_and_beyond_it_is_brought_to_it_by_mass() {
        let stretched = |by: f64| {
            let x = vec![DVec3::ZERO, DVec3::X * 0.1 * (1.0 + by)];
            let mut sheet =
                Sheet::new(x, (&[0.01, 0.03], &[false; 2]), [chain(2, 0.1), Vec::new()], Contacts::none(), 0.0);
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
    fn a_bending_spring_brakes_as_an_implicit_one_does() {
        // (m/h² + k) d = k C for a spring to a held end.
        let x = vec![DVec3::ZERO, DVec3::X * 0.12];
        let spring = vec![Spring { ends: [0, 1], rest: 0.1, stiffness: 5.0 }];
        let mut sheet = Sheet::new(x, (&[1.0, 0.01], &[true, false]), [Vec::new(), spring], Contacts::none(), 0.0);
        sheet.bend(0.01);
        let exact = 5.0 * 0.02 / (0.01 / 1e-4 + 5.0);
        assert!((0.12 - sheet.x[1].x - exact).abs() < 1e-12);
    }
}
