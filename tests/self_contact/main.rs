//! Self-contact: known cases, knots, perturbed starts and garments that touch themselves.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking, and prints counts"
)]

mod knot;
mod layers;
mod skin;
mod starts;

use std::f64::consts::TAU;

use glam::DVec3;
use partwise::body::distance::Body;
use partwise::drape::{Settings, drape, unobserved};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, Refined, Stop, refine, refine_with};
use partwise::mesh::self_intersection::self_intersecting_pairs;
use partwise::mesh::{RestShape, Topology, TriMesh};
use partwise::scene::SceneSpec;

/// A sheet of `columns` × `rows` squares from `origin` along `u` and `v`.
fn sheet(columns: u32, rows: u32, origin: DVec3, u: DVec3, v: DVec3) -> TriMesh {
    let at = |i: u32, j: u32| origin + u * f64::from(i) + v * f64::from(j);
    let positions = (0..=rows).flat_map(|j| (0..=columns).map(move |i| at(i, j))).collect();
    let index = |i: u32, j: u32| j * (columns + 1) + i;
    let squares = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let triangles = squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i, j + 1), index(i + 1, j + 1)];
            if (i + j) % 2 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] }
        })
        .collect();
    TriMesh::new(positions, triangles)
}

fn both(mut a: TriMesh, b: TriMesh) -> TriMesh {
    let n = a.positions.len() as u32;
    a.positions.extend(b.positions);
    a.triangles.extend(b.triangles.into_iter().map(|t| t.map(|v| v + n)));
    a
}

/// A closed box with its upper side in the plane z = 0.
fn plate() -> Body {
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        DVec3::new(side(0), side(1), side(2) * 0.2 - 0.1)
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Body::new(&TriMesh::new((0..8).map(corner).collect(), triangles)).unwrap()
}

fn cloth(mesh: &TriMesh, held: &[u32]) -> Cloth {
    let fabric = Fabric::by_name("jersey").unwrap();
    Cloth::new(mesh, &Topology::new(mesh), &RestShape::from_edges(mesh).unwrap(), &fabric, held).unwrap()
}

fn crossings(mesh: &TriMesh, x: &[DVec3]) -> usize {
    self_intersecting_pairs(&mesh.with_positions(x.to_vec())).len()
}

/// Solves `mesh` on `body` and asserts convergence without intersections.
fn rests(mesh: &TriMesh, held: &[u32], body: Option<&Body>, start: Vec<DVec3>) -> Refined {
    let cloth = cloth(mesh, held);
    let options = RefineOptions::default();
    let mut go_on = |_: &partwise::mechanics::refine::Step<'_>| std::ops::ControlFlow::Continue(());
    let end = match body {
        Some(body) => refine(&cloth, body, start, &options, &mut go_on),
        None => refine_with(&cloth, Contacts::none(), start, &options, &mut go_on),
    };
    let end = end.unwrap();
    assert_eq!(end.stop, Stop::Converged, "after {} steps: {}", end.steps, end.residual_over_weight);
    assert_eq!(crossings(mesh, &end.positions), 0);
    end
}

#[test]
fn a_sheet_folded_over_itself_stays_folded() {
    let (h, radius) = (0.01, 0.006);
    let mesh = sheet(24, 5, DVec3::ZERO, DVec3::X * h, DVec3::Y * h);
    let turn = std::f64::consts::PI * radius;
    // One half folded back over the other.
    let bent = |p: DVec3| {
        let s = p.x - 0.12;
        let (x, z) = if s < 0.0 {
            (s, 0.0)
        } else if s < turn {
            (radius * (s / radius).sin(), radius * (1.0 - (s / radius).cos()))
        } else {
            (turn - s, 2.0 * radius)
        };
        DVec3::new(x, p.y, z + 0.003)
    };
    let start: Vec<DVec3> = mesh.positions.iter().map(|p| bent(*p)).collect();
    let end = rests(&mesh, &[], Some(&plate()), start);
    // The upper half rests on the lower one.
    let top = (0..6).map(|j| end.positions[j * 25 + 24].z).fold(0.0, f64::max);
    let under = (0..6).map(|j| end.positions[j * 25].z).fold(0.0, f64::max);
    assert!(top > under + 3e-4 && top < 0.009, "{top} over {under}");
}

/// A sphere of radius `r` on the plane z = 0.
fn ball(r: f64) -> TriMesh {
    let (rings, around) = (16u32, 32u32);
    let at = |ring: u32, i: u32| {
        let (a, b) = (0.5 * TAU * f64::from(ring) / f64::from(rings), TAU * f64::from(i) / f64::from(around));
        DVec3::new(a.sin() * b.cos(), a.sin() * b.sin(), 1.0 + a.cos()) * r
    };
    let mut positions = vec![at(0, 0), at(rings, 0)];
    positions.extend((1..rings).flat_map(|ring| (0..around).map(move |i| at(ring, i))));
    let index = |ring: u32, i: u32| match ring {
        0 => 0,
        ring if ring == rings => 1,
        ring => 2 + (ring - 1) * around + i % around,
    };
    let quads = (0..rings).flat_map(|ring| (0..around).map(move |i| (ring, i)));
    let mut triangles = Vec::new();
    for (ring, i) in quads {
        let [a, b, c, d] = [index(ring, i), index(ring + 1, i), index(ring + 1, i + 1), index(ring, i + 1)];
        triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
    }
    TriMesh::new(positions, triangles)
}

