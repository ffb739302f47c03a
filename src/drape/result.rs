//! The result of a drape, stage by stage, and the times of the stages.

use std::time::Duration;

use glam::DVec3;

use super::release::Release;
use crate::body::distance::SurfacePoint;
use crate::mechanics::fit::Fit;
use crate::mechanics::folded_surface::{FoldableCloth, FoldedSurface, folded_surface};
use crate::mechanics::folds::Folds;
use crate::mechanics::refine::{Record, Stop};
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::scene::Scene;

/// How long each stage took.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StageTimes {
    /// Closest points on the body.
    pub distance: Duration,
    /// Equation (1): levels to connected PARTs.
    pub segment: Duration,
    /// Masses, elements and offsets of the cloth, as far as they take longer than the distances, which are computed at the same time.
    /// With `distance`, the part that does not depend on the range table.
    pub cloth: Duration,
    /// Stage two.
    pub mechanics: Duration,
    /// Newton steps at full resolution, and the part of their setup that does not overlap stage two; zero if no steps are requested,
    /// although the preview's energy and residual are still measured.
    pub refine: Duration,
    /// All of it, start to end; more than the sum by what lies between.
    pub total: Duration,
}

impl StageTimes {
    /// Time between the stages.
    #[must_use]
    pub(crate) fn other(self) -> Duration {
        self.total.saturating_sub(self.distance + self.segment + self.cloth + self.mechanics + self.refine)
    }
}

/// The outcome of stage two for one PART.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartOutcome {
    /// Resultant force F, N.
    pub force_n: DVec3,
    /// Displacement D, m.
    pub displacement: DVec3,
    /// Whether the body carries it.
    pub contact: bool,
}

/// Where the cloth stands at full resolution.
#[derive(Debug, Clone)]
pub struct ClothState {
    /// Energy, J.
    pub energy: f64,
    /// ‖∇E‖₂ over free vertices, over the garment's weight.
    pub residual_over_weight: f64,
    /// Newton steps done.
    pub steps: usize,
    /// Why they ended.
    pub stop: Stop,
    /// Every step, the start first.
    pub history: Vec<Record>,
    /// Strain and pressure.
    pub fit: Fit,
}

/// The result, stage by stage.
#[derive(Debug, Clone)]
pub struct Drape {
    /// Closest points on the body, per garment vertex, before draping.
    pub surface: Vec<SurfacePoint>,
    /// Unsigned distances to the body, m.
    pub distance: Vec<f64>,
    /// The range table of stage one, with the rows that its rule made for this garment.
    pub table: RangeTable,
    /// The PARTs of stage one; cut to an extent where the model does so.
    pub parts: Parts,
    /// How many PARTs the range table alone made.
    pub level_part_count: usize,
    /// Stage two, per PART.
    pub outcomes: Vec<PartOutcome>,
    /// The garment after stage two, before any step at full resolution, m.
    pub preview: Vec<DVec3>,
    /// Cloth that the preview has no room for, and folds of PARTs do not show; the coupled model's alone.
    pub folds: Option<Folds>,
    /// Data of the cloth for drawing them; none for several layers.
    pub(crate) foldable: Option<FoldableCloth>,
    /// The displaced garment, m.
    pub positions: Vec<DVec3>,
    /// The cloth at full resolution; the equations of the paper alone need none.
    pub state: Option<ClothState>,
    /// Result of the release of edges that were held until the garment rested.
    pub release: Option<Release>,
    /// Pairs of triangles of the displaced garment that cross: steps at full resolution keep cloth off cloth, PARTs alone do not.
    pub self_intersecting_pairs: usize,
    /// Vertices of the displaced garment inside the body.
    pub penetrating_vertices: usize,
    /// How deep the deepest of them is, m.
    pub penetration: f64,
    /// Stage times.
    pub times: StageTimes,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

impl Drape {
    /// The preview with the folds that its PARTs do not show; `scene` is that of the drape. `None` for several layers and for the
    /// paper's model, which know no excess length.
    #[must_use]
    pub fn folded_preview(&self, scene: &Scene) -> Option<FoldedSurface> {
        let (folds, cloth) = (self.folds.as_ref()?, self.foldable.as_ref()?);
        let preview = scene.garment.with_positions(self.preview.clone());
        Some(folded_surface(cloth, &scene.topology, &scene.body, &preview, folds))
    }
}
