//! A garment through every stage, ready to be told and recorded: a step with all its stages, its fit and folds, and the
//! solver's steps.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::Job;
use crate::drape::Drape;
use crate::record::{
    FoldView, Layout, OutfitView, Overlay, PatternView, RecordOptions, Recorder, StepView, Tab, WrinkleView,
};
use crate::scene::{Loaded, Tailored};
use crate::session::Finished;
use crate::study::job::Measured;
use glam::DVec3;

use super::SinkArgs;
use super::summary::Summary;

/// A garment through every stage.
pub(super) struct Solved {
    pub(super) loaded: Loaded,
    pub(super) drape: Drape,
    pub(super) measured: Measured,
    /// By iteration: a plot has one point each.
    pub(super) snapshots: BTreeMap<usize, Snapshot>,
    pub(super) summary: Summary,
}

/// The cloth at one of the solver's steps; the mesh every so often.
pub(super) struct Snapshot {
    pub(super) energy: f64,
    pub(super) residual_over_weight: f64,
    pub(super) positions: Option<Vec<DVec3>>,
}

impl Solved {
    /// A state of a session, and what was measured of it.
    pub(super) fn of_session(job: &Job, finished: &Finished, measured: Measured) -> anyhow::Result<Self> {
        let (loaded, drape) = (finished.loaded_scene.input.clone(), finished.drape.clone());
        let mut summary = Summary::new(&loaded, &job.settings, &drape, &measured)?;
        summary.add_time("load", Duration::from_secs_f64(1e-3 * finished.loaded_scene.load_ms));
        Ok(Self { loaded, drape, measured, snapshots: BTreeMap::new(), summary })
    }

    /// How to record it; `live` where more steps follow, whose meshes may be others.
    pub(super) fn record_options(&self, sinks: &SinkArgs, iterations: bool, live: bool) -> RecordOptions {
        let overlays = self.overlays();
        let layers = &self.loaded.scene.layers;
        let several = layers.len() > 1;
        let of_cloth = overlays.iter().map(|overlay| overlay.name).filter(|name| *name != "error");
        RecordOptions {
            sinks: sinks.sinks(&self.loaded.garment_name),
            name: self.loaded.garment_name.clone(),
            layout: Layout {
                several_tables: live,
                follow: live,
                iterations: iterations && self.snapshots.len() > 1,
                error: self.measured.evaluation.is_some(),
                pattern: self.loaded.tailored.is_some(),
                outfit: if several { layers.clone() } else { Vec::new() },
                wrinkles: self.measured.evaluation.is_some(),
                fit: of_cloth.map(str::to_owned).collect(),
                // Who drapes an outfit looks at that first.
                opens_on: if several { Tab::Outfit } else { Tab::Stages },
                ..Layout::default()
            },
            replaceable: live,
            front: sinks.seen_from.direction(),
        }
    }

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
        if self.measured.evaluation.is_some() {
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
        if scene.layers.len() == 1 && scene.own_fabrics.len() > 1 {
            recorder.fabrics(index, &scene.fabric_of_vertices())?;
        }
        let forces: Vec<DVec3> = self.drape.outcomes.iter().map(|o| o.force_n).collect();
        let mut scalars = self.summary.metrics.scalars();
        scalars.retain(|(name, _)| name.starts_with("error/"));
        recorder.step(&StepView {
            index,
            distance_m: &self.drape.distance,
            part_of_vertex: &self.drape.parts.part_of_vertex,
            part_force_n: &forces,
            draped: &self.drape.positions,
            panel: &self.summary.panel(),
            scalars: &scalars,
            overlays: &self.overlays(),
        })?;
        if let Some(Tailored { pattern, put_on }) = &self.loaded.tailored {
            let (flat, garment_vertex) = put_on.garment.unsewn(pattern);
            let fit: Vec<Overlay<'_>> =
                self.overlays().into_iter().filter(|o| ["strain", "pressure"].contains(&o.name)).collect();
            recorder.pattern(&PatternView { index, flat: &flat, garment_vertex: &garment_vertex, overlays: &fit })?;
        }
        if scene.layers.len() > 1 {
            let of_part = |&p: &u32| forces.get(p as usize).map_or(0.0, |force| force.length());
            let force_n: Vec<f64> = self.drape.parts.part_of_vertex.iter().map(of_part).collect();
            recorder.outfit(&OutfitView { index, force_n: &force_n, draped: &self.drape.positions })?;
        }
        if let Some(folds) = &self.drape.folds {
            let draped = &self.drape.positions;
            let (excess_percent, across) = (&folds.excess_percent, &folds.across);
            recorder.folds(&FoldView { index, draped, excess_percent, across })?;
        }
        if let Some(evaluation) = &self.measured.evaluation {
            let joining = scene.topology.edges.as_slice();
            let seams = self.drape.parts.seams.iter().zip(&evaluation.wrinkles.seams);
            let jumps_mm: Vec<([u32; 2], f64)> = seams
                .flat_map(|(seam, measured)| {
                    seam.edges.iter().map(|&e| (joining[e as usize], measured.displacement_difference_mm))
                })
                .collect();
            recorder.wrinkles(&WrinkleView {
                index,
                draped: &self.drape.positions,
                jumps_mm: &jumps_mm,
                curvature_per_m: &evaluation.wrinkles.vertex_curvature_per_m,
            })?;
        }
        if iterations {
            for (iteration, s) in &self.snapshots {
                let iteration = i64::try_from(*iteration).unwrap_or(i64::MAX);
                recorder.iteration(iteration, s.energy, s.residual_over_weight, s.positions.as_deref())?;
            }
        }
        self.summary.add_time("record", start.elapsed());
        Ok(())
    }
}
