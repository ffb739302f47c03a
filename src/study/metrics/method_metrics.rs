//! Metrics of a drape by a reference method: those of [`Metrics`] that need no PARTs, and the end of the simulation.

use serde::Serialize;

use super::drape_metrics::Metrics;
use super::faults::{SlidPart, sinking};
use crate::mechanics::fit::{Fit, fit};
use crate::mechanics::methods::{Ended, MethodDrape, MethodInput};
use crate::mesh::self_intersection::self_intersecting_pairs;
use crate::study::accuracy::{State, rms_mm};

/// Metrics of one drape by a reference method. Names shared with [`Metrics`] have the same meaning; energy and pressure are those of
/// this project's model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct MethodMetrics {
    pub vertices: usize,
    pub triangles: usize,
    /// Reason for the end of the simulation.
    pub ended: Ended,
    /// Time steps.
    pub steps: usize,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// RMS speed of the free vertices at the end, m/s.
    pub rms_speed_m_per_s: f64,
    pub displacement_rms_mm: f64,
    pub penetrating_vertices: usize,
    pub penetration_mm: f64,
    pub body_crossing_pairs: usize,
    /// The reference methods have no self-contact.
    pub self_intersecting_pairs: usize,
    pub top_sank_mm: f64,
    #[serde(skip)]
    pub slid: Vec<SlidPart>,
    pub energy_j: f64,
    pub residual_at_rest_over_weight: f64,
    pub strain_p95: f64,
    pub strain_max: f64,
    pub pressure_max_kpa: f64,
}

impl MethodMetrics {
    /// Metrics of a drape, and strain and pressure at its vertices.
    pub(crate) fn of(dressing: &MethodInput<'_>, drape: &MethodDrape) -> (Self, Fit) {
        let MethodInput { scene, cloth, .. } = dressing;
        let x = &drape.positions;
        let garment = scene.garment.with_positions(x.clone());
        let state = State::of(cloth, &scene.body, x);
        let fit = fit(cloth, cloth.contacts(&scene.body, x), x, cloth.contact_stiffness());
        let (top_sank_mm, slid) = sinking(scene, x);
        let metrics = Self {
            vertices: scene.garment.vertex_count(),
            triangles: scene.garment.triangles.len(),
            ended: drape.ended,
            steps: drape.steps,
            simulated_s: drape.simulated_s,
            rms_speed_m_per_s: drape.rms_speed_m_per_s,
            displacement_rms_mm: rms_mm(x, &scene.garment.positions),
            penetrating_vertices: state.penetrating_vertices,
            penetration_mm: state.penetration_mm,
            body_crossing_pairs: scene.body.crossing_pairs(&garment).len(),
            self_intersecting_pairs: self_intersecting_pairs(&garment).len(),
            top_sank_mm,
            slid,
            energy_j: state.energy_j,
            residual_at_rest_over_weight: state.residual_over_weight,
            strain_p95: state.strain_p95,
            strain_max: state.strain_max,
            pressure_max_kpa: fit.pressure_max_kpa,
        };
        (metrics, fit)
    }

    /// The metrics as pairs of name and text.
    pub(crate) fn findings(&self) -> Vec<(&'static str, String)> {
        let how = match self.ended {
            Ended::AtRest => "at rest",
            Ended::TimeOver => "time limit reached, still moving",
            Ended::Interrupted => "interrupted",
        };
        let (time, speed) = (self.simulated_s, 100.0 * self.rms_speed_m_per_s);
        let mut found = vec![
            ("ended", format!("{how} after {} steps, {time:.2} s, at {speed:.2} cm/s RMS", self.steps)),
            ("moved", format!("{:.1} mm RMS", self.displacement_rms_mm)),
            ("residual", format!("{:.1e} of the weight, by the common energy", self.residual_at_rest_over_weight)),
        ];
        found.extend(self.shared().findings());
        found
    }

    /// Warnings for the user.
    pub(crate) fn warnings(&self, dressing: &MethodInput<'_>) -> Vec<String> {
        let mut found = self.shared().warnings(dressing.scene);
        if self.ended == Ended::TimeOver {
            found.push(format!(
                "the cloth still moves at {:.1} cm/s RMS after {:.0} s; it has not converged",
                100.0 * self.rms_speed_m_per_s,
                self.simulated_s
            ));
        }
        found
    }

    /// The metrics shared with drapes by PARTs.
    fn shared(&self) -> Metrics {
        Metrics {
            penetrating_vertices: self.penetrating_vertices,
            penetration_mm: self.penetration_mm,
            body_crossing_pairs: self.body_crossing_pairs,
            self_intersecting_pairs: self.self_intersecting_pairs,
            top_sank_mm: self.top_sank_mm,
            slid: self.slid.clone(),
            strain_p95: Some(self.strain_p95),
            strain_max: Some(self.strain_max),
            pressure_max_kpa: Some(self.pressure_max_kpa),
            ..Metrics::default()
        }
    }
}
