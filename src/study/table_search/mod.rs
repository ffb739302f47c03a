//! Search for range tables with the best trade-off between the number of PARTs and the representable error, which the paper leaves
//! open (section 3.3: "the proposed scheme cannot provide an optimal solution for the determination of the number of the
//! levels and range values of each level").
//!
//! Both quantities are sums over levels: the PARTs of level [a, b) are the connected pieces of the vertices with a ≤ d < b,
//! independent of the other levels, with or without an extent e to which the level is cut. A table is therefore a path through the
//! candidate bounds, and one dynamic program gives the best table for every number of PARTs,
//!
//! ```text
//! E(b, p) = min over a < b and e of E(a, p − c(a, b, e)) + v(a, b, e)
//! ```
//!
//! It is exact over all tables whose bounds are candidates. Several garments, each with a limit of PARTs, share one program in which
//! each PART has a cost (see `multipliers`). Without extents, for one garment of ordinary size, every bound that changes a table is a
//! candidate, so the result is optimal among all tables. With extents, candidates are quantiles of the distances and the bounds
//! of given tables, so the front is never worse than those tables; later rounds place candidates close to the bounds of the best
//! table found.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c(a, b, e) | PARTs of level [a, b) cut to extent e, over all garments | – |
//! | v(a, b, e) | their squared representable error, Σ over garments of weight/vertices · squared residual of each PART's motion | m² |
//! | E(b, p) | least squared error of the vertices below b with p PARTs | m² |
//!
//! Source: own; segmentation by dynamic programming is due to Bellman 1961, "On the approximation of curves by line segments
//! using dynamic programming", Communications of the ACM 4(6). Limits: the error is that of one motion per PART (affine by default)
//! against one reference drape, without mechanics; the coupled model also blends the motions and folds the cloth. The cost is
//! O(m n + m² p) for m candidates, n vertices and p PARTs without extents, and m² cuts with them.

mod candidates;
mod extent_grid;
mod front;
mod intervals;
mod multipliers;
mod options;
mod program;
mod sample;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

pub(crate) use front::{Front, FrontPoint};
pub(crate) use options::SearchOptions;
pub(crate) use sample::{Sample, SearchError};

use candidates::Candidates;
use extent_grid::ExtentGrid;
use intervals::{Intervals, forbid};
use multipliers::Multipliers;
use program::Program;

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Progress {
    /// Round, from 1.
    pub round: usize,
    /// Rounds in all.
    pub rounds: usize,
    /// Lower bounds of this round whose levels are evaluated.
    pub done: usize,
    /// Lower bounds of this round.
    pub total: usize,
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Search {
    /// The best tables after each round, never worse than the round before.
    pub rounds: Vec<Front>,
    /// Whether all bounds were candidates; the tables are then optimal for these extents.
    pub exact: bool,
}

/// Finds the tables on the Pareto front of PARTs and representable error. The result has the same bits on any number of threads;
/// `progress` is called from any thread; when it breaks, the result holds the rounds finished before.
///
/// # Errors
/// [`SearchError`] if a sample is invalid or no table is coarse enough.
pub(crate) fn search(
    samples: &[Sample<'_>],
    options: &SearchOptions,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Search, SearchError> {
    sample::check(samples)?;
    let within = |s: &Sample<'_>| s.max_parts.min(s.distances_m.len());
    let samples: &[Sample<'_>] = &samples.iter().map(|s| Sample { max_parts: within(s), ..*s }).collect::<Vec<_>>();
    let mut extents = ExtentGrid::new(&options.widths_cm, &options.shapes);
    let mut candidates = Candidates::quantiles(samples, options);
    let mut multipliers = Multipliers::equal(samples.len());
    let exact = candidates.every;
    let round_count = if exact { 1 } else { options.rounds.max(1) };
    let mut rounds: Vec<Front> = Vec::new();
    for round in 1..=round_count {
        let total = candidates.bins();
        let done = AtomicUsize::new(0);
        let step = || {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress { round, rounds: round_count, done, total })
        };
        let found = match samples {
            [sample] => one_garment(sample, &candidates, &extents, options, &step),
            several => multipliers::round(several, &candidates, &extents, options, &mut multipliers, &step),
        };
        let Some(found) = found else { return Ok(Search { rounds, exact: false }) };
        let front = rounds.last().map_or_else(|| found.clone(), |before| before.union(&found));
        let Some(best) = front.best.as_ref() else {
            return Err(SearchError::TooFewParts { max_parts: samples.iter().map(|s| s.max_parts).collect() });
        };
        candidates = candidates.around(&best.inner_bounds_cm, options.candidates_around, round);
        if round == 1 {
            extents = ExtentGrid::fine(&options.widths_cm, &options.shapes);
        }
        let reached = best.rms_m;
        rounds.push(front);
        let two_before = round.checked_sub(3).and_then(|i| rounds[i].best.as_ref());
        if two_before.is_some_and(|before| reached > 0.999 * before.rms_m) {
            break;
        }
    }
    Ok(Search { rounds, exact })
}

/// Lower bounds evaluated in parallel. Larger batches need more memory; 64 keep all threads of usual machines busy. Heuristic.
const BATCH: usize = 64;

/// The front of one garment over one set of candidates; `None` if `step` breaks.
fn one_garment(
    sample: &Sample<'_>,
    candidates: &Candidates,
    extents: &ExtentGrid,
    options: &SearchOptions,
    step: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Option<Front> {
    let bins = candidates.bins();
    let members = candidates.members(sample.distances_m);
    let share = 1.0 / sample.distances_m.len() as f64;
    let intervals = Intervals::new(sample, extents, options.motion);
    let row = |lower: usize| {
        let mut costs = intervals.row(&members[lower..]);
        costs.iter_mut().for_each(|cost| cost.error *= share);
        forbid(&mut costs, candidates.too_thin(lower, options.thinnest_cm), extents, options);
        step().is_continue().then_some(costs)
    };
    let mut program = Program::new(bins, sample.max_parts, extents.len());
    for from in (0..bins).step_by(BATCH) {
        let batch = from..bins.min(from + BATCH);
        let rows: Vec<_> = batch.clone().into_par_iter().with_max_len(1).map(row).collect::<Option<_>>()?;
        for (lower, row) in batch.zip(&rows) {
            program.add(lower, row);
        }
    }
    let inner_cm = candidates.inner_cm();
    let points: Vec<_> =
        program.paths().iter().map(|path| FrontPoint::on(path, path.parts, &inner_cm, extents)).collect();
    Some(Front { best: points.last().cloned(), points })
}

#[cfg(test)]
mod tests;
