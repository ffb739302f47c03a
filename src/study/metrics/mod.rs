//! The figures of a drape: one view, which the terminal, scripts, the rows of a sweep and the recording read from.
//!
//! [`Metrics`] are plain numbers, deterministic all of them; [`LevelCount`]s tell them level by level. What needs a
//! reference drape is there where somebody asked for one.

mod by_method;
mod ease;
mod levels;
mod warnings;

pub use by_method::MethodMetrics;
pub use ease::GirthEase;
pub use levels::LevelCount;
use serde::{Deserialize, Serialize};
use warnings::sank;
pub use warnings::{Slid, TightestOpening};

use crate::base::quantiles::nearest_rank;
use crate::drape::Drape;
use crate::mechanics::fit::TORN_PERCENT;
use crate::mesh::self_intersection::crossing_pairs;
use crate::scene::Scene;
use crate::study::accuracy::{self, Accuracy};
use crate::study::evaluate::Evaluation;

/// The figures of one drape. The names are the keys of `--format json` and the columns of a sweep.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Metrics {
    /// Vertices of the garment.
    pub vertices: usize,
    /// Its triangles.
    pub triangles: usize,
    /// Levels that hold at least one vertex.
    pub levels: usize,
    /// PARTs.
    pub part_count: usize,
    /// PARTs that the range table alone made.
    pub level_part_count: usize,
    /// PARTs of one vertex.
    pub singletons: usize,
    /// PARTs the body carries.
    pub contact_parts: usize,
    /// Vertices whose distance lies in a hole of the table as printed.
    pub hole_vertices: usize,
    /// Vertices in no level.
    pub unassigned_vertices: usize,
    /// RMS displacement from undraped to draped, mm.
    pub displacement_rms_mm: f64,
    /// Vertices inside the body at the end.
    pub penetrating_vertices: usize,
    /// How deep the deepest of them is, mm.
    pub penetration_mm: f64,
    /// Pairs of a triangle of the garment and one of the body that cross: skin that shows between vertices that are outside.
    #[serde(default)]
    pub body_crossing_pairs: usize,
    /// Pairs of triangles of the garment that cross.
    pub self_intersecting_pairs: usize,
    /// How far the garment's highest edge has sunk, mm; without an edge its highest tenth. Of several connected parts that of the
    /// one which sank farthest.
    #[serde(default)]
    pub top_sank_mm: f64,
    /// The connected parts that slid, with nothing held of them.
    #[serde(skip)]
    pub slid: Vec<Slid>,
    /// Energy, J.
    pub energy_j: Option<f64>,
    /// ‖∇E‖ over the garment's weight where the solver left it, friction as the cloth came to rest.
    pub residual_over_weight: Option<f64>,
    /// Steps at full resolution.
    pub refine_steps: Option<usize>,
    /// 95th percentile of the largest principal strain.
    pub strain_p95: Option<f64>,
    /// Its largest value.
    pub strain_max: Option<f64>,
    /// The opening that is stretched most, of a garment whose cloth is stretched too far.
    #[serde(skip)]
    pub tightest_opening: Option<TightestOpening>,
    /// Largest contact pressure, kPa.
    pub pressure_max_kpa: Option<f64>,
    /// RMS vertex error against the result's own continuation, mm.
    pub rms_mm: Option<f64>,
    /// RMS vertex error against the canonical drape, mm.
    pub canonical_rms_mm: Option<f64>,
    /// RMS between canonical drapes from perturbed starts, mm.
    pub canonical_spread_mm: Option<f64>,
    /// RMS of the canonical drape that one displacement per PART cannot show, mm.
    pub representable_rms_mm: Option<f64>,
    /// RMS of it that one affine map per PART, blended over the seams, cannot show, mm: what the coupled model's PARTs
    /// could hold it to at best.
    pub representable_affine_rms_mm: Option<f64>,
    /// ‖∇E‖ over the weight of the drape as a state without a history, where friction holds as much as it can: see
    /// [`accuracy::state`].
    pub residual_at_rest_over_weight: Option<f64>,
    /// The same of the own continuation: what an error against it is fairly judged by.
    pub own_affine_rms_mm: Option<f64>,
    /// Spearman's rank correlation of the paper's wrinkle measure with the mean curvature, over the seams.
    pub wrinkle_rank_correlation: Option<f64>,
    /// Excess length that no PART shows after stage two, 95th percentile over the vertices, percent.
    pub folds_p95_percent: Option<f64>,
    /// Its rank correlation with the mean curvature of where the cloth settles, over the vertices.
    pub fold_rank_correlation: Option<f64>,
}

