//! A strip that juts out from a clamp sags as Peirce's cantilever (ASTM D1388): bending length c = (B/ρg)^⅓.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::GRAVITY;
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, Stop, refine_with};
use partwise::mesh::{RestShape, Topology, TriMesh};

use crate::bench::{fabric, rectangle};

/// Peirce's bending length (m) of a strip that sags to θ (radians) over a length L: L (cos(θ/2) / 8 tan θ)^⅓.
fn peirce(length: f64, theta: f64) -> f64 {
    length * ((0.5 * theta).cos() / (8.0 * theta.tan())).cbrt()
}

#[test]
fn a_cantilever_has_peirces_bending_length() {
    let density = 0.15;
    for (bending, along) in [(1e-5, 20), (1e-5, 40), (6e-5, 24)] {
        let c = (bending / (density * GRAVITY)).cbrt();
        // The test stops at 41.5 degrees, where the overhang is twice the bending length.
        // A row of vertices bends for half a cell to either side, so the clamp lies half a cell inside the last held row.
        let overhang = 2.0 * c;
        let cell = overhang / (f64::from(along) + 0.5);
        let mesh = rectangle(DVec3::X * (cell * f64::from(along + 2)), DVec3::Y * 0.02, along as usize + 2, 4);
        let held: Vec<u32> =
            (0..mesh.vertex_count() as u32).filter(|&v| mesh.positions[v as usize].x < 2.5 * cell).collect();
        let fabric = fabric(density, 2000.0, 0.0, bending, 0.0);
        let mut cloth =
            Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &held).unwrap();
        cloth.solver.newton.tolerance = 1e-5;
        let end = refine_with(&cloth, Contacts::none(), mesh.positions, &RefineOptions::default(), &mut |_| {
            ControlFlow::Continue(())
        });
        let end = end.unwrap();
        assert_eq!(end.stop, Stop::Converged, "residual {:e}", end.residual_over_weight);
        let tip = end.positions.iter().filter(|p| p.z < 0.0).fold(DVec3::ZERO, |t, p| if p.z < t.z { *p } else { t });
        let theta = (-tip.z).atan2(tip.x - 1.5 * cell);
        let measured = peirce(overhang, theta);
        assert!(
            (measured / c - 1.0).abs() < 0.05,
            "B {bending:e}, {along} cells: c {measured} for {c}, ratio {}",
            measured / c
        );
    }
}

/// Deflection (m) at the end of a strip that juts out by `length`, in small bending: its weight bends it where the moment exceeds the
/// Coulomb moment HB, so by W g/(8 B) (L² − 2 HB/(W g))².
fn with_friction(weight: f64, length: f64, bending: f64, moment: f64) -> f64 {
    weight / (8.0 * bending) * (length * length - 2.0 * moment / weight).max(0.0).powi(2)
}

/// The same cells all split along one diagonal: six neighbours about every vertex. A ring of four does not determine x_uv, and a strip of
/// alternating diagonals, with rings of four and eight, sags 13 to 60 % too far by it.
fn regular(mut mesh: TriMesh) -> TriMesh {
    for cell in mesh.triangles.chunks_exact_mut(2) {
        // [a, b, d], [b, c, d] become [a, b, c], [a, c, d].
        if cell[0][2] == cell[1][2] && cell[0][1] == cell[1][0] {
            cell[0][2] = cell[1][1];
            cell[1][0] = cell[0][0];
        }
    }
    mesh
}

#[test]
fn a_cantilever_with_friction_between_yarns_sags_as_its_closed_form() {
    let (density, length, along) = (0.15, 0.01, 40);
    let weight = density * GRAVITY;
    let cell = length / (f64::from(along) + 0.5);
    // Elastic, and with friction that holds 36 and 60 % of the moment at the clamp. It sags by a twentieth of its length: a cloth of 4 µN·m and
    // a centimetre long, whose curvature there is 20/m.
    let full = 0.5 * weight * length * length;
    for share in [0.0, 0.36, 0.6] {
        let (bending, moment) = (3.7e-6 * (1.0 - share) * (1.0 - share), share * full);
        let size = [DVec3::X * (cell * f64::from(along + 2)), DVec3::Y * 0.002];
        let mesh = regular(rectangle(size[0], size[1], along as usize + 2, 8));
        let held: Vec<u32> =
            (0..mesh.vertex_count() as u32).filter(|&v| mesh.positions[v as usize].x < 2.5 * cell).collect();
        let fabric = Fabric { bending_friction_n: [moment; 2], ..fabric(density, 2000.0, 0.0, bending, 0.0) };
        let mut cloth =
            Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &held).unwrap();
        (cloth.solver.newton.tolerance, cloth.solver.softening.strain) = (1e-6, 0.0);
        let end = refine_with(&cloth, Contacts::none(), mesh.positions, &RefineOptions::default(), &mut |_| {
            ControlFlow::Continue(())
        });
        let end = end.unwrap();
        let (sag, expected) = (-end.positions.last().unwrap().z, with_friction(weight, length, bending, moment));
        assert!((sag / expected - 1.0).abs() < 0.02, "HB {share}: {sag} m for {expected} m, {} steps", end.steps);
    }
}
