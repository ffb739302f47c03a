//! Evaluation of a drape against its references: its own continuation and the canonical drape.
//!
//! The *own continuation* is refined to convergence from the result itself (`accuracy.rms_mm`). The *canonical drape* is
//! refined from the undraped garment (`accuracy.canonical_rms_mm`). Its *spread* is the RMS distance between it and drapes
//! from perturbed starts (`accuracy.canonical_spread_mm`, [`perturbed`]). A garment has several equilibria, so an error below
//! the spread does not rank results. References are cached on disk; see `reference`.

use std::ops::ControlFlow;
use std::time::Instant;

use glam::DVec3;

use crate::base::math;
use crate::base::random::Random;
use crate::drape::{Drape, Scene, Settings};
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, EnergyError};
use crate::mechanics::refine::{Observer, RefineOptions, SolveError, Stop, refine};
use crate::study::accuracy::reference::{Reference, ReferenceCache, ReferenceInput, ReferenceKey};
use crate::study::accuracy::{Accuracy, AccuracyError, Comparison, compare, rms, rms_mm, vertex_errors_mm};
use crate::study::wrinkles::{self, Wrinkles};

/// RMS of a perturbation, m. Heuristic: about the difference between previews by different range tables, and less than two
/// dressings of a real garment differ.
const PERTURBATION: f64 = 5e-3;

/// Largest wave number of a perturbation along an axis, 1/m: waves of at least 20 cm, the length of a fold. Larger values strain the
/// cloth; the first relaxation removes such waves.
const WAVE_NUMBER: f64 = 30.0;

/// Number of plane waves in a perturbation.
const WAVES: usize = 8;

/// Why a drape cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The cloth cannot be set up.
    #[error(transparent)]
    Energy(#[from] EnergyError),
    /// The solver of the reference failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Drape and reference cannot be compared.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
    /// The canonical drape of layered garments is not defined.
    #[error(
        "found {garments} layered garments, expected one: each layer drapes over the result of the layer below, so an outfit has no canonical \
         drape; omit --accuracy, or measure each garment by itself"
    )]
    #[allow(missing_docs, reason = "the message says what it is")]
    Layers { garments: usize },
    /// The garment falls off the body.
    #[error("the garment falls off the body before it rests, so it has no reference; hold an edge of it (--hold)")]
    Fallen,
    /// The caller interrupted the computation.
    #[error("interrupted while a reference was refined")]
    Interrupted,
}

/// Options of an evaluation.
#[derive(Debug, Clone, Default)]
pub(crate) struct EvaluateOptions {
    /// Cache of references; `None` computes each reference.
    pub cache: Option<ReferenceCache>,
    /// Number of perturbed starts for the spread of the canonical drape.
    pub spread_starts: u64,
}

/// Errors of a drape against its references.
#[derive(Debug, Clone)]
pub(crate) struct Evaluation {
    /// Errors and state.
    pub accuracy: Accuracy,
    /// Distance of each vertex to its own continuation, mm.
    pub error_mm: Vec<f64>,
    /// The canonical drape.
    pub canonical: Reference,
    /// Wrinkle measures of the paper and by curvature.
    pub wrinkles: Wrinkles,
    /// Spearman's rank correlation over the vertices of the preview's excess length with the mean curvature of the own continuation;
    /// `None` for a model without excess length.
    pub fold_rank_correlation: Option<f64>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Measures `drape` against its references, which are read from the cache or computed.
///
/// # Errors
/// [`EvaluateError`]; [`EvaluateError::Interrupted`] where `observer` ends a reference before it has converged.
pub(crate) fn evaluate(
    scene: &Scene,
    settings: &Settings,
    drape: &Drape,
    options: &EvaluateOptions,
    observer: Observer<'_>,
) -> Result<Evaluation, EvaluateError> {
    require_one_garment(scene)?;
    let cloth =
        Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(&settings.fabric), &scene.held)?;
    let solver = RefineOptions { self_contact: settings.self_contact, ..RefineOptions::default() };
    let mut references = References { scene, cloth: &cloth, solver, options, warnings: Vec::new() };
    let own = references.from(&drape.positions, observer)?;
    let canonical = references.from(&scene.garment.positions, observer)?;
    let mut spread = Vec::new();
    for seed in 1..=options.spread_starts {
        let start = perturbed(&scene.garment.positions, &scene.held, seed);
        spread.push(rms_mm(&references.from(&start, observer)?.positions, &canonical.positions));
    }
    let warnings = references.warnings;
    let mut measured = compare(&Comparison {
        mesh: &scene.garment,
        topology: &scene.topology,
        cloth: &cloth,
        body: &scene.body,
        parts: Some(&drape.parts),
        start: &scene.garment.positions,
        result: &drape.positions,
        reference: &own.positions,
    })?;
    measured.canonical_rms_mm = Some(rms_mm(&drape.positions, &canonical.positions));
    measured.canonical_spread_mm = (!spread.is_empty()).then(|| rms(&spread));
    let settled = scene.garment.with_positions(own.positions.clone());
    let fold_rank_correlation = drape.folds.as_ref().and_then(|folds| {
        wrinkles::rank_correlation(&folds.excess_percent, &wrinkles::mean_curvature(&settled, &scene.topology))
    });
    let moved: Vec<DVec3> = drape.outcomes.iter().map(|o| o.displacement).collect();
    Ok(Evaluation {
        error_mm: vertex_errors_mm(&drape.positions, &own.positions),
        wrinkles: wrinkles::measure(&scene.garment, &scene.topology, &drape.parts, &moved, &drape.positions),
        fold_rank_correlation,
        accuracy: measured,
        canonical,
        warnings,
    })
}

