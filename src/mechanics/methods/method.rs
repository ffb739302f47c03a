//! The interface of the reference methods, and the rule by which a garment that moves in time counts as resting.
//!
//! Rest: v = √(Σ |v_i|² / n) over the free vertices stays below a speed for a duration, by default 1 cm/s for a quarter of a second.
//! Gravity alone exceeds that speed within a millisecond, so a garment that has just been released does not count as resting. Source:
//! the stopping rule of this project's comparison; the papers give none but "until the speed falls under a tolerance" (\[20\]).
//! Limits: the rule tests speeds and not forces, so cloth that creeps passes. The residual of the common energy is therefore
//! reported beside it.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Touch;
use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mesh::TriMesh;
use crate::scene::Scene;

/// The input of a method.
#[derive(Debug, Clone, Copy)]
pub struct MethodInput<'a> {
    /// Body and garment.
    pub scene: &'a Scene,
    /// The fabric of the whole garment.
    pub fabric: &'a Fabric,
    /// Masses, areas, held vertices and contact offset of the garment; its energy is not used.
    pub cloth: &'a Cloth,
}

/// The state of a run after a step.
#[derive(Debug, Clone, Copy)]
pub struct MethodStep<'a> {
    /// The stage of the method.
    pub stage: &'static str,
    /// Steps done.
    pub step: usize,
    /// Simulated time, s.
    pub time_s: f64,
    /// RMS speed of the free vertices, m/s.
    pub rms_speed_m_per_s: f64,
    /// Positions, m.
    pub positions: &'a [DVec3],
}

