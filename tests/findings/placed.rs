//! How garments are placed and held: garments given twice, and held edges by the thousand.

use glam::DVec3;
use partwise::Job;
use partwise::SceneSpec;
use partwise::drape::{Refine, Scene, Settings};
use partwise::mesh::TriMesh;
use partwise::mesh::export::write_mesh;
use partwise::study::metrics::RESTS;

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
    // Another garment over it is none of its vertices.
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
    // Far too narrow, though at rest.
    let mut narrow = Scene::of_meshes(&cone(), tube(0.3)).unwrap();
    narrow.held.clone_from(&scene.held);
    narrow.rest.corners.iter_mut().flatten().for_each(|p| *p *= 0.5);
    let (torn, ..) = draped(&narrow);
    assert!(torn.verdict.contains("more than fabrics bear"), "{}", torn.verdict);
    // Off the body.
    let ring = turned(&[(0.6, 0.9), (0.6, 0.85), (0.6, 0.8)], 24, None);
    let (fallen, ..) = draped(&Scene::of_meshes(&cone(), ring).unwrap());
    assert!(fallen.verdict.starts_with("fell off the body"), "{}", fallen.verdict);
}
