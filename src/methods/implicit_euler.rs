//! Implicit steps in time: what `zhu2016` and `thomaszewski2006` have in common.
//!
//! Backward Euler, linearised once a step (Baraff, Witkin: "Large steps in cloth simulation", SIGGRAPH 1998), with the
//! displacement d of a step for its unknown:
//!
//! (M (1/h² + c/h) + K) d = f(x) + M v/h,  x ← x + d,  v ← d/h.
//!
//! The body pushes with κ A (h_o − q) along its normal, as everywhere in this project, and holds by Coulomb's friction
//! ([`Grip`]). A vertex that touches has no velocity off the body after the step: cloth does not
//! bounce.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | h | time step | s |
//! | c | damping by the air, a rate | 1/s |
//! | f, K | force of cloth, gravity, contact and friction, and its stiffness −∂f/∂x, made positive | N, N/m |
//! | d, v | displacement of a step, velocity | m, m/s |

use glam::{DMat3, DVec3, Mat3A, Vec3A};

use super::friction::Grip;
use super::linear::{ConjugateGradients, Operator, System};
use super::rest::{Ended, Rest, RestRule, find_velocities, rms_speed};
use super::{MethodInput, MethodDrape, MethodError, MethodOutcome, Moment, Spectator, Stopwatch};
use crate::GRAVITY;
use crate::mechanics::energy::Contacts;
use crate::mechanics::energy::contact::Touch;

/// How a garment is moved in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pacing {
    /// Time step h, s.
    pub step_s: f64,
    /// Damping by the air c, 1/s.
    pub damping_per_s: f64,
    /// Share of the right side that the linear solver may leave.
    pub tolerance: f64,
    /// Its iterations at most.
    pub iterations: usize,
}

impl Default for Pacing {
    fn default() -> Self {
        Self { step_s: 0.02, damping_per_s: 6.0, tolerance: 1e-2, iterations: 200 }
    }
}

/// The cloth of a method; as an operator, its stiffness where it was last looked at.
pub trait Elastic: Operator {
    /// Adds the cloth's force at `x`, N, and keeps its stiffness there.
    fn linearise(&mut self, x: &[DVec3], force: &mut [DVec3]);

    /// Adds each vertex's own block of that stiffness, N/m.
    fn add_own(&self, own: &mut [Mat3A]);

    /// Corrects positions after a step, if the method does so; returns how many corrections it made.
    fn limit(&mut self, _x: &mut [DVec3]) -> Option<u64> {
        None
    }
}

/// The body of a method.
pub trait Obstacle {
    /// What touches at `x`, vertices ascending.
    fn touches(&mut self, x: &[DVec3]) -> &[Touch];
}

impl Obstacle for Contacts<'_> {
    fn touches(&mut self, x: &[DVec3]) -> &[Touch] {
        self.update(x);
        Contacts::touches(self)
    }
}

/// What a march goes by: the method's name for errors, how to move, when to stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course<'a> {
    /// The method.
    pub method: &'static str,
    /// How it is moved.
    pub pacing: &'a Pacing,
    /// When it rests.
    pub rule: &'a RestRule,
    /// Coefficient of friction.
    pub friction: f64,
}

/// A cloth on its way.
struct State {
    x: Vec<DVec3>,
    v: Vec<DVec3>,
    force: Vec<DVec3>,
    side: Vec<Vec3A>,
    added: Vec<Mat3A>,
    own: Vec<Mat3A>,
    d: Vec<Vec3A>,
}

/// Moves the cloth from where it is placed until it rests; tells the work of the linear solver, and the corrections of
/// [`Elastic::limit`] where there are any.
pub(super) fn march(
    dressing: &MethodInput<'_>,
    course: Course<'_>,
    (elastic, obstacle): (&mut dyn Elastic, &mut dyn Obstacle),
    mut watch: Stopwatch,
    onlooker: Spectator<'_>,
) -> MethodOutcome {
    let cloth = dressing.cloth;
    let n = cloth.vertex_count();
    let mut rest = Rest::new(*course.rule);
    let mut state = State {
        x: dressing.scene.garment.positions.clone(),
        v: vec![DVec3::ZERO; n],
        force: Vec::new(),
        side: vec![Vec3A::ZERO; n],
        added: Vec::new(),
        own: Vec::new(),
        d: vec![Vec3A::ZERO; n],
    };
    let mut solver = ConjugateGradients::default();
    let mut friction = Grip::new(course.friction);
    let (mut steps, mut iterations, mut corrections) = (0, 0, None);
    let h = course.pacing.step_s;
    loop {
        let touches = watch.time("contact", || obstacle.touches(&state.x));
        friction.refresh(touches, &state.x, |v| state.v[v] * h);
        watch.time("forces", || state.assemble(dressing, elastic, touches, &friction, course.pacing));
        let limits = (course.pacing.tolerance, course.pacing.iterations);
        let State { added, own, side, d, .. } = &mut state;
        let system = System { matrix: &mut *elastic, added, own, side, fixed: &cloth.held };
        let done = watch.time("linear solver", || solver.solve(system, limits, d));
        iterations += done as u64;
        let from = state.advance(&cloth.held);
        let corrected = watch.time("strain limiting", || elastic.limit(&mut state.x));
        corrections = corrected.map(|more| corrections.unwrap_or(0) + more);
        find_velocities(&mut state.v, [&from, &state.x], h, touches);
        steps += 1;
        let rms_speed = rms_speed(state.v.iter().zip(&cloth.held).filter(|(_, held)| !**held).map(|(v, _)| v));
        if !rms_speed.is_finite() {
            return Err(MethodError::Unstable { method: course.method, step: steps });
        }
        let ended = rest.after(h, rms_speed);
        let moment = Moment {
            stage: "in time",
            step: steps,
            time_s: rest.time_s(),
            rms_speed_m_per_s: rms_speed,
            positions: &state.x,
        };
        let stopped = onlooker(&moment).is_break().then_some(Ended::Interrupted);
        if let Some(ended) = ended.or(stopped) {
            let corrected = corrections.map(|corrections| ("strain corrections", corrections));
            return Ok(MethodDrape {
                positions: state.x,
                ended,
                steps,
                simulated_s: rest.time_s(),
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
    /// The linear system of a step.
    fn assemble(
        &mut self,
        dressing: &MethodInput<'_>,
        elastic: &mut dyn Elastic,
        touches: &[Touch],
        friction: &Grip,
        pacing: &Pacing,
    ) {
        let cloth = dressing.cloth;
        let h = pacing.step_s;
        let inertia = 1.0 / (h * h) + pacing.damping_per_s / h;
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
        self.own.clone_from(&self.added);
        elastic.add_own(&mut self.own);
        for (i, &mass) in cloth.masses.iter().enumerate() {
            let side = self.force[i] + mass * (self.v[i] / h - GRAVITY * DVec3::Z);
            self.side[i] = if cloth.held[i] { Vec3A::ZERO } else { side.as_vec3a() };
            self.d[i] = if cloth.held[i] { Vec3A::ZERO } else { (self.v[i] * h).as_vec3a() };
        }
    }

    /// Goes along the solution; returns where it was.
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
