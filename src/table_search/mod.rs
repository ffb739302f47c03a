//! Search for range tables: the best trade between the number of PARTs and the representable error, which the paper leaves
//! open (section 3.3: "the proposed scheme cannot provide an optimal solution for the determination of the number of the
//! levels and range values of each level").
//!
//! Both quantities add up over levels: the PARTs of level [a, b) are the connected pieces of the vertices with a ≤ d < b, whatever
//! the other levels are, and so are their errors, cut to an extent e of the level's own or not. So a table is a path through the
//! candidate bounds, and the best tables for every number of PARTs come out of one dynamic program,
//!
//! ```text
//! E(b, p) = min over a < b and e of E(a, p − c(a, b, e)) + v(a, b, e)
//! ```
//!
//! exact over all tables whose bounds are candidates. For levels alone on a garment of ordinary size every bound that makes a
//! difference is one, so that no table at all is better. With extents candidates are quantiles of the distances plus the bounds
//! of given tables (so the front is never worse than those); later rounds put them close around the best table found.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | c(a, b, e) | PARTs of level [a, b) cut to extent e, over all garments | – |
//! | v(a, b, e) | their share of the squared representable error, Σ over garments of weight/vertices · Σ \|u_i − ū_k\|² | m² |
//! | E(b, p) | least squared error of the vertices below b with p PARTs | m² |
//!
//! Source: own; segmentation by dynamic programming goes back to Bellman 1961, "On the approximation of curves by line segments
//! using dynamic programming", Communications of the ACM 4(6). Limits: the error is of one translation a PART against one
//! reference drape; O(m n + m² p) for m candidates, n vertices and p PARTs without extents, m² cuts with them.

mod candidates;
mod front;
mod intervals;
mod ladder;
mod program;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

pub use front::{Front, FrontPoint};

use crate::mesh::{Topology, TriMesh};
use crate::parts::Grain;
use crate::range_table::RangeTable;
use candidates::Candidates;
use ladder::Ladder;
use program::Program;

/// One garment to find a table for.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
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
}

/// What to search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOptions {
    /// Candidate bounds per round. Default 400, with extents 120: a level between each two of them is evaluated, which with
    /// extents means cut.
    pub candidates: usize,
    /// With at most so many distinct distances every bound is a candidate, and one round is exact. Default 12,000 for
    /// levels alone, 0 with extents.
    pub exact_up_to: usize,
    /// Most PARTs a table may yield, over all garments together.
    pub max_parts: usize,
    /// Widths each level may be cut to, cm; not to be cut is always open to it. Empty for levels alone.
    pub widths_cm: Vec<f64>,
    /// Heights over widths of the pieces. Default 1/2, 1, 2 and 4: powers of two are exact, which lets one run of seeds serve
    /// all widths.
    pub shapes: Vec<f64>,
    /// Candidate bounds in each round after the first. Default 400, with extents 40.
    pub candidates_around: usize,
    /// Rounds: the first over quantiles, the others around the best table so far, with extents finely between the widths and
    /// shapes given. They end early when two in a row bring less than a thousandth. Default 3, with extents 12.
    pub rounds: usize,
    /// Tables whose bounds are candidates too, so that the front is never worse than those are without extents.
    pub include: Vec<RangeTable>,
}

impl SearchOptions {
    /// Defaults for levels alone with a limit of PARTs.
    #[must_use]
    pub fn new(max_parts: usize) -> Self {
        let include = vec![RangeTable::table_3()];
        Self {
            candidates: 400,
            candidates_around: 400,
            exact_up_to: 12_000,
            max_parts,
            widths_cm: Vec::new(),
            shapes: vec![0.5, 1.0, 2.0, 4.0],
            rounds: 3,
            include,
        }
    }

    /// Defaults for levels that may each be cut to one of these widths (cm).
    #[must_use]
    pub fn with_extents(max_parts: usize, widths_cm: &[f64]) -> Self {
        Self {
            candidates: 120,
            candidates_around: 40,
            exact_up_to: 0,
            rounds: 12,
            widths_cm: widths_cm.to_vec(),
            ..Self::new(max_parts)
        }
    }
}

/// How far a search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Round, from 1.
    pub round: usize,
    /// Rounds in all.
    pub rounds: usize,
    /// Lower bounds of this round whose levels are evaluated.
    pub done: usize,
    /// Lower bounds of this round.
    pub total: usize,
}

