//! Search over several garments, each with its own limit of PARTs, by Lagrange multipliers.
//!
//! With one limit per garment, an exact dynamic program needs one count per garment, which is too large. The Lagrangian
//! relaxation has a single count: a PART of garment g costs c_g, and the total cost is limited,
//!
//! ```text
//! minimise E  subject to  Σ_g c_g n_g ≤ Σ_g c_g N_g,    c_g ∝ λ_g / N_g
//! ```
//!
//! Every table within all limits satisfies this one. If the best table exceeds a limit, that garment's λ rises relative to the
//! others, λ_g ← λ_g n_g/N_g, and the program runs again; it is cheap beside the evaluation of the levels.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | n_g, N_g | PARTs of garment g and their limit | – |
//! | λ_g | multiplier, Σ λ_g = 1 | – |
//! | c_g | cost of a PART, a whole number, because the program counts in whole numbers | – |
//! | E | weighted mean square of the representable error | m² |
//!
//! Source: Everett 1963, "Generalized Lagrange multiplier method for solving problems of optimum allocation of resources",
//! Operations Research 11(3). Limits: the relaxation does not find tables that are optimal for no λ.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::candidates::Candidates;
use super::extent_grid::ExtentGrid;
use super::front::{Front, FrontPoint};
use super::intervals::{Cost, Intervals, forbid};
use super::options::SearchOptions;
use super::program::{Path, Program};
use super::sample::{Sample, vertex_weights};

/// Approximate total cost of all limits. With Table 3's counts the costs of PARTs lie between 1 and some tens; a larger budget resolves
/// the multipliers more finely and makes the program larger.
const BUDGET: f64 = 2000.0;

/// Largest number of programs in a round. Multipliers carry over between rounds and usually converge within two or three programs.
const PROGRAMS: usize = 6;

/// The multipliers λ, one per garment.
#[derive(Debug, Clone)]
pub(super) struct Multipliers(Vec<f64>);

impl Multipliers {
    /// Equal multipliers.
    pub(super) fn equal(garments: usize) -> Self {
        Self(vec![1.0 / garments as f64; garments])
    }

    /// Cost of a PART of each garment, c_g.
    fn part_costs(&self, samples: &[Sample<'_>]) -> Vec<u32> {
        let cost = |(m, s): (&f64, &Sample<'_>)| (m * BUDGET / s.max_parts.max(1) as f64).round().max(1.0) as u32;
        self.0.iter().zip(samples).map(cost).collect()
    }

    /// Multiplies each λ by the share of its limit that is used, and normalises.
    fn adjust(&mut self, samples: &[Sample<'_>], parts: &[usize]) {
        for ((multiplier, sample), &parts) in self.0.iter_mut().zip(samples).zip(parts) {
            // The clamp keeps one program from removing a multiplier or letting it dominate all others.
            let used = parts as f64 / sample.max_parts.max(1) as f64;
            *multiplier *= used.clamp(0.25, 4.0);
        }
        let total: f64 = self.0.iter().sum();
        self.0.iter_mut().for_each(|m| *m = (*m / total).max(1e-3));
    }
}

/// The front over one set of candidates, and the best table within all limits; `None` if `step` breaks.
pub(super) fn round(
    samples: &[Sample<'_>],
    candidates: &Candidates,
    extents: &ExtentGrid,
    options: &SearchOptions,
    multipliers: &mut Multipliers,
    step: &(dyn Fn() -> ControlFlow<()> + Sync),
) -> Option<Front> {
    let bins = candidates.bins();
    let members: Vec<Vec<Vec<u32>>> = samples.iter().map(|s| candidates.members(s.distances_m)).collect();
    let intervals: Vec<Intervals<'_>> = samples.iter().map(|s| Intervals::new(s, extents, options.motion)).collect();
    let of_garments = |lower: usize| -> Option<Vec<Vec<Cost>>> {
        let mut rows: Vec<_> = intervals.iter().zip(&members).map(|(i, members)| i.row(&members[lower..])).collect();
        let too_thin = candidates.too_thin(lower, options.thinnest_cm);
        rows.iter_mut().for_each(|row| forbid(row, too_thin, extents, options));
        step().is_continue().then_some(rows)
    };
    let rows: Vec<Vec<Vec<Cost>>> =
        (0..bins).into_par_iter().with_max_len(1).map(of_garments).collect::<Option<_>>()?;
    let inner_cm = candidates.inner_cm();
    let mut front = Front::default();
    let mut before = Vec::new();
    for _ in 0..PROGRAMS {
        let part_costs = multipliers.part_costs(samples);
        if part_costs == before {
            break;
        }
        let budget = part_costs.iter().zip(samples).map(|(&c, s)| c as usize * s.max_parts).sum();
        let mut program = Program::new(bins, budget, extents.len());
        for (lower, rows) in rows.iter().enumerate() {
            program.add(lower, &total_costs(samples, &part_costs, rows));
        }
        let mut found = Front::default();
        let mut last = None;
        for path in program.paths() {
            let parts = parts(&rows, &path, extents.len());
            let point = FrontPoint::on(&path, parts.iter().sum(), &inner_cm, extents);
            if parts.iter().zip(samples).all(|(&parts, s)| parts <= s.max_parts) {
                // Error falls along the paths.
                found.best = Some(point.clone());
            }
            found.points.push(point);
            last = Some(parts);
        }
        front = front.union(&found);
        let Some(last) = last else { break };
        multipliers.adjust(samples, &last);
        before = part_costs;
    }
    Some(front)
}

/// The costs of levels over all garments. A level with more PARTs than a garment's limit costs more than any budget.
fn total_costs(samples: &[Sample<'_>], part_costs: &[u32], rows: &[Vec<Cost>]) -> Vec<Cost> {
    let mut all = vec![Cost::default(); rows.first().map_or(0, Vec::len)];
    for (((sample, weight), part_cost), row) in samples.iter().zip(vertex_weights(samples)).zip(part_costs).zip(rows) {
        for (cost, own) in all.iter_mut().zip(row) {
            let cost_of_parts =
                if own.parts as usize > sample.max_parts { u32::MAX } else { own.parts.saturating_mul(*part_cost) };
            cost.parts = cost.parts.saturating_add(cost_of_parts);
            cost.error += weight * own.error;
        }
    }
    all
}

/// The PARTs of each garment along a path.
fn parts(rows: &[Vec<Vec<Cost>>], path: &Path, extents: usize) -> Vec<usize> {
    let mut parts = vec![0; rows.first().map_or(0, Vec::len)];
    for level in &path.levels {
        let place = (level.upper - level.lower - 1) * extents + level.extent;
        for (parts, row) in parts.iter_mut().zip(&rows[level.lower]) {
            *parts += row[place].parts as usize;
        }
    }
    parts
}
