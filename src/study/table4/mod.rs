//! The paper's Table 4 run again: every way to drape on the same garments, time and error together.
//!
//! A row is a garment at a size; an entrant is a way to drape it: the [reference methods](crate::methods), the paper's
//! own equations, the coupled model's two stages alone, and those with the converged drape after. All drape the same
//! scene in the same fabric on the same threads. Repeats are interleaved, each entrant once a round, after a round that
//! is not counted; so what else the machine does hits all alike, and ratios are taken round by round.
//!
//! Time is from the loaded scene to the draped positions; of ours the four stages' sum, without what is measured
//! afterwards; of the methods all they do, their own preparation included, but for the cloth's masses and areas.
//!
//! | figure | meaning |
//! |---|---|
//! | median, spread | of the counted rounds, ms; the spread is the interquartile range |
//! | ratio | median of its time over the converged drape's, round by round, with its interquartile range |
//! | canonical error | RMS distance of the vertices to the canonical drape, which is refined from the undraped start, mm |
//! | own error | RMS distance to the equilibrium that Newton's method reaches from the result, mm |
//! | hem, girths | height of the lowest edge, lengths of level sections, cm; beside those of the canonical drape |
//! | residual | ‖∇E‖ of this project's energy over the weight, friction holding what it can |
//!
//! A garment has several equilibria: the RMS between canonical drapes of starts put on a little differently is told
//! with each row, and an error under it says nothing.

mod methods;
mod row_log;
mod run;
mod shape;
mod table;

use std::ops::ControlFlow;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::base::quantiles::interpolated;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::refine::{RefineOptions, Stop, refine};
use crate::methods::RestRule;
use crate::scene::Scene;
use crate::study::accuracy::{self, state::State};
use crate::study::evaluate::perturbed;
pub(crate) use methods::{ComparedMethod, METHODS, TEN_ROWS, printed_ms};
pub(crate) use row_log::{Conditions, RowLog, RowLogError};
use run::{Outcome, run};
pub(crate) use shape::Silhouette;
use shape::Tape;
pub(crate) use table::{Cells, csv_lines, exponents, tables};

/// How a contest is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Table4Options {
    /// Counted rounds.
    pub rounds: usize,
    /// Rounds before them.
    pub warm_up: usize,
    /// Perturbed starts for the spread between equilibria.
    pub starts: u64,
    /// When what moves in time rests.
    pub rule: RestRule,
}

impl Default for Table4Options {
    fn default() -> Self {
        Self { rounds: 5, warm_up: 1, starts: 2, rule: RestRule::default() }
    }
}

/// One way to drape one garment, measured.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct MethodResult {
    /// Its name.
    #[serde(rename = "entrant")]
    pub method: String,
    /// Why there is nothing else.
    pub error: Option<String>,
    /// Time of each counted round, ms.
    pub times_ms: Vec<f64>,
    /// Their median.
    pub median_ms: f64,
    /// Their interquartile range.
    pub spread_ms: f64,
    /// Median of its time over the converged drape's.
    pub ratio: f64,
    /// Interquartile range of that.
    pub ratio_spread: f64,
    /// Why it ended: `at-rest` or `time-over` for what moves in time, `converged` and so on for what does not.
    pub ended: String,
    /// Steps in time, or of Newton's method.
    pub steps: usize,
    /// Simulated time, s, of what moves in time.
    pub simulated_s: Option<f64>,
    /// RMS to the canonical drape, mm.
    pub canonical_rms_mm: f64,
    /// RMS to where it would settle, mm.
    pub own_rms_mm: f64,
    /// Residual of the common energy over the weight.
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
    /// What the method counted.
    pub counts: Vec<(String, u64)>,
}

/// A row: a garment at a size, with all entrants.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Table4Row {
    /// The garment.
    pub garment: String,
    /// Vertices asked for.
    pub asked: usize,
    /// Its vertices.
    pub vertices: usize,
    /// RMS between canonical drapes of perturbed starts and the canonical one, mm; `None` where none were asked for.
    pub spread_mm: Option<f64>,
    /// Hem and girths of the canonical drape.
    #[serde(default)]
    pub canonical: Silhouette,
    /// One for each entrant.
    pub entries: Vec<MethodResult>,
}

