//! Metrics of a drape by PARTs, as numbers, as text, and as warnings.

use serde::{Deserialize, Serialize};

use super::ease::GirthEase;
use super::faults::{SANK_MM, SlidPart, TightestOpening, begins_above_the_bust, bridges, sinking};
use crate::base::quantiles::nearest_rank;
use crate::drape::Drape;
use crate::mechanics::fit::{CRUSHED_SHARE, TORN_PERCENT};
use crate::mechanics::refine::Stop;
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::scene::Scene;
use crate::study::accuracy::{Accuracy, rms_mm};
use crate::study::evaluate::Evaluation;

/// The verdict on a drape without fault.
pub const RESTS: &str = "rests";

/// Metrics of one drape. The field names are the keys of `--format json` and the columns of a sweep.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Metrics {
    /// Vertices of the garment.
    pub vertices: usize,
    /// Triangles of the garment.
    pub triangles: usize,
    /// Levels that hold at least one vertex.
    pub levels: usize,
    /// PARTs.
    pub part_count: usize,
    /// PARTs of the range table, before they are cut or joined.
    pub level_part_count: usize,
    /// PARTs of one vertex.
    pub singletons: usize,
    /// PARTs in contact with the body.
    pub contact_parts: usize,
    /// Vertices whose distance lies in a gap between the printed ranges of the table.
    pub hole_vertices: usize,
    /// Vertices in no level.
    pub unassigned_vertices: usize,
    /// RMS displacement from undraped to draped, mm.
    pub displacement_rms_mm: f64,
    /// Vertices inside the body at the end.
    pub penetrating_vertices: usize,
    /// Depth of the deepest of them, mm.
    pub penetration_mm: f64,
    /// Intersecting pairs of a garment triangle and a body triangle; skin is visible there even if no vertex is inside.
    #[serde(default)]
    pub body_crossing_pairs: usize,
    /// Intersecting pairs of garment triangles.
    pub self_intersecting_pairs: usize,
    /// Descent of the garment's highest edge, mm; without an edge of its highest tenth. Of several connected parts, the largest
    /// descent.
    #[serde(default)]
    pub top_sank_mm: f64,
    /// Connected parts without held vertices that slid down.
    #[serde(skip)]
    pub slid: Vec<SlidPart>,
    /// Energy, J.
    pub energy_j: Option<f64>,
    /// ‖∇E‖ over the garment's weight at the end of the solve, with the solver's friction forces.
    pub residual_over_weight: Option<f64>,
    /// Newton steps at full resolution.
    pub refine_steps: Option<usize>,
    /// 95th percentile of the largest principal strain.
    pub strain_p95: Option<f64>,
    /// Largest principal strain.
    pub strain_max: Option<f64>,
    /// The opening stretched most, if the strain exceeds what fabrics bear.
    #[serde(skip)]
    pub tightest_opening: Option<TightestOpening>,
    /// Largest contact pressure, kPa.
    pub pressure_max_kpa: Option<f64>,
    /// RMS vertex error to the result's own continuation, mm.
    pub rms_mm: Option<f64>,
    /// RMS vertex error to the canonical drape, mm.
    pub canonical_rms_mm: Option<f64>,
    /// RMS distance between canonical drapes from perturbed starts, mm.
    pub canonical_spread_mm: Option<f64>,
    /// Representable error of the canonical drape with one translation per PART, mm.
    pub representable_rms_mm: Option<f64>,
    /// Representable error of the canonical drape with one affine map per PART, blended over the seams, mm: the best that the
    /// coupled model's PARTs can reach.
    pub representable_affine_rms_mm: Option<f64>,
    /// ‖∇E‖ over the weight of the drape as a state without history, less the forces that friction can balance: see
    /// `state`.
    pub residual_at_rest_over_weight: Option<f64>,
    /// Representable error of the own continuation with blended affine maps, mm: a lower bound of `rms_mm` before relaxation.
    pub own_affine_rms_mm: Option<f64>,
    /// Spearman's rank correlation of the paper's wrinkle measure with the mean curvature, over the seams.
    pub wrinkle_rank_correlation: Option<f64>,
    /// Excess length that the PARTs do not represent after stage two, 95th percentile over the vertices, percent.
    pub folds_p95_percent: Option<f64>,
    /// Rank correlation of the excess length with the mean curvature of the own continuation, over the vertices.
    pub fold_rank_correlation: Option<f64>,
    /// Girth of the garment as cut less the body's at the bust, cm.
    #[serde(default)]
    pub ease_bust_cm: Option<f64>,
    /// The same at the waist.
    #[serde(default)]
    pub ease_waist_cm: Option<f64>,
    /// The same at the hip.
    #[serde(default)]
    pub ease_hip_cm: Option<f64>,
    /// Length of the hem as cut less a tape around the body inside it, cm.
    #[serde(default)]
    pub ease_hem_cm: Option<f64>,
    /// `rests`, or the criteria that the drape fails, by the limits of the certificate.
    #[serde(default)]
    pub verdict: String,
}