#[test]
fn a_cloth_on_a_ball_and_the_floor_lies_in_folds() {
    let lift = DVec3::Z * 2e-3;
    let ball = ball(0.05);
    let ball = ball.with_positions(ball.positions.iter().map(|x| *x + lift).collect());
    let body = Body::new(&both(plate().mesh().clone(), ball)).unwrap();
    let h = 0.0125;
    let mesh = sheet(24, 24, DVec3::new(-0.148, -0.151, 0.12), DVec3::X * h, DVec3::Y * h);
    let end = rests(&mesh, &[], Some(&body), mesh.positions.clone());
    assert!(end.positions.iter().all(|x| body.nearest(*x).signed_distance > 0.0));
    let highest = end.positions.iter().map(|x| x.z).fold(0.0, f64::max);
    let on_floor = end.positions.iter().filter(|x| x.z < 0.01).count();
    assert!(highest > 0.1 && highest < 0.11 && on_floor > 50, "{highest} {on_floor}");
}

#[test]
fn intersecting_sheets_separate() {
    // Both sheets are held at an edge; a third of one reaches through the other.
    let h = 0.01;
    let one = sheet(12, 12, DVec3::new(-0.06, 0.0, 0.0), DVec3::X * h, DVec3::NEG_Z * h);
    let other = sheet(8, 8, DVec3::new(-0.031, -0.052, -0.043), DVec3::X * h, DVec3::Y * h);
    let mesh = both(one, other);
    let held: Vec<u32> = (0..13).chain(169..178).collect();
    assert!(crossings(&mesh, &mesh.positions) > 10);
    rests(&mesh, &held, None, mesh.positions.clone());
}

/// A ribbon closed to a ring of radius `r` about `centre`, its axis along `axis`, as wide as three edges.
fn ring(r: f64, centre: DVec3, axis: DVec3, start: DVec3) -> TriMesh {
    let (n, h) = (40, 0.008);
    let (u, v) = (start, axis.cross(start));
    let at = |i: u32, j: u32| {
        let a = TAU * f64::from(i) / f64::from(n);
        centre + (u * a.cos() + v * a.sin()) * r + axis * (f64::from(j) - 1.5) * h
    };
    let positions = (0..4).flat_map(|j| (0..n).map(move |i| at(i, j))).collect();
    let squares = (0..3u32).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = squares
        .flat_map(|(i, j)| {
            let [a, b] = [j * n + i, j * n + (i + 1) % n];
            [[a, b, b + n], [a, b + n, a + n]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}

/// Gauss's integral over two closed lines: how many times they are linked.
fn linking(a: &[DVec3], b: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    for i in 0..a.len() {
        let (p, dp) = ((a[i] + a[(i + 1) % a.len()]) / 2.0, a[(i + 1) % a.len()] - a[i]);
        for j in 0..b.len() {
            let (q, dq) = ((b[j] + b[(j + 1) % b.len()]) / 2.0, b[(j + 1) % b.len()] - b[j]);
            let r = p - q;
            sum += r.dot(dp.cross(dq)) / r.length().powi(3);
        }
    }
    sum / (2.0 * TAU)
}

#[test]
fn a_ring_through_a_ring_is_carried_by_it() {
    let one = ring(0.05, DVec3::ZERO, DVec3::Y, DVec3::Z);
    let other = ring(0.05, DVec3::new(0.0, 0.0, -0.06), DVec3::X, DVec3::Z);
    let mesh = both(one, other);
    let n = 160;
    // The top of the first.
    let held: Vec<u32> = (0..4).flat_map(|j| [39, 0, 1].map(|i| j * 40 + i)).collect();
    assert_eq!(crossings(&mesh, &mesh.positions), 0);
    let before = linking(&mesh.positions[40..80], &mesh.positions[n + 40..n + 80]);
    let end = rests(&mesh, &held, None, mesh.positions.clone());
    let after = linking(&end.positions[40..80], &end.positions[n + 40..n + 80]);
    assert!((before.abs() - 1.0).abs() < 0.1 && (after - before).abs() < 0.1, "{before} and {after}");
    // It hangs: all of it is below the top of the first, and it has come down on it.
    let lowest = |x: &[DVec3]| x.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let (first, second) = (lowest(&end.positions[..n]), lowest(&end.positions[n..]));
    assert!(second < first - 0.03, "{first} and {second}");
}

#[test]
fn a_garment_in_self_contact_ends_without_intersections_on_any_number_of_threads() {
    // A pullover in cotton, small for its vertices, whose sleeves fold.
    let scene = SceneSpec { garment: "flared-skirt@1500".into(), ..SceneSpec::default() }.load().unwrap().scene;
    let settings = Settings { fabric: Fabric::by_name("cotton").unwrap(), ..Settings::default() };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| drape(&scene, &settings, &mut unobserved).unwrap())
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one.self_intersecting_pairs, 0);
    assert!(one.positions == two.positions);
}
