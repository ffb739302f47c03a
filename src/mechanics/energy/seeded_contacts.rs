//! Contacts that know distances from elsewhere: who cannot have come near the body since need not be asked where he is.
//!
//! The signed distance q has slope at most one: q(x) ≥ q(x₀) − |x − x₀|, wherever q(x₀) is from. Stage one asks for every vertex as
//! placed; most are still far after a drape, and a query costs as much as ten triangles' energies.

use glam::DVec3;

use super::contact::Obstacle;
use super::field::SIDE;
use super::{Cloth, Contacts};
use crate::body::distance::Body;

impl Cloth {
    /// Contacts with a body at `x`, [by planes](Contacts::by_planes) or not, where the signed distances (m) of the vertices at `at` are
    /// known already; none where they are not.
    #[must_use]
    pub(crate) fn contacts_knowing<'b>(
        &self,
        body: &'b Body,
        x: &[DVec3],
        planes: bool,
        at: &[DVec3],
        distance_m: impl Iterator<Item = f64>,
    ) -> Contacts<'b> {
        let untouched = self.untouched(body);
        let untouched = if planes { untouched.by_planes() } else { untouched };
        self.found(untouched.knowing(at, distance_m), x)
    }
}

impl Contacts<'_> {
    fn knowing(mut self, at: &[DVec3], distance_m: impl Iterator<Item = f64>) -> Self {
        // The rounded distance is less by no more than the lattice's side.
        let less = if matches!(self.met, Obstacle::Rounded(_)) { SIDE } else { 0.0 };
        for (v, (x, distance)) in at.iter().zip(distance_m).enumerate() {
            if self.held.get(v) == Some(&false) {
                self.keep(v, *x, distance - less);
            }
        }
        self
    }

    /// Whether vertex v at `x` is known to be farther than `distance_m` from the body, without asking.
    pub(crate) fn is_clear(&self, v: usize, x: DVec3, distance_m: f64) -> bool {
        self.answer[v] - x.distance(self.asked_at[v]) > distance_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::cuboid;

    #[test]
    fn what_is_known_changes_nothing_that_is_found() {
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let placed = vec![at(0.0, 0.0, 0.001), at(0.1, 0.0, 0.05), at(0.1, 0.1, 0.2), at(0.0, 0.1, 0.0005)];
        let mesh = TriMesh::new(placed.clone(), vec![[0, 1, 2], [0, 2, 3]]);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        let known: Vec<f64> = placed.iter().map(|x| body.nearest(*x).signed_distance).collect();
        // The second comes down to the body, the third does not, the last goes into it.
        let mut x = placed.clone();
        (x[1].z, x[2].z, x[3].z) = (0.0004, 0.19, -0.001);
        for planes in [false, true] {
            let asked = cloth.contacts_knowing(&body, &x, planes, &placed, std::iter::empty());
            let told = cloth.contacts_knowing(&body, &x, planes, &placed, known.iter().copied());
            assert!(asked.touches().len() >= 2, "{:?}", asked.touches());
            assert_eq!(asked.touches(), told.touches());
            assert!(told.is_clear(2, x[2], 0.1) && !told.is_clear(3, x[3], 0.0));
        }
    }
}
