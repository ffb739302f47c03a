//! Accuracy of a drape: its distance to a reference, and metrics of its state.
//!
//! A garment has several equilibria of nearly the same energy, so the distance to a single reference misleads. A result is
//! compared with its *own continuation*, refined to convergence from the result itself (`vertices`, `rms_mm`), and with
//! the *canonical drape*, refined from the undraped start (`canonical_rms_mm`). Both are reported with the spread of canonical drapes
//! from perturbed starts (`canonical_spread_mm`). The vertex error e_i = |x_i − x'_i| is split by zone: contact, where the
//! reference is within `CONTACT_ZONE` of the body, and free. `shape` compares shapes, `state` measures residual and
//! strain, `representable` the best drape that the PARTs can represent; `reference` caches references on disk.
//!
//! Limits: the reference is a drape of the model, not of real cloth; drape tests compare the model with real cloth.

pub(crate) mod moments;
pub(crate) mod reference;
pub(crate) mod representable;
pub(crate) mod shape;
pub(crate) mod state;
pub(crate) mod summary;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use reference::ReferenceCache;
pub(crate) use representable::Representable;
pub(crate) use shape::SectionGirth;
pub(crate) use state::State;
pub use summary::rms_mm;
pub(crate) use summary::{ErrorSummary, rms, vertex_errors, vertex_errors_mm};

use crate::body::distance::{Body, DistanceError};
use crate::mechanics::energy::Cloth;
use crate::mesh::{Topology, TriMesh};
use crate::parts::Parts;
use summary::MM_PER_M;

/// A vertex whose reference is nearer than this to the body (m) is in the contact zone: the contact distance of the paper's
/// model, the upper value of Table 3's level 7.
pub(crate) const CONTACT_ZONE: f64 = 0.005;

/// Why two drapes cannot be compared.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum AccuracyError {
    /// The lists belong to different meshes.
    #[error("{what} has {found} vertices, expected {expected}: both drapes must have the mesh of the garment")]
    Count { what: &'static str, found: usize, expected: usize },
    /// A coordinate is not finite.
    #[error("vertex number {} of {what} is not finite: the solver that computed it failed", .vertex + 1)]
    NotFinite { what: &'static str, vertex: usize },
    /// A drape is not a valid surface.
    #[error("the distance between the drapes cannot be computed: {0}")]
    Distance(#[from] DistanceError),
}

/// A drape, its reference and their common garment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Comparison<'a> {
    /// Mesh of the garment; its positions are not used.
    pub mesh: &'a TriMesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// Its energy.
    pub cloth: &'a Cloth,
    /// The body.
    pub body: &'a Body,
    /// PARTs whose representable error is measured.
    pub parts: Option<&'a Parts>,
    /// Undraped positions, from which the PARTs' displacements start, m.
    pub start: &'a [DVec3],
    /// The measured drape, m.
    pub result: &'a [DVec3],
    /// The reference drape, m.
    pub reference: &'a [DVec3],
}

/// Errors of a drape. Serialised names carry their units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Accuracy {
    /// Vertex error over the whole garment; its fields are written on this level (`rms_mm`, ...).
    #[serde(flatten)]
    pub vertices: ErrorSummary,
    /// Vertex error in the contact zone.
    pub contact: ErrorSummary,
    /// Vertex error outside the contact zone.
    pub free: ErrorSummary,
    /// RMS distance to the canonical drape, mm; set by `evaluate`.
    pub canonical_rms_mm: Option<f64>,
    /// RMS distance between canonical drapes from perturbed starts, mm; set by `evaluate`.
    pub canonical_spread_mm: Option<f64>,
    /// Symmetric Hausdorff distance, mm.
    pub hausdorff_mm: f64,
    /// Mean angle between vertex normals, degrees.
    pub normal_angle_deg: f64,
    /// Height of the hem, m; `None` without an edge.
    pub hem_height_m: Option<f64>,
    /// Height of the reference's hem, m.
    pub reference_hem_height_m: Option<f64>,
    /// Horizontal sections, low to high.
    pub girths: Vec<SectionGirth>,
    /// (E − E_ref)/|E_ref|.
    pub energy_gap: f64,
    /// The result as a state; its fields are written on this level (`residual_over_weight`, `strain_p95`, ...).
    #[serde(flatten)]
    pub state: State,
    /// Representable error with one translation a PART, mm; `None` without PARTs.
    pub representable_rms_mm: Option<f64>,
    /// All representable errors.
    pub representable: Option<Representable>,
}

/// Measures a result against a reference. `canonical_*` are `None`: they need further references.
pub(crate) fn compare(c: &Comparison<'_>) -> Result<Accuracy, AccuracyError> {
    let expected = c.mesh.vertex_count();
    for (what, list) in [("the start", c.start), ("the result", c.result), ("the reference", c.reference)] {
        if list.len() != expected {
            return Err(AccuracyError::Count { what, found: list.len(), expected });
        }
        if let Some(vertex) = list.iter().position(|x| !x.is_finite()) {
            return Err(AccuracyError::NotFinite { what, vertex });
        }
    }
    let errors = vertex_errors(c.result, c.reference);
    let near = c.body.nearest_all(c.reference);
    let zone = |contact: bool| {
        let inside = |d: f64| (d < CONTACT_ZONE) == contact;
        let of_zone: Vec<f64> =
            errors.iter().zip(&near).filter(|(_, p)| inside(p.signed_distance)).map(|(&e, _)| e).collect();
        ErrorSummary::of(&of_zone)
    };
    let (result, reference) = (c.mesh.with_positions(c.result.to_vec()), c.mesh.with_positions(c.reference.to_vec()));
    let state = State::of(c.cloth, c.body, c.result);
    let reference_energy = State::of(c.cloth, c.body, c.reference).energy_j;
    let hem = shape::hem_heights(c.topology, c.result, c.reference);
    let representable =
        c.parts.map(|p| representable::representable(c.topology, p, &c.cloth.held, c.start, c.reference));
    Ok(Accuracy {
        vertices: ErrorSummary::of(&errors),
        contact: zone(true),
        free: zone(false),
        canonical_rms_mm: None,
        canonical_spread_mm: None,
        hausdorff_mm: MM_PER_M * shape::hausdorff(c.mesh, c.result, c.reference)?,
        normal_angle_deg: shape::mean_normal_angle_deg(&result, &reference),
        hem_height_m: hem.map(|h| h.0),
        reference_hem_height_m: hem.map(|h| h.1),
        girths: shape::section_girths(&result, &reference),
        energy_gap: (state.energy_j - reference_energy) / reference_energy.abs().max(f64::MIN_POSITIVE),
        state,
        representable_rms_mm: representable.map(|r| r.translation_rms_mm),
        representable,
    })
}

#[cfg(test)]
mod tests;
