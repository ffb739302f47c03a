//! The dynamic program over candidate bounds: least error for every number of PARTs, or for all they may cost where they are
//! charged.

use rayon::prelude::*;

use super::intervals::Cost;

/// A level of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    /// Its smallest levels, from the first to the one after its last.
    pub(super) lower: usize,
    pub(super) upper: usize,
    /// Its step of the ladder.
    pub(super) step: usize,
}

/// The best table at some number of PARTs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// PARTs, or what they cost.
    pub(super) parts: usize,
    /// Squared error, m².
    pub(super) squared: f64,
    /// Its levels, ascending.
    pub(super) levels: Vec<Span>,
}

/// How the best table up to a bound ends.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    /// Lower bound of its last level.
    lower: u32,
    /// PARTs of that level.
    parts: u32,
    /// Its step of the ladder.
    step: u32,
}

/// E(b, p) for every bound b and number of PARTs p, filled from the lowest bound upwards.
pub(super) struct Program {
    bins: usize,
    max_parts: usize,
    steps: usize,
    error: Vec<f64>,
    last: Vec<Last>,
}

/// The steps of one level with no more PARTs than allowed, without those that another beats in both PARTs and error.
fn worthwhile(steps: &[Cost], max_parts: usize) -> Vec<(u32, Cost)> {
    let mut kept: Vec<(u32, Cost)> = (0..).zip(steps.iter().copied()).collect();
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

/// Bounds worth a task of their own.
const GRAIN: usize = 64;

impl Program {
    /// An empty program over `bins` smallest levels with `steps` extents each.
    pub(super) fn new(bins: usize, max_parts: usize, steps: usize) -> Self {
        let width = max_parts + 1;
        let mut error = vec![f64::INFINITY; (bins + 1) * width];
        error[0] = 0.0;
        Self { bins, max_parts, steps, error, last: vec![Last::default(); (bins + 1) * width] }
    }

    /// Takes the levels that start at `lower`: their costs to each upper bound, all steps of one after the other. Rows come in
    /// ascending order, each once.
    pub(super) fn take(&mut self, lower: usize, row: &[Cost]) {
        let (width, max_parts) = (self.max_parts + 1, self.max_parts);
        let (before, after) = self.error.split_at_mut((lower + 1) * width);
        let below = &before[lower * width..];
        let Some(fewest) = below.iter().position(|e| e.is_finite()) else { return };
        let last = &mut self.last[(lower + 1) * width..];
        let uppers = after.par_chunks_mut(width).zip(last.par_chunks_mut(width)).zip(row.par_chunks(self.steps));
        uppers.with_min_len(GRAIN).for_each(|((error, last), steps)| {
            for (step, cost) in worthwhile(steps, max_parts) {
                let parts = cost.parts as usize;
                let level = Last { lower: lower as u32, parts: cost.parts, step };
                let from = (fewest + parts).min(width);
                let reach = error[from..].iter_mut().zip(&mut last[from..]).zip(&below[fewest..]);
                for ((best, last), &below) in reach {
                    // Strictly less: of equals the lowest bound stays, which is the table with fewer levels.
                    if below + cost.error < *best {
                        *best = below + cost.error;
                        *last = level;
                    }
                }
            }
        });
    }

    /// The Pareto front, once all rows are taken: ascending PARTs, falling error.
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
            levels.push(Span { lower, upper, step: last.step as usize });
            parts -= last.parts as usize;
            upper = lower;
        }
        levels.reverse();
        levels
    }
}