/// Called after every step; a break ends the run.
pub(crate) type Observer<'a> = &'a mut (dyn FnMut(&MethodStep<'_>) -> ControlFlow<()> + Send);

/// An intermediate result of a method, for display.
#[derive(Debug, Clone)]
pub enum Exhibit {
    /// Lines in space, m: fitted quadrics, bounding surfaces. Lines with the same index form one object.
    Lines(Vec<(usize, Vec<DVec3>)>),
    /// A surface, m: a limit surface.
    Surface(TriMesh),
    /// Moving pieces.
    Moving {
        /// The triangles, one group for each piece.
        mesh: TriMesh,
        /// Steps, numbered as in [`MethodStep`], and positions, m.
        frames: Vec<(usize, Vec<DVec3>)>,
    },
}

/// The result of a method.
#[derive(Debug, Clone)]
pub struct MethodDrape {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Why the run ended.
    pub ended: Ended,
    /// Number of time steps.
    pub steps: usize,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// RMS speed of the free vertices at the end, m/s.
    pub rms_speed_m_per_s: f64,
    /// Duration of each part of the work, by name, in order of its first start.
    pub times: Vec<(&'static str, Duration)>,
    /// Duration of the whole run.
    pub total: Duration,
    /// Counters by name.
    pub counts: Vec<(&'static str, u64)>,
    /// Intermediate results by name; empty unless requested.
    pub exhibits: Vec<(&'static str, Exhibit)>,
    /// Remarks for the user.
    pub notes: Vec<String>,
}

/// Why a method has no result.
#[derive(Debug, thiserror::Error)]
pub enum MethodError {
    /// The scene lacks something that the method needs.
    #[error("{method} cannot run here: {reason}")]
    Unfit {
        /// The method.
        method: &'static str,
        /// The missing property.
        reason: String,
    },
    /// The cloth cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The simulation diverged.
    #[error("{method}: positions are not finite after step {step}; the time step is too long for this fabric and mesh")]
    Unstable {
        /// The method.
        method: &'static str,
        /// The first step with such positions.
        step: usize,
    },
}

impl MethodError {
    pub(super) fn unfit(method: &'static str, reason: impl Into<String>) -> Self {
        Self::Unfit { method, reason: reason.into() }
    }
}

/// A result or an error.
pub(crate) type MethodOutcome = Result<MethodDrape, MethodError>;

/// A method that drapes a garment from its placed start to rest.
pub trait ReferenceMethod: Sync {
    /// Author and year.
    fn name(&self) -> &'static str;

    /// The method itself; [`drape`](Self::drape) checks its input and calls it inside the thread pool.
    ///
    /// # Errors
    /// [`MethodError`], in one line.
    fn run(&self, input: &MethodInput<'_>, rule: &RestRule, observer: Observer<'_>) -> MethodOutcome;

    /// Drapes until the garment rests by `rule`; `observer` is called after every step and may end the run.
    ///
    /// # Errors
    /// [`MethodError`], in one line.
    fn drape(&self, input: &MethodInput<'_>, rule: &RestRule, observer: Observer<'_>) -> MethodOutcome {
        let n = input.cloth.fabrics.len();
        if n > 1 {
            let reason = format!("found {n} fabrics in the garment, expected one: the method as published has one");
            return Err(MethodError::unfit(self.name(), reason));
        }
        // Inside the pool, since hundreds of short parallel loops follow.
        rayon::scope(|_| self.run(input, rule, observer))
    }
}

/// When a garment counts as resting, and when a run is given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// RMS speed of the free vertices, m/s.
    pub speed_m_per_s: f64,
    /// Simulated time for which the speed must stay below it, s.
    pub over_s: f64,
    /// Simulated time after which the run ends unfinished, s.
    pub limit_s: f64,
}

impl Default for RestRule {
    fn default() -> Self {
        Self { speed_m_per_s: 0.01, over_s: 0.25, limit_s: 20.0 }
    }
}

/// Why a run in time ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// The garment rests.
    AtRest,
    /// The garment was still moving at the end of the simulated time.
    TimeOver,
    /// The observer ended the run.
    Interrupted,
}

/// Applies a [`RestRule`] step by step.
#[derive(Debug, Clone)]
pub(super) struct RestDetector {
    rule: RestRule,
    /// Simulated time so far, s.
    pub(super) time_s: f64,
    slow_for_s: f64,
}

impl RestDetector {
    pub(super) fn new(rule: RestRule) -> Self {
        Self { rule, time_s: 0.0, slow_for_s: 0.0 }
    }

    /// Advances by a step of `h` seconds at whose end the vertices have this RMS speed, m/s.
    pub(super) fn after(&mut self, h: f64, rms_speed: f64) -> Option<Ended> {
        self.time_s += h;
        self.slow_for_s = if rms_speed < self.rule.speed_m_per_s { self.slow_for_s + h } else { 0.0 };
        // Tolerances, since the sum of the steps is rounded.
        if self.slow_for_s >= self.rule.over_s - 1e-9 {
            Some(Ended::AtRest)
        } else if self.time_s >= self.rule.limit_s - 1e-9 {
            Some(Ended::TimeOver)
        } else {
            None
        }
    }
}

/// Velocities (m/s) after a step of `h` seconds between these positions (m). Touching vertices lose their velocity off the body:
/// cloth does not bounce.
pub(super) fn find_velocities(v: &mut [DVec3], [from, to]: [&[DVec3]; 2], h: f64, touches: &[Touch]) {
    for ((v, to), from) in v.iter_mut().zip(to).zip(from) {
        *v = (*to - *from) / h;
    }
    for t in touches {
        let v = &mut v[t.vertex as usize];
        *v -= t.normal * v.dot(t.normal).max(0.0);
    }
}

/// √(Σ |v_i|² / n) of the free vertices, m/s.
pub(super) fn rms_speed<'v>(free: impl Iterator<Item = &'v DVec3>) -> f64 {
    let (sum, count) = free.fold((0.0, 0usize), |(sum, n), v| (sum + v.length_squared(), n + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// Durations by name, in order of their first start.
#[derive(Debug, Clone)]
pub(super) struct Stopwatch {
    pub(super) began: Instant,
    pub(super) parts: Vec<(&'static str, Duration)>,
}

impl Stopwatch {
    pub(super) fn begin() -> Self {
        Self { began: Instant::now(), parts: Vec::new() }
    }

    /// Runs `work` and adds its duration to that of `name`.
    pub(super) fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let began = Instant::now();
        let out = work();
        let spent = began.elapsed();
        match self.parts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += spent,
            None => self.parts.push((name, spent)),
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_is_a_quarter_of_a_second_without_a_break() {
        let mut rest = RestDetector::new(RestRule { limit_s: 2.0, ..RestRule::default() });
        for _ in 0..24 {
            assert_eq!(rest.after(0.01, 0.009), None);
        }
        assert_eq!(rest.after(0.01, 0.011), None, "a break");
        for _ in 0..24 {
            assert_eq!(rest.after(0.01, 0.009), None);
        }
        assert_eq!(rest.after(0.01, 0.009), Some(Ended::AtRest));
        let mut fast = RestDetector::new(RestRule { limit_s: 0.03, ..RestRule::default() });
        assert_eq!([fast.after(0.01, 1.0), fast.after(0.01, 1.0)], [None; 2]);
        assert_eq!(fast.after(0.01, 1.0), Some(Ended::TimeOver));
    }
}
