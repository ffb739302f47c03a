//! Checks of equilibria, until one lasts.

use crate::mechanics::newton::{FullSpace, NewtonState, RestCheck, SolveError, check_rest};

/// Result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Every criterion of rest passes.
    Rests,
    /// A criterion fails, and the solve goes on; `escaped` where the equilibrium was unstable and the cloth has left it.
    GoesOn { escaped: bool },
    /// As many checks as are allowed have failed, the last one by this criterion.
    Unsettled(&'static str),
}

/// The checks so far.
#[derive(Debug, Default)]
pub(super) struct RestPhase {
    checks: usize,
    /// The criterion that failed at the last check; empty before it.
    failed: &'static str,
}

impl RestPhase {
    /// Checks the equilibrium that `descent` has reached with the steps of `tangent`.
    pub(super) fn check(
        &mut self,
        descent: &mut NewtonState<'_, '_>,
        tangent: &mut FullSpace,
    ) -> Result<Verdict, SolveError> {
        if self.checks == descent.cloth.solver.rest_check.max_checks {
            return Ok(Verdict::Unsettled(self.failed));
        }
        self.checks += 1;
        Ok(match check_rest(descent, tangent, self.checks > 1)? {
            RestCheck::Rests => Verdict::Rests,
            RestCheck::Fails(criterion) => {
                self.failed = criterion.name;
                descent.contacts.lower_offsets(&descent.x);
                Verdict::GoesOn { escaped: false }
            }
            RestCheck::Escaped => {
                self.failed = "lowest curvature";
                Verdict::GoesOn { escaped: true }
            }
        })
    }

    /// Whether no check was made yet.
    pub(super) fn is_first(&self) -> bool {
        self.checks == 0
    }
}
