//! Newton steps of the whole cloth, every vertex its own unknown, and which Hessian they are taken with.
//!
//! The true Hessian ([`HessianKind::True`]) keeps compression up to the buckling stress of a triangle. It is closer to the energy and
//! may be indefinite. Then the projected Hessian replaces it for this step, and after a rejected step for the next.

use glam::{DMat3, DVec3};

use super::factor::SolveError;
use super::solver::Solver;
use crate::mechanics::energy::{Cloth, Contacts, HessianKind, HessianLayout};

/// The inputs of a Newton step.
pub(crate) struct State<'a> {
    pub(crate) cloth: &'a Cloth,
    pub(crate) x: &'a [DVec3],
    pub(crate) contacts: &'a Contacts<'a>,
    pub(crate) gradient: &'a [DVec3],
    /// ε, 1/s².
    pub(crate) damping: f64,
}

/// The Hessian of all free vertices, and its factor.
#[derive(Debug, Default)]
pub(crate) struct FullSpace {
    /// Analysed at the first step, or before: a preview takes none.
    pub(crate) solver: Option<Solver>,
    /// The layout with blocks for the gaps of the cloth with itself, once there are some.
    coupled: Option<HessianLayout>,
    blocks: Vec<DMat3>,
    damped: Vec<f64>,
    pub(super) unknowns: Vec<DVec3>,
    /// Whether the last factorisation was of the true Hessian.
    is_true: bool,
    /// Whether the next step takes the projected Hessian.
    projects: bool,
}

impl FullSpace {
    /// Solves with a Hessian of this kind; the solution is in `unknowns`.
    pub(super) fn solve(&mut self, here: &State<'_>, kind: HessianKind) -> Result<(), SolveError> {
        let State { cloth, x, contacts, gradient, damping } = *here;
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        cloth.hessian_in(layout, kind, x, contacts, &mut self.blocks);
        let solver = self.solver.get_or_insert_with(|| Solver::new(&layout.pattern));
        self.damped.clear();
        self.damped.extend(layout.order.iter().map(|&v| cloth.masses[v as usize] * damping));
        self.unknowns.clear();
        self.unknowns.extend(layout.order.iter().map(|&v| -gradient[v as usize]));
        solver.solve(&layout.pattern, &self.blocks, &self.damped, kind == HessianKind::Projected, &mut self.unknowns)
    }

    /// The layout of the Hessian.
    pub(super) fn layout<'a>(&'a self, cloth: &'a Cloth) -> &'a HessianLayout {
        self.coupled.as_ref().unwrap_or_else(|| cloth.layout())
    }

    /// The layout of the Hessian, the solver of matrices in it, and blocks to fill.
    pub(crate) fn parts<'a>(&'a mut self, cloth: &'a Cloth) -> (&'a HessianLayout, &'a mut Solver, &'a mut Vec<DMat3>) {
        let layout = self.coupled.as_ref().unwrap_or_else(|| cloth.layout());
        (layout, self.solver.get_or_insert_with(|| Solver::new(&layout.pattern)), &mut self.blocks)
    }

    /// Makes a layout with blocks for these pairs of vertices, ordered for the positions `x` (m), unless the present one has them.
    pub(crate) fn couple<P: Iterator<Item = [u32; 2]>>(&mut self, cloth: &Cloth, x: &[DVec3], pairs: impl Fn() -> P) {
        if !self.layout(cloth).has(pairs()) {
            self.coupled = Some(cloth.layout_with(x, pairs()));
            self.solver = None;
        }
    }

    /// The step of every vertex, m, zero where held, and every free vertex's own block of a positive H + ε M, N/m.
    pub(super) fn step(
        &mut self,
        here: &State<'_>,
        d: &mut Vec<DVec3>,
        own: &mut Vec<DMat3>,
    ) -> Result<(), SolveError> {
        let State { cloth, x, contacts, .. } = *here;
        if let Some(proximity) = &contacts.proximity {
            self.couple(cloth, x, || proximity.pairs());
        }
        self.is_true = !std::mem::take(&mut self.projects) && self.solve(here, HessianKind::True).is_ok();
        if !self.is_true {
            self.solve(here, HessianKind::Projected)?;
        }
        d.clear();
        d.resize(x.len(), DVec3::ZERO);
        own.clear();
        own.resize(x.len(), DMat3::ZERO);
        let layout = self.layout(cloth);
        let starts = &layout.pattern.starts;
        for (i, &v) in layout.order.iter().enumerate() {
            d[v as usize] = self.unknowns[i];
            own[v as usize] = self.blocks[starts[i] as usize] + DMat3::from_diagonal(DVec3::splat(self.damped[i]));
        }
        Ok(())
    }

    /// After a rejected step: the next one takes the projected Hessian; returns whether this one had the true one.
    pub(crate) fn fall_back(&mut self) -> bool {
        self.projects = true;
        std::mem::take(&mut self.is_true)
    }
}
