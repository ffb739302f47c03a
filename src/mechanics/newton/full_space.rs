//! Newton steps of the whole cloth, every vertex its own unknown, and which Hessian they are taken with.
//!
//! The bearing Hessian ([`Cloth::hessian_bearing`](crate::mechanics::energy::Cloth::hessian_bearing)) keeps the compression that
//! a triangle's bending holds, and is closer to the energy; it is not always positive. Where it is not, the positive one takes
//! over for a few steps, more each time.

use glam::{DMat3, DVec3};

use super::{SolveError, Solver, State, Tangent};
use crate::mechanics::energy::HessianLayout;

/// Steps with the positive Hessian, at most, after one whose bearing Hessian failed.
const LONGEST_PAUSE: usize = 4;

/// The Hessian of all free vertices, and its factor.
#[derive(Debug, Default)]
pub(crate) struct Whole {
    /// Analysed with the first step, if not before: a preview takes none.
    pub(crate) solver: Option<Solver>,
    /// Where the blocks are once gaps of the cloth with itself couple vertices that are no neighbours.
    pub(super) coupled: Option<HessianLayout>,
    pub(super) blocks: Vec<DMat3>,
    damped: Vec<f64>,
    pub(super) unknowns: Vec<DVec3>,
    /// Whether the last factorisation was of the bearing Hessian.
    pub(super) bearing: bool,
    /// Steps yet to be taken with the positive Hessian.
    waiting: usize,
    /// How many those were the last time.
    pause: usize,
}

impl Whole {
    /// Solves with the `bearing` or the positive Hessian; the solution is in `unknowns`.
    pub(super) fn solve(&mut self, here: &State<'_>, bearing: bool) -> Result<(), SolveError> {
        let State { cloth, x, contacts, gradient, damping } = *here;
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        cloth.hessian_in(layout, bearing, x, contacts, &mut self.blocks);
        let solver = self.solver.get_or_insert_with(|| Solver::new(&layout.pattern));
        self.damped.clear();
        self.damped.extend(layout.order.iter().map(|&v| cloth.masses[v as usize] * damping));
        self.unknowns.clear();
        self.unknowns.extend(layout.order.iter().map(|&v| -gradient[v as usize]));
        solver.solve(&layout.pattern, &self.blocks, &self.damped, !bearing, &mut self.unknowns)
    }

    /// Makes a place for every pair of vertices that a gap couples, if there is none yet.
    pub(super) fn couple(&mut self, here: &State<'_>) {
        let State { cloth, x, contacts, .. } = *here;
        let Some(proximity) = &contacts.proximity else { return };
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        if !layout.has(proximity.pairs()) {
            self.coupled = Some(cloth.layout_with(x, proximity.pairs()));
            self.solver = None;
        }
    }
}

impl Tangent for Whole {
    fn step(&mut self, here: &State<'_>, d: &mut Vec<DVec3>, own: &mut Vec<DMat3>) -> Result<(), SolveError> {
        let State { cloth, x, .. } = *here;
        self.couple(here);
        let mut solved = false;
        if self.waiting == 0 {
            solved = self.solve(here, true).is_ok();
            self.pause = if solved { 0 } else { (2 * self.pause).clamp(1, LONGEST_PAUSE) };
            self.waiting = self.pause;
        }
        self.bearing = solved;
        if !solved {
            self.waiting -= 1;
            self.solve(here, false)?;
        }
        d.clear();
        d.resize(x.len(), DVec3::ZERO);
        own.clear();
        own.resize(x.len(), DMat3::ZERO);
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        let starts = &layout.pattern.starts;
        for (i, &v) in layout.order.iter().enumerate() {
            d[v as usize] = self.unknowns[i];
            own[v as usize] = self.blocks[starts[i] as usize] + DMat3::from_diagonal(DVec3::splat(self.damped[i]));
        }
        Ok(())
    }

    fn pause(&mut self) -> bool {
        self.waiting = LONGEST_PAUSE;
        std::mem::take(&mut self.bearing)
    }
}
