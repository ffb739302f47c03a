//! What a session has found so far, piece by piece; every piece says which state it belongs to.
//!
//! | field | of every piece that has it |
//! |---|---|
//! | `state` | the state it belongs to |
//! | `ground` | body and garment, what was cut or draped |
//! | `positions` | the garment, m |
//! | `ms`, `after_ms` | milliseconds of its steps, and from the edit to here |

#![allow(missing_docs, reason = "the table above says what the fields are that have no text of their own")]

use std::sync::Arc;

use glam::DVec3;

use crate::drape::{ClothState, Distances, Drape, LetGo, PartOutcome, Refine};
use crate::garment::fabric::Fabric;
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::scene::{Loaded, SceneSpec};
use crate::study::job::Job;
use crate::study::metrics::Metrics;

/// Body and garment, and how far apart they are: what stays while tables and fabrics change.
#[derive(Debug)]
pub struct LoadedScene {
    /// Counts bodies and garments up from 1.
    pub generation: u64,
    /// What was loaded.
    pub spec: SceneSpec,
    /// The scene with its origin.
    pub loaded: Loaded,
    /// Milliseconds it took to load.
    pub load_ms: f64,
    pub(crate) distances: Distances,
    pub(crate) distance_ms: f64,
}

impl LoadedScene {
    /// Unsigned distance of each garment vertex to the body before draping, m.
    #[must_use]
    pub(crate) fn distance_m(&self) -> &[f64] {
        &self.distances.unsigned_m
    }
}

/// Stage one of a state.
#[derive(Debug, Clone)]
pub struct Segmented {
    pub state: u64,
    pub ground: Arc<LoadedScene>,
    /// The table, with the rows its rule made.
    pub table: Arc<RangeTable>,
    /// The PARTs.
    pub parts: Arc<Parts>,
    /// The body's reaction on each PART in the drape at hand, N; empty where there is none yet.
    pub force_n: Arc<Vec<DVec3>>,
    /// Milliseconds of the cut.
    pub segment_ms: f64,
    pub after_ms: f64,
    pub(crate) min_part: usize,
}

/// Stage two of a state.
#[derive(Debug, Clone)]
pub struct Preview {
    pub state: u64,
    pub ground: Arc<LoadedScene>,
    /// Whether it went on from the preview before, in which case the two stages from the undraped garment are still to come.
    pub warm: bool,
    /// Whether its steps are done.
    pub done: bool,
    /// The PARTs that moved: those of stage one, or cut to the extent of the run.
    pub parts: Arc<Parts>,
    /// What each did; empty before the steps are done.
    pub outcomes: Arc<Vec<PartOutcome>>,
    pub positions: Arc<Vec<DVec3>>,
    pub ms: f64,
    pub after_ms: f64,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// The garment at full resolution, on its way to rest or there.
#[derive(Debug, Clone)]
pub struct AtRest {
    pub state: u64,
    pub ground: Arc<LoadedScene>,
    /// Whether no step is left to take: where its forces balance, it was looked at that this lasts.
    pub done: bool,
    /// Whether its forces balance; that it lasts may yet be looked at, which moves little.
    pub balanced: bool,
    /// Whether it is the drape of an earlier state: where a cloth rests does not depend on the table, and a fabric that it was in before
    /// hangs as it did.
    pub kept: bool,
    /// Whether it began at the drape before.
    pub warm: bool,
    pub positions: Arc<Vec<DVec3>>,
    /// ‖∇E‖ over the weight.
    pub residual_over_weight: f64,
    /// Steps at full resolution.
    pub steps: usize,
    pub ms: f64,
    pub after_ms: f64,
    /// What came of letting go what was held until it rested.
    pub let_go: Option<LetGo>,
    pub(crate) reaction_n: Arc<Vec<DVec3>>,
    pub(crate) told: Option<Arc<ClothState>>,
    pub(crate) of: (Fabric, Refine, bool),
    /// Where the next drape goes on from: what is let go at the end is held there.
    pub(crate) held: Arc<Vec<DVec3>>,
}

/// A state with nothing left to compute.
#[derive(Debug)]
pub struct Finished {
    pub state: u64,
    pub ground: Arc<LoadedScene>,
    /// All of it.
    pub drape: Drape,
    /// Its figures.
    pub metrics: Metrics,
    /// RMS distance of the two stages alone from where the garment rests, mm, where it was refined.
    pub preview_error_mm: Option<f64>,
    /// What affine maps of these PARTs, blended over the seams, could hold that to, mm.
    pub bound_mm: Option<f64>,
}

/// An edit that turned out to be impossible when it was tried.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The state it made.
    pub state: u64,
    /// Why it cannot be.
    pub sentence: String,
    /// The first of the files that it read body or garment from, where these are the reason: the sentence may quote it.
    pub file: Option<String>,
    /// The state that stands instead; none where there was no good one yet.
    pub back_to: Option<u64>,
}

/// A state that was kept beside those after it.
#[derive(Debug, Clone)]
pub struct Pin {
    /// Its number among the pins.
    pub id: u64,
    /// What it is called.
    pub label: String,
    pub state: u64,
    /// Its job.
    pub job: Arc<Job>,
    /// Its drape: at rest where it had come to rest, else as previewed.
    pub positions: Arc<Vec<DVec3>>,
    pub ground: Arc<LoadedScene>,
    /// Its numbers.
    pub numbers: TrailPoint,
}

/// The numbers of a state, for lines over the edits.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct TrailPoint {
    pub state: u64,
    /// Its PARTs.
    pub parts: usize,
    /// Milliseconds of stage one.
    pub segment_ms: f64,
    /// Milliseconds of stage two from the undraped garment.
    pub two_stages_ms: Option<f64>,
    /// Milliseconds at full resolution.
    pub rest_ms: Option<f64>,
    /// RMS distance of the two stages alone from where the garment rests, mm.
    pub preview_error_mm: Option<f64>,
    /// What affine maps of the PARTs could hold that to, mm.
    pub bound_mm: Option<f64>,
}

/// All that is known at one moment.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// Grows with everything that becomes known.
    pub serial: u64,
    /// The newest state.
    pub state: u64,
    /// Its job.
    pub job: Arc<Job>,
    /// Whether there is nothing left to compute for it.
    pub idle: bool,
    /// The newest body and garment.
    pub ground: Option<Arc<LoadedScene>>,
    /// The newest stage one.
    pub sectioned: Option<Arc<Segmented>>,
    /// The newest stage two.
    pub preview: Option<Arc<Preview>>,
    /// The newest drape at full resolution.
    pub rest: Option<Arc<AtRest>>,
    /// The newest state that was finished.
    pub finished: Option<Arc<Finished>>,
    /// The last edit that could not be.
    pub refused: Option<Arc<Refusal>>,
    /// What was pinned, in order.
    pub pins: Arc<Vec<Arc<Pin>>>,
    /// The numbers of the last states, oldest first.
    pub trail: Arc<Vec<TrailPoint>>,
    /// Steps that can be taken back.
    pub undo: usize,
    /// Steps that can be taken on again.
    pub redo: usize,
    /// States that a newer edit overtook before they were finished.
    pub superseded: u64,
}