/// The canonical drape of a scene, read from the cache or computed, with warnings.
pub(crate) fn canonical(
    scene: &Scene,
    fabric: &Fabric,
    options: &EvaluateOptions,
    observer: Observer<'_>,
) -> Result<(Reference, Vec<String>), EvaluateError> {
    require_one_garment(scene)?;
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(fabric), &scene.held)?;
    let solver = RefineOptions::default();
    let mut references = References { scene, cloth: &cloth, solver, options, warnings: Vec::new() };
    let reference = references.from(&scene.garment.positions, observer)?;
    Ok((reference, references.warnings))
}

fn require_one_garment(scene: &Scene) -> Result<(), EvaluateError> {
    match scene.layers.len() {
        garments @ 2.. => Err(EvaluateError::Layers { garments }),
        _ => Ok(()),
    }
}

/// Start positions displaced by a smooth random field of 5 mm RMS, equal for equal seeds; held vertices stay in place. White noise
/// would not change the equilibrium, since the first relaxation removes it.
#[must_use]
pub fn perturbed(positions: &[DVec3], held: &[u32], seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let mut vector = || DVec3::new(random.signed(), random.signed(), random.signed());
    let waves: [(DVec3, DVec3, DVec3); WAVES] =
        std::array::from_fn(|_| (WAVE_NUMBER * vector(), std::f64::consts::PI * vector(), vector()));
    let field =
        |p: DVec3| -> DVec3 { waves.iter().map(|(k, phase, along)| *along * math::sin(k.dot(p) + phase.x)).sum() };
    let moves: Vec<DVec3> = positions.iter().map(|&p| field(p)).collect();
    let rms = (moves.iter().map(|m| m.length_squared()).sum::<f64>() / moves.len().max(1) as f64).sqrt();
    let mut moved: Vec<DVec3> =
        positions.iter().zip(moves).map(|(p, m)| *p + m * (PERTURBATION / rms.max(f64::MIN_POSITIVE))).collect();
    for &v in held {
        moved[v as usize] = positions[v as usize];
    }
    moved
}

/// Computes references of one garment, or reads them from the cache.
struct References<'a> {
    scene: &'a Scene,
    cloth: &'a Cloth,
    solver: RefineOptions,
    options: &'a EvaluateOptions,
    warnings: Vec<String>,
}

impl References<'_> {
    /// The equilibrium that refinement reaches from `start` (m).
    fn from(&mut self, start: &[DVec3], observer: Observer<'_>) -> Result<Reference, EvaluateError> {
        let solver = self.solver.clone();
        let key = ReferenceKey::new(&ReferenceInput {
            garment: &self.scene.garment,
            rest: &self.scene.rest,
            fabrics: &self.cloth.fabrics,
            body: self.scene.body.mesh(),
            held: &self.scene.held,
            start,
            options: &format!("{solver:?}, {:?}", self.cloth.solver),
        });
        let mut compute = || {
            let began = Instant::now();
            let mut interrupted = false;
            let refined = refine(self.cloth, &self.scene.body, start.to_vec(), &solver, &mut |step| {
                if self.scene.fallen(step.positions).is_some() {
                    return ControlFlow::Break(());
                }
                let answer = observer(step);
                interrupted |= answer.is_break();
                answer
            })?;
            if refined.stop == Stop::Interrupted {
                return Err(if interrupted { EvaluateError::Interrupted } else { EvaluateError::Fallen });
            }
            Ok(Reference {
                energy_j: refined.energy,
                residual_over_weight: refined.residual_over_weight,
                steps: refined.steps as u64,
                seconds: began.elapsed().as_secs_f64(),
                positions: refined.positions,
            })
        };
        let reference = match &self.options.cache {
            None => compute()?,
            Some(cache) => {
                let found = cache.get_or_compute(&key, start.len(), &mut compute)?;
                self.warnings.extend(found.warnings);
                found.reference
            }
        };
        if reference.residual_over_weight >= self.cloth.solver.newton.tolerance {
            self.warnings.push(format!(
                "the solver of a reference stopped at a residual of {:.1e} of the weight, expected less than {:.0e}: errors against it are inexact",
                reference.residual_over_weight, self.cloth.solver.newton.tolerance
            ));
        }
        Ok(reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perturbation_is_smooth_of_5_mm_rms_and_equal_for_equal_seeds() {
        let sheet: Vec<DVec3> =
            (0..400).map(|i| DVec3::new(f64::from(i % 20), 0.0, f64::from(i / 20)) * 0.01).collect();
        let moved = perturbed(&sheet, &[7], 3);
        assert_eq!(moved, perturbed(&sheet, &[7], 3));
        assert_ne!(moved, perturbed(&sheet, &[7], 4));
        assert_eq!(moved[7], sheet[7]);
        let moves: Vec<DVec3> = moved.iter().zip(&sheet).map(|(m, s)| *m - *s).collect();
        let rms = (moves.iter().map(|m| m.length_squared()).sum::<f64>() / 400.0).sqrt();
        assert!((rms - PERTURBATION).abs() < 1e-4, "{rms}");
        let steepest = (0..399).filter(|i| i % 20 != 19 && ![6, 7].contains(i));
        let steepest = steepest.map(|i| moves[i].distance(moves[i + 1]) / 0.01).fold(0.0, f64::max);
        assert!(steepest < 0.5, "neighbours are strained by {steepest}");
    }
}
