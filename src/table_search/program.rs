//! The dynamic program over candidate bounds: least error for every number of PARTs.

use rayon::prelude::*;

use super::front::{Front, FrontPoint};
use super::intervals::Cost;
use super::ladder::Ladder;
use crate::range_table::Extent;

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
    /// For so many smallest levels, with so many steps of extents each.
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

    /// The Pareto front, once all rows are taken.
    pub(super) fn front(&self, inner_cm: &[f64], ladder: &Ladder) -> Front {
        let mut points = Vec::new();
        let mut least = f64::INFINITY;
        for parts in 0..=self.max_parts {
            let squared = self.error[self.bins * (self.max_parts + 1) + parts];
            if squared < least {
                least = squared;
                let (inner_bounds_cm, extents) = self.table(parts, inner_cm, ladder);
                points.push(FrontPoint { parts, rms_m: squared.max(0.0).sqrt(), inner_bounds_cm, extents });
            }
        }
        Front { points }
    }

    /// The inner bounds and extents of the best table with so many PARTs, read back from the end.
    fn table(&self, mut parts: usize, inner_cm: &[f64], ladder: &Ladder) -> (Vec<f64>, Vec<Extent>) {
        let (mut bounds, mut extents) = (Vec::new(), Vec::new());
        let mut upper = self.bins;
        while upper > 0 {
            let last = self.last[upper * (self.max_parts + 1) + parts];
            parts -= last.parts as usize;
            upper = last.lower as usize;
            if let Some(bound) = upper.checked_sub(1) {
                bounds.push(inner_cm[bound]);
            }
            if ladder.cuts() {
                extents.push(ladder.extent(last.step as usize));
            }
        }
        bounds.reverse();
        extents.reverse();
        (bounds, extents)
    }
}
