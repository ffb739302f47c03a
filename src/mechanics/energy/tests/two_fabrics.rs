//! A cloth of two fabrics: each triangle, ring and vertex has its own constants.

use crate::GRAVITY;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::{Cloth, Contacts, EnergyError};
use crate::mesh::{RestShape, Topology, TriMesh};
use glam::DVec3;

use super::derivatives::{block, check_gradient, check_hessian, grazing};
use super::patch::{deformed, fabric, jitters, sheet};

/// Different from [`fabric`] in every constant.
fn other() -> Fabric {
    Fabric {
        density_kg_per_m2: 0.45,
        thickness_m: 1.6e-3,
        stretch_weft_n_per_m: 2000.0,
        stretch_warp_n_per_m: 700.0,
        shear_n_per_m: 150.0,
        poisson: 0.1,
        bending_nm: [3e-4, 1e-4, 2e-4],
        bending_friction_n: [0.0; 2],
        friction: 0.7,
        ..fabric()
    }
}

/// The rest shape of the sheet with two of the five columns cut from the second fabric.
fn rest(mesh: &TriMesh) -> RestShape {
    let cut_from = (0..mesh.triangles.len()).map(|t| u16::from(t / 2 % 5 >= 3)).collect();
    RestShape { cut_from, ..RestShape::from_edges(mesh).unwrap() }
}

fn cloth(mesh: &TriMesh, fabrics: &[Fabric], held: &[u32]) -> Cloth {
    Cloth::new(mesh, &Topology::new(mesh), &rest(mesh), fabrics, held).unwrap()
}

#[test]
fn gradient_of_two_fabrics_matches_differences() {
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[fabric(), other()], &[]);
    let anchored = cloth.contacts(&body, &grazing(&mesh));
    let x: Vec<DVec3> = grazing(&mesh).iter().enumerate().map(|(i, p)| *p + jitters(i + 7) * 3e-4).collect();
    let moved = |x: &[DVec3]| {
        let mut moved = anchored.clone();
        moved.update(x);
        moved
    };
    assert!(moved(&x).touches().len() > 5);
    let mut gradient = Vec::new();
    cloth.gradient(&x, &moved(&x), &mut gradient);
    check_gradient(&x, |x| cloth.energy(x, &moved(x)), &gradient, "two fabrics");
    cloth.gradient(&deformed(&mesh), &Contacts::none(), &mut gradient);
    check_gradient(&deformed(&mesh), |x| cloth.energy(x, &Contacts::none()), &gradient, "two fabrics, free");
}

#[test]
fn hessian_of_a_flat_stretched_sheet_of_two_fabrics_is_exact() {
    let (mesh, body) = (sheet(), block());
    let cloth = cloth(&mesh, &[fabric(), other()], &[0, 7, 20]);
    let x: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::new(1.05 * p.x, 5e-4, 1.08 * p.z)).collect();
    check_hessian(&cloth, &x, &cloth.contacts(&body, &x), 1e-6);
}

#[test]
fn mass_offset_and_friction_of_a_vertex_are_means_over_its_triangles() {
    let mesh = sheet();
    let (rest, fabrics) = (rest(&mesh), [fabric(), other()]);
    let cloth = cloth(&mesh, &fabrics, &[]);
    let areas = rest.areas();
    let weight: f64 = (0..areas.len()).map(|t| areas[t] * fabrics[rest.fabric_of(t)].density_kg_per_m2).sum();
    assert!((cloth.weight - GRAVITY * weight).abs() < 1e-14, "{} N", cloth.weight);
    let (one, two) = ([fabric()], [other()]);
    let alone = [&one, &two].map(|fabric| {
        let rest = RestShape::from_edges(&mesh).unwrap();
        Cloth::new(&mesh, &Topology::new(&mesh), &rest, &fabric[..], &[]).unwrap()
    });
    let mut on_the_seam = 0;
    for v in 0..mesh.vertex_count() {
        let about: Vec<usize> =
            (0..areas.len()).filter(|&t| mesh.triangles[t].contains(&(v as u32))).map(|t| rest.fabric_of(t)).collect();
        let of = |cloth: &Cloth| [cloth.masses[v], cloth.offsets[v], cloth.friction[v], cloth.thickness[v]];
        let [one, two] = [of(&alone[0]), of(&alone[1])];
        if about.iter().all(|f| *f == about[0]) {
            // To the last bit.
            assert_eq!(of(&cloth), if about[0] == 0 { one } else { two }, "vertex {v}");
        } else {
            on_the_seam += 1;
            for (found, (one, two)) in of(&cloth).into_iter().zip(one.into_iter().zip(two)) {
                assert!(found > one && found < two, "vertex {v}: {found}, {one}, {two}");
            }
        }
    }
    assert_eq!(on_the_seam, 6);
}

#[test]
fn two_equal_fabrics_act_as_one() {
    let mesh = sheet();
    let x = deformed(&mesh);
    let (twice, once) = (cloth(&mesh, &[fabric(), fabric()], &[]), super::patch::cloth(&mesh, &[]));
    let (mut of_twice, mut of_once) = (Vec::new(), Vec::new());
    let energies =
        [twice.gradient(&x, &Contacts::none(), &mut of_twice), once.gradient(&x, &Contacts::none(), &mut of_once)];
    // The order of the sums differs.
    assert!((energies[0] - energies[1]).abs() < 1e-13 * energies[1].abs(), "{energies:?}");
    for (a, b) in of_twice.iter().zip(&of_once) {
        assert!(a.distance(*b) < 1e-12, "{a} {b}");
    }
    assert_eq!((&twice.offsets, &twice.friction), (&once.offsets, &once.friction));
}

#[test]
fn a_missing_fabric_is_refused() {
    let mesh = sheet();
    let found = Cloth::new(&mesh, &Topology::new(&mesh), &rest(&mesh), &fabric(), &[]).unwrap_err();
    assert!(matches!(found, EnergyError::Fabrics { cut_from: 2, given: 1 }), "{found}");
    assert!(found.to_string().contains("2 fabrics and 1 given"), "{found}");
}
