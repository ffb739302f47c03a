//! Skin through cloth: bodies rounder than the cloth's mesh is fine, and ends of a body that stick through.

use partwise::Scene;
use partwise::certificate::certify;
use partwise::mesh::export::write_mesh;
use partwise::mesh::self_intersection::crossing_pairs;
use partwise::mesh::{Axis, Unit};

use super::*;

/// Squares of five centimetres that come down on a knob of three, under the middle of one of them.
fn over_a_knob() -> Scene {
    let knob = ball(0.03);
    let at = DVec3::new(0.008, 0.016, 2e-3);
    let knob = knob.with_positions(knob.positions.iter().map(|x| *x + at).collect());
    let body = Body::new(&both(plate().mesh().clone(), knob)).unwrap();
    let mesh = sheet(6, 6, DVec3::new(-0.15, -0.15, 0.08), DVec3::X * 0.05, DVec3::Y * 0.05);
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
    // It lies on it rather than hovers: some place of a triangle is nearer than twice the cloth's thickness.
    let nearest = scene.garment.triangles.iter().flat_map(|t| {
        let [a, b, c] = t.map(|v| end.positions[v as usize]);
        let steps = (0..=20).flat_map(|i| (0..=20 - i).map(move |j| [i, j].map(|k| f64::from(k) / 20.0)));
        steps.map(move |[s, t]| a + (b - a) * s + (c - a) * t)
    });
    let top = nearest.filter(|x| x.z > 0.03).map(|x| scene.body.nearest(x).signed_distance).fold(1.0, f64::min);
    let thickness = cloth.thickness[0];
    assert!(top > 0.0 && top < 2.0 * thickness, "{top} m, thickness {thickness} m");
    // What the knob carries is found again from where the vertices are.
    let certificate = certify(&scene, &Fabric::by_name("jersey").unwrap(), &end.positions).unwrap();
    assert!(certificate.passes, "{:#?}", certificate.findings);
}

#[test]
fn a_foot_that_sticks_through_a_trouser_leg_is_said_and_taken_inside() {
    // A shin and a foot, of two boxes that share no face: the foot is 12 mm thick, and the leg is put through it.
    let cuboid = |low: DVec3, high: DVec3| {
        let half = plate();
        let (middle, size) = ((low + high) * 0.5, high - low);
        let at = |x: &DVec3| middle + (*x + DVec3::Z * 0.1) * DVec3::new(size.x, size.y, 5.0 * size.z);
        half.mesh().with_positions(half.mesh().positions.iter().map(at).collect())
    };
    let shin = cuboid(DVec3::new(-0.03, -0.03, 0.04), DVec3::new(0.03, 0.03, 0.5));
    let foot = cuboid(DVec3::new(-0.05, -0.03, 0.02), DVec3::new(0.14, 0.03, 0.032));
    let body = both(shin, foot);
    let (around, along) = (36u32, 28u32);
    let at = |i: u32, j: u32| {
        let a = TAU * f64::from(i) / f64::from(around);
        DVec3::new(0.08 * a.cos(), 0.08 * a.sin(), 0.4 * f64::from(j) / f64::from(along))
    };
    let positions = (0..=along).flat_map(|j| (0..around).map(move |i| at(i, j))).collect();
    let squares = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b] = [j * around + i, j * around + (i + 1) % around];
        [[a, b, b + around], [a, b + around, a + around]]
    });
    let leg = TriMesh::new(positions, triangles.collect());
    let before = crossing_pairs(&leg, &body).len();
    let folder = tempfile::tempdir().unwrap();
    let (on, cut) = (folder.path().join("body.obj"), folder.path().join("leg.obj"));
    write_mesh(&on, &body).unwrap();
    write_mesh(&cut, &leg).unwrap();
    let spec = SceneSpec::new(on.display().to_string(), cut.display().to_string());
    let loaded = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), ..spec.clone() }.load().unwrap();
    let skin = |scene: &Scene| crossing_pairs(&scene.garment, scene.body.mesh()).len();
    assert!(before > 20 && skin(&loaded.scene) == 0, "{before} {}", skin(&loaded.scene));
    let said = loaded.notes().join("\n");
    assert!(said.contains("stuck through the garment") && loaded.warnings().is_empty(), "{said}");
    let as_it_is = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), push_out: false, ..spec }.load().unwrap();
    assert_eq!(skin(&as_it_is.scene), before);
}
