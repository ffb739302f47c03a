//! Body through cloth: bodies with more curvature than the mesh of the cloth resolves, and protrusions.

use partwise::Scene;
use partwise::mesh::export::write_mesh;
use partwise::mesh::self_intersection::crossing_pairs;
use partwise::mesh::{Axis, Unit};
use partwise::study::certificate::certify;

use super::*;

/// Top of the knob, m.
const KNOB: DVec3 = DVec3::new(0.008, 0.016, 0.012);

/// A sheet of 5 cm squares above a spherical knob, 12 mm high with a diameter of 6 cm, in the interior of one square.
fn over_a_knob() -> Scene {
    let knob = ball(0.03);
    let at = KNOB - DVec3::Z * 0.06;
    let knob = knob.with_positions(knob.positions.iter().map(|x| *x + at).collect());
    let body = Body::new(&both(plate().mesh().clone(), knob)).unwrap();
    let mesh = sheet(6, 6, DVec3::new(-0.15, -0.15, 0.02), DVec3::X * 0.05, DVec3::Y * 0.05);
    let rest = RestShape::from_edges(&mesh).unwrap();
    Scene::new(body, mesh, rest)
}

#[test]
fn a_coarse_cloth_lies_on_a_knob_that_would_show_through_it() {
    let scene = over_a_knob();
    let (cloth, start) = (cloth(&scene.garment, &[]), scene.garment.positions.clone());
    let skin = |x: &[DVec3]| crossing_pairs(&scene.garment.with_positions(x.to_vec()), scene.body.mesh()).len();
    let mut go_on = |_: &partwise::mechanics::refine::Step<'_>| std::ops::ControlFlow::Continue(());
    let bare = RefineOptions { self_contact: false, ..RefineOptions::default() };
    let through = refine(&cloth, &scene.body, start.clone(), &bare, &mut go_on).unwrap();
    assert!(skin(&through.positions) > 10, "{}", skin(&through.positions));
    let end = rests(&scene.garment, &[], Some(&scene.body), start);
    assert_eq!(skin(&end.positions), 0);
    // The cloth touches the knob: a point of a triangle is nearer than twice the thickness of the cloth.
    let nearest = scene.garment.triangles.iter().flat_map(|t| {
        let [a, b, c] = t.map(|v| end.positions[v as usize]);
        let steps = (0..=20).flat_map(|i| (0..=20 - i).map(move |j| [i, j].map(|k| f64::from(k) / 20.0)));
        steps.map(move |[s, t]| a + (b - a) * s + (c - a) * t)
    });
    let on_it = nearest.filter(|x| x.truncate().distance(KNOB.truncate()) < 0.015);
    let top = on_it.map(|x| scene.body.nearest(x).signed_distance).fold(1.0, f64::min);
    let thickness = cloth.thickness[0];
    assert!(top > 0.0 && top < 2.0 * thickness, "{top} m, thickness {thickness} m");
    // The certificate finds the force of the knob from the positions alone.
    let certificate = certify(&scene, &Fabric::by_name("jersey").unwrap(), &end.positions).unwrap();
    assert!(certificate.passes, "{:#?}", certificate.findings);
}

#[test]
fn a_foot_through_a_trouser_leg_is_reported_and_moved_inside() {
    // The foot is 4 cm thick and reaches 5 cm out of the leg.
    let round = ball(1.0);
    let at = |x: &DVec3| DVec3::new(0.045, 0.0, 0.03) + (*x - DVec3::Z) * DVec3::new(0.095, 0.035, 0.02);
    let foot = round.with_positions(round.positions.iter().map(at).collect());
    let (around, along) = (36u32, 28u32);
    let at = |i: u32, j: u32| {
        let a = TAU * f64::from(i) / f64::from(around);
        DVec3::new(0.09 * a.cos(), 0.09 * a.sin(), 0.4 * f64::from(j) / f64::from(along))
    };
    let positions = (0..=along).flat_map(|j| (0..around).map(move |i| at(i, j))).collect();
    let squares = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b] = [j * around + i, j * around + (i + 1) % around];
        [[a, b, b + around], [a, b + around, a + around]]
    });
    let leg = TriMesh::new(positions, triangles.collect());
    assert!(crossing_pairs(&leg, &foot).len() > 20);
    let folder = tempfile::tempdir().unwrap();
    let (on, cut) = (folder.path().join("body.obj"), folder.path().join("leg.obj"));
    write_mesh(&on, &foot).unwrap();
    write_mesh(&cut, &leg).unwrap();
    let spec = SceneSpec::new(on.display().to_string(), cut.display().to_string());
    let spec = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), hold: Some("top".into()), ..spec };
    let loaded = spec.load().unwrap();
    let message = loaded.notes().join("\n");
    assert!(message.contains("stuck through the garment") && loaded.warnings().is_empty(), "{message}");
    // Without the repair at loading, the solve moves the foot inside.
    let as_it_is = SceneSpec { push_out: false, ..spec }.load().unwrap();
    assert_eq!(as_it_is.pushed_out.protrusion_move_m, 0.0);
    for scene in [loaded.scene, as_it_is.scene] {
        let end = drape(&scene, &Settings::default(), &mut unobserved).unwrap();
        let skin = crossing_pairs(&scene.garment.with_positions(end.positions.clone()), scene.body.mesh()).len();
        assert_eq!((skin, end.self_intersecting_pairs, end.penetrating_vertices), (0, 0, 0));
        assert!(end.state.unwrap().residual_over_weight < 1e-3);
        // The toes end at 0.14.
        assert!(end.positions.iter().any(|x| x.x > 0.14 && x.z < 0.06));
    }
}
