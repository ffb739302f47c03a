//! The front door: scenes by name, from files and from memory, and the jobs that run on them.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;

use partwise::drape::{Refine, unobserved};
use partwise::mesh::TriMesh;
use partwise::parts::range_table::TableRule;
use partwise::scene::SceneError;
use partwise::study::job::{Against, Job};
use partwise::study::sweep::result_hash;
use partwise::{DVec3, Scene, SceneSpec, Settings, drape};

/// A cube of half a metre around (0, 0, 1).
fn cube() -> TriMesh {
    let at = |i: usize, bit: usize| if i >> bit & 1 == 1 { 0.25 } else { -0.25 };
    let positions = (0..8).map(|i| DVec3::new(at(i, 0), at(i, 1), 1.0 + 2.0 * at(i, 2))).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    TriMesh::new(positions, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A square sheet a centimetre above it, 0.6 m wide, one vertex a centimetre inside.
fn sheet() -> TriMesh {
    let n = 12_u32;
    let at = |k: u32| 0.6 * (f64::from(k) / f64::from(n) - 0.5);
    let mut positions: Vec<DVec3> =
        (0..=n).flat_map(|j| (0..=n).map(move |i| DVec3::new(at(i), at(j), 1.51))).collect();
    positions[84].z = 1.49;
    let corner = |i, j| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh::new(positions, triangles.collect())
}

fn write(path: &Path, mesh: &TriMesh) {
    partwise::mesh::export::write_mesh(path, mesh).unwrap();
}

fn preview() -> Settings {
    Job::preview().settings
}

#[test]
fn meshes_in_memory_and_in_files_are_one_scene_whichever_way_they_face() {
    let folder = tempfile::tempdir().unwrap();
    let (body, garment) = (folder.path().join("body.obj"), folder.path().join("sheet.obj"));
    write(&body, &cube());
    write(&garment, &sheet());
    let spec = SceneSpec::new(body.display().to_string(), garment.display().to_string());
    let spec = SceneSpec { unit: Some(partwise::mesh::Unit::M), up: Some(partwise::mesh::Axis::Z), ..spec };
    let loaded = spec.load().unwrap();
    assert_eq!((loaded.body_name.as_str(), loaded.garment_name.as_str()), ("body", "sheet"));
    assert_eq!(loaded.pushed_out.found_inside, 1);
    assert!(loaded.reports.len() == 2 && loaded.notes().len() == 3 && loaded.warnings().is_empty());
    let mut turned = sheet();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let drapes = [loaded.scene.clone(), Scene::of_meshes(&cube(), sheet()).unwrap()]
        .map(|scene| result_hash(&drape::drape(&scene, &preview(), &mut unobserved).unwrap().positions));
    assert_eq!(drapes[0], drapes[1]);
    assert_eq!(Scene::of_meshes(&cube(), turned).unwrap().garment.triangles[0], sheet().triangles[0]);
    let out = folder.path().join("out.obj");
    let draped = drape::drape(&loaded.scene, &preview(), &mut unobserved).unwrap();
    loaded.write(&out, &draped.positions).unwrap();
    assert_eq!(fs::read_to_string(&out).unwrap().lines().filter(|l| l.starts_with("f ")).count(), 288);
    let unpushed = SceneSpec { push_out: false, ..spec.clone() }.load().unwrap();
    assert_eq!(unpushed.scene.garment.positions[84].z, 1.49);
    let held = SceneSpec { hold: Some("top".into()), ..spec.clone() }.load().unwrap();
    assert_eq!(held.scene.held.len(), 48);
    let error = SceneSpec { hold: Some("cuff".into()), ..spec }.load().unwrap_err();
    let SceneError::In { name, source } = error else { panic!("{error}") };
    assert!(name.ends_with("sheet.obj") && matches!(*source, SceneError::UnknownGroup { .. }), "{name}: {source}");
}

#[test]
fn names_that_mean_nothing_are_told_before_any_time_is_spent() {
    for (body, garment, word) in
        [("mannequin", "pullover-1", "form"), ("form", "toga", "flared-skirt"), ("form", "pullover-1@many", "@5000")]
    {
        let said = SceneSpec::new(body, garment).check_names().unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    }
    let said = SceneSpec::new("nowhere.obj", "shirt.obj").load().unwrap_err().to_string();
    assert!(said.contains("nowhere.obj"), "{said}");
}

#[test]
fn a_file_of_measurements_is_a_body_as_the_measurements_are() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("me.toml");
    fs::write(&file, "bust_cm = 95.0\n").unwrap();
    let by_file = SceneSpec::new(file.display().to_string(), "flared-skirt@400").load().unwrap();
    let mut spec = SceneSpec::new("form", "flared-skirt@400");
    spec.measurements.bust_cm = 95.0;
    assert_eq!(by_file.scene.body.mesh(), spec.load().unwrap().scene.body.mesh());
    fs::write(&file, "bosom_cm = 95.0\n").unwrap();
    let said = SceneSpec::new(file.display().to_string(), "flared-skirt@400").load().unwrap_err().to_string();
    assert!(said.contains("me.toml") && said.contains("bosom_cm"), "{said}");
}

#[test]
fn a_job_measures_what_it_is_asked_and_a_seed_moves_the_start_alone() {
    let scene = Scene::of_meshes(&cube(), sheet()).unwrap();
    let mut job = Job { accuracy: Against::Canonical, ..Job::preview() };
    job.settings.table = TableRule::Quantile { name: "thirds".into(), levels: 3 };
    let draped = job.drape(&scene, &mut unobserved).unwrap();
    assert_eq!(draped.table, job.settings.table.resolve(&scene.distances_m().unwrap()).unwrap());
    assert_eq!(draped.table.name, "thirds");
    let measured = job.measure(&scene, &draped, None, &mut unobserved).unwrap();
    let metrics = &measured.metrics;
    assert!(metrics.canonical_rms_mm.unwrap() > 0.0, "{metrics:?}");
    // What translates can turn and stretch as well.
    assert!(metrics.representable_affine_rms_mm.unwrap() < metrics.representable_rms_mm.unwrap(), "{metrics:?}");
    assert!(metrics.rms_mm.is_none() && measured.error_mm.len() == metrics.vertices);
    job.seed = 7;
    let moved = job.drape(&scene, &mut unobserved).unwrap();
    assert_ne!(moved.positions, draped.positions);
    // The table is the undisturbed garment's, or starts would differ by it too.
    assert_eq!(moved.table, draped.table);
    (job.seed, job.accuracy, job.settings.refine) = (0, Against::Own, Refine::Converged);
    let settled = job.drape(&scene, &mut unobserved).unwrap();
    let own = job.measure(&scene, &settled, None, &mut unobserved).unwrap().metrics;
    // The solver's residual is under its tolerance; what friction can hold is another figure.
    assert!(own.rms_mm.is_some() && own.residual_at_rest_over_weight.is_some());
    assert_eq!(own.residual_over_weight, settled.state.map(|s| s.residual_over_weight));
}