/// A search that cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// Nothing to search on.
    #[error("no garment to tune on, expected at least one")]
    NoGarment,
    /// A list that is not one entry per vertex.
    #[error("garment {garment}: {what} has {found} entries, expected {expected}, one per vertex")]
    Length {
        /// Garment number, from 1.
        garment: usize,
        /// Which list.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// A weight that is no positive number.
    #[error("garment {garment} has the weight {found}, expected a positive, finite number")]
    Weight {
        /// Garment number, from 1.
        garment: usize,
        /// Its weight.
        found: f64,
    },
    /// A distance or displacement that is no number.
    #[error("garment {garment}: vertex {vertex} has no finite distance and displacement")]
    NotFinite {
        /// Garment number, from 1.
        garment: usize,
        /// Vertex, from 0.
        vertex: usize,
    },
    /// Even the coarsest table has more PARTs.
    #[error(
        "no table tried has {max_parts} PARTs or fewer, not even one single level; allow more PARTs or a larger extent"
    )]
    TooFewParts {
        /// The limit given.
        max_parts: usize,
    },
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// The best tables after each round, never worse than the round before.
    pub rounds: Vec<Front>,
    /// Whether every bound was tried: no table with these extents is better then.
    pub exact: bool,
}

impl Search {
    /// The final front.
    #[must_use]
    pub fn front(&self) -> &Front {
        const NONE: &Front = &Front { points: Vec::new() };
        self.rounds.last().unwrap_or(NONE)
    }
}

/// Finds the tables on the Pareto front of PARTs and representable error. The result has the same bits on any number of threads;
/// `progress` is called from any of them.
///
/// # Errors
/// [`SearchError`] where the samples do not fit together or no table is coarse enough.
pub fn search(
    samples: &[Sample<'_>],
    options: &SearchOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Search, SearchError> {
    check(samples)?;
    let mut ladder = Ladder::new(&options.widths_cm, &options.shapes);
    let mut candidates = Candidates::quantiles(samples, options);
    let exact = candidates.complete();
    let round_count = if exact { 1 } else { options.rounds.max(1) };
    let mut rounds: Vec<Front> = Vec::new();
    for round in 1..=round_count {
        let total = candidates.bins();
        let done = AtomicUsize::new(0);
        let step = || {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress { round, rounds: round_count, done, total });
        };
        let found = one_round(samples, &candidates, &ladder, options.max_parts, &step);
        let front = rounds.last().map_or_else(|| found.clone(), |before| before.union(&found));
        let Some(best) = front.best_within(options.max_parts) else {
            return Err(SearchError::TooFewParts { max_parts: options.max_parts });
        };
        candidates = candidates.around(&best.inner_bounds_cm, options.candidates_around, round);
        if round == 1 {
            ladder = Ladder::fine(&options.widths_cm, &options.shapes);
        }
        let reached = best.rms_m;
        rounds.push(front);
        let two_before = round.checked_sub(3).and_then(|i| rounds[i].best_within(options.max_parts));
        if two_before.is_some_and(|before| reached > 0.999 * before.rms_m) {
            break;
        }
    }
    Ok(Search { rounds, exact })
}

/// Lower bounds whose levels are evaluated at once: enough for any machine, few enough to hold.
const BATCH: usize = 64;

/// The front over one set of candidates.
fn one_round(
    samples: &[Sample<'_>],
    candidates: &Candidates,
    ladder: &Ladder,
    max_parts: usize,
    step: &(dyn Fn() + Sync),
) -> Front {
    let total_weight: f64 = samples.iter().map(|s| s.weight).sum();
    let bins = candidates.bins();
    let members: Vec<Vec<Vec<u32>>> = samples.iter().map(|s| candidates.members(s.distances_m)).collect();
    let row = |lower: usize| {
        let mut costs = vec![intervals::Cost::default(); (bins - lower) * ladder.len()];
        for (sample, members) in samples.iter().zip(&members) {
            let share = sample.weight / (total_weight * sample.distances_m.len() as f64);
            let found = intervals::row(sample, &members[lower..], ladder, max_parts);
            for (cost, found) in costs.iter_mut().zip(found) {
                cost.parts = cost.parts.saturating_add(found.parts);
                cost.error += share * found.error;
            }
        }
        step();
        costs
    };
    let mut program = Program::new(bins, max_parts, ladder.len());
    for from in (0..bins).step_by(BATCH) {
        let batch = from..bins.min(from + BATCH);
        let rows: Vec<_> = batch.clone().into_par_iter().with_max_len(1).map(row).collect();
        for (lower, row) in batch.zip(&rows) {
            program.take(lower, row);
        }
    }
    program.front(&candidates.inner_cm(), ladder)
}

fn check(samples: &[Sample<'_>]) -> Result<(), SearchError> {
    if samples.is_empty() {
        return Err(SearchError::NoGarment);
    }
    for (garment, s) in (1..).zip(samples) {
        let expected = s.mesh.vertex_count();
        for (what, found) in [("the distances", s.distances_m.len()), ("the displacement", s.displacement.len())] {
            if found != expected {
                return Err(SearchError::Length { garment, what, found, expected });
            }
        }
        if !(s.weight.is_finite() && s.weight > 0.0) {
            return Err(SearchError::Weight { garment, found: s.weight });
        }
        let finite = |(d, u): (&f64, &DVec3)| d.is_finite() && u.is_finite();
        if let Some(vertex) = s.distances_m.iter().zip(s.displacement).position(|pair| !finite(pair)) {
            return Err(SearchError::NotFinite { garment, vertex });
        }
    }
    Ok(())
}
