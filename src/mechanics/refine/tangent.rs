//! The Newton step (H + ε M) d = −∇E, and which Hessian H it is taken with.
//!
//! The bearing Hessian ([`Cloth::hessian_bearing`]) keeps the compression that a triangle's bending holds, and is closer to the
//! energy; it is not always positive. Where it is not, the positive one ([`Cloth::hessian`]) takes over for a few steps, more
//! each time.

use glam::{DMat3, DVec3};

use super::{SolveError, Solver};
use crate::mechanics::energy::{Cloth, Contacts};

/// Steps with the positive Hessian, at most, after one whose bearing Hessian failed.
const LONGEST_PAUSE: usize = 4;

/// Which Hessian is taken, and its blocks.
#[derive(Debug, Default)]
pub(super) struct Tangent {
    pub(super) blocks: Vec<DMat3>,
    /// Whether the last factorisation was of the bearing Hessian.
    bearing: bool,
    /// Steps yet to be taken with the positive Hessian.
    waiting: usize,
    /// How many those were the last time.
    pause: usize,
}

/// Where a step is taken from.
pub(super) struct State<'a> {
    pub(super) cloth: &'a Cloth,
    pub(super) x: &'a [DVec3],
    pub(super) contacts: &'a Contacts<'a>,
    pub(super) gradient: &'a [DVec3],
}

impl Tangent {
    /// The step d, by the bearing Hessian, or where that is not positive, by the positive one, for a few steps more each time.
    pub(super) fn direction(
        &mut self,
        here: &State<'_>,
        solver: &mut Solver,
        diagonal: &[f64],
        d: &mut Vec<DVec3>,
    ) -> Result<(), SolveError> {
        let State { cloth, x, contacts, gradient } = *here;
        let mut solve = |blocks: &[DMat3], positive: bool| {
            d.clear();
            d.extend(cloth.order.iter().map(|&v| -gradient[v as usize]));
            solver.solve(&cloth.pattern, blocks, diagonal, positive, d)
        };
        if self.waiting == 0 {
            cloth.hessian_bearing(x, contacts, &mut self.blocks);
            self.bearing = solve(&self.blocks, false).is_ok();
            if self.bearing {
                self.pause = 0;
                return Ok(());
            }
            self.pause = (2 * self.pause).clamp(1, LONGEST_PAUSE);
            self.waiting = self.pause;
        }
        self.waiting -= 1;
        self.bearing = false;
        cloth.hessian(x, contacts, &mut self.blocks);
        solve(&self.blocks, true)
    }

    /// After a step that led nowhere: whether the positive Hessian is left to try.
    pub(super) fn pause(&mut self) -> bool {
        self.waiting = LONGEST_PAUSE;
        std::mem::take(&mut self.bearing)
    }
}
