//! A start that crosses itself, untangled before the first step: what crosses is asked apart, and the cloth relaxed in between.
//!
//! How: [`proximity`](super::super::energy::proximity), which also knows where else to start from. No factorisation is needed.

use super::NewtonState;

impl NewtonState<'_, '_> {
    /// Relaxes the start, what crosses asked apart, as often as it takes or `rounds` at most; once more from how the cloth was placed where
    /// much more is left than crosses there.
    pub(crate) fn untangle_or_go_back(&mut self, rounds: usize, iterations: usize) {
        self.untangle(rounds, iterations);
        let Self { contacts, x, .. } = self;
        if let Some(there) = contacts.proximity.as_mut().and_then(|itself| itself.clearer(x)) {
            *x = there;
            contacts.update(x);
            contacts.refresh(x);
            self.evaluate();
            self.untangle(rounds, iterations);
        }
    }

    /// Relaxes the start, what crosses asked apart, as often as it takes or `rounds` at most.
    pub(crate) fn untangle(&mut self, rounds: usize, iterations: usize) {
        for _ in 0..rounds {
            if self.contacts.proximity.as_mut().is_none_or(|itself| itself.crossings(&self.x) == 0) {
                return;
            }
            self.relax(iterations, || ());
        }
    }
}
