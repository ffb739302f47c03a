//! Contact places within triangles, from equilibrium to equilibrium.
//!
//! Near an equilibrium, triangles that the body passes through receive contact places; at one the places are updated
//! (`Contacts::update_face_contacts`), and the cloth descends to the next equilibrium. They are removed for good where the cloth does not
//! rest with them.

use crate::mechanics::energy::FaceUpdate;
use crate::mechanics::newton::NewtonState;

/// The phase.
#[derive(Debug, Default)]
pub(super) struct FaceContactPhase {
    /// Since which step the cloth has had to rest with its places.
    since: Option<usize>,
    /// Whether it has been at an equilibrium.
    updated: bool,
}

impl FaceContactPhase {
    /// Updates the places at an equilibrium after this many steps.
    pub(super) fn at_equilibrium(&mut self, descent: &mut NewtonState<'_, '_>, iteration: usize) -> FaceUpdate {
        let NewtonState { contacts, x, .. } = descent;
        let update = contacts.update_face_contacts(x);
        self.updated = true;
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
        if near_rest && descent.contacts.extend_face_contacts(&descent.x, !self.updated) > 0 {
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::body::distance::Body;
    use crate::mechanics::energy::Cloth;
    use crate::mesh::samples::{cuboid, sheet};

    /// A post goes through one of two triangles, between its corners, by a millimetre or by a centimetre.
    #[test]
    fn places_are_added_near_rest_where_the_cloth_is_not_deep_and_removed_after_the_most_steps() {
        let mesh = sheet(1, 1, |i, j| DVec3::new(0.1 * i, 0.1 * j, 0.0));
        let post = |top: f64| Body::new(&cuboid(DVec3::new(0.02, 0.06, -1.0), DVec3::new(0.04, 0.08, top))).unwrap();
        let of = |max_residual: f64| {
            let cloth = Cloth::sample(&mesh, "jersey", &[]);
            let mut solver = cloth.solver;
            solver.face_contact.max_residual = max_residual;
            cloth.with_solver(solver)
        };
        for (top, max_residual, adds) in [(1e-3, 0.0, false), (1e-3, 1e9, true), (1e-2, 1e9, false)] {
            let (body, cloth) = (post(top), of(max_residual));
            let contacts = cloth.contacts(&body, &mesh.positions);
            let mut descent = NewtonState::new(&cloth, contacts, mesh.positions.clone(), 1.0);
            descent.begin_self_contact();
            let free = descent.residual;
            let mut phase = FaceContactPhase::default();
            assert!(!phase.before_step(&mut descent, 0, false), "not where it may not");
            assert_eq!(phase.before_step(&mut descent, 1, true), adds, "{max_residual}");
            assert_eq!(descent.residual != free, adds, "the post pushes");
            assert_ne!(phase.at_equilibrium(&mut descent, 1), FaceUpdate::Unchanged);
            let limit = 1 + cloth.solver.face_contact.max_steps;
            assert!(!phase.before_step(&mut descent, limit, false), "{max_residual}");
            assert!(phase.before_step(&mut descent, limit + 1, false), "{max_residual}");
            assert_eq!(descent.residual, free, "nothing pushes any more");
        }
    }
}
