//! The public entry points: scenes by name, from files and from memory, and the jobs that run on them.

#![allow(clippy::unwrap_used)]

mod fixtures;

use std::fs;
use std::path::Path;

use fixtures::{Diagonals, cuboid, flipped, grid};
use partwise::drape::{Refine, unobserved};
use partwise::mesh::{MeshSource, TriMesh};
use partwise::parts::range_table::TableRule;
use partwise::scene::SceneError;
use partwise::study::job::{Against, Job};
use partwise::study::sweep::result_hash;
use partwise::{DVec3, Scene, SceneSpec, Settings, drape};

/// A block 0.5 m wide whose top is at z = 1.5 m.
fn block() -> TriMesh {
    cuboid(DVec3::new(-0.25, -0.25, 0.5), DVec3::new(0.25, 0.25, 1.5))
}

/// A square sheet a centimetre above the block, 0.6 m wide, one vertex a centimetre inside.
fn sheet() -> TriMesh {
    let at = |k: u32| 0.6 * (f64::from(k) / 12.0 - 0.5);
    let mut mesh = grid(12, 12, Diagonals::Parallel, |i, j| DVec3::new(at(i), at(j), 1.51));
    mesh.positions[84].z = 1.49;
    mesh
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
    write(&body, &block());
    write(&garment, &sheet());
    let spec = SceneSpec::new(body.display().to_string(), garment.display().to_string());
    let spec = SceneSpec { unit: Some(partwise::mesh::Unit::M), up: Some(partwise::mesh::Axis::Z), ..spec };
    let loaded = spec.load().unwrap();
    assert_eq!((loaded.body_name.as_str(), loaded.garment_name.as_str()), ("body", "sheet"));
    assert_eq!(loaded.pushed_out.found_inside, 1);
    assert!(loaded.reports.len() == 2 && loaded.notes().len() == 3 && loaded.warnings().is_empty());
    let drapes = [loaded.scene.clone(), Scene::of_meshes(&block(), sheet()).unwrap()]
        .map(|scene| result_hash(&drape::drape(&scene, &preview(), &mut unobserved).unwrap().positions));
    assert_eq!(drapes[0], drapes[1]);
    assert_eq!(Scene::of_meshes(&block(), flipped(sheet())).unwrap().garment.triangles[0], sheet().triangles[0]);
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
fn unknown_names_are_errors_before_anything_is_loaded() {
    for (body, garment, word) in
        [("mannequin", "pullover-1", "form"), ("form", "toga", "flared-skirt"), ("form", "pullover-1@many", "@5000")]
    {
        let message = SceneSpec::new(body, garment).check_names().unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    let message = SceneSpec::new("nowhere.obj", "shirt.obj").load().unwrap_err().to_string();
    assert!(message.contains("nowhere.obj"), "{message}");
}

#[test]
fn a_file_of_measurements_makes_the_same_body_as_the_measurements() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("me.toml");
    fs::write(&file, "bust_cm = 95.0\n").unwrap();
    let by_file = SceneSpec::new(file.display().to_string(), "flared-skirt@400").load().unwrap();
    let mut spec = SceneSpec::new("form", "flared-skirt@400");
    spec.measurements.bust_cm = 95.0;
    assert_eq!(by_file.scene.body.mesh(), spec.load().unwrap().scene.body.mesh());
    fs::write(&file, "bosom_cm = 95.0\n").unwrap();
    let message = SceneSpec::new(file.display().to_string(), "flared-skirt@400").load().unwrap_err().to_string();
    assert!(message.contains("me.toml") && message.contains("bosom_cm"), "{message}");
}

#[test]
fn a_job_measures_against_its_reference_and_a_seed_perturbs_the_start_alone() {
    let scene = Scene::of_meshes(&block(), sheet()).unwrap();
    let mut job = Job { accuracy: Against::Canonical, ..Job::preview() };
    job.settings.table = TableRule::Quantile { name: "thirds".into(), levels: 3 };
    let draped = job.drape(&scene, &mut unobserved).unwrap();
    assert_eq!(draped.table, job.settings.table.resolve(&scene.distances_m().unwrap()).unwrap());
    assert_eq!(draped.table.name, "thirds");
    let measured = job.measure(&scene, &draped, None, &mut unobserved).unwrap();
    let metrics = &measured.metrics;
    assert!(metrics.canonical_rms_mm.unwrap() > 0.0, "{metrics:?}");
    // Affine maps include translations.
    assert!(metrics.representable_affine_rms_mm.unwrap() < metrics.representable_rms_mm.unwrap(), "{metrics:?}");
    assert!(metrics.rms_mm.is_none() && measured.error_mm.len() == metrics.vertices);
    job.seed = 7;
    let moved = job.drape(&scene, &mut unobserved).unwrap();
    assert_ne!(moved.positions, draped.positions);
    // The table is that of the unperturbed garment; otherwise the starts would differ by the table, too.
    assert_eq!(moved.table, draped.table);
    (job.seed, job.accuracy, job.settings.refine) = (0, Against::Own, Refine::Converged);
    let settled = job.drape(&scene, &mut unobserved).unwrap();
    let own = job.measure(&scene, &settled, None, &mut unobserved).unwrap().metrics;
    // The solver's residual is the reported one; the residual at rest excludes forces that friction can hold.
    assert!(own.rms_mm.is_some() && own.residual_at_rest_over_weight.is_some());
    assert_eq!(own.residual_over_weight, settled.state.map(|s| s.residual_over_weight));
}

#[test]
fn meshes_in_memory_give_the_scene_of_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let [body, garment] = ["body.obj", "garment.obj"].map(|name| folder.path().join(name).display().to_string());
    let spec =
        SceneSpec { unit: Some(partwise::mesh::Unit::M), up: Some(partwise::mesh::Axis::Z), ..SceneSpec::default() };
    let mut in_memory = SceneSpec { body: "arrays/body".into(), garment: "arrays/garment".into(), ..spec.clone() };
    for (file, name, mesh) in [(&body, "arrays/body", block()), (&garment, "arrays/garment", sheet())] {
        write(Path::new(file), &mesh);
        let faces: Vec<i64> = mesh.triangles.as_flattened().iter().map(|&v| v.into()).collect();
        let source = MeshSource::of_arrays(mesh.positions, &faces, 3).unwrap();
        in_memory.in_memory.insert(name.into(), source.into());
    }
    let [read, given] = [SceneSpec { body, garment, ..spec }, in_memory.clone()].map(|spec| spec.load().unwrap());
    assert_eq!(given.scene.garment, read.scene.garment);
    assert_eq!(given.scene.body.mesh(), read.scene.body.mesh());
    assert_eq!(given.in_file(&given.scene.garment.positions).len(), sheet().vertex_count());
    assert_eq!(given.garment_name, "garment");
    in_memory.in_memory.remove("arrays/garment");
    assert!(in_memory.load().unwrap_err().to_string().contains("arrays/garment"));
    let problem = MeshSource::of_arrays(vec![DVec3::ZERO; 2], &[0, 1, 2], 3).unwrap_err().to_string();
    assert_eq!(problem, "faces[0, 2]: found 2, expected 0 to 1, the vertices of the mesh");
}
