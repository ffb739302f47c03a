//! The certificate: a cloth that lies on a table has one, and each of its lines fails for a garment made to fail it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod fixtures;

use std::ops::ControlFlow;

use fixtures::{Diagonals, cuboid, grid, scene};
use glam::{DMat3, DVec3};
use partwise::Scene;
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, Refined, Stop, refine_with};
use partwise::mesh::TriMesh;
use partwise::study::certificate::{Certificate, CertifyError, Forces, certify};

/// Squares along each side of the cloth, and the length of one, m.
const SQUARES: u32 = 8;
const SIDE: f64 = 0.02;

/// A table 2 `half` wide with its top at z = 0, turned by `turn` about the origin.
fn table(half: f64, turn: DMat3) -> TriMesh {
    let mut table = cuboid(DVec3::new(-half, -half, -1.0), DVec3::new(half, half, 0.0));
    table.positions.iter_mut().for_each(|x| *x = turn * *x);
    table
}

/// A square cloth in the plane z = 0 about the origin.
fn sheet() -> TriMesh {
    let middle = 0.5 * f64::from(SQUARES);
    let at = |i, j| DVec3::new(f64::from(i) - middle, f64::from(j) - middle, 0.0) * SIDE;
    grid(SQUARES, SQUARES, Diagonals::Parallel, at)
}

fn jersey() -> Fabric {
    Fabric::by_name("jersey").unwrap()
}

/// The distance that the cloth keeps from what it lies on, m.
fn offset(scene: &Scene) -> f64 {
    Cloth::new(&scene.garment, &scene.topology, &scene.rest, &jersey(), &scene.held).unwrap().offset
}

fn certified(scene: &Scene, x: &[DVec3]) -> Certificate {
    certify(scene, &jersey(), x).unwrap()
}

/// The cloth on a table, at rest: where each of the others starts from.
fn lying() -> (Scene, Vec<DVec3>) {
    let scene = scene(&table(1.0, DMat3::IDENTITY), sheet());
    let up = DVec3::Z * offset(&scene);
    let x = scene.garment.positions.iter().map(|x| *x + up).collect();
    (scene, x)
}

#[track_caller]
fn fails(certificate: &Certificate, line: &str) {
    let finding = certificate.finding(line).unwrap();
    assert!(!finding.passes && !certificate.passes, "{finding:?}");
}

#[test]
fn a_cloth_on_a_table_passes_every_line() {
    let (scene, x) = lying();
    let certificate = certified(&scene, &x);
    assert!(certificate.passes, "{:#?}", certificate.findings);
    assert_eq!(certificate.findings.len(), 12);
    let carried = &certificate.finding("forces add up").unwrap().remark;
    assert!(carried.contains("the body carries 100.0 %"), "{carried}");
}

#[test]
fn in_the_air_nothing_holds_it() {
    let (scene, x) = lying();
    let x: Vec<DVec3> = x.iter().map(|x| *x + DVec3::Z * 0.05).collect();
    let certificate = certified(&scene, &x);
    for line in ["residual", "forces add up", "still moving", "distance to rest"] {
        fails(&certificate, line);
    }
    // One unit of weight on n vertices, about alike.
    let residual = certificate.finding("residual").unwrap().value;
    let alike = 1.0 / f64::from(SQUARES + 1);
    assert!(residual > alike && residual < 1.2 * alike, "{residual}");
    assert!((certificate.finding("forces add up").unwrap().value - 1.0).abs() < 1e-9);
}

#[test]
fn on_a_slope_steeper_than_its_friction_it_slides() {
    let steepest = jersey().friction.atan();
    for (angle, slides) in [(steepest - 0.02, false), (steepest + 0.02, true)] {
        let turn = DMat3::from_rotation_y(angle);
        let mut scene = scene(&table(1.0, turn), sheet());
        let up = DVec3::Z * offset(&scene);
        let x: Vec<DVec3> = scene.garment.positions.iter().map(|x| turn * (*x + up)).collect();
        scene.garment = scene.garment.with_positions(x.clone());
        let certificate = certified(&scene, &x);
        let friction = certificate.finding("friction").unwrap();
        assert_eq!(friction.passes, !slides, "{angle}: {friction:?}");
    }
}

#[test]
fn compressed_between_two_held_edges_it_would_buckle() {
    let (mut scene, _) = lying();
    let half = 0.5 * f64::from(SQUARES) * SIDE;
    let on_edge = |x: &DVec3| x.x.abs() > half - 1e-9;
    scene.held = (0u32..).zip(&scene.garment.positions).filter(|(_, x)| on_edge(x)).map(|(v, _)| v).collect();
    let squeezed = |by: f64| -> Vec<DVec3> {
        scene.garment.positions.iter().map(|x| DVec3::new(x.x * (1.0 - by), x.y, 0.1)).collect()
    };
    let finding = |by| certified(&scene, &squeezed(by)).finding("lowest curvature").unwrap().clone();
    let flat = finding(0.0);
    assert!(flat.passes && flat.value > 0.0, "{flat:?}");
    let squeezed = finding(0.05);
    assert!(!squeezed.passes && squeezed.remark.contains("unstable modes"), "{squeezed:?}");
}

