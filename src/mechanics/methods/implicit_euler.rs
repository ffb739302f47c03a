//! Implicit steps in time, shared by `zhu2016` and `thomaszewski2006`.
//!
//! Backward Euler, linearised once a step (Baraff, Witkin: "Large steps in cloth simulation", SIGGRAPH 1998), with the
//! displacement d of a step as unknown:
//!
//! (M (1/h² + c/h) + K) d = f(x) + M v/h,  x ← x + d,  v ← d/h.
//!
//! The body pushes with κ A (h_o − q) along its normal, as everywhere in this project, and holds by Coulomb's `Friction`. A
//! touching vertex has no velocity off the body after the step: cloth does not bounce.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | time step | s |
//! | c | damping by the air, a rate | 1/s |
//! | f, K | force of cloth, gravity, contact and friction, and its stiffness −∂f/∂x, projected to be positive | N, N/m |
//! | d, v | displacement of a step, velocity | m, m/s |

use glam::{DMat3, DVec3, Mat3A, Vec3A};

use super::friction::Friction;
use super::linear::{ConjugateGradients, Operator, System};
use super::method::{
    Ended, MethodDrape, MethodError, MethodInput, MethodOutcome, MethodStep, Observer, RestDetector, RestRule,
    Stopwatch, find_velocities, rms_speed,
};
use crate::GRAVITY;
use crate::mechanics::energy::Contacts;
use crate::mechanics::energy::Touch;

/// Time step, damping and accuracy of the integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EulerSettings {
    /// Time step h, s.
    pub step_s: f64,
    /// Damping by the air c, 1/s.
    pub damping_per_s: f64,
    /// Relative residual of the linear solver.
    pub tolerance: f64,
    /// Most iterations of the linear solver.
    pub max_iterations: usize,
}

impl Default for EulerSettings {
    fn default() -> Self {
        Self { step_s: 0.02, damping_per_s: 6.0, tolerance: 1e-2, max_iterations: 200 }
    }
}

/// The elastic forces of a method; as an operator, the stiffness of its last linearisation.
pub trait Elastic: Operator {
    /// Adds the cloth's force at `x`, N, and stores its stiffness there.
    fn linearise(&mut self, x: &[DVec3], force: &mut [DVec3]);

    /// Adds the diagonal blocks of that stiffness, N/m.
    fn add_diagonal(&self, diagonal: &mut [Mat3A]);

    /// Corrects positions after a step, if the method does so; returns the number of corrections.
    fn limit(&mut self, _x: &mut [DVec3]) -> Option<u64> {
        None
    }
}

/// The contact search of a method.
pub trait Obstacle {
    /// The contacts at `x`, by ascending vertex.
    fn touches(&mut self, x: &[DVec3]) -> &[Touch];
}

impl Obstacle for Contacts<'_> {
    fn touches(&mut self, x: &[DVec3]) -> &[Touch] {
        self.update(x);
        Contacts::touches(self)
    }
}

/// Parameters of an integration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Integration<'a> {
    /// Name of the method, for errors.
    pub method: &'static str,
    /// Time step, damping and accuracy.
    pub settings: &'a EulerSettings,
    /// When the garment rests.
    pub rule: &'a RestRule,
    /// Coefficient of friction.
    pub friction: f64,
}

/// Positions, velocities, and the linear system of the current step.
struct State {
    x: Vec<DVec3>,
    v: Vec<DVec3>,
    force: Vec<DVec3>,
    right_side: Vec<Vec3A>,
    added: Vec<Mat3A>,
    diagonal: Vec<Mat3A>,
    d: Vec<Vec3A>,
}

