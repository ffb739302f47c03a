//! Coulomb's law: a cloth on a slope stays below the slip angle and slides above it; on a sphere it rests.

use std::ops::ControlFlow;

use glam::{DQuat, DVec3};
use partwise::body::distance::Body;
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::refine::{RefineOptions, Refined, Stop, refine};
use partwise::mesh::{RestShape, Topology, TriMesh};

use crate::bench::{block, fabric, rectangle, sphere, table};

fn settle(mesh: &TriMesh, body: &Body, friction: f64, steps: usize) -> Refined {
    let fabric = fabric(0.2, 60.0, 0.3, 2e-5, friction);
    let cloth = Cloth::new(mesh, &Topology::new(mesh), &RestShape::from_edges(mesh).unwrap(), &fabric, &[]).unwrap();
    let options = RefineOptions { max_steps: Some(steps), ..RefineOptions::default() };
    refine(&cloth, body, mesh.positions.clone(), &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Mean displacement, m.
fn drift(mesh: &TriMesh, end: &Refined) -> DVec3 {
    end.positions.iter().zip(&mesh.positions).map(|(a, b)| *a - *b).sum::<DVec3>() / end.positions.len() as f64
}

/// How a 10 cm square ends on a slope of `degrees`, and how far it slid down.
fn on_a_slope(degrees: f64, friction: f64) -> (Refined, f64) {
    let tilt = f64::to_radians(degrees);
    let turn = DQuat::from_rotation_y(tilt);
    let body = block(DVec3::new(2.0, 1.0, 0.2), tilt);
    let mut mesh = rectangle(DVec3::X * 0.1, DVec3::Y * 0.1, 6, 6);
    for p in &mut mesh.positions {
        *p = turn * (*p + DVec3::Z * 1e-3);
    }
    let end = settle(&mesh, &body, friction, 60);
    let slid = drift(&mesh, &end).dot(turn * DVec3::X);
    (end, slid)
}

#[test]
fn below_the_slip_angle_it_stays() {
    // tan 20° = 0.364, tan 16° = 0.287: below 0.3's 16.7 degrees.
    for (degrees, friction) in [(10.0, 0.3), (16.0, 0.3), (20.0, 0.4)] {
        let (end, slid) = on_a_slope(degrees, friction);
        assert_eq!(
            end.stop,
            Stop::Converged,
            "{degrees} degrees, μ {friction}: residual {:e}",
            end.residual_over_weight
        );
        assert!(slid.abs() < 2e-3, "{degrees} degrees, μ {friction}: slid {slid} m");
    }
}

#[test]
fn above_the_slip_angle_it_slides() {
    for (degrees, friction) in [(17.5, 0.3), (30.0, 0.3), (5.0, 0.0)] {
        let (end, slid) = on_a_slope(degrees, friction);
        assert!(end.stop != Stop::Converged, "{degrees} degrees, μ {friction}: at rest");
        assert!(slid > 0.02, "{degrees} degrees, μ {friction}: slid only {slid} m");
    }
}

#[test]
fn a_cloth_over_a_table_edge_holds_or_slides_by_its_friction() {
    // About a third hangs over: it holds where 2 μ exp(μ π/2) > 1 (Euler's rope over the edge), from μ = 0.31 on.
    let body = table(0.2, 0.03);
    assert!(body.nearest(DVec3::Z * 0.01).signed_distance > 0.0, "the table is inside out");
    let mut mesh = rectangle(DVec3::X * 0.3, DVec3::Y * 0.06, 30, 6);
    for p in &mut mesh.positions {
        *p += DVec3::new(0.0, -0.03, 1e-3);
    }
    let held = settle(&mesh, &body, 0.5, 200);
    assert_eq!(held.stop, Stop::Converged, "residual {:e}", held.residual_over_weight);
    assert!(held.positions[0].x < 0.01, "slid to {}", held.positions[0].x);
    let low = held.positions.iter().map(|p| p.z).fold(0.0, f64::min);
    assert!(low < -0.06, "the end hangs only to {low}");
    let slid = settle(&mesh, &body, 0.15, 80);
    let at = slid.positions[0];
    assert!(at.x > 0.03 || at.z < -0.1, "{:?} at {at}, neither slid nor fallen off", slid.stop);
}

#[test]
fn a_cloth_rests_on_a_sphere() {
    let body = sphere(0.1);
    let mut mesh = rectangle(DVec3::X * 0.24, DVec3::Y * 0.24, 16, 16);
    for p in &mut mesh.positions {
        *p += DVec3::new(-0.12, -0.12, 0.101);
    }
    let end = settle(&mesh, &body, 0.3, 300);
    assert_eq!(end.stop, Stop::Converged, "residual {:e}", end.residual_over_weight);
    assert!(end.positions.iter().all(|&p| body.nearest(p).signed_distance >= 0.0), "a vertex is inside");
    assert!(drift(&mesh, &end).truncate().length() < 5e-3, "slid off centre");
    assert!(end.positions[0].z < 0.03, "the corner stays at {}", end.positions[0].z);
}

/// Over an edge of a radius of 8 mm the rounded distance is more than the exact one by more than this cloth is thick.
#[test]
fn a_thin_cloth_keeps_out_of_a_narrow_edge_without_pressing_harder() {
    let body = table(0.05, 0.008);
    let mut mesh = rectangle(DVec3::X * 0.2, DVec3::Y * 0.01, 100, 5);
    for p in &mut mesh.positions {
        *p += DVec3::new(-0.1, -0.005, 5e-4);
    }
    let fabric = Fabric { thickness_m: 5e-5, ..fabric(0.2, 300.0, 0.2, 5e-6, 0.3) };
    let (topology, rest) = (Topology::new(&mesh), RestShape::from_edges(&mesh).unwrap());
    let middle: Vec<u32> = (0..=5).map(|row| 101 * row + 50).collect();
    let cloth = Cloth::new(&mesh, &topology, &rest, &fabric, &middle).unwrap();
    let options = RefineOptions { max_steps: Some(200), ..RefineOptions::default() };
    let end = refine(&cloth, &body, mesh.positions.clone(), &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let least = end.positions.iter().map(|&p| body.nearest(p).signed_distance).fold(1.0, f64::min);
    assert_eq!(end.stop, Stop::Converged, "{} steps, residual {:e}", end.steps, end.residual_over_weight);
    assert!(least >= 0.0, "inside by {least:e} m");
    assert_eq!(end.contact_stiffness, cloth.contact_stiffness());
}