impl Metrics {
    /// What the drape of `scene` says by itself.
    #[must_use]
    pub fn of(scene: &Scene, drape: &Drape) -> Self {
        let (parts, state) = (&drape.parts, drape.state.as_ref());
        let (top_sank_mm, slid) = sank(scene, &drape.positions);
        let draped = scene.garment.with_positions(drape.positions.clone());
        Self {
            vertices: scene.garment.vertex_count(),
            triangles: scene.garment.triangles.len(),
            levels: parts.parts_per_level.iter().filter(|n| **n > 0).count(),
            part_count: parts.len(),
            level_part_count: drape.level_part_count,
            singletons: parts.singletons,
            contact_parts: drape.outcomes.iter().filter(|o| o.contact).count(),
            folds_p95_percent: drape.folds.as_ref().map(|f| nearest_rank(&f.excess_percent, 0.95)),
            hole_vertices: parts.hole_vertices,
            unassigned_vertices: parts.unassigned,
            displacement_rms_mm: accuracy::rms_mm(&drape.positions, &scene.garment.positions),
            penetrating_vertices: drape.penetrating_vertices,
            penetration_mm: 1e3 * drape.penetration,
            body_crossing_pairs: crossing_pairs(&draped, scene.body.mesh()).len(),
            top_sank_mm,
            slid,
            self_intersecting_pairs: drape.self_intersecting_pairs,
            energy_j: state.map(|s| s.energy),
            residual_over_weight: state.map(|s| s.residual_over_weight),
            refine_steps: state.map(|s| s.steps),
            strain_p95: state.map(|s| 1e-2 * s.fit.strain_p95_percent),
            strain_max: state.map(|s| 1e-2 * s.fit.strain_max_percent),
            tightest_opening: state
                .filter(|s| s.fit.strain_max_percent > TORN_PERCENT)
                .and_then(|_| TightestOpening::of(scene, &drape.positions)),
            pressure_max_kpa: state.map(|s| s.fit.pressure_max_kpa),
            ..Self::default()
        }
    }

    /// With what an evaluation found. A model without a state of its own gets energy and strain from it.
    #[must_use]
    pub(crate) fn with_evaluation(self, evaluation: &Evaluation) -> Self {
        let Accuracy { vertices, canonical_rms_mm, canonical_spread_mm, state, .. } = evaluation.accuracy;
        Self {
            energy_j: self.energy_j.or(Some(state.energy_j)),
            strain_p95: self.strain_p95.or(Some(state.strain_p95)),
            strain_max: self.strain_max.or(Some(state.strain_max)),
            rms_mm: Some(vertices.rms_mm),
            canonical_rms_mm,
            canonical_spread_mm,
            residual_at_rest_over_weight: Some(state.residual_over_weight),
            wrinkle_rank_correlation: evaluation.wrinkles.rank_correlation,
            fold_rank_correlation: evaluation.fold_rank_correlation,
            own_affine_rms_mm: evaluation.accuracy.representable.map(|r| r.blended_affine_rms_mm),
            ..self
        }
    }

    /// How many PARTs there are, and how many of them the range table alone made where they were cut or joined after it.
    #[must_use]
    pub(crate) fn parts_text(&self) -> String {
        match self.level_part_count {
            by_levels if by_levels == self.part_count => format!("{} PARTs", self.part_count),
            by_levels => format!("{} PARTs ({by_levels} by its levels, then cut to extents)", self.part_count),
        }
    }