/// A cloth that hangs free over the table, its vertices at which `holds` is true held.
fn hanging(holds: impl Fn(DVec3) -> bool) -> (Scene, Vec<DVec3>) {
    let (mut scene, _) = lying();
    let upright = |x: &DVec3| DVec3::new(x.x, 0.0, x.y + 0.2);
    let x: Vec<DVec3> = scene.garment.positions.iter().map(upright).collect();
    scene.garment = scene.garment.with_positions(x.clone());
    scene.held = (0u32..).zip(&x).filter(|(_, x)| holds(**x)).map(|(v, _)| v).collect();
    (scene, x)
}

/// The equilibrium reached from `start`; `lasting` requires a stable one.
fn rests(scene: &Scene, start: &[DVec3], lasting: bool) -> Refined {
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &jersey(), &scene.held).unwrap();
    let options = RefineOptions { lasting, ..RefineOptions::default() };
    let mut go_on = |_: &partwise::mechanics::refine::Step<'_>| ControlFlow::Continue(());
    let end = refine_with(&cloth, Contacts::none(), start.to_vec(), &options, &mut go_on).unwrap();
    assert_eq!(end.stop, Stop::Converged);
    end
}

#[test]
fn a_strip_pressed_along_its_plane_stands_straight_until_it_is_looked_at() {
    let half = 0.5 * f64::from(SQUARES) * SIDE;
    let (mut scene, flat) = hanging(|x| x.x.abs() > half - 1e-9);
    let by = 0.05;
    let start: Vec<DVec3> = flat.iter().map(|x| DVec3::new(x.x * (1.0 - by), x.y, x.z)).collect();
    // Placed with its held edges together, and cut as it was before: the rest shape stays.
    scene.garment = scene.garment.with_positions(start.clone());
    let deepest = |x: &[DVec3]| x.iter().map(|x| x.y.abs()).fold(0.0, f64::max);
    let (straight, buckled) = (rests(&scene, &start, false), rests(&scene, &start, true));
    assert!(deepest(&straight.positions) < 1e-9, "{}", deepest(&straight.positions));
    fails(&certified(&scene, &straight.positions), "lowest curvature");
    assert!(buckled.energy < straight.energy);
    // The depth of a sine of the same arc length, less in-plane compression.
    let sine = 2.0 / std::f64::consts::PI * by.sqrt() * 2.0 * half;
    let deep = deepest(&buckled.positions);
    assert!(deep > 0.5 * sine && deep < 1.3 * sine, "{deep} m, a sine {sine} m");
    let certificate = certified(&scene, &buckled.positions);
    assert!(certificate.passes, "{:#?}", certificate.findings);
}

#[test]
fn a_cloth_that_leans_by_half_a_degree_still_swings() {
    let half = 0.5 * f64::from(SQUARES) * SIDE;
    let top = 0.2 + half;
    let (scene, flat) = hanging(|x| x.z > top - 1e-9);
    let straight = rests(&scene, &flat, true).positions;
    let turn = DMat3::from_rotation_x(8e-3);
    let hinge = DVec3::Z * top;
    let leaning: Vec<DVec3> = straight.iter().map(|x| hinge + turn * (*x - hinge)).collect();
    let tip = |x: &[DVec3]| x.iter().map(|x| x.y.abs()).fold(0.0, f64::max);
    assert!(tip(&leaning) > 1e-3);
    let left = rests(&scene, &leaning, false);
    assert_eq!(
        (left.steps, left.positions == leaning),
        (0, true),
        "its residual is small: {}",
        left.residual_over_weight
    );
    fails(&certified(&scene, &leaning), "still moving");
    let swung = rests(&scene, &leaning, true);
    assert!(swung.steps > 0 && tip(&swung.positions) < 2e-4, "{} steps, {} m", swung.steps, tip(&swung.positions));
    assert!(certified(&scene, &swung.positions).passes);
}

