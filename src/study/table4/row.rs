//! One row of Table 4: a garment draped by every compared method, timed and measured.

use std::ops::ControlFlow;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::methods::{ComparedMethod, METHODS, Outcome};
use super::silhouette::{SectionHeights, Silhouette};
use crate::base::quantiles::interpolated;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::methods::RestRule;
use crate::mechanics::refine::{RefineOptions, Step, Stop, refine};
use crate::scene::Scene;
use crate::study::accuracy::{State, rms, rms_mm};
use crate::study::evaluate::perturbed;

/// Options of a run of Table 4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Table4Options {
    /// Counted rounds.
    pub rounds: usize,
    /// Uncounted rounds before them.
    pub warm_up: usize,
    /// Perturbed starts for the spread between equilibria.
    pub starts: u64,
    /// When a simulation over time counts as at rest.
    pub rule: RestRule,
}

impl Default for Table4Options {
    fn default() -> Self {
        Self { rounds: 5, warm_up: 1, starts: 2, rule: RestRule::default() }
    }
}

/// One method's result on one garment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct MethodResult {
    /// Name of the method.
    #[serde(rename = "entrant")]
    pub method: String,
    /// Why the method cannot drape this scene; the other fields are empty then.
    pub error: Option<String>,
    /// Time of each counted round, ms.
    pub times_ms: Vec<f64>,
    /// Their median.
    pub median_ms: f64,
    /// Their interquartile range.
    pub spread_ms: f64,
    /// Median over the rounds of the method's time divided by the converged drape's.
    pub ratio: f64,
    /// Interquartile range of that ratio.
    pub ratio_spread: f64,
    /// Reason for the end: `at-rest` or `time-over` for a simulation over time, `converged` and so on for the others.
    pub ended: String,
    /// Time steps, or Newton steps.
    pub steps: usize,
    /// Simulated time, s; `None` for a method without time steps.
    pub simulated_s: Option<f64>,
    /// RMS distance to the canonical drape, mm.
    pub canonical_rms_mm: f64,
    /// RMS distance to the equilibrium reached from the result, mm.
    pub own_rms_mm: f64,
    /// Residual of this project's energy over the weight.
    pub residual_over_weight: f64,
    /// 95th percentile of the largest principal strain.
    pub strain_p95: f64,
    /// Largest strain.
    pub strain_max: f64,
    /// Vertices inside the body.
    pub penetrating_vertices: usize,
    /// Depth of the deepest, mm.
    pub penetration_mm: f64,
    /// Hem and girths.
    #[serde(default)]
    pub silhouette: Silhouette,
    /// Counters that the method reports.
    pub counts: Vec<(String, u64)>,
}

/// A garment at a size with the results of all methods.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Table4Row {
    /// Name of the garment.
    pub garment: String,
    /// Requested vertices.
    pub asked: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// RMS distance between canonical drapes from perturbed starts and the canonical drape, mm; `None` without such starts.
    pub spread_mm: Option<f64>,
    /// Hem and girths of the canonical drape.
    #[serde(default)]
    pub canonical: Silhouette,
    /// One result a method, in the order of [`METHODS`].
    pub entries: Vec<MethodResult>,
}

/// A row with its drapes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DrapedRow {
    /// The measured row.
    pub row: Table4Row,
    /// Vertices of each method's last drape, m; `None` for a method that failed.
    pub draped: Vec<Option<Vec<DVec3>>>,
    /// The canonical drape, m.
    pub canonical: Vec<DVec3>,
}

/// Why there is no row.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Table4Error {
    /// The caller interrupted the row.
    #[error("interrupted")]
    Interrupted,
    /// The cloth cannot be set up or solved.
    #[error("{0}")]
    Failed(String),
}

/// Called between any two steps with the number of finished rounds, the number of rounds and the current task; decides
/// whether to continue.
pub(crate) type Listener<'a> = &'a mut (dyn FnMut(usize, usize, &str) -> ControlFlow<()> + Send);

