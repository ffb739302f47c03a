//! The results of a session, one struct for each step. Every result names the state that it belongs to.
//!
//! | field | meaning in every result that has it |
//! |---|---|
//! | `state` | number of the state that the result belongs to |
//! | `loaded_scene` | body and garment that were segmented or draped |
//! | `positions` | vertices of the garment, m |
//! | `ms`, `after_ms` | milliseconds of the computation, and from the edit to the result |

#![allow(missing_docs, reason = "the table above describes the fields without a comment of their own")]

use std::sync::Arc;

use glam::DVec3;

use crate::drape::{ClothState, Distances, Drape, PartOutcome, Refine, Release, Settings};
use crate::garment::fabric::Fabric;
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::scene::{Loaded, SceneSpec};
use crate::study::job::Job;
use crate::study::metrics::Metrics;

/// Body and garment, and the distances between them. Edits of table and fabric keep them.
#[derive(Debug)]
pub struct LoadedScene {
    /// Number of this pair of body and garment, from 1.
    pub generation: u64,
    /// The specification that was loaded.
    pub spec: SceneSpec,
    /// The scene with the reports of its files.
    pub input: Loaded,
    /// Milliseconds of loading.
    pub load_ms: f64,
    pub(crate) distances: Distances,
    pub(crate) distance_ms: f64,
}

impl LoadedScene {
    /// Unsigned distance of each garment vertex to the body before draping, m.
    pub(crate) fn distances_m(&self) -> &[f64] {
        &self.distances.unsigned_m
    }
}

/// Stage one of a state.
#[derive(Debug, Clone)]
pub struct Segmented {
    pub state: u64,
    pub loaded_scene: Arc<LoadedScene>,
    /// The range table, with the rows that its rule generated.
    pub table: Arc<RangeTable>,
    /// The PARTs that the model moves: those of the table, cut to the finest extent of the run.
    pub parts: Arc<Parts>,
    /// The PARTs of the table alone; the same as `parts` if the run cuts none.
    pub table_parts: Arc<Parts>,
    /// Reaction of the body on each PART in the current drape, N; empty before there is one.
    pub force_n: Arc<Vec<DVec3>>,
    /// Milliseconds of the segmentation.
    pub segment_ms: f64,
    pub after_ms: f64,
    pub(crate) min_part: usize,
    /// The finest extent of the run, m, if it cuts PARTs.
    pub(crate) extent_m: Option<f64>,
}

/// Stage two of a state.
#[derive(Debug, Clone)]
pub struct Preview {
    pub state: u64,
    pub loaded_scene: Arc<LoadedScene>,
    /// Whether its last step is done.
    pub done: bool,
    /// The PARTs that moved: those of stage one, or cut to the extent of the run.
    pub parts: Arc<Parts>,
    /// Force and displacement of each PART; empty before the last step is done.
    pub outcomes: Arc<Vec<PartOutcome>>,
    pub positions: Arc<Vec<DVec3>>,
    pub ms: f64,
    pub after_ms: f64,
    pub warnings: Vec<String>,
}

/// The settings that a drape at rest depends on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RestInputs {
    fabric: Fabric,
    pub(super) refine: Refine,
    self_contact: bool,
}

impl RestInputs {
    pub(super) fn of(settings: &Settings) -> Self {
        Self { fabric: settings.fabric.clone(), refine: settings.refine, self_contact: settings.self_contact }
    }
}

/// The garment at full resolution, on its way to rest or at rest.
#[derive(Debug, Clone)]
pub struct AtRest {
    pub state: u64,
    pub loaded_scene: Arc<LoadedScene>,
    /// Whether the solver has ended. If the forces balance, the rest was then also tested for stability.
    pub done: bool,
    /// Whether the forces balance. The test for stability that may follow moves the garment little.
    pub balanced: bool,
    /// Whether it is the drape of an earlier state: a rest does not depend on the table, and the last few fabrics keep theirs.
    pub reused: bool,
    /// Whether it continued from the previous drape.
    pub warm: bool,
    pub positions: Arc<Vec<DVec3>>,
    /// Residual ‖∇E‖ over the weight of the cloth.
    pub residual_over_weight: f64,
    /// Newton steps at full resolution.
    pub steps: usize,
    pub ms: f64,
    pub after_ms: f64,
    /// Outcome of releasing the vertices that were held until the garment rested.
    pub release: Option<Release>,
    /// Reaction of the body on each vertex, N.
    pub(crate) reaction_n: Arc<Vec<DVec3>>,
    pub(crate) cloth_state: Option<Arc<ClothState>>,
    pub(crate) inputs: RestInputs,
    /// Positions before the release, from which the next drape continues.
    pub(crate) held_positions: Arc<Vec<DVec3>>,
}

