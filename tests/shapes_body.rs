//! The dress form: requested girths, measured by slicing; closed; smooth; the same bits on every run.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use partwise::DVec3;
use partwise::body::dress_form::{BodySpec, DressForm, dress_form};
use partwise::body::girth::{Plane, loop_around, section};
use partwise::mesh::self_intersection::self_intersecting_pairs;
use partwise::mesh::{Topology, TriMesh};

fn assert_girths(form: &DressForm, mesh: &TriMesh, what: &str) {
    for mark in form.girths() {
        let found = loop_around(mesh, mark.plane).unwrap().tape_length();
        assert!(
            (found / mark.requested - 1.0).abs() < 0.01,
            "{what}: {} is {:.2} cm, requested {:.2}",
            mark.name,
            100.0 * found,
            100.0 * mark.requested
        );
    }
}

fn assert_closed(mesh: &TriMesh, what: &str) {
    let topology = Topology::new(mesh);
    assert!(topology.edge_valence.iter().all(|&v| v == 2), "{what}");
    assert_eq!(topology.components().1, 1, "{what}");
    // V − E + F = 2: a sphere, so arms and legs do not touch anything.
    assert_eq!(mesh.positions.len() + mesh.triangles.len(), topology.edges.len() + 2, "{what}");
    let mut directed: Vec<(u32, u32)> = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    directed.sort_unstable();
    assert!(directed.windows(2).all(|w| w[0] != w[1]), "{what}: winding");
}

fn volume(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[test]
fn the_default_form_has_the_girths_of_size_38() {
    let form = DressForm::new(&BodySpec::default()).unwrap();
    let mesh = form.mesh(15_000).unwrap();
    assert_eq!(mesh.triangles.len(), 15_000);
    assert_closed(&mesh, "default");
    assert_girths(&form, &mesh, "default");
    assert!(self_intersecting_pairs(&mesh).is_empty());
    // A woman of this size weighs about 60 kg and floats: 50 to 70 litres, and outward winding makes it positive.
    assert!((0.050..0.070).contains(&volume(&mesh)), "{}", volume(&mesh));
}

#[test]
fn the_form_stands_on_the_floor_has_its_stature_and_faces_minus_y() {
    let mesh = dress_form(&BodySpec::default()).unwrap();
    let (low, high) = mesh.bounds().unwrap();
    assert!(low.z.abs() < 0.003 && (high.z - 1.68).abs() < 0.005, "{low} {high}");
    // Left and right alike to a fraction of an edge; toes in front of the heels, and of everything else.
    assert!((low.x + high.x).abs() < 0.005);
    let foremost = mesh.positions.iter().min_by(|a, b| a.y.total_cmp(&b.y)).unwrap();
    assert!(foremost.z < 0.06, "{foremost}");
    // The crotch is where the middle plane's outline is lowest.
    let outline = section(&mesh, Plane { origin: DVec3::new(0.0001, 0.0, 0.0), normal: DVec3::X });
    let crotch = outline.iter().flat_map(|l| &l.points).map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!((crotch - 0.816).abs() < 0.02, "{crotch}");
}

#[test]
fn triangles_are_well_shaped_and_the_surface_is_smooth() {
    let mesh = dress_form(&BodySpec::default()).unwrap();
    let small = (0..mesh.triangles.len()).filter(|&t| smallest_angle(mesh.corners(t)) < 20.0).count();
    assert!(small * 100 < mesh.triangles.len(), "{small}");
    // Neighbouring triangles turn by a few degrees; by more only at finger tips, the soles' edges, and the saddles at crotch and
    // armpits, where the form is as narrow as an edge is long.
    let topology = Topology::new(&mesh);
    let normal = |t: u32| mesh.double_area_vector(t as usize).normalize();
    let mut turns: Vec<f64> =
        topology.edge_triangles.iter().map(|&[a, b]| normal(a).angle_between(normal(b)).to_degrees()).collect();
    turns.sort_by(f64::total_cmp);
    let share = |part: f64| turns[(part * turns.len() as f64) as usize];
    let sharpest = turns[turns.len() - 1];
    assert!(share(0.5) < 8.0 && share(0.99) < 45.0 && sharpest < 100.0, "{} {} {sharpest}", share(0.5), share(0.99));
}

fn smallest_angle(c: [DVec3; 3]) -> f64 {
    (0..3).map(|i| (c[(i + 1) % 3] - c[i]).angle_between(c[(i + 2) % 3] - c[i]).to_degrees()).fold(180.0, f64::min)
}

#[test]
fn girths_agree_at_other_resolutions() {
    let form = DressForm::new(&BodySpec::default()).unwrap();
    for triangles in [5_000, 24_000] {
        let mesh = form.mesh(triangles).unwrap();
        assert_eq!(mesh.triangles.len(), triangles);
        assert_closed(&mesh, "resolution");
        assert_girths(&form, &mesh, "resolution");
    }
    assert!(form.mesh(100).unwrap_err().to_string().contains("100"));
}

/// ANSUR II, women: mean and standard deviation of what scales a body; limbs follow the hip.
fn ansur(stature: f64, bust: f64, waist: f64, hip: f64) -> BodySpec {
    let hip_cm = 102.1 + 7.6 * hip;
    let limb = hip_cm / 102.1;
    let bust_cm = 94.7 + 8.3 * bust;
    BodySpec {
        stature_cm: 162.9 + 6.4 * stature,
        bust_cm,
        underbust_cm: bust_cm - 13.0,
        waist_cm: 86.1 + 10.0 * waist,
        hip_cm,
        neck_cm: 33.0 * (bust_cm / 94.7).sqrt(),
        thigh_cm: 61.6 * limb,
        knee_cm: 37.3 * limb,
        calf_cm: 37.3 * limb,
        ankle_cm: 21.6 * limb.sqrt(),
        biceps_cm: 30.6 * limb,
        wrist_cm: 15.5 * limb.sqrt(),
        ..BodySpec::default()
    }
}

#[test]
fn every_body_within_two_deviations_is_closed_true_to_size_and_free_of_self_intersection() {
    // All corners of the four deviations, and the mean.
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 2.0 } else { -2.0 };
    let mut specs: Vec<BodySpec> = (0..16).map(|i| ansur(sign(i, 0), sign(i, 1), sign(i, 2), sign(i, 3))).collect();
    specs.push(ansur(0.0, 0.0, 0.0, 0.0));
    for spec in specs {
        let what = format!("{} {} {} {}", spec.stature_cm, spec.bust_cm, spec.waist_cm, spec.hip_cm);
        let form = DressForm::new(&spec).unwrap();
        let mesh = form.mesh(6_000).unwrap();
        assert_closed(&mesh, &what);
        assert_girths(&form, &mesh, &what);
        assert_eq!(self_intersecting_pairs(&mesh), Vec::<[u32; 2]>::new(), "{what}");
        let top = mesh.bounds().unwrap().1.z;
        assert!((100.0 * top - spec.stature_cm).abs() < 0.7, "{what}: {top}");
    }
}

