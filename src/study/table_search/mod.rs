//! Search for range tables: the best trade between the number of PARTs and the representable error, which the paper leaves
//! open (section 3.3: "the proposed scheme cannot provide an optimal solution for the determination of the number of the
//! levels and range values of each level").
//!
//! Both quantities add up over levels: the PARTs of level [a, b) are the connected pieces of the vertices with a ≤ d < b,
//! independent of the other levels, with or without an extent e to which the level is cut. So a table is a path through the
//! candidate bounds, and the best tables for every number of PARTs come out of one dynamic program,
//!
//! ```text
//! E(b, p) = min over a < b and e of E(a, p − c(a, b, e)) + v(a, b, e)
//! ```
//!
//! exact over all tables whose bounds are candidates. Several garments, each with a limit of PARTs, share one program in which each PART
//! has a cost (see `multipliers`). For levels alone on one garment of ordinary size every bound that makes a
//! difference is one, so that no table at all is better. With extents candidates are quantiles of the distances plus the bounds
//! of given tables (so the front is never worse than those); later rounds put them close around the best table found.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c(a, b, e) | PARTs of level [a, b) cut to extent e, over all garments | – |
//! | v(a, b, e) | their share of the squared representable error, Σ over garments of weight/vertices · what its motion leaves of each PART | m² |
//! | E(b, p) | least squared error of the vertices below b with p PARTs | m² |
//!
//! Source: own; segmentation by dynamic programming goes back to Bellman 1961, "On the approximation of curves by line segments
//! using dynamic programming", Communications of the ACM 4(6). Limits: the error is of one motion a PART by itself, an affine map unless asked
//! otherwise, against one reference drape, and no mechanics: the coupled model blends the maps, and folds or does not; O(m n + m² p) for m candidates, n vertices and p PARTs without extents, m² cuts with them.

mod candidates;
mod error;
mod extent_grid;
mod front;
mod intervals;
mod multipliers;
mod options;
mod program;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

pub(crate) use error::SearchError;
pub(crate) use front::{Front, FrontPoint};
pub(crate) use options::SearchOptions;

use crate::mesh::{Topology, TriMesh};
use crate::parts::Grain;
use candidates::Candidates;
use extent_grid::Ladder;
use intervals::Intervals;
use multipliers::Charges;
use program::Program;

/// One garment to find a table for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a> {
    /// The garment, undraped.
    pub mesh: &'a TriMesh,
    /// Its connectivity.
    pub topology: &'a Topology,
    /// The grain of its cloth.
    pub grain: &'a Grain,
    /// Distance of each vertex from the body, m; its sign does not matter.
    pub distances_m: &'a [f64],
    /// Reference displacement of each vertex, undraped to draped, m.
    pub displacement: &'a [DVec3],
    /// How much its squared error counts beside the other garments'; only the ratios matter.
    pub weight: f64,
    /// Largest number of PARTs of the garment; clamped to its number of vertices.
    pub max_parts: usize,
}

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
    /// Whether all bounds were candidates; no table with these extents is better then.
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
    error::check(samples)?;
    let within = |s: &Sample<'_>| s.max_parts.min(s.distances_m.len());
    let samples: &[Sample<'_>] = &samples.iter().map(|s| Sample { max_parts: within(s), ..*s }).collect::<Vec<_>>();
    let mut ladder = Ladder::new(&options.widths_cm, &options.shapes);
    let mut candidates = Candidates::quantiles(samples, options);
    let mut charges = Charges::even(samples.len());
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
            [sample] => one_garment(sample, &candidates, &ladder, options, &step),
            several => multipliers::round(several, &candidates, &ladder, options, &mut charges, &step),
        };
        let Some(found) = found else { return Ok(Search { rounds, exact: false }) };
        let front = rounds.last().map_or_else(|| found.clone(), |before| before.union(&found));
        let Some(best) = front.best.as_ref() else {
            return Err(SearchError::TooFewParts { max_parts: samples.iter().map(|s| s.max_parts).collect() });
        };
        candidates = candidates.around(&best.inner_bounds_cm, options.candidates_around, round);
        if round == 1 {
            ladder = Ladder::fine(&options.widths_cm, &options.shapes);
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

/// Weight of a vertex of each garment in the squared error.
fn shares(samples: &[Sample<'_>]) -> Vec<f64> {
    let total_weight: f64 = samples.iter().map(|s| s.weight).sum();
    samples.iter().map(|s| s.weight / (total_weight * s.distances_m.len() as f64)).collect()
}

/// Excludes levels from all tables: the first `too_thin` levels, and uncut levels if the options require a cut.
fn forbid(row: &mut [intervals::Cost], too_thin: usize, ladder: &Ladder, options: &SearchOptions) {
    for (i, steps) in row.chunks_mut(ladder.len()).enumerate() {
        if i < too_thin {
            steps.fill(intervals::TOO_MANY);
        } else if !options.uncut && ladder.cuts() {
            steps[0] = intervals::TOO_MANY;
        }
    }
}

/// The front of one garment over one set of candidates; `None` if `step` breaks.
fn one_garment(
    sample: &Sample<'_>,
    candidates: &Candidates,
    ladder: &Ladder,
    options: &SearchOptions,
    step: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Option<Front> {
    let bins = candidates.bins();
    let members = candidates.members(sample.distances_m);
    let share = 1.0 / sample.distances_m.len() as f64;
    let intervals = Intervals::new(sample, ladder, options.motion);
    let row = |lower: usize| {
        let mut costs = intervals.row(&members[lower..]);
        costs.iter_mut().for_each(|cost| cost.error *= share);
        forbid(&mut costs, candidates.too_thin(lower, options.thinnest_cm), ladder, options);
        step().is_continue().then_some(costs)
    };
    let mut program = Program::new(bins, sample.max_parts, ladder.len());
    for from in (0..bins).step_by(BATCH) {
        let batch = from..bins.min(from + BATCH);
        let rows: Vec<_> = batch.clone().into_par_iter().with_max_len(1).map(row).collect::<Option<_>>()?;
        for (lower, row) in batch.zip(&rows) {
            program.take(lower, row);
        }
    }
    let inner_cm = candidates.inner_cm();
    let points: Vec<_> =
        program.paths().iter().map(|path| FrontPoint::on(path, path.parts, &inner_cm, ladder)).collect();
    Some(Front { best: points.last().cloned(), points })
}

#[cfg(test)]
mod tests;