/// A row with the drapes it is about.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DrapedRow {
    /// The figures.
    pub row: Table4Row,
    /// Vertices of each entrant's last drape, m; `None` for who cannot run.
    pub draped: Vec<Option<Vec<DVec3>>>,
    /// The canonical drape, m.
    pub canonical: Vec<DVec3>,
}

/// Why there is no row.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Table4Error {
    /// The caller stopped it: no row.
    #[error("interrupted")]
    Interrupted,
    /// The cloth cannot be set up or solved.
    #[error("{0}")]
    Failed(String),
}

/// Asked between any two steps whether to go on, and told how far a row is: rounds done and of how many, and what is
/// done now.
pub(crate) type Listener<'a> = &'a mut (dyn FnMut(usize, usize, &str) -> ControlFlow<()> + Send);

/// Runs a row.
///
/// # Errors
/// [`Table4Error`]; an entrant that fails has an entry that says why.
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
        for (i, entrant) in METHODS.into_iter().enumerate() {
            // What cannot run once cannot run at all.
            if matches!(last[i], Some(Err(_))) {
                continue;
            }
            let mut go_on = || listener(round, rounds, entrant.name());
            if go_on().is_break() {
                return Err(Table4Error::Interrupted);
            }
            let outcome = run(entrant, scene, fabric, &cloth, &options.rule, &mut go_on);
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
        let mut go_on = |_: &crate::mechanics::refine::Step<'_>| listener(rounds, rounds, what);
        let found = refine(&cloth, &scene.body, start.to_vec(), &RefineOptions::default(), &mut go_on);
        let found = found.map_err(|e| failed(&e))?;
        if found.stop == Stop::Interrupted { Err(Table4Error::Interrupted) } else { Ok(found.positions) }
    };
    let canonical = settle(&scene.garment.positions, "canonical drape")?;
    let mut squares = Vec::new();
    for seed in 1..=options.starts {
        let start = perturbed(&scene.garment.positions, &scene.held, seed);
        squares.push(accuracy::rms_mm(&settle(&start, "perturbed starts")?, &canonical).powi(2));
    }
    let spread_mm = (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
    let base =
        METHODS.iter().position(|e| *e == ComparedMethod::Converged).map(|i| times[i].clone()).unwrap_or_default();
    let tape = Tape::new(scene, &canonical);
    let (mut entries, mut draped) = (Vec::new(), Vec::new());
    for ((entrant, times_ms), outcome) in METHODS.into_iter().zip(times).zip(last) {
        let mut entry = MethodResult { method: entrant.name().to_owned(), ..MethodResult::default() };
        match outcome {
            Some(Ok(outcome)) => {
                let x = outcome.positions;
                entry.own_rms_mm = accuracy::rms_mm(&x, &settle(&x, "own continuations")?);
                entry.silhouette = tape.measure(scene, &x);
                entry.canonical_rms_mm = accuracy::rms_mm(&x, &canonical);
                let state = State::of(&cloth, &scene.body, &x);
                entry.residual_over_weight = state.residual_over_weight;
                (entry.strain_p95, entry.strain_max) = (state.strain_p95, state.strain_max);
                (entry.penetrating_vertices, entry.penetration_mm) = (state.penetrating_vertices, state.penetration_mm);
                let ratios: Vec<f64> = times_ms.iter().zip(&base).map(|(own, base)| own / base).collect();
                (entry.median_ms, entry.spread_ms) = quartiles(&times_ms);
                (entry.ratio, entry.ratio_spread) = quartiles(&ratios);
                entry.times_ms = times_ms;
                (entry.ended, entry.steps) = (outcome.ended, outcome.steps);
                (entry.simulated_s, entry.counts) = (outcome.simulated_s, outcome.counts);
                draped.push(Some(x));
            }
            failed => {
                entry.error = Some(failed.and_then(Result::err).unwrap_or_else(|| "no round was run".to_owned()));
                draped.push(None);
            }
        }
        entries.push(entry);
    }
    let vertices = scene.garment.vertex_count();
    let measured = tape.measure(scene, &canonical);
    let row = Table4Row { garment: garment.to_owned(), asked, vertices, spread_mm, canonical: measured, entries };
    Ok(DrapedRow { row, draped, canonical })
}

/// Median and interquartile range.
fn quartiles(list: &[f64]) -> (f64, f64) {
    (interpolated(list, 0.5), interpolated(list, 0.75) - interpolated(list, 0.25))
}

#[cfg(test)]
mod tests;