impl Metrics {
    /// Metrics of a drape of `scene` that need no reference.
    #[must_use]
    pub fn of(scene: &Scene, drape: &Drape) -> Self {
        let (parts, state) = (&drape.parts, drape.state.as_ref());
        let (top_sank_mm, slid) = sinking(scene, &drape.positions);
        let draped = scene.garment.with_positions(drape.positions.clone());
        let metrics = Self {
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
            displacement_rms_mm: rms_mm(&drape.positions, &scene.garment.positions),
            penetrating_vertices: drape.penetrating_vertices,
            penetration_mm: 1e3 * drape.penetration,
            body_crossing_pairs: scene.body.crossing_pairs(&draped).len(),
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
        };
        Self { verdict: metrics.faults(scene, drape), ..metrics }
    }

    /// Adds the eases.
    pub(crate) fn with_ease(self, ease: &[GirthEase]) -> Self {
        let at = |name| ease.iter().find(|ease| ease.at == name).and_then(|ease| ease.ease_cm);
        Self {
            ease_bust_cm: at("bust"),
            ease_waist_cm: at("waist"),
            ease_hip_cm: at("hip"),
            ease_hem_cm: at("hem"),
            ..self
        }
    }

    /// The eases, cm, by the place of each.
    pub(crate) fn eases_cm(&self) -> [(&'static str, Option<f64>); 4] {
        [
            ("bust", self.ease_bust_cm),
            ("waist", self.ease_waist_cm),
            ("hip", self.ease_hip_cm),
            ("hem", self.ease_hem_cm),
        ]
    }

    /// Adds the errors of an evaluation. A model without a state takes energy and strain from it.
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

    /// Number of PARTs; if they were cut or joined, also the number that the range table made.
    pub(crate) fn parts_text(&self) -> String {
        match self.level_part_count {
            levels if levels == self.part_count => format!("{} PARTs", self.part_count),
            levels => format!("{} PARTs ({levels} by its levels, then cut to extents)", self.part_count),
        }
    }

    /// All metrics as pairs of name and text.
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

    /// [`RESTS`], or the criteria that the drape fails, separated by semicolons.
    fn faults(&self, scene: &Scene, drape: &Drape) -> String {
        let mut faults = Vec::new();
        let has_fallen = !scene.fallen_parts(&drape.positions).is_empty();
        if has_fallen {
            faults.push(scene.off(&drape.positions).to_owned());
        } else if !self.slid.is_empty() {
            faults.push(format!("slid down by {:.0} cm", 0.1 * self.top_sank_mm));
        }
        match &drape.state {
            None => faults.push("not solved at full resolution".to_owned()),
            Some(state) => match state.stop {
                Stop::Converged => {
                    let share = scene.area_share(&drape.positions);
                    faults.extend(
                        (share < CRUSHED_SHARE).then(|| format!("crushed to {:.0} % of its area", 1e2 * share)),
                    );
                }
                Stop::Unsettled(criterion) => faults.push(format!("does not rest by the criterion `{criterion}`")),
                // The fall ended the steps.
                Stop::Interrupted if has_fallen => {}
                Stop::Interrupted => {
                    faults
                        .push(format!("interrupted at a residual of {:.1e} of the weight", state.residual_over_weight));
                }
                Stop::StepsDone | Stop::Stalled => {
                    let residual = state.residual_over_weight;
                    let preview = if state.steps == 0 { " after the two stages alone" } else { "" };
                    faults.push(format!("does not rest: residual {residual:.1e} of the weight{preview}"));
                }
            },
        }
        let counts = [
            (self.penetrating_vertices, "vertices inside the body"),
            (self.body_crossing_pairs, "pairs of triangles with skin through cloth"),
        ];
        faults.extend(counts.iter().filter(|(count, _)| *count > 0).map(|(count, of)| format!("{count} {of}")));
        if self.self_intersecting_pairs > 0 {
            let placed = self_intersecting_pairs(&scene.garment).len();
            let as_placed = if placed > 0 { format!(" ({placed} as placed)") } else { String::new() };
            faults.push(format!(
                "{} pairs of triangles with cloth through cloth{as_placed}",
                self.self_intersecting_pairs
            ));
        }
        if let Some(strain) = self.strain_max.filter(|strain| 1e2 * *strain > TORN_PERCENT) {
            let opening = self.tightest_opening.map(TightestOpening::text).unwrap_or_default();
            faults.push(format!("strain of {:.0} %, more than fabrics bear{opening}", 1e2 * strain));
        }
        if faults.is_empty() { RESTS.to_owned() } else { faults.join("; ") }
    }

    /// The verdict in one line.
    pub(crate) fn verdict_line(&self) -> String {
        let strain =
            self.strain_max.map(|strain| format!(", strain of {:.0} % at most", 1e2 * strain)).unwrap_or_default();
        match self.verdict.as_str() {
            RESTS => format!("verdict: rests, nothing inside the body, no crossing{strain}"),
            faults => format!("verdict: {faults}"),
        }
    }

    /// Solver, strain, intersections and errors as pairs of name and text.
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
                (Some(own), canonical) => {
                    let canonical =
                        canonical.map_or_else(String::new, |mm| format!(", {mm:.1} to the canonical drape"));
                    Some(format!("{own:.2} mm RMS to the rest it converges to by itself{canonical}"))
                }
                (None, canonical) => canonical.map(|mm| format!("{mm:.1} mm RMS to the canonical drape")),
            },
        );
        let spread = |mm| format!("{mm:.1} mm RMS between drapes from perturbed starts");
        add("spread", self.canonical_spread_mm.map(spread));
        // A drape can be nearer: the last steps move each vertex by itself.
        let best = self.representable_affine_rms_mm.zip(self.representable_rms_mm).map(|(affine, one)| {
            format!(
                "{affine:.1} mm RMS to the canonical drape by the best affine map of each PART, {one:.1} by the best displacement, \
                 without steps of single vertices"
            )
        });
        let single = |mm| format!("{mm:.1} mm RMS to the canonical drape by the best displacement of each PART");
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

    /// Whether the strain exceeds what fabrics bear.
    pub(crate) fn is_torn(&self) -> bool {
        self.strain_max.is_some_and(|strain| 1e2 * strain > TORN_PERCENT)
    }

    /// Metrics that a recording plots: leaf of the entity path `/numbers`, and value.
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

    /// RMS error to the own continuation, else to the canonical drape, mm.
    #[must_use]
    pub fn error_mm(&self) -> Option<f64> {
        self.rms_mm.or(self.canonical_rms_mm)
    }

    /// Warnings for the user, each with a remedy.
    pub(crate) fn warnings(&self, scene: &Scene) -> Vec<String> {
        let mut found = Vec::new();
        if let [SlidPart { sank_mm, .. }, more @ ..] = self.slid.as_slice() {
            let parts: Vec<usize> = self.slid.iter().map(|slid| slid.part).collect();
            let [have, edge, it, waistband] = if more.is_empty() {
                ["has", "its highest edge sank by", "it", "if it has a waistband,"]
            } else {
                ["have", "their highest edges sank by up to", "them", "if they have waistbands,"]
            };
            let remedy = match begins_above_the_bust(scene, &parts) {
                // A poncho has no waistband.
                Some(true) => {
                    "a garment without a waistband lies on the shoulders: make its neck opening narrower than they are, or"
                }
                Some(false) => waistband,
                None => "if something should,",
            };
            found.push(format!(
                "{} {have} slid down: {edge} {:.0} cm, and nothing holds {it}; {remedy} {}",
                scene.named(&parts),
                0.1 * sank_mm,
                scene.how_to_hold(&parts)
            ));
        }
        if let Some(bridges) = bridges(&scene.garment).filter(|_| self.top_sank_mm > SANK_MM) {
            found.push(bridges);
        }
        if self.body_crossing_pairs > 0 {
            found.push(format!(
                "skin shows through the cloth: {} pairs of garment and body triangles intersect{}; in a preview, after a few steps or with \
                 --no-self-contact this is expected; at rest the garment is too tight there: use a finer garment mesh or a wider garment",
                self.body_crossing_pairs,
                if self.penetrating_vertices == 0 { ", though no vertex is inside" } else { "" }
            ));
        }
        if self.self_intersecting_pairs > 0 {
            found.push(format!(
                "cloth goes through cloth: {} pairs of triangles intersect; in a preview, after a few steps, with --no-self-contact and by the \
                 reference methods this is expected; at rest the layers were placed through each other: place them apart (`partwise check` counts them)",
                self.self_intersecting_pairs
            ));
        }
        if let Some(strain) = self.strain_max.filter(|strain| 1e2 * *strain > TORN_PERCENT) {
            found.push(format!(
                "the cloth is stretched by up to {:.0} %, more than fabrics bear: the garment is too small there, or caught{}",
                1e2 * strain,
                self.tightest_opening.map(TightestOpening::text).unwrap_or_default()
            ));
        }
        found
    }
}
