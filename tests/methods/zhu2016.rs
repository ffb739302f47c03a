//! Springs, units, quadrics and the hierarchy.

use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::methods::implicit_euler::Obstacle;
use partwise::mechanics::methods::zhu2016::Zhu2016;
use partwise::mechanics::methods::zhu2016::hierarchy::Hierarchy;
use partwise::mechanics::methods::{Ended, Exhibit, MethodError, MethodInput, RestRule};
use partwise::{DVec3, GRAVITY, Scene, SceneSpec};

use crate::fixtures::isotropic;
use crate::scenes::{STILL, drape, hanging, rectangle};

#[test]
fn a_hanging_strip_stretches_as_its_closed_form() {
    let (length, density, stretch) = (0.6, 0.2, 60.0);
    let scene = hanging(rectangle(DVec3::X * 0.1, DVec3::NEG_Z * length, 6, 36), (0..7).collect());
    let made = drape(&Zhu2016::default(), &scene, &isotropic(density, stretch, 0.3, 1e-6), &STILL).unwrap();
    assert_eq!(made.ended, Ended::AtRest);
    let hem = &made.positions[made.positions.len() - 7..];
    let lowest = hem.iter().map(|p| p.z).sum::<f64>() / 7.0;
    let ratio = (-lowest - length) / (density * GRAVITY * length * length / (2.0 * stretch));
    // Springs along and across carry all of Y, and the diagonals add to it.
    assert!((0.8..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn no_spring_stays_longer_than_its_limit() {
    let scene = hanging(rectangle(DVec3::X * 0.1, DVec3::NEG_Z * 0.2, 2, 4), (0..3).collect());
    // Without a limit its upper edge would be strained by a half.
    let soft = isotropic(0.2, 0.8, 0.3, 1e-7);
    let made = drape(&Zhu2016 { strain_limit: 0.05, ..Zhu2016::default() }, &scene, &soft, &STILL).unwrap();
    let longest = |made: &[DVec3]| {
        let ends = scene.topology.edges.iter().map(|edge| edge.map(|v| v as usize));
        let rest = &scene.garment.positions;
        ends.map(|[a, b]| made[a].distance(made[b]) / rest[a].distance(rest[b])).fold(0.0, f64::max)
    };
    // The sweeps of a step leave an error, which grows with the number of springs in series.
    assert!(longest(&made.positions) < 1.1, "{}", longest(&made.positions));
    let count = |name: &str| made.counts.iter().find(|c| c.0 == name).unwrap().1;
    assert!(count("strain corrections") > 0);
    let free = drape(&Zhu2016 { strain_limit: 10.0, ..Zhu2016::default() }, &scene, &soft, &STILL).unwrap();
    assert!(longest(&free.positions) > 1.3, "{}", longest(&free.positions));
}

/// The dress form with a skirt.
fn dressed() -> Scene {
    SceneSpec::new("form", "flared-skirt@900").load().unwrap().scene
}

#[test]
fn the_hierarchy_agrees_with_an_exact_search() {
    let scene = dressed();
    let fabric = isotropic(0.2, 60.0, 0.3, 1e-5);
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabric, &[]).unwrap();
    let body = scene.body.mesh();
    let normals = body.vertex_normals();
    // Points about the skin from 15 mm inside to 15 mm outside, as many at a time as the cloth has vertices.
    for (round, depth) in [-0.015, -0.004, 0.0, 0.5 * cloth.offset, 0.99 * cloth.offset, 0.015].into_iter().enumerate()
    {
        let mut hierarchy = Hierarchy::new(&MethodInput { scene: &scene, fabric: &fabric, cloth: &cloth }).unwrap();
        let pick = |i: usize| (i * 7919 + round * 131) % body.vertex_count();
        let points: Vec<DVec3> = (0..cloth.vertex_count())
            .map(|i| {
                let ([a, b, c], t) = (body.triangles[(i * 31 + round) % body.triangles.len()], 1.0 / 3.0);
                let on_face = i % 2 == 0;
                let p = if on_face {
                    [a, b, c].iter().map(|&v| body.positions[v as usize]).sum::<DVec3>() * t
                } else {
                    body.positions[pick(i)]
                };
                let n = if on_face { normals[a as usize] } else { normals[pick(i)] };
                p + n * depth
            })
            .collect();
        let exact = scene.body.nearest_all(&points);
        let touches = hierarchy.touches(&points).to_vec();
        let of = |v: usize| touches.iter().find(|t| t.vertex as usize == v);
        for (v, exact) in exact.iter().enumerate() {
            // In creases the sign of blended normals may differ within rounding of the skin.
            if exact.signed_distance < cloth.offset - 1e-9 {
                let touch = of(v).unwrap_or_else(|| panic!("vertex {v} at {} was missed", exact.signed_distance));
                let off = (cloth.offset - touch.depth - exact.signed_distance).abs();
                assert!(
                    off < 1e-9 || exact.signed_distance < -0.01,
                    "vertex {v}: off by {off} at {}",
                    exact.signed_distance
                );
            } else if exact.signed_distance > cloth.offset + 1e-9 {
                assert!(of(v).is_none(), "vertex {v} at {} does not touch", exact.signed_distance);
            }
        }
        let counts = hierarchy.tests;
        assert_eq!(counts.world, cloth.vertex_count() as u64);
        assert!(counts.quadrics < counts.units && counts.touching <= counts.triangles, "{counts:?}");
        // Seven units: head, two arms, trunk, hip, two legs.
        assert!(hierarchy.notes()[0].contains("7 units, 5 of them limbs"), "{:?}", hierarchy.notes());
    }
}

#[test]
fn a_skirt_comes_to_rest_outside_the_body_with_the_same_bits_every_time() {
    let scene = dressed();
    let fabric = Fabric::default();
    let rule = RestRule::default();
    let made = drape(&Zhu2016::default(), &scene, &fabric, &rule).unwrap();
    assert_eq!(made.ended, Ended::AtRest);
    assert!(made.rms_speed_m_per_s < 0.01);
    assert!(scene.body.nearest_all(&made.positions).iter().all(|p| p.signed_distance > 0.0));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let again = one.install(|| drape(&Zhu2016::default(), &scene, &fabric, &rule)).unwrap();
    assert_eq!(made.positions, again.positions);
    assert_eq!(made.counts, again.counts);
}

#[test]
fn an_open_body_is_refused_in_one_line() {
    let mut scene = dressed();
    let mut open = scene.body.mesh().clone();
    open.triangles.pop();
    scene.body = partwise::body::distance::Body::new_open(&open).unwrap();
    let error = drape(&Zhu2016::default(), &scene, &Fabric::default(), &STILL).unwrap_err();
    assert!(matches!(error, MethodError::Unfit { .. }));
    assert!(error.to_string().contains("3 boundary edges") && !error.to_string().contains('\n'), "{error}");
}

#[test]
fn the_quadrics_can_be_shown() {
    let scene = dressed();
    let rule = RestRule { limit_s: 0.1, ..RestRule::default() };
    let method = Zhu2016 { exhibit: true, ..Zhu2016::default() };
    let made = drape(&method, &scene, &Fabric::default(), &rule).unwrap();
    assert_eq!(made.ended, Ended::TimeOver);
    let [("units and quadrics", Exhibit::Lines(lines))] = made.exhibits.as_slice() else { panic!() };
    let quadrics = made.counts.iter().find(|c| c.0 == "quadrics").unwrap().1;
    assert_eq!(lines.len() as u64, 2 * quadrics);
    // Each slice's lines, at 1 + ε, go around the body: none of its vertices is outside all of them by height and breadth.
    let reach = lines.iter().flat_map(|(_, line)| line).map(|p| p.z).fold(0.0, f64::max);
    let top = scene.body.mesh().positions.iter().map(|p| p.z).fold(0.0, f64::max);
    assert!(reach > top, "{reach} {top}");
}
