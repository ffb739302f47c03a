//! Options and result of the coupled solve.

use std::time::Duration;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::serde_name;
use crate::mechanics::energy::EnergyError;
use crate::mechanics::newton::SolveError;

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

/// How PARTs are solved together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoupledOptions {
    /// How a PART moves.
    pub motion: Motion,
    /// Iterations at most, of up to 150 PARTs; more in proportion to the square root of their number.
    pub max_iterations: usize,
    /// A root mean square change of the maps below this, m, ends the iterations.
    pub least_change_m: f64,
    /// Largest extents of PARTs along the cloth, m, coarse to fine: one solve each, from where the one before ended. Empty: the
    /// PARTs as the range table makes them.
    pub extents_m: Vec<f64>,
}

impl Default for CoupledOptions {
    fn default() -> Self {
        Self { motion: Motion::Affine, max_iterations: 40, least_change_m: 1e-4, extents_m: Vec::new() }
    }
}

/// Displacement and forces of one PART.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartResult {
    /// Mean displacement of its vertices from their start, D, m.
    pub displacement: DVec3,
    /// Its weight F⁰, N: the force at a vertex is shared by the blending weights of its PARTs, here and below.
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
    /// Unknown vectors: four a PART that moves by an affine map.
    pub unknowns: usize,
    /// Residual force over weight in the PARTs' own coordinates.
    pub residual_over_weight: f64,
    /// Vertices that were left within the cloth's thickness of the body and pushed out.
    pub pushed_out: usize,
    /// Time for the weights and the factor.
    pub setup: Duration,
    /// Time for the iterations.
    pub solve: Duration,
}
