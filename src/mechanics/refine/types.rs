//! Input and output of a refinement.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::mechanics::newton::Record;

/// Options of one run. The options of the solver belong to the cloth ([`Cloth::solver`](crate::mechanics::energy::Cloth::solver)).
#[derive(Debug, Clone, PartialEq)]
pub struct RefineOptions {
    /// At most this many steps; `None` for as many as it takes, up to the solver's limit.
    pub max_steps: Option<usize>,
    /// Whether the start is near a rest, so that little damping is needed.
    pub from_rest: bool,
    /// Whether cloth is kept apart from cloth: see `proximity`.
    pub self_contact: bool,
    /// Whether a rest must last: hardly anything moves by the next step, and no way leads out on which the energy falls.
    pub lasting: bool,
    /// Residual over weight at which the run ends, whether or not the cloth rests there; `None` for a rest.
    pub until: Option<f64>,
    /// Residual over weight to which a rest is continued with its own contacts; `None` ends there. For checks of a rest.
    pub continued_to: Option<f64>,
}

impl Default for RefineOptions {
    fn default() -> Self {
        Self { max_steps: None, from_rest: false, self_contact: true, lasting: true, until: None, continued_to: None }
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
    /// Whether the forces balance; set once, before the check of stability.
    pub at_rest: bool,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The residual is under the tolerance, and the cloth rests by every criterion of [`rest`](crate::mechanics::rest); or it is under the one
    /// that the run was to reach.
    Converged,
    /// The residual is under the tolerance, but this criterion of rest keeps failing.
    Unsettled(&'static str),
    /// The steps asked for are done.
    StepsDone,
    /// The observer said so.
    Interrupted,
    /// No step lowers the energy any more, though the residual is over the tolerance: rounding is reached before, or the solve cycles far from
    /// rest.
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
    /// Pairs of triangles that intersect; 0 without self-contact.
    pub crossings: usize,
    /// Steps done, those from other starts included (`refine::starts`).
    pub steps: usize,
    /// Every step, the start first.
    pub history: Vec<Record>,
    /// Why it ended.
    pub stop: Stop,
    /// Contact stiffness κ at the end, N/m³: more than to begin with, if vertices had to be kept out.
    pub contact_stiffness: f64,
}

/// Called after every step; may end the run.
pub(crate) type Observer<'a> = &'a mut (dyn FnMut(&Step<'_>) -> ControlFlow<()> + Send);
