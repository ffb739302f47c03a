//! \[19\] D. Zhu, Z. Li: "Dynamic garment simulation based on hybrid bounding volume hierarchy", Autex Research Journal
//! 16(4), 2016, 241–249.
//!
//! Confirmed by the source: the body is segmented (arms, legs, trunk, hip); each unit is cut into slices, and each
//! slice fitted with a cylinder (limbs) or an elliptic cylinder (trunk, hip); a garment vertex is tested against the
//! world box, then the units, then in the unit's frame against (x/a)² + (y/b)² < (1 + ε)², |z| < h/2, then against the
//! leaf triangles; the garment is a triangle mesh of masses and springs.
//!
//! Our reading: how the body is segmented ([`units`]); ε from the fit itself, so that no contact within the cloth's offset
//! is missed ([`quadric`]); the leaf's triangles by sectors ([`hierarchy`]); spring constants from
//! the fabric and Provot's strain limiting at 10 % ([`springs`]); backward Euler
//! ([`integrate`](super::implicit_euler)), as its integrator is not confirmed; penalty contact with Coulomb friction; steps of 20 ms
//! (in steps of 33 ms a pullover of 900 vertices diverged) and damping by the air of 6 1/s (of 2, 4, 6 and 8, the time to rest was
//! shortest at 6 and 8).
//!
//! Limits: springs along edges have no shear stiffness and no Poisson's ratio of their own; the energy of bending springs grows with
//! the fourth power of the curvature, so they match the fabric at one radius only.

pub mod hierarchy;
pub mod quadric;
pub mod springs;
pub mod units;

use super::implicit_euler::{EulerSettings, Integration, integrate};
use super::method::{
    Exhibit, MethodDrape, MethodError, MethodInput, MethodOutcome, Observer, ReferenceMethod, RestRule, Stopwatch,
};
use hierarchy::Hierarchy;
use springs::Springs;

/// The method's name.
pub(crate) const NAME: &str = "zhu2016";

/// The method with its parameters.
#[derive(Debug, Clone)]
pub struct Zhu2016 {
    /// Time step, damping and accuracy.
    pub settings: EulerSettings,
    /// Elongation above which Provot's limiting shortens a spring.
    pub strain_limit: f64,
    /// Whether to return units and quadrics.
    pub exhibit: bool,
}

impl Default for Zhu2016 {
    fn default() -> Self {
        Self { settings: EulerSettings::default(), strain_limit: 0.1, exhibit: false }
    }
}

impl ReferenceMethod for Zhu2016 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn run(&self, input: &MethodInput<'_>, rule: &RestRule, observer: Observer<'_>) -> MethodOutcome {
        let mut watch = Stopwatch::begin();
        let mut springs = watch.time("springs", || Springs::new(input, self.strain_limit));
        let mut hierarchy =
            (watch.time("hierarchy", || Hierarchy::new(input))).map_err(|reason| MethodError::unfit(NAME, reason))?;
        let integration = Integration { method: NAME, settings: &self.settings, rule, friction: input.fabric.friction };
        let draped = integrate(input, integration, &mut springs, &mut hierarchy, watch, observer)?;
        let tests = hierarchy.tests;
        let of_hierarchy = [
            ("units", hierarchy.units.len() as u64),
            ("quadrics", hierarchy.slices() as u64),
            ("world box tests", tests.world),
            ("unit tests", tests.units),
            ("quadric tests", tests.quadrics),
            ("leaf triangle tests", tests.triangles),
            ("touching", tests.touching),
        ];
        let exhibits =
            if self.exhibit { vec![("units and quadrics", Exhibit::Lines(hierarchy.outlines()))] } else { Vec::new() };
        let counts = of_hierarchy.into_iter().chain(draped.counts).collect();
        Ok(MethodDrape { counts, exhibits, notes: hierarchy.notes(), ..draped })
    }
}
