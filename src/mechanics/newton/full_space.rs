//! Newton steps of the whole cloth, every vertex its own unknown.
//!
//! The Hessian of a step keeps compression up to the buckling stress of a triangle ([`HessianKind::UpToBuckling`]). It is closer to the energy than
//! the projected one and may be indefinite. A step solves with it inexactly, by conjugate gradients that the factor of the projected Hessian
//! preconditions ([`Solver`]); after a rejected step the next one solves with the projected Hessian.

use glam::{DMat3, DVec3};

use super::factor::SolveError;
use super::solver::Solver;
use crate::mechanics::energy::{Cloth, Contacts, HessianKind, HessianLayout};

/// Largest residual of a step, relative to the gradient: the next step reduces what is left (inexact Newton method; Dembo, Eisenstat, Steihaug 1982).
const STEP_TOLERANCE: f64 = 0.1;

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
    /// Whether the next step takes the projected Hessian.
    projects: bool,
}

impl FullSpace {
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

    /// The step of every vertex, m, zero where held, and every free vertex's own block of the projected H + ε M, N/m.
    pub(super) fn step(
        &mut self,
        here: &State<'_>,
        d: &mut Vec<DVec3>,
        own: &mut Vec<DMat3>,
    ) -> Result<(), SolveError> {
        let State { cloth, x, contacts, gradient, damping } = *here;
        if let Some(proximity) = &contacts.proximity {
            self.couple(cloth, x, || proximity.pairs());
        }
        let Self { solver, coupled, blocks, projects } = self;
        let layout = coupled.as_ref().unwrap_or_else(|| cloth.layout());
        let solver = solver.get_or_insert_with(|| Solver::new(&layout.pattern));
        let damped: Vec<f64> = layout.order.iter().map(|&v| cloth.masses[v as usize] * damping).collect();
        cloth.hessian_in(layout, HessianKind::Projected, x, contacts, blocks);
        solver.factorise(blocks, &damped)?;
        own.clear();
        own.resize(x.len(), DMat3::ZERO);
        for ((&v, &start), shift) in layout.order.iter().zip(&layout.pattern.starts).zip(&damped) {
            own[v as usize] = blocks[start as usize] + DMat3::from_diagonal(DVec3::splat(*shift));
        }
        if !std::mem::take(projects) {
            cloth.hessian_in(layout, HessianKind::UpToBuckling, x, contacts, blocks);
        }
        let mut unknowns: Vec<DVec3> = layout.order.iter().map(|&v| -gradient[v as usize]).collect();
        solver.solve(&layout.pattern, blocks, &damped, STEP_TOLERANCE, &mut unknowns);
        *d = layout.scatter(&unknowns, x.len());
        Ok(())
    }

    /// After a rejected step: the next one takes the projected Hessian.
    pub(crate) fn project_next(&mut self) {
        self.projects = true;
    }
}
