//! Shapes that are known: with gravity off and no body a panel lies flat, and what is sewn of panels is the disc, cylinder and cone that
//! paper would make.

use glam::DVec3;
use partwise::garment::fabric::Fabric;
use partwise::garment::pattern::{SewingPattern, SewnGarment, sew};
use partwise::mechanics::energy::{Cloth, Contacts};
use partwise::mechanics::refine::{RefineOptions, refine_with};
use partwise::mechanics::solver_options::NewtonOptions;
use partwise::mesh::Topology;
use serde_json::{Value, json};

use crate::{parse, pattern, stitch, straight};

/// At rest without weight: a hundred-thousandth of it is left, with which everything falls together. `tolerance` is in
/// it: a hundred would be what counts as rest with all of it.
fn relaxed(sewn: &SewnGarment, tolerance: f64) -> (Vec<DVec3>, f64) {
    let mut fabric = Fabric::by_name("cotton").unwrap();
    fabric.density_kg_per_m2 *= 1e-5;
    // Bending as of paper, isotropic, because a cone of anisotropic cloth is not round.
    fabric.bending_nm = [100.0 * fabric.bending_nm[1]; 3];
    let topology = Topology::new(&sewn.mesh);
    let mut cloth = Cloth::new(&sewn.mesh, &topology, &sewn.rest, &fabric, &[]).unwrap();
    // A plane piece is an unstable equilibrium, so the start is perturbed deterministically.
    let moved = |(i, x): (usize, &DVec3)| {
        let wave = |k: f64| 1e-3 * (k * (i as f64 + 1.0)).sin();
        *x + DVec3::new(wave(12.9898), wave(78.233), wave(37.719))
    };
    let start = sewn.mesh.positions.iter().enumerate().map(moved).collect();
    // The criteria of rest are shares of the weight, of which this cloth has next to none.
    cloth.solver.newton = NewtonOptions { tolerance, damping: 1e4, ..NewtonOptions::default() };
    cloth.solver.softening.strain = 0.0;
    let options = RefineOptions { max_steps: Some(500), lasting: false, ..RefineOptions::default() };
    let rested =
        refine_with(&cloth, Contacts::none(), start, &options, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
    assert_eq!(rested.stop, partwise::mechanics::refine::Stop::Converged, "{:e}", rested.residual_over_weight);
    let strain = |(t, c): (&[u32; 3], &[glam::DVec2; 3])| {
        let side = |i: usize, j: usize| {
            rested.positions[t[i] as usize].distance(rested.positions[t[j] as usize]) / c[i].distance(c[j]) - 1.0
        };
        [side(0, 1), side(1, 2), side(2, 0)].into_iter().fold(0.0, |m: f64, s| m.max(s.abs()))
    };
    let most = sewn.mesh.triangles.iter().zip(&sewn.rest.corners).map(strain).fold(0.0, f64::max);
    (rested.positions, most)
}

/// Best plane through points: a point of it and its normal.
fn plane(x: &[DVec3]) -> (DVec3, DVec3) {
    let middle = x.iter().sum::<DVec3>() / x.len() as f64;
    // The normal is what all cross products share.
    let normal: DVec3 = x
        .windows(2)
        .map(|w| (w[0] - middle).cross(w[1] - middle))
        .fold(DVec3::ZERO, |n, c| if n.dot(c) < 0.0 { n - c } else { n + c });
    (middle, normal.normalize())
}

#[test]
fn every_panel_lies_flat() {
    let vertices = [[0.0, 0.0], [30.0, 0.0], [34.0, 20.0], [20.0, 24.0], [0.0, 40.0]];
    let mut panel = straight(&vertices, 20.0);
    panel["edges"][1]["curvature"] = json!({ "type": "quadratic", "params": [[0.5, 0.2]] });
    panel["rotation"] = json!([10.0, 20.0, 30.0]);
    let sewn = sew(&parse(&pattern(&json!({ "one": panel }), &json!([]))), 0.025).unwrap();
    let (x, strain) = relaxed(&sewn, 3.0);
    let (middle, normal) = plane(&x);
    let off = x.iter().map(|x| (*x - middle).dot(normal).abs()).fold(0.0, f64::max);
    assert!(strain < 1e-3 && off < 1e-3, "strain {strain}, {off} m off the plane");
}

#[test]
fn four_sectors_make_a_disc() {
    let radius = 20.0;
    let mut panels = serde_json::Map::new();
    let corner = [[0.0, 0.0], [radius, 0.0], [0.0, radius]];
    for k in 0..4 {
        let mut sector = straight(&corner, 20.0);
        sector["edges"][1]["curvature"] = json!({ "type": "circle", "params": [radius, 0, 1] });
        sector["rotation"] = json!([0.0, 0.0, 90.0 * f64::from(k)]);
        panels.insert(format!("sector_{k}"), sector);
    }
    let stitches: Vec<Value> =
        (0..4).map(|k| stitch((&format!("sector_{k}"), 2), (&format!("sector_{}", (k + 1) % 4), 0))).collect();
    let sewn = sew(&parse(&pattern(&Value::Object(panels), &json!(stitches))), 0.02).unwrap();
    let (x, strain) = relaxed(&sewn, 3.0);
    let topology = Topology::new(&sewn.mesh);
    let edge = topology.boundary_loops();
    assert_eq!(edge.len(), 1);
    let centre = x[sewn.seams[0].iter().copied().find(|v| sewn.seams[1].contains(v)).unwrap() as usize];
    let (middle, normal) = plane(&x);
    let off = x.iter().map(|x| (*x - middle).dot(normal).abs()).fold(0.0, f64::max);
    assert!(strain < 0.01 && off < 2e-3, "strain {strain}, {off} m off the plane");
    for &v in &edge[0] {
        let r = x[v as usize].distance(centre);
        assert!((r - 0.2).abs() < 0.002, "{r} m from the centre");
    }
}

/// Two panels sewn along both sides, front and back, relaxed; their axis is vertical.
fn tube(front: Value, back: Value, sides: [[usize; 2]; 2], tolerance: f64) -> (SewingPattern, SewnGarment, Vec<DVec3>) {
    let stitches: Vec<Value> = sides.iter().map(|[a, b]| stitch(("front", *a), ("back", *b))).collect();
    let read = parse(&pattern(&json!({ "front": front, "back": back }), &json!(stitches)));
    let sewn = sew(&read, 0.0125).unwrap();
    let (x, strain) = relaxed(&sewn, tolerance);
    assert!(strain < 0.01, "strain {strain}");
    (read, sewn, x)
}

/// The axis of a tube of two open ends: a point and the direction from the first end to the second, of its length, m.
fn axis(x: &[DVec3], ends: &[Vec<u32>]) -> (DVec3, DVec3) {
    assert_eq!(ends.len(), 2);
    let middle = |edge: &Vec<u32>| edge.iter().map(|&v| x[v as usize]).sum::<DVec3>() / edge.len() as f64;
    (middle(&ends[0]), middle(&ends[1]) - middle(&ends[0]))
}

/// How far along the axis (0 to 1) and how far from it (m) each vertex is, the ends left out: cloth bends less over its last edges.
fn about(x: &[DVec3], (origin, along): (DVec3, DVec3)) -> Vec<(f64, f64)> {
    let place = |x: &DVec3| {
        let t = (*x - origin).dot(along) / along.length_squared();
        (t, x.distance(origin + t * along))
    };
    x.iter().map(place).filter(|(t, _)| (0.3..=0.7).contains(t)).collect()
}

#[test]
fn two_rectangles_make_a_cylinder() {
    let width = 30.0;
    let front = straight(&[[-15.0, 0.0], [15.0, 0.0], [15.0, 20.0], [-15.0, 20.0]], 8.0);
    let back = straight(&[[-15.0, 0.0], [-15.0, 20.0], [15.0, 20.0], [15.0, 0.0]], -8.0);
    let (_, sewn, x) = tube(front, back, [[1, 2], [3, 0]], 3.0);
    let exact = 2.0 * 0.01 * width / std::f64::consts::TAU;
    let axis = axis(&x, &Topology::new(&sewn.mesh).boundary_loops());
    assert!((axis.1.length() / 0.2 - 1.0).abs() < 0.01, "height {}", axis.1.length());
    for (_, r) in about(&x, axis) {
        assert!((r / exact - 1.0).abs() < 0.01, "radius {r}, expected {exact}");
    }
}

#[test]
fn two_sectors_make_a_cone() {
    // Sectors of 60 degrees between 15 and 40 cm: together a third of a turn, so that the cone's radius is a third of the flat one.
    let (inner, outer) = (15.0, 40.0);
    let at = |r: f64, degrees: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        [r * cos, r * sin]
    };
    let sector = |clockwise: bool, z: f64| {
        let (a, b) = (-90.0 - 30.0, -90.0 + 30.0);
        let loop_of = [at(outer, a), at(outer, b), at(inner, b), at(inner, a)];
        let vertices = if clockwise { [loop_of[0], loop_of[3], loop_of[2], loop_of[1]] } else { loop_of };
        let mut panel = straight(&vertices, z);
        let (hem, waist) = if clockwise { (3, 1) } else { (0, 2) };
        panel["edges"][hem]["curvature"] = json!({ "type": "circle", "params": [outer, 0, i32::from(!clockwise)] });
        panel["edges"][waist]["curvature"] = json!({ "type": "circle", "params": [inner, 0, i32::from(clockwise)] });
        panel
    };
    let (_, sewn, x) = tube(sector(false, 8.0), sector(true, -8.0), [[1, 2], [3, 0]], 15.0);
    let ends = Topology::new(&sewn.mesh).boundary_loops();
    let axis = axis(&x, &ends);
    let exact = 0.01 * (outer - inner) * (1.0 - 1.0 / 9.0_f64).sqrt();
    assert!((axis.1.length() / exact - 1.0).abs() < 0.01, "height {}, expected {exact}", axis.1.length());
    let first = x[ends[0][0] as usize].distance(axis.0);
    let (from, to) = if first > 0.09 { (outer, inner) } else { (inner, outer) };
    for (t, r) in about(&x, axis) {
        let exact = 0.01 / 3.0 * (from + t * (to - from));
        assert!((r / exact - 1.0).abs() < 0.01, "radius {r} at {t}, expected {exact}");
    }
}
