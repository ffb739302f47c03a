//! Fit: strain of the cloth and its pressure on the body, the readings of a virtual try-on.
//!
//! The strain of a triangle is its largest principal strain, σ₁ − 1, where σ₁² is the larger eigenvalue of FᵀF, and F the
//! deformation gradient from the rest shape. A vertex has the mean of its triangles, weighted by rest area. The pressure at a
//! vertex is the contact force κ A (h − q) over its rest area A.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F | deformation gradient, columns along weft and warp | – |
//! | ε | largest principal strain | % in results, – inside |
//! | p | contact pressure | kPa |
//!
//! Limits: slivers and triangles that bridge open seams are left out, since their shape at rest is not that of the cloth
//! (`energy::membrane`, `mesh::bridges`). Wrinkles finer than an edge are not resolved, and the negative strain across a fold is not
//! reported. The pressure is that of the penalty at rest; it is smooth over about one edge.

use glam::DVec3;

use super::energy::{Cloth, Contacts};
use crate::base::math;
use crate::base::quantiles::nearest_rank;

/// Principal strain above which a result is not a wearable garment, %: more than fabrics bear.
pub(crate) const TORN_PERCENT: f64 = 50.0;

/// Share of its area at rest below which a garment at rest counts as crushed. A skirt with `bending_nm = 100` keeps 0.17. Heuristic.
pub(crate) const CRUSHED_SHARE: f64 = 0.5;

/// Strain and pressure per vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Largest principal strain, percent.
    pub strain_percent: Vec<f64>,
    /// Contact pressure, kPa.
    pub pressure_kpa: Vec<f64>,
    /// 95th percentile over the triangles of the largest principal strain, percent.
    pub strain_p95_percent: f64,
    /// Its largest value, percent.
    pub strain_max_percent: f64,
    /// Largest contact pressure, kPa.
    pub pressure_max_kpa: f64,
}

/// Measures `cloth` at rest at `x` (m) on contacts of stiffness κ (N/m³).
#[must_use]
pub fn fit(cloth: &Cloth, mut contacts: Contacts<'_>, x: &[DVec3], contact_stiffness: f64) -> Fit {
    let mut sum = vec![0.0; x.len()];
    let mut area = vec![0.0; x.len()];
    let mut strains: Vec<f64> = Vec::with_capacity(cloth.triangles.len());
    for triangle in cloth.triangles.iter().filter(|triangle| triangle.has_strain()) {
        let strain = 100.0 * principal_strain(triangle.deformation(x));
        strains.push(strain);
        for v in triangle.vertices {
            sum[v as usize] += strain * triangle.area;
            area[v as usize] += triangle.area;
        }
    }
    let strain_percent = sum.iter().zip(&area).map(|(s, a)| if *a > 0.0 { s / a } else { 0.0 }).collect();
    let mut pressure_kpa = vec![0.0; x.len()];
    contacts.stiffen(contact_stiffness / contacts.stiffness());
    contacts.update(x);
    for touch in contacts.touches() {
        let v = touch.vertex as usize;
        pressure_kpa[v] = 1e-3 * touch.force() / cloth.areas[v];
    }
    Fit {
        strain_p95_percent: nearest_rank(&strains, 0.95),
        strain_max_percent: nearest_rank(&strains, 1.0),
        pressure_max_kpa: pressure_kpa.iter().copied().fold(0.0, f64::max),
        strain_percent,
        pressure_kpa,
    }
}

/// Largest singular value of the deformation gradient with these columns, minus one.
pub(crate) fn principal_strain([fu, fv]: [DVec3; 2]) -> f64 {
    let (a, b, c) = (fu.length_squared(), fv.length_squared(), fu.dot(fv));
    (0.5 * (a + b) + math::hypot(0.5 * (a - b), c)).sqrt() - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::distance::Body;
    use crate::garment::fabric::Fabric;
    use crate::mesh::TriMesh;
    use crate::mesh::samples::cuboid;
    use crate::mesh::{RestShape, Topology};

    #[test]
    fn triangles_of_a_guessed_rest_shape_are_left_out() {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.5);
        let mesh =
            TriMesh::new(vec![at(0.0, 0.0), at(0.1, 0.0), at(0.1, 0.1), at(0.0, 0.1)], vec![[0, 1, 2], [0, 2, 3]]);
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let mut rest = RestShape::from_edges(&mesh).unwrap();
        rest.corners[0] = rest.corners[0].map(|p| 0.5 * p);
        let strain = |rest: &RestShape| {
            let fabric = Fabric::by_name("jersey").unwrap();
            let cloth = Cloth::new(&mesh, &Topology::new(&mesh), rest, &fabric, &[]).unwrap();
            let contacts = cloth.contacts(&body, &mesh.positions);
            let stiffness = contacts.stiffness();
            fit(&cloth, contacts, &mesh.positions, stiffness).strain_max_percent
        };
        assert!((strain(&rest) - 100.0).abs() < 1e-9);
        rest.guessed = vec![true, false];
        assert!(strain(&rest).abs() < 1e-9);
    }

    #[test]
    fn strain_and_pressure_of_a_stretched_sheet_on_a_table_are_those_imposed() {
        let flat = |s: f64, z: f64| {
            let at = |x: f64, y: f64| DVec3::new(s * x, y, z);
            vec![at(-0.1, -0.1), at(0.1, -0.1), at(0.1, 0.1), at(-0.1, 0.1)]
        };
        let mesh = TriMesh::new(flat(1.0, 0.1), vec![[0, 1, 2], [0, 2, 3]]);
        let cloth = Cloth::sample(&mesh, "jersey", &[]);
        // A table of 1 m with its top at z = 0.
        let body = Body::new(&cuboid(DVec3::new(-0.5, -0.5, -1.0), DVec3::new(0.5, 0.5, 0.0))).unwrap();
        let (depth, stretch) = (0.2e-3, 1.03);
        let x = flat(stretch, cloth.offset - depth);
        let stiffness = cloth.contacts(&body, &x).stiffness();
        let fit = fit(&cloth, cloth.contacts(&body, &x), &x, stiffness);
        assert!((fit.strain_p95_percent - 3.0).abs() < 1e-9, "{}", fit.strain_p95_percent);
        assert!(fit.strain_percent.iter().all(|s| (s - 3.0).abs() < 1e-9));
        let expected = 1e-3 * cloth.contacts(&body, &x).stiffness() * depth;
        assert!(fit.pressure_kpa.iter().all(|p| (p - expected).abs() < 1e-9 * expected), "{:?}", fit.pressure_kpa);
    }
}
