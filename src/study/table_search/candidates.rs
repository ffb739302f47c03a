//! Candidate bounds of levels, as ranks in the sorted distances of all garments.
//!
//! The rank of a bound alone decides which vertices lie below it, so bounds of equal rank are one candidate. The bound itself is
//! halfway between its two neighbouring distances.

use super::options::SearchOptions;
use super::sample::Sample;
use crate::parts::range_table::METRES_PER_CM;

/// Bounds between which levels may begin and end.
#[derive(Debug, Clone)]
pub(super) struct Candidates {
    /// Distinct unsigned distances of all garments, ascending, m.
    sorted: Vec<f64>,
    /// Ranks in `sorted`, ascending, distinct, each from 1 to its length − 1.
    ranks: Vec<usize>,
    /// Whether `ranks` holds all ranks; no other bound changes a table then.
    pub(super) every: bool,
    /// Spacing of the first candidates, in ranks.
    spacing: usize,
}

impl Candidates {
    /// Evenly spaced ranks and those of the tables to include; for a single garment with at most `exact_up_to` distances, every
    /// rank.
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
        // Between distances that differ in their last bits, rounding to centimetres may leave no bound.
        let parts = |r: usize| {
            let bound_m = bound_cm(&sorted, r) * METRES_PER_CM;
            sorted[r - 1] < bound_m && bound_m <= sorted[r]
        };
        ranks.retain(|&r| r > 0 && r < sorted.len() && parts(r));
        ranks.sort_unstable();
        ranks.dedup();
        Self { sorted, ranks, every: false, spacing }
    }

    /// The given bounds and `count` more ranks: two thirds around the bounds, one third quantiles, which differ from round to
    /// round.
    pub(super) fn around(&self, bounds_cm: &[f64], count: usize, round: usize) -> Self {
        let near = 2 * count / 3;
        let each = (near / (2 * bounds_cm.len().max(1))).max(1);
        // Offsets from a bound halve from the spacing of the first candidates to one rank. If `count` does not allow them all,
        // rounds take turns.
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
        // Multiples of the golden ratio modulo 1 do not repeat.
        let shift = (round as f64 * 0.618_033_988_749_895).fract();
        ranks.extend((0..others).map(|i| ((i as f64 + shift) * self.sorted.len() as f64 / others as f64) as usize));
        Self::of(self.sorted.clone(), ranks, self.spacing)
    }

    /// Number of smallest levels: those between neighbouring candidates.
    pub(super) fn bins(&self) -> usize {
        self.ranks.len() + 1
    }

    /// Number of levels from `lower` on that are thinner than `cm`. The last level is unbounded and not thin.
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
            // A distance of rank r lies above all candidates up to r.
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

/// Number of distances below a bound.
fn rank(sorted: &[f64], bound_cm: f64) -> usize {
    sorted.partition_point(|&s| s < bound_cm * METRES_PER_CM)
}
