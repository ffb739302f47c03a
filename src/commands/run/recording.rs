//! One garment's drape in a recording: a step with all its stages, its fit and folds, and the solver's steps.

use std::time::Instant;

use glam::DVec3;
use partwise::record::{FoldView, Overlay, PatternView, Recorder, StepView, WrinkleView};
use partwise::scene::Tailored;

use super::{Solved, ms};

impl Solved {
    /// What is shown on the draped garment: fit, and the error where it was measured.
    pub(super) fn overlays(&self) -> Vec<Overlay<'_>> {
        let mut overlays = Vec::new();
        if let Some(state) = &self.drape.state {
            overlays.push(Overlay { name: "strain", unit: "%", values: &state.fit.strain_percent });
            overlays.push(Overlay { name: "pressure", unit: "kPa", values: &state.fit.pressure_kpa });
        }
        if let Some(folds) = &self.drape.folds {
            overlays.push(Overlay { name: "folds", unit: "%", values: &folds.excess_percent });
        }
        if self.measured.assessment.is_some() {
            overlays.push(Overlay { name: "error", unit: "mm", values: &self.measured.error_mm });
        }
        overlays
    }

    /// Logs everything as step `index`, with the solver's steps if they are wanted.
    pub(super) fn record(&mut self, recorder: &mut Recorder, index: i64, iterations: bool) -> anyhow::Result<()> {
        let start = Instant::now();
        let scene = &self.loaded.scene;
        recorder.body(index, scene.body.mesh())?;
        recorder.garment(index, &scene.garment)?;
        let forces: Vec<DVec3> = self.drape.outcomes.iter().map(|o| o.force_n).collect();
        let mut scalars = self.summary.figures.scalars();
        scalars.retain(|(name, _)| name.starts_with("error/"));
        recorder.step(&StepView {
            index,
            distance_m: &self.drape.distance,
            part_of_vertex: &self.drape.parts.part_of_vertex,
            part_force_n: &forces,
            draped: &self.drape.positions,
            panel: &self.summary.panel(&self.job.settings.fabric),
            scalars: &scalars,
            overlays: &self.overlays(),
        })?;
        if let Some(Tailored { pattern, put_on }) = &self.loaded.tailored {
            let (flat, garment_vertex) = put_on.garment.unsewn(pattern);
            let fit: Vec<Overlay<'_>> =
                self.overlays().into_iter().filter(|o| ["strain", "pressure"].contains(&o.name)).collect();
            recorder.pattern(&PatternView { index, flat: &flat, garment_vertex: &garment_vertex, overlays: &fit })?;
        }
        if let Some(folds) = &self.drape.folds {
            let draped = &self.drape.positions;
            let (excess_percent, across) = (&folds.excess_percent, &folds.across);
            recorder.folds(&FoldView { index, draped, excess_percent, across })?;
        }
        if let Some(assessment) = &self.measured.assessment {
            let joining = scene.topology.edges.as_slice();
            let seams = self.drape.parts.seams.iter().zip(&assessment.wrinkles.seams);
            let jumps_mm: Vec<([u32; 2], f64)> = seams
                .flat_map(|(seam, measured)| {
                    seam.edges.iter().map(|&e| (joining[e as usize], measured.displacement_difference_mm))
                })
                .collect();
            recorder.wrinkles(&WrinkleView {
                index,
                draped: &self.drape.positions,
                jumps_mm: &jumps_mm,
                curvature_per_m: &assessment.wrinkles.vertex_curvature_per_m,
            })?;
        }
        if iterations {
            for s in &self.snapshots {
                let iteration = i64::try_from(s.iteration).unwrap_or(i64::MAX);
                recorder.iteration(iteration, s.energy, s.residual_over_weight, s.positions.as_deref())?;
            }
        }
        self.summary.timings_ms.insert("record", ms(start.elapsed()));
        Ok(())
    }
}