/// A complete state.
#[derive(Debug)]
pub struct Finished {
    pub state: u64,
    pub loaded_scene: Arc<LoadedScene>,
    /// The drape.
    pub drape: Drape,
    /// Its metrics.
    pub metrics: Metrics,
    /// RMS distance of the preview from the drape at rest, mm; none without steps at full resolution.
    pub preview_error_mm: Option<f64>,
    /// Least RMS distance, mm, that affine maps of these PARTs, blended over the seams, could reach.
    pub bound_mm: Option<f64>,
}

/// An edit that was accepted and whose computation failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The state that the edit made.
    pub state: u64,
    /// The error message.
    pub sentence: String,
    /// The first file of body or garment, if these are the cause: the message may quote it.
    pub file: Option<String>,
    /// The state that replaces it; none before the first good one.
    pub back_to: Option<u64>,
}

/// A state that is kept beside later ones.
#[derive(Debug, Clone)]
pub struct Pin {
    /// Number of the pin.
    pub id: u64,
    /// Label in the viewer.
    pub label: String,
    pub state: u64,
    /// The job of the state.
    pub job: Arc<Job>,
    /// The drape: at rest if there was one, else the preview.
    pub positions: Arc<Vec<DVec3>>,
    /// Stage one, for the colours of the PARTs.
    pub segmented: Arc<Segmented>,
    /// The garment after both stages.
    pub preview: Arc<Vec<DVec3>>,
    pub loaded_scene: Arc<LoadedScene>,
    /// The trail's point of the state.
    pub numbers: TrailPoint,
}

/// The numbers of a state, plotted over the edits.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct TrailPoint {
    pub state: u64,
    /// Number of PARTs.
    pub parts: usize,
    /// Milliseconds of stage one.
    pub segment_ms: f64,
    /// Milliseconds of stage two from the undraped garment.
    pub two_stages_ms: Option<f64>,
    /// Milliseconds at full resolution.
    pub rest_ms: Option<f64>,
    /// RMS distance of the preview from the drape at rest, mm.
    pub preview_error_mm: Option<f64>,
    /// Least RMS distance, mm, that affine maps of the PARTs could reach.
    pub bound_mm: Option<f64>,
}

/// All results at one moment. Each result is the newest of its kind and may belong to an earlier state.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// Grows with every new result.
    pub serial: u64,
    /// Number of the newest state.
    pub state: u64,
    /// Job of the newest state.
    pub job: Arc<Job>,
    /// Whether the newest state is complete.
    pub idle: bool,
    /// Body and garment.
    pub loaded_scene: Option<Arc<LoadedScene>>,
    /// Stage one.
    pub segmented: Option<Arc<Segmented>>,
    /// Stage two.
    pub preview: Option<Arc<Preview>>,
    /// The drape at full resolution.
    pub rest: Option<Arc<AtRest>>,
    /// The newest complete state.
    pub finished: Option<Arc<Finished>>,
    /// The last edit whose computation failed.
    pub refused: Option<Arc<Refusal>>,
    /// Pinned states, oldest first.
    pub pins: Arc<Vec<Arc<Pin>>>,
    /// Numbers of the last states, oldest first.
    pub trail: Arc<Vec<TrailPoint>>,
    /// Number of edits that can be undone.
    pub undo: usize,
    /// Number of edits that can be redone.
    pub redo: usize,
    /// Number of states that a newer edit replaced before they were complete.
    pub superseded: u64,
}
