//! Refinement: from any start to the drape, by Newton's method at full resolution.
//!
//! The steps are those of `mechanics::newton` in all vertices. Stops where the residual ‖∇E‖₂ over the free vertices, divided
//! by the garment's weight, is under the tolerance and no vertex is inside the body, and where that rest lasts: a residual is as small on
//! a saddle of the energy, and where cloth slides slowly. A rest is therefore looked at, and left where it is none
//! (`newton::ways_out`); that costs one to two steps, and what it takes to come to rest again.
//!
//! **Stiff cloth begins soft.** A woven membrane lets a step go only as far as its triangles stay as long as they are to a part
//! in thousands, so it creeps into its folds a millimetre at a time. Far from rest it is therefore first settled with its stiffness
//! capped at what its own weight strains by [`RefineOptions::soft_strain`]; with a few millimetres left to go, it continues
//! with its true stiffness. Each of the two energies falls; [`Record::softened`] says which one a step belongs to.

mod cycle_damping;
mod settle;

use std::ops::ControlFlow;

use glam::DVec3;

pub use super::newton::{Record, SolveError, Solver};
pub(crate) use settle::untangled;
pub use settle::{refine, refine_with};

/// When to stop, and how carefully to go.
#[derive(Debug, Clone, PartialEq)]
pub struct RefineOptions {
    /// At most this many steps; `None` for as many as it takes (see [`STEP_LIMIT`]).
    pub max_steps: Option<usize>,
    /// Residual over weight that counts as converged.
    pub tolerance: f64,
    /// Damping ε to begin with, 1/s².
    pub damping: f64,
    /// Longest move of a vertex in one step, m.
    pub longest_move_m: f64,
    /// Strain under its own hanging weight that stiff cloth may have to begin with; 0 for its true stiffness throughout.
    pub soft_strain: f64,
    /// Whether cloth keeps off cloth: see [`proximity`](super::energy::proximity).
    pub self_contact: bool,
    /// Whether a rest must last: hardly anything moves by the next step, and no way leads out on which the energy falls.
    pub lasting: bool,
}

/// No run takes more steps than this.
pub(crate) const STEP_LIMIT: usize = 2000;

impl Default for RefineOptions {
    fn default() -> Self {
        Self {
            max_steps: None,
            tolerance: 1e-3,
            damping: 300.0,
            longest_move_m: 0.1,
            soft_strain: 0.005,
            self_contact: true,
            lasting: true,
        }
    }
}

/// One step, as the observer sees it.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Steps done: 0 for the start.
    pub iteration: usize,
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over the weight.
    pub residual_over_weight: f64,
    /// Vertices within the offset of the body.
    pub contacts: usize,
    /// Positions, m.
    pub positions: &'a [DVec3],
    /// Whether it rests as far as its forces tell; told once, before it is looked at whether that lasts.
    pub at_rest: bool,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The residual is under the tolerance.
    Converged,
    /// The steps asked for are done.
    StepsDone,
    /// The observer said so.
    Interrupted,
    /// No step lowers the energy any more: rounding is reached before the tolerance.
    Stalled,
}

/// Where a run ended.
#[derive(Debug, Clone)]
pub struct Refined {
    /// Vertex positions, m.
    pub positions: Vec<DVec3>,
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over the weight.
    pub residual_over_weight: f64,
    /// Steps done.
    pub steps: usize,
    /// Every step, the start first.
    pub history: Vec<Record>,
    /// Why it ended.
    pub stop: Stop,
    /// Contact stiffness κ at the end, N/m³: more than to begin with, if vertices had to be kept out.
    pub contact_stiffness: f64,
}

/// Told of every step; may end the run.
pub(crate) type Observer<'a> = &'a mut (dyn FnMut(&Step<'_>) -> ControlFlow<()> + Send);
