//! Runs the points of a sweep: stages as `partwise run`, figures against the references, everything kept for the recording.

use std::ops::ControlFlow;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use clap::ValueEnum;
use partwise::accuracy;
use partwise::accuracy::reference::ReferenceCache;
use partwise::assess::{AssessError, AssessOptions, assess, canonical, perturbed};
use partwise::drape::{Drape, Model, Refine, Scene, Settings, drape};
use partwise::mechanics::coupled::CoupledOptions;
use partwise::mechanics::paper::PaperOptions;
use partwise::mechanics::refine::{Step, Stop};
use partwise::parts::representable_rms_m;
use partwise::range_table::EffectiveLevel;
use partwise::sweep::{self, Measures, ModelChoice, Point, PointError, Solve, Solved, Times, result_hash};

use super::kept::{KeptPoint, KeptScene, Shelf};
use super::scenes::{Placed, Scenes};
use crate::commands::interrupt;

/// Name of the option that says what points are measured against; part of their ids.
pub(crate) const ACCURACY: &str = "accuracy";

/// What points are measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Against {
    /// Nothing: no error
    None,
    /// The canonical drape: one reference for each body, garment and fabric
    Canonical,
    /// Its own continuation too: a converged drape for every point, seconds each
    Own,
}

impl Against {
    /// As on the command line and in the rows.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Canonical => "canonical",
            Self::Own => "own",
        }
    }
}

impl FromStr for Against {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        <Self as ValueEnum>::from_str(text, false)
            .map_err(|_| format!("found accuracy = {text}, expected none, canonical or own"))
    }
}

/// Runs points and keeps what the recording needs.
pub(crate) struct Bench<'a> {
    shelf: &'a Shelf,
    references: AssessOptions,
    scenes: Scenes,
    broken: Mutex<Option<std::io::Error>>,
    keeping_us: AtomicU64,
}

/// A pass over a point.
pub(crate) struct Pass {
    placed: Arc<Placed>,
    settings: Settings,
    drape: Drape,
}

impl<'a> Bench<'a> {
    /// A bench that keeps its points on `shelf` and its references in `cache`.
    pub(crate) fn new(shelf: &'a Shelf, cache: Option<ReferenceCache>) -> Self {
        Self {
            shelf,
            references: AssessOptions { cache, spread_starts: 0 },
            scenes: Scenes::default(),
            broken: Mutex::new(None),
            keeping_us: AtomicU64::new(0),
        }
    }

