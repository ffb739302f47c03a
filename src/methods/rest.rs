//! When a garment that moves in time has come to rest: one rule for every method.
//!
//! v = √(Σ |v_i|² / n) over the free vertices stays under a speed for a while, 1 cm/s over a quarter of a second unless
//! asked otherwise. Gravity alone passes that speed within a millisecond, so a garment let go is not mistaken for one
//! at rest. The rule sees speed and not forces: what creeps passes, and therefore the residual of the common energy is
//! told beside it.
//!
//! Source: the stopping rule of this project's comparison; the papers give none but "until the speed falls under a
//! tolerance" (\[20\]).

use glam::DVec3;

use crate::mechanics::energy::contact::Touch;

/// When a garment counts as resting, and when to give up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestRule {
    /// RMS speed of the free vertices, m/s.
    pub speed_m_per_s: f64,
    /// How long it must stay under that, s of simulated time.
    pub over_s: f64,
    /// Simulated time after which it is given up, s.
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
    /// The rule holds.
    AtRest,
    /// It was still moving when its simulated time was over.
    TimeOver,
    /// The onlooker said so.
    Interrupted,
}

/// Follows a run and says when it rests.
#[derive(Debug, Clone)]
pub struct Rest {
    rule: RestRule,
    time_s: f64,
    slow_for_s: f64,
}

impl Rest {
    /// At the start, nothing is known.
    #[must_use]
    pub(crate) fn new(rule: RestRule) -> Self {
        Self { rule, time_s: 0.0, slow_for_s: 0.0 }
    }

    /// After a step of `h` seconds at whose end the vertices have this RMS speed, m/s.
    pub(crate) fn after(&mut self, h: f64, rms_speed: f64) -> Option<Ended> {
        self.time_s += h;
        self.slow_for_s = if rms_speed < self.rule.speed_m_per_s { self.slow_for_s + h } else { 0.0 };
        // Sums of steps fall short of the whole by rounding.
        if self.slow_for_s >= self.rule.over_s - 1e-9 {
            Some(Ended::AtRest)
        } else if self.time_s >= self.rule.limit_s - 1e-9 {
            Some(Ended::TimeOver)
        } else {
            None
        }
    }

    /// Simulated time so far, s.
    #[must_use]
    pub(crate) fn time_s(&self) -> f64 {
        self.time_s
    }
}

/// Velocities (m/s) after a step of `h` seconds between these positions (m); what touches does not leave the body with it: cloth does not
/// bounce.
pub(super) fn find_velocities(v: &mut [DVec3], [from, to]: [&[DVec3]; 2], h: f64, touches: &[Touch]) {
    for ((v, to), from) in v.iter_mut().zip(to).zip(from) {
        *v = (*to - *from) / h;
    }
    for t in touches {
        let v = &mut v[t.vertex as usize];
        *v -= t.normal * v.dot(t.normal).max(0.0);
    }
}

/// √(Σ |v_i|² / n) of the vertices that are free, m/s.
pub(super) fn rms_speed<'v>(free: impl Iterator<Item = &'v DVec3>) -> f64 {
    let (sum, count) = free.fold((0.0, 0usize), |(sum, n), v| (sum + v.length_squared(), n + 1));
    (sum / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_is_a_quarter_of_a_second_without_a_break() {
        let mut rest = Rest::new(RestRule { limit_s: 2.0, ..RestRule::default() });
        for _ in 0..24 {
            assert_eq!(rest.after(0.01, 0.009), None);
        }
        assert_eq!(rest.after(0.01, 0.011), None, "a break");
        for _ in 0..24 {
            assert_eq!(rest.after(0.01, 0.009), None);
        }
        assert_eq!(rest.after(0.01, 0.009), Some(Ended::AtRest));
        let mut fast = Rest::new(RestRule { limit_s: 0.03, ..RestRule::default() });
        assert_eq!([fast.after(0.01, 1.0), fast.after(0.01, 1.0)], [None; 2]);
        assert_eq!(fast.after(0.01, 1.0), Some(Ended::TimeOver));
    }
}
