//! How garments are placed and held: garments given twice, and held edges by the thousand.

use std::ops::ControlFlow;

use glam::DVec3;
use partwise::Job;
use partwise::SceneSpec;
use partwise::drape::{Refine, Scene, Settings, drape, unobserved};
use partwise::mesh::TriMesh;
use partwise::mesh::export::{write_mesh, write_textured};
use partwise::study::metrics::{Metrics, RESTS};

use super::{cone, draped, draped_by, sphere, turned};

#[test]
fn a_garment_given_twice_is_refused_with_both_remedies() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("skirt.obj").display().to_string();
    let skirt = SceneSpec { garment: "flared-skirt@700".to_owned(), ..SceneSpec::default() };
    write_mesh(file.as_ref(), &skirt.load().unwrap().scene.garment).unwrap();
    for name in [&skirt.garment, &file] {
        let twice = SceneSpec { over: vec![name.clone()], garment: name.clone(), ..SceneSpec::default() };
        let refusal = twice.load().unwrap_err().to_string();
        for part in [name.as_str(), "vertices lie exactly on", "Give it once", "wider"] {
            assert!(refusal.contains(part), "no \"{part}\" in: {refusal}");
        }
    }
    // The vertices of another garment over it do not count.
    SceneSpec { over: vec!["pullover-1@900".to_owned()], ..skirt }.load().unwrap();
}

