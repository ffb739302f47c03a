//! Contact places within triangles, from equilibrium to equilibrium.
//!
//! Near an equilibrium, triangles that the body passes through receive contact places; at one the places are updated (`Contacts::update_face_contacts`), and the
//! cloth descends to the next equilibrium. They are removed for good where the cloth does not rest with them.

use crate::mechanics::energy::FaceUpdate;
use crate::mechanics::newton::NewtonState;

/// The phase: since which step the cloth has had to rest with its places.
#[derive(Debug, Default)]
pub(super) struct FaceContactPhase {
    since: Option<usize>,
}

impl FaceContactPhase {
    /// Updates the places at an equilibrium after this many steps.
    pub(super) fn at_equilibrium(&mut self, descent: &mut NewtonState<'_, '_>, iteration: usize) -> FaceUpdate {
        let NewtonState { contacts, x, .. } = descent;
        let update = contacts.update_face_contacts(x);
        self.since = (update != FaceUpdate::Unchanged).then_some(iteration);
        update
    }

    /// Removes the places if the cloth does not rest with them, or adds some near rest where that is allowed; returns whether they changed.
    pub(super) fn before_step(&mut self, descent: &mut NewtonState<'_, '_>, iteration: usize, may_add: bool) -> bool {
        let options = descent.cloth.solver.face_contact;
        let mut changed = false;
        if self.since.is_some_and(|since| iteration > since + options.max_steps) {
            self.since = None;
            descent.contacts.remove_face_contacts();
            refreshed(descent);
            changed = true;
        }
        let near_rest = may_add && descent.residual < options.max_residual;
        if near_rest && descent.contacts.extend_face_contacts(&descent.x) > 0 {
            self.since.get_or_insert(iteration);
            refreshed(descent);
            changed = true;
        }
        changed
    }
}

fn refreshed(descent: &mut NewtonState<'_, '_>) {
    descent.contacts.refresh(&descent.x);
    descent.evaluate();
}
