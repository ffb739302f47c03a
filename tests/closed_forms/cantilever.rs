//! A strip that juts out from a clamp sags as Peirce's cantilever (ASTM D1388): bending length c = (B/ρg)^⅓.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::GRAVITY;
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, Stop, refine_with};
use partwise::mesh::{RestShape, Topology};

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
        let cloth =
            Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &held).unwrap();
        let options = RefineOptions { tolerance: 1e-5, ..RefineOptions::default() };
        let end = refine_with(&cloth, Contacts::none(), mesh.positions, &options, &mut |_| ControlFlow::Continue(()));
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