    /// The figures in words: name and value.
    #[must_use]
    pub(crate) fn facts(&self) -> Vec<(&'static str, String)> {
        let mut facts = vec![
            ("vertices", self.vertices.to_string()),
            ("PARTs", format!("{} ({} single vertices)", self.part_count, self.singletons)),
            ("touching the body", format!("{} PARTs", self.contact_parts)),
            ("moved", format!("{:.1} mm RMS", self.displacement_rms_mm)),
        ];
        facts.extend(self.findings());
        facts
    }

    /// Strain, error and what else was measured, in words.
    #[must_use]
    pub(crate) fn findings(&self) -> Vec<(&'static str, String)> {
        let mut found = Vec::new();
        let mut add = |name, value: Option<String>| found.extend(value.map(|value| (name, value)));
        let residual = self.refine_steps.zip(self.residual_over_weight);
        add("refined", residual.map(|(steps, r)| format!("{steps} steps, residual {r:.1e} of the weight")));
        let strain = self.strain_p95.zip(self.strain_max);
        add("strain", strain.map(|(p95, max)| format!("{:.1} % (P95), {:.1} % at most", 1e2 * p95, 1e2 * max)));
        add("pressure", self.pressure_max_kpa.map(|kpa| format!("{kpa:.2} kPa at most")));
        let inside = match self.penetrating_vertices {
            0 => "0 vertices".to_owned(),
            n => format!("{n} vertices, up to {:.1} mm deep", self.penetration_mm),
        };
        add("inside the body", Some(inside));
        add("skin through cloth", Some(format!("{} pairs of triangles", self.body_crossing_pairs)));
        add("cloth through cloth", Some(format!("{} pairs of triangles", self.self_intersecting_pairs)));
        add(
            "error",
            match (self.rms_mm, self.canonical_rms_mm) {
                (Some(own), canonical) => Some(format!(
                    "{own:.2} mm RMS against its own continuation, {:.1} against the canonical drape",
                    canonical.unwrap_or_default()
                )),
                (None, canonical) => canonical.map(|mm| format!("{mm:.1} mm RMS against the canonical drape")),
            },
        );
        let spread = |mm| format!("{mm:.1} mm RMS between drapes from perturbed starts");
        add("spread", self.canonical_spread_mm.map(spread));
        let best = self.representable_affine_rms_mm.zip(self.representable_rms_mm).map(|(affine, one)| {
            format!("its PARTs could hold it to {affine:.1} mm by affine maps, {one:.1} mm by one displacement each")
        });
        let single = |mm| format!("its PARTs could hold it to {mm:.1} mm by one displacement each");
        add("representable", best.or(self.representable_rms_mm.map(single)));
        add(
            "folds",
            self.folds_p95_percent.map(|p95| match self.fold_rank_correlation {
                Some(r) => format!(
                    "{p95:.1} % of length no PART shows (P95), rank correlation {r:.2} with the mean curvature at rest"
                ),
                None => format!("{p95:.1} % of length no PART shows after stage two (P95)"),
            }),
        );
        let rank = |r| format!("rank correlation {r:.2} of PART jumps with the mean curvature");
        add("wrinkles", self.wrinkle_rank_correlation.map(rank));
        found
    }

    /// What a recording plots over its tables: leaf of `/numbers` and value.
    #[must_use]
    pub(crate) fn scalars(&self) -> Vec<(&'static str, f64)> {
        let all = [
            ("error/rms_mm", self.rms_mm),
            ("error/canonical_rms_mm", self.canonical_rms_mm),
            ("error/representable_rms_mm", self.representable_rms_mm),
            ("error/representable_affine_rms_mm", self.representable_affine_rms_mm),
            ("displacement_rms_mm", Some(self.displacement_rms_mm)),
            ("levels", Some(self.levels as f64)),
            ("singletons", Some(self.singletons as f64)),
            ("penetrating_vertices", Some(self.penetrating_vertices as f64)),
        ];
        all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }

    /// The error a drape is judged by, mm: against its own continuation, else against the canonical drape.
    #[must_use]
    pub fn error_mm(&self) -> Option<f64> {
        self.rms_mm.or(self.canonical_rms_mm)
    }
}
