//! The dynamic program over candidate bounds: least error for every number of PARTs, or for every total cost if PARTs have costs.

use rayon::prelude::*;

use super::intervals::Cost;

/// A level of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    /// Range of its smallest levels; `upper` is excluded.
    pub(super) lower: usize,
    pub(super) upper: usize,
    /// Index of its extent in the grid.
    pub(super) extent: usize,
}

/// The table of least error for a number of PARTs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// Number of PARTs, or their total cost.
    pub(super) parts: usize,
    /// Squared error, m².
    pub(super) squared: f64,
    /// Its levels, ascending.
    pub(super) levels: Vec<Span>,
}

/// The last level of the best table up to a bound.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    /// Its lower bound.
    lower: u32,
    /// Its number of PARTs.
    parts: u32,
    /// Index of its extent in the grid.
    extent: u32,
}

/// E(b, p) for every bound b and number of PARTs p, filled from the lowest bound upwards.
pub(super) struct Program {
    bins: usize,
    max_parts: usize,
    extents: usize,
    error: Vec<f64>,
    last: Vec<Last>,
}

/// The Pareto-optimal extents of one level with at most `max_parts` PARTs.
fn undominated(costs: &[Cost], max_parts: usize) -> Vec<(u32, Cost)> {
    let mut kept: Vec<(u32, Cost)> = (0..).zip(costs.iter().copied()).collect();
    kept.retain(|(_, cost)| cost.parts as usize <= max_parts);
    kept.sort_by(|(_, a), (_, b)| a.parts.cmp(&b.parts).then(a.error.total_cmp(&b.error)));
    let mut least = f64::INFINITY;
    kept.retain(|(_, cost)| {
        cost.error < least && {
            least = cost.error;
            true
        }
    });
    kept
}

/// Smallest number of upper bounds for a separate task. Heuristic.
const MIN_TASK: usize = 64;

impl Program {
    /// An empty program over `bins` smallest levels with `extents` choices of an extent each.
    pub(super) fn new(bins: usize, max_parts: usize, extents: usize) -> Self {
        let width = max_parts + 1;
        let mut error = vec![f64::INFINITY; (bins + 1) * width];
        error[0] = 0.0;
        Self { bins, max_parts, extents, error, last: vec![Last::default(); (bins + 1) * width] }
    }

    /// Adds the levels that start at `lower`: their costs by upper bound and, within, by extent. Call it once for each lower bound,
    /// in ascending order.
    pub(super) fn add(&mut self, lower: usize, row: &[Cost]) {
        let (width, max_parts) = (self.max_parts + 1, self.max_parts);
        let (before, after) = self.error.split_at_mut((lower + 1) * width);
        let prefix = &before[lower * width..];
        let Some(fewest) = prefix.iter().position(|e| e.is_finite()) else { return };
        let last = &mut self.last[(lower + 1) * width..];
        let uppers = after.par_chunks_mut(width).zip(last.par_chunks_mut(width)).zip(row.par_chunks(self.extents));
        uppers.with_min_len(MIN_TASK).for_each(|((error, last), costs)| {
            for (extent, cost) in undominated(costs, max_parts) {
                let parts = cost.parts as usize;
                let level = Last { lower: lower as u32, parts: cost.parts, extent };
                let from = (fewest + parts).min(width);
                let reach = error[from..].iter_mut().zip(&mut last[from..]).zip(&prefix[fewest..]);
                for ((best, last), &prefix) in reach {
                    // Strictly less: of equal errors the lowest bound stays, which gives the table with fewer levels.
                    if prefix + cost.error < *best {
                        *best = prefix + cost.error;
                        *last = level;
                    }
                }
            }
        });
    }

    /// The Pareto front once all rows are added, by ascending number of PARTs.
    pub(super) fn paths(&self) -> Vec<Path> {
        let mut paths = Vec::new();
        let mut least = f64::INFINITY;
        for parts in 0..=self.max_parts {
            let squared = self.error[self.bins * (self.max_parts + 1) + parts];
            if squared < least {
                least = squared;
                paths.push(Path { parts, squared, levels: self.levels(parts) });
            }
        }
        paths
    }

    /// The levels of the best table with `parts` PARTs, traced back from the last level.
    fn levels(&self, mut parts: usize) -> Vec<Span> {
        let mut levels = Vec::new();
        let mut upper = self.bins;
        while upper > 0 {
            let last = self.last[upper * (self.max_parts + 1) + parts];
            let lower = last.lower as usize;
            levels.push(Span { lower, upper, extent: last.extent as usize });
            parts -= last.parts as usize;
            upper = lower;
        }
        levels.reverse();
        levels
    }
}
