//! What is asked of the coupled solve, and what it answers.

use std::time::Duration;

use glam::DVec3;

use crate::mechanics::energy::EnergyError;
use crate::mechanics::refine::{Record, SolveError};
use crate::parts::Parts;

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
    /// An extent that cuts nothing sensible.
    #[error("an extent of {0} m cannot cut a garment: give a positive length, a few centimetres")]
    Extent(f64),
    /// No three PARTs meet.
    #[error(
        "no three of the {parts} PARTs meet in a triangle, so they make no cloth: cut them to an extent of a few centimetres"
    )]
    NoCloth {
        /// PARTs there are.
        parts: usize,
    },
    /// The coarse cloth cannot be set up.
    #[error("the coarse cloth: {0}")]
    Energy(#[from] EnergyError),
    /// The coarse cloth cannot be solved.
    #[error("the coarse cloth: {0}")]
    Solve(#[from] SolveError),
}

/// How PARTs are solved together.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoupledOptions {
    /// Largest extents along the cloth, m, coarse to fine: one solve each, from where the one before ended. Empty: the PARTs
    /// as they are.
    pub extents_m: Vec<f64>,
    /// PARTs under this many vertices are joined to a neighbour before they are cut.
    pub min_vertices: usize,
    /// So are PARTs of an area under this share of the finest extent squared.
    pub least_area: f64,
    /// Sweeps of the blend; `None` for as many as half a PART is wide.
    pub blend_sweeps: Option<usize>,
    /// Residual over weight at which a coarse cloth counts as settled, once its steps are short.
    pub tolerance: f64,
    /// A whole Newton step that moves no node by more than this, m, ends a solve as well.
    pub least_move_m: f64,
    /// Newton steps of each solve at most.
    pub max_steps: usize,
    /// Damping ε to begin with, 1/s².
    pub damping: f64,
    /// Strain that the coarse cloth may have where it hangs by its whole height: its membrane stiffness is at most ρ g H over
    /// this. Flat triangles of stiff cloth can only fold along their edges, which is no way for cloth to fall.
    pub coarse_strain: f64,
    /// Share of the fabric's bending stiffness that the coarse cloth has.
    pub bending_share: f64,
    /// Share of its membrane stiffness that the coarse cloth keeps under compression.
    pub compression_share: f64,
}

impl Default for CoupledOptions {
    fn default() -> Self {
        Self {
            // On the knit skirt and dresses 8 cm are farther from their own drape, 5 cm no nearer in all and over a tenth of the time.
            extents_m: vec![0.06],
            min_vertices: 1,
            // A small node costs as much as any other: a tenth of the PARTs fewer, the preview as near.
            least_area: 0.75,
            blend_sweeps: None,
            // A preview is millimetres off whatever the coarse cloth does: at 1e-2 and 1 mm it takes up to half as many steps
            // more, and comes no nearer.
            tolerance: 5e-2,
            // A third of the error a preview is meant to have.
            least_move_m: 3e-3,
            max_steps: 60,
            damping: 3.0,
            // A 60 cm skirt then hangs at most 1.5 mm too long, and folds while it may.
            coarse_strain: 0.005,
            // With all of it a knit skirt folds in four where its drape has eight; with a tenth it crumples.
            bending_share: 0.3,
            compression_share: 0.03,
        }
    }
}

/// What one PART did.
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
    /// Whether its node is held.
    pub held: bool,
}

/// One solve of the cascade.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Largest extent, m; infinite where nothing was cut.
    pub extent_m: f64,
    /// PARTs.
    pub part_count: usize,
    /// Triangles of the coarse cloth.
    pub triangle_count: usize,
    /// Newton steps.
    pub steps: usize,
    /// Residual over weight of the coarse cloth at the end.
    pub residual_over_weight: f64,
    /// Energy of the coarse cloth, J.
    pub energy: f64,
    /// Vertices after this stage, m.
    pub positions: Vec<DVec3>,
    /// Newton's steps on the coarse cloth, the start first.
    pub history: Vec<Record>,
    /// Time for the PARTs and the coarse cloth.
    pub setup: Duration,
    /// Time for Newton's steps.
    pub solve: Duration,
    /// Time for the blend and the push-out.
    pub blend: Duration,
}

/// The garment after the coupled solve.
#[derive(Debug, Clone)]
pub struct CoupledResult {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// The PARTs of the last stage.
    pub parts: Parts,
    /// What each of them did.
    pub part_results: Vec<PartResult>,
    /// Every solve, coarse to fine.
    pub stages: Vec<Stage>,
    /// Vertices that the blend left within the cloth's thickness of the body and that were pushed out.
    pub pushed_out: usize,
    /// What a user should know.
    pub warnings: Vec<String>,
}

impl CoupledResult {
    /// Residual over weight of the last coarse cloth.
    #[must_use]
    pub fn residual_over_weight(&self) -> f64 {
        self.stages.last().map_or(0.0, |s| s.residual_over_weight)
    }

    /// Newton steps of all stages.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.stages.iter().map(|s| s.steps).sum()
    }
}