#[test]
fn the_edges_of_twenty_thousand_parts_are_held_in_time_that_grows_with_their_number() {
    // Found one by one, with a walk over the whole garment for each, they would take hours.
    let parts = 20_000;
    let mut mesh = TriMesh::default();
    for i in 0..parts {
        let at = DVec3::new(0.3, 0.0, 1.0 + 1e-5 * f64::from(i));
        mesh.positions.extend([at, at + DVec3::Y * 0.01, at + DVec3::Z * 0.01]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let scene = Scene::of_meshes(&sphere(), mesh).unwrap();
    let names: Vec<String> = (1..=parts).map(|part| format!("top:{part}")).collect();
    let held = scene.edges(&names.join(",")).unwrap();
    assert!(held.iter().copied().eq(0..3 * parts), "{} held", held.len());
    assert_eq!(scene.edge("top:2").unwrap(), [3, 4, 5]);
    assert!(scene.edge("top:20001").unwrap_err().to_string().contains("`top:1` to `top:20000`"));
}

#[test]
fn the_verdict_names_every_criterion_that_fails() {
    let tube =
        |radius: f64| turned(&(0..6).map(|k| (radius, 0.95 - 0.05 * f64::from(k))).collect::<Vec<_>>(), 40, None);
    let mut scene = Scene::of_meshes(&cone(), tube(0.3)).unwrap();
    let (slid, ..) = draped(&scene);
    assert!(slid.verdict.starts_with("slid down by "), "{}", slid.verdict);
    scene.held = scene.edge("top").unwrap();
    let (rests, ..) = draped(&scene);
    assert_eq!(rests.verdict, RESTS);
    // Without a step at full resolution it does not rest.
    let preview = Job { settings: Settings { refine: Refine::Steps(0), ..Settings::default() }, ..Job::default() };
    let (metrics, ..) = draped_by(&scene, &preview);
    assert!(metrics.verdict.contains("does not rest: residual "), "{}", metrics.verdict);
    assert!(metrics.verdict.contains("after the two stages alone"), "{}", metrics.verdict);
    // An interrupted drape is not judged by a residual that may be small by then.
    let job = Job::default();
    let stopped = drape(&scene, &job.settings, &mut |_| ControlFlow::Break(())).unwrap();
    let metrics = job.measure(&scene, &stopped, None, &mut unobserved).unwrap().metrics;
    assert!(metrics.verdict.starts_with("interrupted at a residual "), "{}", metrics.verdict);
    // Far too narrow, though at rest.
    let mut narrow = Scene::of_meshes(&cone(), tube(0.3)).unwrap();
    narrow.held.clone_from(&scene.held);
    narrow.rest.corners.iter_mut().flatten().for_each(|p| *p *= 0.5);
    let (torn, ..) = draped(&narrow);
    assert!(torn.verdict.contains("more than fabrics bear"), "{}", torn.verdict);
    // Off the body.
    let ring = turned(&[(0.6, 0.9), (0.6, 0.85), (0.6, 0.8)], 24, None);
    let (fallen, ..) = draped(&Scene::of_meshes(&cone(), ring).unwrap());
    assert!(fallen.verdict.starts_with("fallen off the body"), "{}", fallen.verdict);
}

#[test]
fn a_skirt_too_wide_for_the_hips_ends_once_it_lies_below_the_crotch() {
    let form = SceneSpec::default().load().unwrap().scene.body.mesh().clone();
    let skirt = |radius: f64, top: f64| {
        let ring = |k: i32| (radius + 0.01 * f64::from(k), top - 0.03 * f64::from(k));
        turned(&(0..12).map(ring).collect::<Vec<_>>(), 40, None)
    };
    // It hung from the feet after over a hundred steps.
    let mut scene = Scene::of_meshes(&form, skirt(0.22, 1.0)).unwrap();
    let result = drape(&scene, &Settings::default(), &mut unobserved).unwrap();
    let (slid, x) = (Metrics::of(&scene, &result), &result.positions);
    assert_eq!(slid.verdict, "slid off the trunk, down to the legs");
    assert!(slid.refine_steps.is_some_and(|steps| steps < 30), "{:?} steps", slid.refine_steps);
    assert!(
        x.iter().all(|x| x.z < 0.82) && x.iter().any(|x| x.z > 0.4),
        "its solve ended too late: {:?}",
        x.iter().map(|x| x.z).fold((9.0_f64, 0.0_f64), |(a, b), z| (a.min(z), b.max(z)))
    );
    let message = "slid off the trunk, down to the legs; hold its edge (--hold top)";
    assert!(result.warnings.iter().any(|w| w.contains(message)), "{:?}", result.warnings);
    // Held, it rests.
    scene.held = scene.edge("top").unwrap();
    assert_eq!(draped(&scene).0.verdict, RESTS);
    // Around a leg as placed: it never was on the trunk.
    let mut leg = skirt(0.16, 0.7);
    leg.positions.iter_mut().for_each(|x| x.x += 0.1);
    let low = Scene::of_meshes(&form, leg).unwrap();
    assert!(!draped(&low).0.verdict.contains("trunk"));
}

#[test]
fn a_dress_as_cut_for_one_size_rests_on_its_neighbours() {
    let folder = tempfile::tempdir().unwrap();
    let [dress, form] = ["dress.obj", "form.toml"].map(|name| folder.path().join(name).display().to_string());
    let cut = SceneSpec { garment: "long-sleeved-dress@2000".to_owned(), ..SceneSpec::default() };
    let Scene { garment, rest, .. } = cut.load().unwrap().scene;
    write_textured(dress.as_ref(), &garment, &rest.corners).unwrap();
    // The form is of EU 38.
    for size in [-2.0, -1.0, 1.0, 2.0] {
        let (bust, hip) = (4.0 / 6.7 * size, 4.0 / 6.1 * size);
        let rows = [
            ("bust", 88.0 + 4.0 * size),
            ("underbust", 75.0 + 4.0 * size),
            ("waist", 72.0 + 4.0 * size),
            ("hip", 96.0 + 4.0 * size),
            ("neck", 31.7 + 1.3 * bust),
            ("biceps", 27.9 + 2.7 * bust),
            ("wrist", 15.4 + 0.1 * bust),
            ("thigh", 57.0 + 4.6 * hip),
            ("knee", 36.1 + 1.2 * hip),
            ("calf", 36.1 + 1.2 * hip),
            ("ankle", 21.3 + 0.3 * hip),
        ];
        std::fs::write(&form, rows.map(|(name, cm)| format!("{name}_cm = {cm}\n")).concat()).unwrap();
        let loaded = SceneSpec::new(&form, &dress).load().unwrap();
        let (metrics, ..) = draped(&loaded.scene);
        assert_eq!(metrics.verdict, RESTS, "{size} sizes up");
    }
}