/// Integrates from the placed garment until it rests. Counts the iterations of the linear solver, and the corrections of
/// [`Elastic::limit`] if there are any.
pub(super) fn integrate(
    input: &MethodInput<'_>,
    integration: Integration<'_>,
    elastic: &mut dyn Elastic,
    obstacle: &mut dyn Obstacle,
    mut watch: Stopwatch,
    observer: Observer<'_>,
) -> MethodOutcome {
    let cloth = input.cloth;
    let n = cloth.vertex_count();
    let mut rest = RestDetector::new(*integration.rule);
    let mut state = State {
        x: input.scene.garment.positions.clone(),
        v: vec![DVec3::ZERO; n],
        force: Vec::new(),
        right_side: vec![Vec3A::ZERO; n],
        added: Vec::new(),
        diagonal: Vec::new(),
        d: vec![Vec3A::ZERO; n],
    };
    let mut solver = ConjugateGradients::default();
    let mut friction = Friction::new(integration.friction);
    let (mut steps, mut iterations, mut corrections) = (0, 0, None);
    let Integration { settings, .. } = integration;
    let h = settings.step_s;
    loop {
        let touches = watch.time("contact", || obstacle.touches(&state.x));
        friction.refresh(touches, &state.x, |v| state.v[v] * h);
        watch.time("forces", || state.assemble(input, elastic, touches, &friction, settings));
        let State { added, diagonal, right_side, d, .. } = &mut state;
        let system = System { matrix: &mut *elastic, added, diagonal, right_side, fixed: &cloth.held };
        let done = watch.time("linear solver", || solver.solve(system, settings.tolerance, settings.max_iterations, d));
        iterations += done as u64;
        let from = state.advance(&cloth.held);
        let corrected = watch.time("strain limiting", || elastic.limit(&mut state.x));
        corrections = corrected.map(|more| corrections.unwrap_or(0) + more);
        find_velocities(&mut state.v, [&from, &state.x], h, touches);
        steps += 1;
        let rms_speed = rms_speed(state.v.iter().zip(&cloth.held).filter(|(_, held)| !**held).map(|(v, _)| v));
        if !rms_speed.is_finite() {
            return Err(MethodError::Unstable { method: integration.method, step: steps });
        }
        let ended = rest.after(h, rms_speed);
        let state_of_step = MethodStep {
            stage: "in time",
            step: steps,
            time_s: rest.time_s,
            rms_speed_m_per_s: rms_speed,
            positions: &state.x,
        };
        let stopped = observer(&state_of_step).is_break().then_some(Ended::Interrupted);
        if let Some(ended) = ended.or(stopped) {
            let corrected = corrections.map(|n| ("strain corrections", n));
            return Ok(MethodDrape {
                positions: state.x,
                ended,
                steps,
                simulated_s: rest.time_s,
                rms_speed_m_per_s: rms_speed,
                total: watch.began.elapsed(),
                times: watch.parts,
                counts: [("linear iterations", iterations)].into_iter().chain(corrected).collect(),
                exhibits: Vec::new(),
                notes: Vec::new(),
            });
        }
    }
}

impl State {
    /// Assembles the linear system of a step.
    fn assemble(
        &mut self,
        input: &MethodInput<'_>,
        elastic: &mut dyn Elastic,
        touches: &[Touch],
        friction: &Friction,
        settings: &EulerSettings,
    ) {
        let cloth = input.cloth;
        let h = settings.step_s;
        let inertia = 1.0 / (h * h) + settings.damping_per_s / h;
        self.added.clear();
        self.added.extend(cloth.masses.iter().map(|m| Mat3A::from_diagonal(glam::Vec3::splat((m * inertia) as f32))));
        self.force.clear();
        self.force.resize(self.x.len(), DVec3::ZERO);
        elastic.linearise(&self.x, &mut self.force);
        for t in touches {
            self.force[t.vertex as usize] += t.normal * t.force();
            let n = t.normal.as_vec3a();
            self.added[t.vertex as usize] += Mat3A::from_cols(n * n.x, n * n.y, n * n.z) * t.stiffness as f32;
        }
        for (v, force, block) in friction.terms(&self.x) {
            self.force[v as usize] += force;
            self.added[v as usize] += single(block);
        }
        self.diagonal.clone_from(&self.added);
        elastic.add_diagonal(&mut self.diagonal);
        for (i, &mass) in cloth.masses.iter().enumerate() {
            let side = self.force[i] + mass * (self.v[i] / h - GRAVITY * DVec3::Z);
            self.right_side[i] = if cloth.held[i] { Vec3A::ZERO } else { side.as_vec3a() };
            self.d[i] = if cloth.held[i] { Vec3A::ZERO } else { (self.v[i] * h).as_vec3a() };
        }
    }

    /// Moves the free vertices by the solution; returns the positions before.
    fn advance(&mut self, held: &[bool]) -> Vec<DVec3> {
        let from = self.x.clone();
        for ((x, d), held) in self.x.iter_mut().zip(&self.d).zip(held) {
            if !held {
                *x += d.as_dvec3();
            }
        }
        from
    }
}

fn single(m: DMat3) -> Mat3A {
    Mat3A::from_cols(m.x_axis.as_vec3a(), m.y_axis.as_vec3a(), m.z_axis.as_vec3a())
}
