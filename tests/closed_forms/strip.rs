//! A strip hung by one end stretches by ρ g L²/2k.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::GRAVITY;
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{Record, RefineOptions, Stop, refine_with};
use partwise::mesh::{RestShape, Topology};

use crate::bench::{fabric, rectangle};

/// Elongation over ρ g L²/2k of a strip 60 × 10 cm in cells of 10 cm / `across`.
fn elongation_ratio(across: usize, stretch: f64) -> f64 {
    let (length, density) = (0.6, 0.2);
    let mesh = rectangle(DVec3::X * 0.1, DVec3::NEG_Z * length, across, 6 * across);
    let held: Vec<u32> = (0..=across as u32).collect();
    let fabric = fabric(density, stretch, 0.3, 1e-5, 0.0);
    let mut cloth =
        Cloth::new(&mesh, &Topology::new(&mesh), &RestShape::from_edges(&mesh).unwrap(), &fabric, &held).unwrap();
    cloth.solver.newton.tolerance = 1e-6;
    let end = refine_with(&cloth, Contacts::none(), mesh.positions.clone(), &RefineOptions::default(), &mut |_| {
        ControlFlow::Continue(())
    });
    let end = end.unwrap();
    assert_eq!(end.stop, Stop::Converged, "residual {:e}", end.residual_over_weight);
    let same = |w: &&[Record]| w[0].softened == w[1].softened;
    assert!(end.history.windows(2).filter(same).all(|w| w[1].energy <= w[0].energy), "the energy rose");
    let hem = &end.positions[end.positions.len() - across - 1..];
    let lowest = hem.iter().map(|p| p.z).sum::<f64>() / hem.len() as f64;
    (-lowest - length) / (density * GRAVITY * length * length / (2.0 * stretch))
}

/// Of two fabrics in series the upper bears what the lower weighs: ρ₁ g L₁²/2k₁ + ρ₂ g L₂ L₁/k₁ + ρ₂ g L₂²/2k₂.
#[test]
fn a_strip_of_two_fabrics_stretches_as_the_sum_of_their_closed_forms() {
    let (across, along) = (4, 24);
    let (length, [upper, lower]) = (0.6, [0.35, 0.25]);
    let mesh = rectangle(DVec3::X * 0.1, DVec3::NEG_Z * length, across, along);
    let cut_from: Vec<u16> = (0..mesh.triangles.len()).map(|t| u16::from(t / (2 * across) >= 14)).collect();
    let rest = RestShape { cut_from, ..RestShape::from_edges(&mesh).unwrap() };
    let held: Vec<u32> = (0..=across as u32).collect();
    for [(d1, k1), (d2, k2)] in [[(0.2, 60.0), (0.4, 600.0)], [(0.45, 3000.0), (0.15, 40.0)]] {
        let fabrics = [fabric(d1, k1, 0.0, 1e-5, 0.0), fabric(d2, k2, 0.0, 1e-5, 0.0)];
        let mut cloth = Cloth::new(&mesh, &Topology::new(&mesh), &rest, &fabrics[..], &held).unwrap();
        cloth.solver.newton.tolerance = 1e-6;
        let end = refine_with(&cloth, Contacts::none(), mesh.positions.clone(), &RefineOptions::default(), &mut |_| {
            ControlFlow::Continue(())
        });
        let end = end.unwrap();
        assert_eq!(end.stop, Stop::Converged, "residual {:e}", end.residual_over_weight);
        let hem = &end.positions[end.positions.len() - across - 1..];
        let lowest = hem.iter().map(|p| p.z).sum::<f64>() / hem.len() as f64;
        let hangs = d2 * GRAVITY * lower;
        let expected = d1 * GRAVITY * upper * upper / (2.0 * k1) + hangs * upper / k1 + hangs * lower / (2.0 * k2);
        let ratio = (-lowest - length) / expected;
        assert!((ratio - 1.0).abs() < 0.02, "k {k1} over {k2}: {ratio}");
    }
}

#[test]
fn a_strip_stretches_as_its_closed_form_at_three_resolutions() {
    for across in [2, 4, 8] {
        for stretch in [60.0, 4000.0] {
            let ratio = elongation_ratio(across, stretch);
            assert!((ratio - 1.0).abs() < 0.02, "{across} cells across, k {stretch}: {ratio}");
        }
    }
}
