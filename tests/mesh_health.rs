//! Health, fit and push-out on shapes whose figures are known.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

mod fixtures;

use std::f64::consts::PI;

use fixtures::Diagonals;
use glam::DVec3;
use partwise::body::distance::Body;
use partwise::mesh::TriMesh;
use partwise::mesh::health::health;
use partwise::scene::{Placement, Scene, SceneError, facing_body, push_out};

/// A sphere about the origin with `n` parallels and 2n meridians.
fn sphere(radius: f64, n: u32) -> TriMesh {
    fixtures::sphere(DVec3::ZERO, radius, n, 2 * n)
}

/// An open tube about the z axis: `rows` rings of `around` vertices, radius by angle and height.
fn tube(rows: u32, around: u32, height: f64, radius: impl Fn(f64, f64) -> f64) -> TriMesh {
    fixtures::tube(around, rows, Diagonals::Parallel, |share, angle| {
        let z = height * (share - 0.5);
        let r = radius(angle, z);
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

#[test]
fn a_sphere_is_sound_and_its_figures_are_those_of_geometry() {
    let found = health(&sphere(0.5, 40));
    assert_eq!((found.vertices, found.triangles), (2 + 40 * 80, 2 * 80 * 40));
    assert!(found.closed && found.components == 1 && found.boundary_loops == 0);
    assert_eq!((found.self_intersecting_pairs, found.disagreeing_edges, found.non_manifold_edges), (0, 0, 0));
    // An inscribed polyhedron falls short of the sphere by about (π/n)²/2.
    assert!((found.area_m2 / PI - 1.0).abs() < 3e-3, "{}", found.area_m2);
    assert!((found.volume_m3.unwrap() / (PI / 6.0) - 1.0).abs() < 5e-3);
    assert!(found.min_angle_deg.min > 0.0 && found.min_angle_deg.max <= 60.0);
    let rows = found.rows();
    assert!(rows.iter().any(|(name, value)| *name == "closed" && value.starts_with("yes, 52")), "{rows:?}");
}

#[test]
fn two_spheres_that_overlap_are_found_to_cross() {
    let (mut both, other) = (sphere(0.5, 12), sphere(0.5, 12));
    let n = both.positions.len() as u32;
    both.positions.extend(other.positions.iter().map(|p| p + DVec3::new(0.31, 0.17, 0.11)));
    both.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + n)));
    let found = health(&both);
    assert_eq!(found.components, 2);
    assert!(found.closed && found.self_intersecting_pairs > 20);
    let apart: Vec<DVec3> =
        both.positions.iter().enumerate().map(|(v, &p)| if v as u32 >= n { p + DVec3::X } else { p }).collect();
    assert_eq!(health(&both.with_positions(apart)).self_intersecting_pairs, 0);
}

#[test]
fn a_tube_has_two_loops_and_outward_normals() {
    let garment = tube(21, 60, 0.4, |_, _| 0.6);
    let found = health(&garment);
    assert_eq!((found.boundary_loops, found.boundary_edges, found.closed), (2, 120, false));
    let body_mesh = sphere(0.5, 40);
    let body = Body::new(&body_mesh).unwrap();
    assert!(facing_body(&garment, &body).iter().all(|&facing| !facing));
    let mut reversed = garment.clone();
    reversed.triangles.iter_mut().for_each(|t| t.reverse());
    assert!(facing_body(&reversed, &body).iter().all(|&facing| facing));
    let fit = Placement::new(&garment, &body);
    assert_eq!((fit.penetrating_vertices, fit.crossing_pairs), (0, 0));
    assert!((fit.clearance_m.min - 0.1).abs() < 2e-3, "{fit:?}");
    assert!(Scene::of_meshes(&body_mesh, garment.clone()).is_ok());
    let away = garment.with_positions(garment.positions.iter().map(|p| p + DVec3::X * 30.0).collect());
    let error = Scene::of_meshes(&body_mesh, away).unwrap_err();
    assert!(matches!(error, SceneError::NotNear { nearest, .. } if (nearest - 28.9).abs() < 0.01), "{error}");
    assert!(error.to_string().contains("28.90 m"), "{error}");
}

/// Sizes of a dent (m): shallow and wide; deep; a spike at single vertices.
#[test]
fn dents_are_pushed_out_without_turning_a_triangle_over() {
    let body_mesh = sphere(0.5, 60);
    let body = Body::new(&body_mesh).unwrap();
    for (depth, width) in [(0.012, 0.3), (0.045, 0.25), (0.03, 0.02)] {
        let garment = tube(41, 160, 0.3, |turn, z| {
            let dent = (-((turn - PI) / width).powi(2) - (z / (0.5 * width)).powi(2)).exp();
            0.52 - (0.02 + depth) * dent
        });
        let before = Placement::new(&garment, &body);
        let thickness = 0.0005;
        let (pushed, report) = push_out(&garment, &body, thickness);
        assert!(report.found_inside > 0 && report.found_inside == before.penetrating_vertices);
        assert!((report.deepest_m - before.deepest_m).abs() < 1e-15);
        assert_eq!((report.left_inside, report.turned_over), (0, 0), "{report}");
        let q = body.nearest_all(&pushed.positions);
        for (v, (near, was)) in q.iter().zip(body.nearest_all(&garment.positions)).enumerate() {
            let floor = if was.signed_distance < 0.0 { thickness } else { was.signed_distance.min(thickness) };
            assert!(near.signed_distance > floor * (1.0 - 1e-5), "vertex {v}: {} < {floor}", near.signed_distance);
        }
        for t in 0..garment.triangles.len() {
            assert!(garment.double_area_vector(t).dot(pushed.double_area_vector(t)) > 0.0);
        }
        // Away from the dent nothing moved.
        let still = garment.positions.iter().zip(&pushed.positions).filter(|(p, q)| p == q).count();
        assert_eq!(still + report.moved, garment.vertex_count());
        assert!(report.moved < garment.vertex_count() / 2, "{report}");
        assert_eq!(report.too_deep > 0, depth > 0.031, "{report}");
    }
}

#[test]
fn the_same_bits_come_out_on_one_thread_and_on_three() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let body_mesh = sphere(0.5, 40);
            let body = Body::new(&body_mesh).unwrap();
            let garment = tube(31, 120, 0.3, |turn, z| 0.5 + 0.02 * (5.0 * turn).sin() + 0.1 * z);
            let (pushed, report) = push_out(&garment, &body, 0.0);
            assert_eq!(report.left_inside, 0, "{report}");
            (Placement::new(&garment, &body), pushed, report)
        })
    };
    let one = run(1);
    assert!(one.0.crossing_pairs > 100);
    assert_eq!(one, run(3));
}

#[test]
fn a_garment_that_is_outside_is_left_as_it_is() {
    let body = Body::new(&sphere(0.5, 30)).unwrap();
    let garment = tube(11, 40, 0.3, |_, _| 0.5002);
    let (same, report) = push_out(&garment, &body, 0.001);
    assert_eq!(same, garment);
    assert_eq!((report.found_inside, report.moved), (0, 0));
    assert!(report.is_clean() && report.to_string().contains("no vertex"));
}