#[test]
fn a_measurement_is_set_by_name_and_the_stored_bodies_parse() {
    let spec = BodySpec::default().with("bust", 92.0).unwrap();
    assert_eq!(spec, BodySpec { bust_cm: 92.0, ..BodySpec::default() });
    let spec = spec.with("waist-height", 101.0).unwrap();
    assert_eq!(spec.waist_height_cm, Some(101.0));
    assert!(BodySpec::default().with("beard", 10.0).unwrap_err().to_string().contains("beard_cm"));

    let eu38 = BodySpec::from_toml(include_str!("../assets/bodies/eu-38.toml")).unwrap();
    let (given, derived) = (eu38.measures().unwrap(), BodySpec::default().measures().unwrap());
    assert_eq!(format!("{given:.6?}"), format!("{derived:.6?}"));
    let mean = BodySpec::from_toml(include_str!("../assets/bodies/ansur-ii-mean.toml")).unwrap();
    let form = DressForm::new(&mean).unwrap();
    assert_girths(&form, &form.mesh(6_000).unwrap(), "ANSUR II mean");
}

#[test]
fn errors_of_measurements_name_the_value_and_the_range() {
    let error = |spec: &BodySpec| DressForm::new(spec).unwrap_err().to_string();
    let thin = BodySpec { waist_cm: 20.0, ..BodySpec::default() };
    assert_eq!(error(&thin), "waist is 20 cm; a body's is from 45 to 150 cm");
    assert!(error(&BodySpec { hip_cm: f64::NAN, ..BodySpec::default() }).contains("hip is NaN"));
    let upside_down = BodySpec { waist_height_cm: Some(125.0), ..BodySpec::default() };
    assert!(error(&upside_down).contains("bust_height is 122.0 cm"), "{}", error(&upside_down));
    assert!(BodySpec::from_toml("bust = 90.0").unwrap_err().to_string().contains("bust"));
}

#[test]
fn the_form_is_the_same_on_any_number_of_threads() {
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| DressForm::new(&BodySpec::default()).unwrap().mesh(4_000).unwrap())
    };
    assert_eq!(on(1), on(3));
}
