//! Softened continuation: stiff cloth begins soft.
//!
//! A woven membrane lets a step go only as far as its triangles stay as long as they are to a part in thousands, so it creeps into its folds
//! a millimetre at a time. Far from rest it is therefore first settled with its stiffness capped: a length of cloth as high as the garment
//! that hangs by its own weight stretches by `strain`. With a few millimetres left to go, it continues with its true stiffness. Each of the
//! two energies falls; [`Record::softened`](crate::mechanics::newton::Record) says which one a step belongs to.

use glam::DVec3;

use crate::GRAVITY;
use crate::mechanics::energy::Cloth;
use crate::mesh::box_about;

/// The softened cloth to begin with at `x` (m), where this is the residual over weight; `None` where the cloth is soft or near rest.
pub(super) fn softened(cloth: &Cloth, x: &[DVec3], residual: f64) -> Option<Cloth> {
    let options = cloth.solver.softening;
    let free = cloth.masses.iter().zip(&cloth.held).filter(|(_, held)| !**held);
    let squares: f64 = free.map(|(m, _)| m * m).sum();
    let free_fall = GRAVITY * squares.sqrt() / cloth.weight;
    if residual > options.min_residual * free_fall { cloth.softened(extent(x), options.strain) } else { None }
}

/// The longest side of the box about `x`, m: about the hanging length, in whichever direction the cloth lies.
pub(super) fn extent(x: &[DVec3]) -> f64 {
    let (low, high) = box_about(x.iter().copied());
    (high - low).max_element().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sheet;

    #[test]
    fn only_stiff_cloth_far_from_rest_is_softened() {
        let mesh = sheet(10, 10, |i, j| DVec3::new(i, 0.0, j) * 0.05);
        let held: Vec<u32> = (110..121).collect();
        for (fabric, stiff) in [("cotton", true), ("jersey", false)] {
            let cloth = Cloth::sample(&mesh, fabric, &held);
            assert_eq!(softened(&cloth, &mesh.positions, 1.0).is_some(), stiff, "{fabric}");
            assert!(softened(&cloth, &mesh.positions, 1e-3).is_none(), "{fabric} near rest");
        }
    }
}