/// A curtain that hangs from its upper edge passes where it was hung, and nowhere else.
#[test]
fn a_curtain_moved_as_a_whole_fails_by_its_held_edge() {
    let top = 0.2 + 0.5 * f64::from(SQUARES) * SIDE;
    let (scene, flat) = hanging(|x| x.z > top - 1e-9);
    let hung = rests(&scene, &flat, true).positions;
    assert!(certified(&scene, &hung).passes);
    let turn = DMat3::from_rotation_z(40f64.to_radians());
    let moves: [(&str, DMat3, DVec3); 4] = [
        ("up", DMat3::IDENTITY, DVec3::Z * 0.3),
        ("down", DMat3::IDENTITY, DVec3::Z * -0.1),
        ("aside", DMat3::IDENTITY, DVec3::X * 0.1),
        ("turned", turn, DVec3::ZERO),
    ];
    for (name, turn, by) in moves {
        let moved: Vec<DVec3> = hung.iter().map(|x| turn * *x + by).collect();
        let certificate = certified(&scene, &moved);
        fails(&certificate, "held edges");
        let others = certificate.findings.iter().filter(|f| !f.passes && f.name != "held edges").count();
        assert_eq!(others, 0, "{name}: {:#?}", certificate.findings);
        let remark = &certificate.finding("held edges").unwrap().remark;
        assert!(remark.contains("of 9 held"), "{remark}");
    }
}

#[test]
fn a_vertex_in_the_table_is_inside_and_its_triangles_cross() {
    let (scene, mut x) = lying();
    x[40].z = -0.005;
    let certificate = certified(&scene, &x);
    fails(&certificate, "inside the body");
    fails(&certificate, "skin through cloth");
    assert_eq!(certificate.finding("inside the body").unwrap().value, 1.0);
}

#[test]
fn a_column_through_a_triangle_shows_without_a_vertex_inside() {
    let column = table(0.002, DMat3::IDENTITY);
    let column = column.with_positions(column.positions.iter().map(|x| *x + DVec3::new(0.01, 0.005, 0.0)).collect());
    let scene = scene(&column, sheet());
    let x: Vec<DVec3> = scene.garment.positions.iter().map(|x| *x - DVec3::Z * 0.01).collect();
    let certificate = certified(&scene, &x);
    fails(&certificate, "skin through cloth");
    assert!(certificate.finding("inside the body").unwrap().passes);
}

#[test]
fn a_point_under_a_triangle_touches_its_corners_and_no_others() {
    // Away from its middle and those of its sides: a shallow pyramid, its top under six tenths of one corner.
    let flat = sheet();
    let triangle = flat.triangles[20];
    let [a, b, c] = triangle.map(|v| flat.positions[v as usize]);
    let top = a * 0.6 + b * 0.25 + c * 0.15;
    let around = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| top + DVec3::new(x, y, -0.2) * 0.5);
    let corners = [top, around[0], around[1], around[2], around[3], top - DVec3::Z];
    let sides = [[1, 2], [2, 3], [3, 4], [4, 1]].into_iter().flat_map(|[u, v]| [[0, u, v], [5, v, u]]).collect();
    let scene = scene(&TriMesh::new(corners.to_vec(), sides), flat);
    let thickness = jersey().thickness_m;
    let touched = |height: f64| -> Vec<u32> {
        let x: Vec<DVec3> = scene.garment.positions.iter().map(|x| *x + DVec3::Z * height).collect();
        let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &jersey(), &scene.held).unwrap();
        let forces = Forces::new(&cloth, &scene.body, &x);
        forces.reactions.iter().filter(|t| t.of_body).flat_map(|t| &t.shares).map(|(v, _)| *v).collect()
    };
    let mut found = touched(thickness + 2e-4);
    found.sort_unstable();
    found.dedup();
    let mut expected = triangle.to_vec();
    expected.sort_unstable();
    assert_eq!(found, expected);
    let keeps = offset(&scene);
    assert_eq!(touched(keeps + 1e-3), [0; 0]);
}

#[test]
fn a_corner_folded_through_the_cloth_crosses_it() {
    let (scene, mut x) = lying();
    // The corner's neighbours are lifted, and it is stuck through the middle of the cloth.
    for (v, up) in [(0, -0.005), (1, 0.01), (9, 0.01), (10, 0.01)] {
        x[v] = x[40] + DVec3::new(0.3 * SIDE, 0.2 * SIDE + v as f64 * 1e-4, up);
    }
    fails(&certified(&scene, &x), "cloth through cloth");
}

#[test]
fn stretched_by_sixty_percent_it_tears() {
    let (scene, x) = lying();
    let x: Vec<DVec3> = x.iter().map(|x| DVec3::new(1.6 * x.x, x.y, x.z)).collect();
    let certificate = certified(&scene, &x);
    fails(&certificate, "largest strain");
    assert!((certificate.finding("largest strain").unwrap().value - 60.0).abs() < 1e-6);
}

#[test]
fn a_mesh_that_is_not_a_garment_is_refused() {
    let (scene, mut x) = lying();
    x[7].y = f64::NAN;
    let said = certify(&scene, &jersey(), &x).unwrap_err();
    assert!(matches!(said, CertifyError::NotFinite { vertex: 7 }) && said.to_string().contains("number 8"), "{said}");
    x.pop();
    assert!(matches!(certify(&scene, &jersey(), &x), Err(CertifyError::Count { found: 80, expected: 81 })));
}
