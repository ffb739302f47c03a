//! \[19\] D. Zhu, Z. Li: "Dynamic garment simulation based on hybrid bounding volume hierarchy", Autex Research Journal
//! 16(4), 2016, 241–249.
//!
//! Confirmed by the source: the body is segmented (arms, legs, trunk, hip); each unit is cut into slices, and each
//! slice fitted with a cylinder (limbs) or an elliptic cylinder (trunk, hip); a garment vertex is tested against the
//! world box, then the units, then in the unit's frame against (x/a)² + (y/b)² < (1 + ε)², |z| < h/2, then against the
//! leaf triangles; the garment is a triangle mesh of masses and springs.
//!
//! Our reading: how the body is segmented ([`units`]); ε from the fit itself, so that nothing within the cloth's offset
//! of the body is missed ([`quadric`]); the leaf's triangles by sectors ([`hierarchy`]); the springs' constants from
//! the fabric's, Provot's strain limiting at 10 % ([`springs`]); backward Euler ([`march`](super::implicit_euler)), as its
//! integrator is not confirmed; penalty contact with Coulomb friction; steps of 20 ms (of 33 ms a pullover of 900
//! vertices flew off) and damping by the air of 6 1/s (of 2, 4, 6 and 8 the time to rest was least at 6 and 8).
//!
//! Limits: springs along edges have no shear and no Poisson's ratio of their own; springs over edges bend by the fourth
//! power of curvature, so they match the fabric at one radius only.

mod closest;
pub mod hierarchy;
pub mod quadric;
pub mod springs;
pub mod units;

use super::implicit_euler::{Course, Pacing, march};
use super::{MethodInput, Exhibit, MethodDrape, MethodOutcome, ReferenceMethod, RestRule, Spectator, Stopwatch};
use hierarchy::Hierarchy;
use springs::Springs;

/// The method's name.
pub(crate) const NAME: &str = "zhu2016";

/// The method with its dials.
#[derive(Debug, Clone)]
pub struct Zhu2016 {
    /// How it is moved in time.
    pub pacing: Pacing,
    /// Elongation at which Provot's limiting sets in.
    pub strain_limit: f64,
    /// Whether units and quadrics are to be shown.
    pub exhibit: bool,
}

impl Default for Zhu2016 {
    fn default() -> Self {
        Self { pacing: Pacing::default(), strain_limit: 0.1, exhibit: false }
    }
}

impl ReferenceMethod for Zhu2016 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn run(&self, dressing: &MethodInput<'_>, rule: &RestRule, onlooker: Spectator<'_>) -> MethodOutcome {
        let mut watch = Stopwatch::begin();
        let mut springs = watch.time("springs", || Springs::new(dressing, self.strain_limit));
        let mut hierarchy = watch.time("hierarchy", || Hierarchy::new(dressing))?;
        let course = Course { method: NAME, pacing: &self.pacing, rule, friction: dressing.fabric.friction };
        let marched = march(dressing, course, (&mut springs, &mut hierarchy), watch, onlooker)?;
        let counts = hierarchy.counts();
        let of_hierarchy = [
            ("units", hierarchy.units() as u64),
            ("quadrics", hierarchy.slices() as u64),
            ("world box tests", counts.world),
            ("unit tests", counts.units),
            ("quadric tests", counts.quadrics),
            ("leaf triangle tests", counts.triangles),
            ("touching", counts.touching),
        ];
        let exhibits =
            if self.exhibit { vec![("units and quadrics", Exhibit::Lines(hierarchy.outlines()))] } else { Vec::new() };
        let counts = of_hierarchy.into_iter().chain(marched.counts).collect();
        Ok(MethodDrape { counts, exhibits, notes: hierarchy.notes(), ..marched })
    }
}
