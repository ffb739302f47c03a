//! Options and result of the coupled solve.

use std::time::Duration;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::serde_name;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::newton::SolveError;
use crate::mechanics::refine::Record;

/// Why PARTs could not be solved together.
#[derive(Debug, thiserror::Error)]
pub enum CoupledError {
    /// Arrays that belong together differ in length.
    #[error("{what} has {found} entries and the garment {expected}: give one for each of the same mesh")]
    Count {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// No PART that could move.
    #[error("none of the garment's vertices lies in a level of the range table: widen its first or last row")]
    NoParts,
    /// The cloth cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The motions cannot be solved.
    #[error("the motions of the PARTs: {0}")]
    Solve(#[from] SolveError),
    /// The caller stopped it.
    #[error("interrupted while the PARTs moved")]
    Interrupted,
}

/// How a PART moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// An affine map: it is shifted, turned, stretched and sheared.
    #[default]
    Affine,
    /// One displacement, as in the paper.
    Translation,
}

impl Motion {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Affine => "affine",
            Self::Translation => "translation",
        }
    }
}

impl std::str::FromStr for Motion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        serde_name::parse(text).ok_or_else(|| format!("found `{text}`, expected affine or translation"))
    }
}

/// How the equilibrium of the PARTs is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// ADMM where most of the garment lies in PARTs wider than two folds, Newton's method otherwise.
    #[default]
    Auto,
    /// Local and global steps on sampled elements with one factor: milliseconds, and no folds.
    Admm,
    /// Newton's method on all elements, with vertices relaxed after every step.
    Newton,
}

/// How PARTs are solved together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoupledOptions {
    /// How a PART moves.
    pub motion: Motion,
    /// How the equilibrium is found.
    pub method: Method,
    /// Iterations of ADMM at most.
    pub max_iterations: usize,
    /// A root mean square change of the maps below this, m, ends ADMM.
    pub least_change_m: f64,
    /// Largest extents of PARTs along the cloth, m, coarse to fine: one solve each, from where the one before ended. Empty: the
    /// PARTs as the range table makes them.
    pub extents_m: Vec<f64>,
    /// Newton steps at most.
    pub max_steps: usize,
    /// A whole step that moves no vertex by more than this, m, ends the solve, once the damping is low.
    pub least_move_m: f64,
    /// Damping ε to begin with, 1/s².
    pub damping: f64,
    /// Strain that the cloth may have where it hangs by its whole height: its membrane stiffness is at most ρ g H over this.
    /// Stiff cloth lets a step go a millimetre.
    pub soft_strain: f64,
    /// Iterations of a relaxation after each step.
    pub relaxing: usize,
    /// Iterations of a relaxation of a step that failed.
    pub relaxing_trial: usize,
}

impl Default for CoupledOptions {
    fn default() -> Self {
        Self {
            motion: Motion::Affine,
            method: Method::Auto,
            max_iterations: 40,
            least_change_m: 1e-4,
            extents_m: Vec::new(),
            max_steps: 40,
            least_move_m: 3e-3,
            damping: 30.0,
            // A 60 cm skirt then hangs at most 1.5 mm too long.
            soft_strain: 0.005,
            relaxing: 20,
            relaxing_trial: 60,
        }
    }
}

/// Displacement and forces of one PART.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartResult {
    /// Mean displacement of its vertices from their start, D, m.
    pub displacement: DVec3,
    /// Its weight F⁰, N.
    pub gravity: DVec3,
    /// The body's reaction on it, friction included, F¹, N.
    pub reaction: DVec3,
    /// The pull of its neighbours through the cloth, F², N; the three cancel up to the residual, and where it is held.
    pub pull: DVec3,
    /// |F¹|, N.
    pub resultant: f64,
    /// Whether the body carries some of it.
    pub in_contact: bool,
    /// Whether one of its vertices is held.
    pub held: bool,
}

/// The garment after the coupled solve.
#[derive(Debug, Clone)]
pub struct CoupledResult {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Displacement and forces of each PART.
    pub parts: Vec<PartResult>,
    /// Every Newton step, the start first.
    pub history: Vec<Record>,
    /// Unknown vectors: four a PART that moves by an affine map.
    pub unknowns: usize,
    /// Residual force over weight in the PARTs' own coordinates.
    pub residual_over_weight: f64,
    /// Vertices that were left within the cloth's thickness of the body and pushed out.
    pub pushed_out: usize,
    /// Time for the weights and the pattern.
    pub setup: Duration,
    /// Time for Newton's steps.
    pub solve: Duration,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}
