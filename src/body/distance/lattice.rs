//! Signed distances at the points of a lattice, kept with the body once they were asked for.
//!
//! Contact asks for them about every vertex that touches; a drape that goes on from another, and the figures of a drape, ask for the same
//! ones again. A value is a function of its point alone, so it is the same whoever asked first.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DVec3, IVec3};

use super::Body;

/// Side of the lattice, m.
pub(crate) const LATTICE_SIDE: f64 = 5e-3;

/// The values found so far.
#[derive(Default)]
pub(super) struct Lattice(Mutex<HashMap<IVec3, f64>>);

impl Lattice {
    fn values(&self) -> MutexGuard<'_, HashMap<IVec3, f64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Body {
    /// Signed distances (m) of these points of the lattice, in their order.
    pub(crate) fn at_lattice(&self, points: &[IVec3]) -> Vec<f64> {
        let mut missing: Vec<IVec3> = {
            let known = self.lattice.values();
            points.iter().filter(|i| !known.contains_key(i)).copied().collect()
        };
        missing.sort_unstable_by_key(IVec3::to_array);
        missing.dedup();
        let at: Vec<DVec3> = missing.iter().map(|i| i.as_dvec3() * LATTICE_SIDE).collect();
        let found = self.nearest_all(&at).into_iter().map(|near| near.signed_distance);
        let mut known = self.lattice.values();
        known.extend(missing.into_iter().zip(found));
        points.iter().map(|i| known.get(i).copied().unwrap_or_default()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::cuboid;

    #[test]
    fn values_are_distances_whoever_asked_before_and_those_of_a_dressed_body_are_its_own() {
        let body = Body::new(&cuboid(DVec3::ZERO, DVec3::splat(0.02))).unwrap();
        let points = [IVec3::new(2, 2, 6), IVec3::new(-1, 2, 2), IVec3::new(2, 2, 6), IVec3::new(2, 1, 3)];
        let exact = |body: &Body| points.map(|i| body.nearest(i.as_dvec3() * LATTICE_SIDE).signed_distance);
        assert_eq!(body.at_lattice(&points[..2]), exact(&body)[..2]);
        assert_eq!(body.clone().at_lattice(&points), exact(&body));
        let lid = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(0.01 + x, 0.01 + y, 0.024));
        let dressed = body.wearing(&TriMesh::new(lid.to_vec(), vec![[0, 1, 2]])).unwrap();
        assert_eq!(dressed.at_lattice(&points), exact(&dressed));
        assert_ne!(exact(&dressed), exact(&body));
        assert_eq!(body.at_lattice(&points), exact(&body));
    }
}