    /// What the points' bodies and garments warned of.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.scenes.warnings()
    }

    /// The scene of a point.
    pub(crate) fn placed(&self, point: &Point) -> Result<Arc<Placed>, PointError> {
        self.scenes.of(point)
    }

    /// Why points could no longer be kept, if so: a full disk.
    pub(crate) fn take_broken(&self) -> Option<std::io::Error> {
        self.broken.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Time spent on keeping points, ms.
    pub(crate) fn keeping_ms(&self) -> f64 {
        self.keeping_us.load(Ordering::Relaxed) as f64 / 1e3
    }

    fn stopped(&self) -> bool {
        interrupt::requested() || self.broken.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// Computes what is kept of a point anew: it has a row, and its file is gone.
    pub(crate) fn keep_again(&self, point: &Point) -> Result<(), PointError> {
        let solved = self.solve(point)?;
        self.measure(point, solved).map(|_| ())
    }

    fn keep(&self, point: &Point, pass: &Pass, error_mm: Vec<f64>) -> Result<(), PointError> {
        let started = Instant::now();
        let Scene { body_mesh, garment, .. } = &pass.placed.scene;
        let parts = &pass.drape.parts;
        let scene = point.scene_id();
        let levels = pass.settings.table.effective_levels();
        let extent = |l: &EffectiveLevel| l.extent.map_or([0.0; 2], |e| [e.width_cm, e.height_cm]);
        let kept = KeptPoint {
            scene: scene.clone(),
            levels_cm: levels.iter().map(|l| [l.lower_cm, l.upper_cm]).collect(),
            extents_cm: levels.iter().map(extent).collect(),
            level_of_part: parts.parts.iter().map(|p| p.level).collect(),
            force_n: pass.drape.outcomes.iter().map(|o| o.force_n).collect(),
            part_of_vertex: parts.part_of_vertex.clone(),
            positions: pass.drape.positions.clone(),
            error_mm,
        };
        let of_scene = || KeptScene {
            body: body_mesh.clone(),
            garment: garment.clone(),
            distance_m: pass.placed.distance_m.clone(),
        };
        let put = self.shelf.put_scene(&scene, of_scene).and_then(|()| self.shelf.put_point(&point.id, kept));
        self.keeping_us.fetch_add(started.elapsed().as_micros() as u64, Ordering::Relaxed);
        put.map_err(|error| {
            // No row for a point that is not kept, and no use in further ones: the disk is full, most likely.
            *self.broken.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            PointError::Interrupted
        })
    }

    /// The figures against the references, and the error of each vertex.
    fn against(&self, point: &Point, pass: &Pass, measures: &mut Measures) -> Result<Vec<f64>, PointError> {
        let text = point.options.get(ACCURACY).map_or("none", String::as_str);
        let Pass { placed, settings, drape } = pass;
        let scene = &placed.scene;
        match text.parse().map_err(PointError::Failed)? {
            Against::None => Ok(Vec::new()),
            Against::Canonical => {
                let found = canonical(scene, &settings.fabric, &self.references, &mut listening);
                let (reference, _) = found.map_err(unassessed)?;
                let start = &scene.garment.positions;
                let moved: Vec<_> = reference.positions.iter().zip(start).map(|(a, b)| *a - *b).collect();
                measures.representable_rms_mm = Some(1e3 * representable_rms_m(&drape.parts, &moved));
                let error = accuracy::vertex_errors(&drape.positions, &reference.positions);
                measures.canonical_rms_mm = Some(accuracy::rms_mm(&drape.positions, &reference.positions));
                Ok(error.iter().map(|e| 1e3 * e).collect())
            }
            Against::Own => {
                let found = assess(scene, settings, drape, &self.references, &mut listening).map_err(unassessed)?;
                let start = &scene.garment.positions;
                let moved: Vec<_> = found.canonical.positions.iter().zip(start).map(|(a, b)| *a - *b).collect();
                measures.representable_rms_mm = Some(1e3 * representable_rms_m(&drape.parts, &moved));
                measures.rms_mm = Some(found.accuracy.vertices.rms_mm);
                measures.canonical_rms_mm = found.accuracy.canonical_rms_mm;
                measures.residual_over_weight = Some(found.accuracy.state.residual_over_weight);
                measures.strain_p95 = Some(found.accuracy.state.strain_p95);
                Ok(found.error_mm)
            }
        }
    }
}

impl Solve for Bench<'_> {
    type Value = Pass;

    fn solve(&self, point: &Point) -> Result<Solved<Pass>, PointError> {
        if self.stopped() {
            return Err(PointError::Interrupted);
        }
        let placed = self.scenes.of(point)?;
        let settings = settings(point, &placed.distance_m)?;
        let perturbed = (point.seed != 0).then(|| start_of(&placed.scene, point.seed));
        let scene = perturbed.as_ref().unwrap_or(&placed.scene);
        let started = Instant::now();
        let drape = drape(scene, &settings, &mut listening).map_err(|e| PointError::failed(&e))?;
        let total = started.elapsed();
        if drape.state.as_ref().is_some_and(|s| s.stop == Stop::Interrupted) {
            return Err(PointError::Interrupted);
        }
        let times = Times {
            distance: drape.times.distance,
            segment: drape.times.segment,
            mechanics: drape.times.mechanics,
            refine: drape.times.refine,
            total,
        };
        let result_hash = result_hash(&drape.positions);
        Ok(Solved { value: Pass { placed, settings, drape }, times, result_hash })
    }

    fn measure(&self, point: &Point, solved: Solved<Pass>) -> Result<Measures, PointError> {
        let pass = solved.value;
        let Pass { placed, drape, .. } = &pass;
        let mut measures = Measures {
            vertices: drape.positions.len(),
            levels: drape.parts.parts_per_level.iter().filter(|n| **n > 0).count(),
            part_count: drape.parts.len(),
            singletons: drape.parts.singletons,
            contact_parts: drape.outcomes.iter().filter(|o| o.contact).count(),
            displacement_rms_mm: accuracy::rms_mm(&drape.positions, &placed.scene.garment.positions),
            penetrating_vertices: drape.penetrating_vertices,
            residual_over_weight: drape.state.as_ref().map(|s| s.residual_over_weight),
            ..Measures::default()
        };
        let error_mm = self.against(point, &pass, &mut measures)?;
        self.keep(point, &pass, error_mm)?;
        Ok(measures)
    }
}

/// The dials of a point.
fn settings(point: &Point, distance_m: &[f64]) -> Result<Settings, PointError> {
    let extents_m = point.extents_cm.iter().map(|cm| cm / 100.0).collect();
    Ok(Settings {
        table: point.table.resolve(distance_m).map_err(|e| PointError::failed(&e))?,
        min_part: point.min_part,
        model: match point.model {
            ModelChoice::Paper => Model::Paper(PaperOptions::default()),
            ModelChoice::Coupled => Model::Coupled(CoupledOptions { extents_m, ..CoupledOptions::default() }),
        },
        refine: match point.refine {
            sweep::Refine::Steps(n) => Refine::Steps(n),
            sweep::Refine::Converged => Refine::Converged,
        },
        fabric: point.fabric.fabric.clone(),
    })
}

/// The scene with the garment placed a millimetre off at random.
fn start_of(scene: &Scene, seed: u64) -> Scene {
    let positions = perturbed(&scene.garment.positions, &scene.held, seed);
    Scene { garment: scene.garment.with_positions(positions), ..scene.clone() }
}

fn listening(_: &Step<'_>) -> ControlFlow<()> {
    if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn unassessed(error: AssessError) -> PointError {
    match error {
        AssessError::Interrupted => PointError::Interrupted,
        other => PointError::failed(&other),
    }
}