/// Drapes and measures one row.
///
/// # Errors
/// [`Table4Error`]. A method that fails is no error: its result holds the reason.
pub(crate) fn row(
    (garment, asked): (&str, usize),
    scene: &Scene,
    fabric: &Fabric,
    options: &Table4Options,
    listener: Listener<'_>,
) -> Result<DrapedRow, Table4Error> {
    let failed = |e: &dyn std::error::Error| Table4Error::Failed(e.to_string());
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(fabric), &scene.held)
        .map_err(|e| failed(&e))?;
    let rounds = options.warm_up + options.rounds;
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); METHODS.len()];
    let mut last: Vec<Option<Result<Outcome, String>>> = METHODS.iter().map(|_| None).collect();
    for round in 0..rounds {
        for (i, method) in METHODS.into_iter().enumerate() {
            // A method that failed once fails in every round.
            if matches!(last[i], Some(Err(_))) {
                continue;
            }
            let mut go_on = || listener(round, rounds, method.name());
            if go_on().is_break() {
                return Err(Table4Error::Interrupted);
            }
            let outcome = method.run(scene, fabric, &cloth, &options.rule, &mut go_on);
            if outcome.as_ref().is_ok_and(|o| o.ended == "interrupted") {
                return Err(Table4Error::Interrupted);
            }
            if let (Ok(outcome), true) = (&outcome, round >= options.warm_up) {
                times[i].push(1e3 * outcome.time.as_secs_f64());
            }
            last[i] = Some(outcome);
        }
    }
    let mut settle = |start: &[DVec3], what: &str| -> Result<Vec<DVec3>, Table4Error> {
        let mut go_on = |_: &Step<'_>| listener(rounds, rounds, what);
        let found = refine(&cloth, &scene.body, start.to_vec(), &RefineOptions::default(), &mut go_on);
        let found = found.map_err(|e| failed(&e))?;
        if found.stop == Stop::Interrupted { Err(Table4Error::Interrupted) } else { Ok(found.positions) }
    };
    let canonical = settle(&scene.garment.positions, "canonical drape")?;
    let mut spread = Vec::new();
    for seed in 1..=options.starts {
        let start = perturbed(&scene.garment.positions, &scene.held, seed);
        spread.push(rms_mm(&settle(&start, "perturbed starts")?, &canonical));
    }
    let spread_mm = (!spread.is_empty()).then(|| rms(&spread));
    let base =
        METHODS.iter().position(|e| *e == ComparedMethod::Converged).map(|i| times[i].clone()).unwrap_or_default();
    let heights = SectionHeights::new(scene, &canonical);
    let (mut entries, mut draped) = (Vec::new(), Vec::new());
    for ((method, times_ms), outcome) in METHODS.into_iter().zip(times).zip(last) {
        let mut result = MethodResult { method: method.name().to_owned(), ..MethodResult::default() };
        match outcome {
            Some(Ok(outcome)) => {
                let x = outcome.positions;
                result.own_rms_mm = rms_mm(&x, &settle(&x, "own continuations")?);
                result.silhouette = heights.measure(scene, &x);
                result.canonical_rms_mm = rms_mm(&x, &canonical);
                let state = State::of(&cloth, &scene.body, &x);
                result.residual_over_weight = state.residual_over_weight;
                (result.strain_p95, result.strain_max) = (state.strain_p95, state.strain_max);
                (result.penetrating_vertices, result.penetration_mm) =
                    (state.penetrating_vertices, state.penetration_mm);
                let ratios: Vec<f64> = times_ms.iter().zip(&base).map(|(own, base)| own / base).collect();
                (result.median_ms, result.spread_ms) = quartiles(&times_ms);
                (result.ratio, result.ratio_spread) = quartiles(&ratios);
                result.times_ms = times_ms;
                (result.ended, result.steps) = (outcome.ended, outcome.steps);
                (result.simulated_s, result.counts) = (outcome.simulated_s, outcome.counts);
                draped.push(Some(x));
            }
            failed => {
                result.error = Some(failed.and_then(Result::err).unwrap_or_else(|| "no round was run".to_owned()));
                draped.push(None);
            }
        }
        entries.push(result);
    }
    let vertices = scene.garment.vertex_count();
    let measured = heights.measure(scene, &canonical);
    let row = Table4Row { garment: garment.to_owned(), asked, vertices, spread_mm, canonical: measured, entries };
    Ok(DrapedRow { row, draped, canonical })
}

/// Median and interquartile range.
fn quartiles(list: &[f64]) -> (f64, f64) {
    (interpolated(list, 0.5), interpolated(list, 0.75) - interpolated(list, 0.25))
}
