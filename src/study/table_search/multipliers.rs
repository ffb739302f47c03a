//! Search over several garments, each with its own limit of PARTs, by Lagrange multipliers.
//!
//! One limit per garment makes a dynamic program with one count per garment, which is too large to solve exactly. The Lagrangian
//! relaxation has a single count: a PART of garment g costs c_g, and the total cost is limited,
//!
//! ```text
//! minimise E  subject to  Σ_g c_g n_g ≤ Σ_g c_g N_g,    c_g ∝ λ_g / N_g
//! ```
//!
//! Every table within all limits is within this one. Where the best one found so breaks a limit, that garment's λ rises and the
//! others' fall, λ_g ← λ_g n_g/N_g, and the program, which is cheap beside the costs of levels, runs again.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | n_g, N_g | PARTs of garment g and the most it may have | – |
//! | λ_g | multiplier, Σ λ_g = 1 | – |
//! | c_g | what a PART costs, a whole number, so that the program stays one over whole numbers | – |
//! | E | weighted mean square of the representable error | m² |
//!
//! Source: Everett 1963, "Generalized Lagrange multiplier method for solving problems of optimum allocation of resources",
//! Operations Research 11(3). Limits: a relaxation, so tables that no choice of charges puts first are not found.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::candidates::Candidates;
use super::extent_grid::Ladder;
use super::front::{Front, FrontPoint};
use super::intervals::{Cost, Intervals};
use super::program::{Path, Program};
use super::{Sample, SearchOptions, forbid, shares};

/// Approximate total cost of all limits. With Table 3's counts the costs of PARTs lie between 1 and some tens; a larger budget resolves
/// the multipliers more finely and makes the program larger.
const BUDGET: f64 = 2000.0;

/// Largest number of programs a round. Multipliers carry over between rounds and usually converge within two or three programs.
const PROGRAMS: usize = 6;

/// The multipliers, one a garment.
#[derive(Debug, Clone)]
pub(super) struct Charges {
    multipliers: Vec<f64>,
}

impl Charges {
    /// Every garment's limit costs the same.
    pub(super) fn even(garments: usize) -> Self {
        Self { multipliers: vec![1.0 / garments as f64; garments] }
    }

    /// Cost of a PART of each garment.
    fn of(&self, samples: &[Sample<'_>]) -> Vec<u32> {
        let charge = |(m, s): (&f64, &Sample<'_>)| (m * BUDGET / s.max_parts.max(1) as f64).round().max(1.0) as u32;
        self.multipliers.iter().zip(samples).map(charge).collect()
    }

    /// Raises those of garments over their limits beside those under.
    fn adjust(&mut self, samples: &[Sample<'_>], parts: &[usize]) {
        for ((multiplier, sample), &parts) in self.multipliers.iter_mut().zip(samples).zip(parts) {
            // No multiplier is lost for good, nor grows beyond all others at a stroke.
            let used = parts as f64 / sample.max_parts.max(1) as f64;
            *multiplier *= used.clamp(0.25, 4.0);
        }
        let total: f64 = self.multipliers.iter().sum();
        self.multipliers.iter_mut().for_each(|m| *m = (*m / total).max(1e-3));
    }
}

/// The front over one set of candidates, and the best table within all limits; none where `step` breaks off.
pub(super) fn round(
    samples: &[Sample<'_>],
    candidates: &Candidates,
    ladder: &Ladder,
    options: &SearchOptions,
    charges: &mut Charges,
    step: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Option<Front> {
    let bins = candidates.bins();
    let members: Vec<Vec<Vec<u32>>> = samples.iter().map(|s| candidates.members(s.distances_m)).collect();
    let intervals: Vec<Intervals<'_>> = samples.iter().map(|s| Intervals::new(s, ladder, options.motion)).collect();
    let of_garments = |lower: usize| -> Option<Vec<Vec<Cost>>> {
        let mut rows: Vec<_> = intervals.iter().zip(&members).map(|(i, members)| i.row(&members[lower..])).collect();
        let too_thin = candidates.too_thin(lower, options.thinnest_cm);
        rows.iter_mut().for_each(|row| forbid(row, too_thin, ladder, options));
        step().is_continue().then_some(rows)
    };
    let rows: Vec<Vec<Vec<Cost>>> =
        (0..bins).into_par_iter().with_max_len(1).map(of_garments).collect::<Option<_>>()?;
    let inner_cm = candidates.inner_cm();
    let mut front = Front::default();
    let mut before = Vec::new();
    for _ in 0..PROGRAMS {
        let now = charges.of(samples);
        if now == before {
            break;
        }
        let budget = now.iter().zip(samples).map(|(&c, s)| c as usize * s.max_parts).sum();
        let mut program = Program::new(bins, budget, ladder.len());
        for (lower, rows) in rows.iter().enumerate() {
            program.take(lower, &together(samples, &now, rows));
        }
        let mut found = Front::default();
        let mut last = None;
        for path in program.paths() {
            let parts = parts(&rows, &path, ladder.len());
            let point = FrontPoint::on(&path, parts.iter().sum(), &inner_cm, ladder);
            if parts.iter().zip(samples).all(|(&parts, s)| parts <= s.max_parts) {
                // Error falls along the paths.
                found.best = Some(point.clone());
            }
            found.points.push(point);
            last = Some(parts);
        }
        front = front.union(&found);
        let Some(last) = last else { break };
        charges.adjust(samples, &last);
        before = now;
    }
    Some(front)
}

/// The costs of levels over all garments, PARTs charged; a level over any garment's limit costs more than any budget.
fn together(samples: &[Sample<'_>], charges: &[u32], rows: &[Vec<Cost>]) -> Vec<Cost> {
    let mut all = vec![Cost::default(); rows.first().map_or(0, Vec::len)];
    for (((sample, share), charge), row) in samples.iter().zip(shares(samples)).zip(charges).zip(rows) {
        for (cost, own) in all.iter_mut().zip(row) {
            let charged =
                if own.parts as usize > sample.max_parts { u32::MAX } else { own.parts.saturating_mul(*charge) };
            cost.parts = cost.parts.saturating_add(charged);
            cost.error += share * own.error;
        }
    }
    all
}

/// The PARTs of each garment along a path.
fn parts(rows: &[Vec<Vec<Cost>>], path: &Path, steps: usize) -> Vec<usize> {
    let mut parts = vec![0; rows.first().map_or(0, Vec::len)];
    for level in &path.levels {
        let place = (level.upper - level.lower - 1) * steps + level.step;
        for (parts, row) in parts.iter_mut().zip(&rows[level.lower]) {
            *parts += row[place].parts as usize;
        }
    }
    parts
}
