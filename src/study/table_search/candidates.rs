//! Candidate bounds: places between two neighbouring distances, as ranks in the sorted distances of all garments.
//!
//! Only the rank of a bound matters to which vertices fall on which side, so candidates of equal rank are one. The bound itself is
//! halfway between its two neighbouring distances.

use super::{Sample, SearchOptions};
use crate::parts::range_table::METRES_PER_CM;

/// Bounds between which levels may begin and end.
#[derive(Debug, Clone)]
pub(super) struct Candidates {
    /// Distinct unsigned distances of all garments, ascending, m.
    sorted: Vec<f64>,
    /// Ranks in `sorted`, ascending, distinct, each from 1 to its length − 1.
    ranks: Vec<usize>,
    /// Whether these are all ranks there are: no other bound makes a difference then.
    pub(super) every: bool,
    /// How far apart candidates are, in ranks.
    spacing: usize,
}

impl Candidates {
    /// Evenly spaced ranks, and those of the tables to include; every rank there is of one garment where they
    /// are few enough.
    pub(super) fn quantiles(samples: &[Sample<'_>], options: &SearchOptions) -> Self {
        let mut sorted: Vec<f64> = samples.iter().flat_map(|s| s.distances_m).map(|d| d.abs()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.dedup();
        if samples.len() == 1 && sorted.len() <= options.exact_up_to {
            let ranks = (1..sorted.len()).collect();
            return Self { every: true, ..Self::of(sorted, ranks, 1) };
        }
        let count = options.candidates.max(1);
        let mut ranks: Vec<usize> = (1..=count).map(|i| i * sorted.len() / (count + 1)).collect();
        for level in options.include.iter().flat_map(crate::parts::range_table::RangeTable::effective_levels) {
            for bound_cm in [level.lower_cm, level.upper_cm] {
                ranks.push(rank(&sorted, bound_cm));
            }
        }
        let spacing = sorted.len().div_ceil(count + 1);
        Self::of(sorted, ranks, spacing)
    }

    fn of(sorted: Vec<f64>, mut ranks: Vec<usize>, spacing: usize) -> Self {
        // Distances that differ in their last bits may have no bound in centimetres between them.
        let parts = |r: usize| {
            let bound_m = bound_cm(&sorted, r) * METRES_PER_CM;
            sorted[r - 1] < bound_m && bound_m <= sorted[r]
        };
        ranks.retain(|&r| r > 0 && r < sorted.len() && parts(r));
        ranks.sort_unstable();
        ranks.dedup();
        Self { sorted, ranks, every: false, spacing }
    }

    /// The given bounds, about `count` ranks near them, near and far, and as many quantiles as a third of these, other ones each
    /// round.
    pub(super) fn around(&self, bounds_cm: &[f64], count: usize, round: usize) -> Self {
        let near = 2 * count / 3;
        let each = (near / (2 * bounds_cm.len().max(1))).max(1);
        // Distances halve from as far as the first candidates were apart to one rank; where there is no room for all, rounds
        // take turns.
        let steps: Vec<usize> = (0..).map(|i| self.spacing >> i).take_while(|&step| step > 0).collect();
        let mut ranks = Vec::new();
        for &bound_cm in bounds_cm {
            let centre = rank(&self.sorted, bound_cm);
            ranks.push(centre);
            for i in 0..each.min(steps.len()) {
                let step = steps[(i + round * each) % steps.len()];
                ranks.extend([centre.saturating_sub(step), centre + step]);
            }
        }
        let others = (count - near).max(1);
        // Multiples of the golden ratio never come back to the same place.
        let shift = (round as f64 * 0.618_033_988_749_895).fract();
        ranks.extend((0..others).map(|i| ((i as f64 + shift) * self.sorted.len() as f64 / others as f64) as usize));
        Self::of(self.sorted.clone(), ranks, self.spacing)
    }

    /// Number of smallest levels, between neighbouring candidates.
    pub(super) fn bins(&self) -> usize {
        self.ranks.len() + 1
    }

    /// How many levels that start at a smallest one, the thinnest first, are thinner than this. The last is open.
    pub(super) fn too_thin(&self, lower: usize, cm: f64) -> usize {
        let at = |bin: usize| bin.checked_sub(1).map_or(0.0, |i| bound_cm(&self.sorted, self.ranks[i]));
        (lower + 1..self.bins()).take_while(|&upper| at(upper) - at(lower) < cm).count()
    }

    /// The candidates, cm.
    pub(super) fn inner_cm(&self) -> Vec<f64> {
        self.ranks.iter().map(|&r| bound_cm(&self.sorted, r)).collect()
    }

    /// The vertices in each smallest level, ascending.
    pub(super) fn members(&self, distances_m: &[f64]) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.bins()];
        for (&d, v) in distances_m.iter().zip(0u32..) {
            // A distance of rank r, itself the r-th of `sorted`, lies above all candidates up to r.
            let rank = self.sorted.partition_point(|&s| s < d.abs());
            members[self.ranks.partition_point(|&c| c <= rank)].push(v);
        }
        members
    }
}

/// The bound of a rank, halfway between its neighbours.
fn bound_cm(sorted: &[f64], rank: usize) -> f64 {
    0.5 * (sorted[rank - 1] + sorted[rank]) / METRES_PER_CM
}

/// How many distances lie below a bound.
fn rank(sorted: &[f64], bound_cm: f64) -> usize {
    sorted.partition_point(|&s| s < bound_cm * METRES_PER_CM)
}
