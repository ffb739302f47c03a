//! Rigid motions, closed forms, and balance of the internal forces.

use crate::GRAVITY;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, Contacts, EnergyError, membrane::Stiffness};
use crate::mesh::samples::sheet as regular_sheet;
use crate::mesh::{RestShape, Topology};
use glam::{DQuat, DVec3};

use super::patch::{cloth, cloth_of, deformed, fabric, sheet};

/// The elastic energy: membrane plus bending.
fn elastic(cloth: &Cloth, x: &[DVec3]) -> f64 {
    let stiffness = Stiffness::new(&fabric());
    cloth.triangles.iter().map(|t| t.energy(&stiffness, t.compression_ratio(), x)).sum::<f64>()
        + cloth.bending.energy(x)
}

#[test]
fn elastic_energy_is_invariant_under_rigid_motions() {
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.3);
    let moved = |x: &[DVec3]| x.iter().map(|p| turn * *p + DVec3::new(3.0, -2.0, 5.0)).collect::<Vec<_>>();
    assert!(elastic(&cloth, &mesh.positions) < 1e-18);
    assert!(elastic(&cloth, &moved(&mesh.positions)) < 1e-18);
    let x = deformed(&mesh);
    let (here, there) = (elastic(&cloth, &x), elastic(&cloth, &moved(&x)));
    assert!((here - there).abs() < 1e-9 * here, "{here} and {there}");
}

#[test]
fn internal_forces_have_no_resultant_and_no_moment() {
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let x = deformed(&mesh);
    let mut gradient = Vec::new();
    cloth.gradient(&x, &Contacts::none(), &mut gradient);
    let (mut force, mut moment, mut scale) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for ((g, p), m) in gradient.iter().zip(&x).zip(&cloth.masses) {
        let internal = *g - DVec3::Z * (m * GRAVITY);
        force += internal;
        moment += p.cross(internal);
        scale += internal.length();
    }
    assert!(force.length() < 1e-12 * scale, "{force}");
    assert!(moment.length() < 1e-12 * scale, "{moment}");
}

#[test]
fn energy_of_a_stretched_sheet_is_its_closed_form() {
    // 5 % along the weft alone: ½ k_u/(1 − ν²) s² per area.
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let x: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::new(1.05 * p.x, p.y, p.z)).collect();
    let area: f64 = cloth.areas.iter().sum();
    let expected = 0.5 * 90.0 / (1.0 - 0.0625) * 0.05 * 0.05 * area;
    assert!((elastic(&cloth, &x) - expected).abs() < 1e-9 * expected);
}

#[test]
fn bending_energy_of_a_cylinder_is_its_closed_form_in_any_direction() {
    // About an axis at 90, 45 and 0 degrees from the weft the curvature is along weft, bias and warp: ½ B/r² per area on any mesh. The
    // edges of the jittered sheet have no special direction; its two corner triangles (4 % of it) are in no ring.
    let mesh = sheet();
    let cloth = cloth(&mesh, &[]);
    let r = 0.2;
    let area: f64 = cloth.areas.iter().sum();
    for (degrees, b) in [(0.0, 2e-5), (45.0, 5e-5), (90.0, 9e-5)] {
        let along = DVec3::new(f64::to_radians(degrees).cos(), 0.0, f64::to_radians(degrees).sin());
        let roll = |p: &DVec3| {
            let s = p.dot(along);
            *p - along * s + along * (r * (s / r).sin()) + DVec3::Y * (r * (1.0 - (s / r).cos()))
        };
        let x: Vec<DVec3> = mesh.positions.iter().map(roll).collect();
        let expected = 0.5 * b / (r * r) * area;
        let computed = cloth.bending.energy(&x);
        assert!((computed / expected - 1.0).abs() < 0.06, "{degrees} degrees: {computed} for {expected}");
    }
}

#[test]
fn bending_friction_of_a_cylinder_is_its_closed_form_in_any_direction() {
    // √((HB κ)² + m²) − m per area, with HB along weft, on the bias its mean, and along warp, and m that mean times the width, 0.1/m. The
    // corner triangles, a hundredth of the sheet, have no friction.
    let mesh = regular_sheet(10, 10, |i, j| DVec3::new(i, 0.0, j) * 0.01);
    let [elastic, rubbing] = [[0.0; 2], [4e-4, 1e-3]]
        .map(|bending_friction_n| cloth_of(&mesh, &Fabric { bending_friction_n, ..fabric() }, &[]));
    let (r, none) = (0.1, Contacts::none());
    let area: f64 = rubbing.areas.iter().sum();
    for (degrees, moment) in [(0.0, 4e-4), (45.0, 7e-4), (90.0, 1e-3)] {
        let along = DVec3::new(f64::to_radians(degrees).cos(), 0.0, f64::to_radians(degrees).sin());
        let roll = |p: &DVec3| {
            let s = p.dot(along);
            *p - along * s + along * (r * (s / r).sin()) + DVec3::Y * (r * (1.0 - (s / r).cos()))
        };
        let x: Vec<DVec3> = mesh.positions.iter().map(roll).collect();
        let computed = rubbing.energy(&x, &none) - elastic.energy(&x, &none);
        let expected = (f64::hypot(moment / r, 0.1 * 7e-4) - 0.1 * 7e-4) * area;
        assert!((computed / expected - 1.0).abs() < 0.03, "{degrees} degrees: {computed} for {expected}");
    }
}

#[test]
fn faulty_data_is_refused_with_its_place() {
    let mesh = sheet();
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let held = Cloth::new(&mesh, &topology, &rest, &fabric(), &[99]).unwrap_err();
    assert!(matches!(held, EnergyError::Held { vertex: 99, count: 36 }), "{held}");
    let mut flat = rest.clone();
    flat.corners[3][2] = flat.corners[3][1];
    let degenerate = Cloth::new(&mesh, &topology, &flat, &fabric(), &[]).unwrap_err();
    assert!(matches!(degenerate, EnergyError::Degenerate { triangle: 3 }), "{degenerate}");
    flat.corners.pop();
    assert!(matches!(Cloth::new(&mesh, &topology, &flat, &fabric(), &[]), Err(EnergyError::RestCount { .. })));
    let all: Vec<u32> = (0..36).collect();
    assert!(matches!(Cloth::new(&mesh, &topology, &rest, &fabric(), &all), Err(EnergyError::NothingFree { .. })));
}
