//! Mesh files of other programs: `make.py` wrote those in `files/` with trimesh, meshio, plyfile, NumPy, pygltflib and Blender.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

mod hostile;
mod large;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;
use partwise::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use partwise::mesh::report::{Remark, Repair};
use partwise::mesh::{Axis, Frame, MeshError, TriMesh, Unit};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/files").join(name)
}

fn body(name: &str) -> Imported {
    import_body(&path(name), &ImportOptions::default()).unwrap()
}

fn garment(name: &str, options: &ImportOptions) -> Result<Imported, MeshError> {
    import_garment(&path(name), options, &Beside::File(&Frame::given(Unit::M, Axis::Z)))
}

fn group(name: &str) -> ImportOptions {
    ImportOptions { group: Some(name.to_owned()), ..ImportOptions::default() }
}

/// The triangles as sets of positions in hundredths of a millimetre, which single precision keeps; each begins at its least corner.
fn triangles(mesh: &TriMesh) -> BTreeSet<[[i64; 3]; 3]> {
    let rounded = |p: DVec3| (1e5 * p).to_array().map(|x| x.round() as i64);
    let from_least = |t: usize| {
        let mut corners = mesh.corners(t).map(rounded);
        let least = (0..3).min_by_key(|&k| corners[k]).unwrap();
        corners.rotate_left(least);
        corners
    };
    (0..mesh.triangles.len()).map(from_least).collect()
}

#[test]
fn every_program_gives_the_same_body() {
    let expected = triangles(&body("body-trimesh-text.ply").mesh);
    assert_eq!(expected.len(), 312);
    for (name, up) in [
        ("body-trimesh-binary.ply", Axis::Z),
        ("body-trimesh-binary.stl", Axis::Z),
        ("body-trimesh-text.stl", Axis::Z),
        ("body-trimesh.glb", Axis::Y),
        ("body-meshio.ply", Axis::Z),
        ("body-meshio.stl", Axis::Z),
        ("body-numpy.npz", Axis::Z),
        ("model-numpy.npz", Axis::Y),
    ] {
        let found = body(name);
        assert_eq!(triangles(&found.mesh), expected, "{name}");
        assert_eq!((found.report.frame.unit, found.report.frame.up), (Unit::M, up), "{name}");
        assert!(found.report.is_closed() && found.mesh.vertex_count() == 158, "{name}: {}", found.report);
        assert_eq!(found.report.remarks, [], "{name}");
        // Corners of an STL are merged, and that is reported; nothing else changes.
        let repairs = if name.ends_with("stl") { vec![Repair::Merged { vertices: 3 * 312 - 158 }] } else { vec![] };
        assert_eq!(found.report.repairs, repairs, "{name}");
    }
}

#[test]
fn every_program_gives_the_same_garment() {
    let expected = triangles(&garment("cloth-trimesh-text.ply", &ImportOptions::default()).unwrap().mesh);
    assert_eq!(expected.len(), 160);
    for name in [
        "cloth-trimesh-binary.ply",
        "cloth-trimesh-binary.stl",
        "cloth-trimesh-text.stl",
        "cloth-plyfile-big-endian.ply",
        "cloth-blender.ply",
        "cloth-blender-text.ply",
        "cloth-blender.stl",
    ] {
        let found = garment(name, &ImportOptions::default()).unwrap();
        assert_eq!(triangles(&found.mesh), expected, "{name}");
        assert_eq!(found.mesh.vertex_count(), 96, "{name}");
    }
    let y_up = ImportOptions { unit: Some(Unit::M), up: Some(Axis::Y), ..group("shirt") };
    assert_eq!(triangles(&garment("scene-blender.glb", &y_up).unwrap().mesh), expected);
}

#[test]
fn texture_coordinates_are_those_of_the_corners() {
    // Of each corner: one of Blender's vertices stands at the seam of the map twice, plyfile wrote a list a face.
    for (name, options) in [
        ("cloth-blender.ply", ImportOptions::default()),
        ("cloth-plyfile-big-endian.ply", ImportOptions::default()),
        ("scene-blender.glb", ImportOptions { unit: Some(Unit::M), up: Some(Axis::Y), ..group("shirt") }),
    ] {
        let found = garment(name, &options).unwrap();
        for (t, corners) in found.texture.iter().enumerate() {
            let [a, b, c] = corners.unwrap();
            let [p, q, r] = found.mesh.corners(t);
            for (flat, worn) in [(a - b, p - q), (b - c, q - r), (c - a, r - p)] {
                assert!((flat.length() - worn.length()).abs() < 1e-6, "{name}, triangle {t}");
            }
        }
    }
}

#[test]
fn nodes_are_objects_and_materials_groups() {
    let shirt = garment("scene-blender.glb", &group("shirt")).unwrap();
    assert_eq!(shirt.mesh.groups, ["front", "back"]);
    let front = shirt.mesh.triangle_group.iter().filter(|&&g| g == 0).count();
    assert_eq!((front, shirt.mesh.triangles.len()), (80, 160));
    assert!(shirt.report.repairs.contains(&Repair::GroupChosen { name: "shirt".to_owned(), left_out: 312 }));
    assert_eq!(garment("scene-blender.glb", &group("back")).unwrap().mesh.triangles.len(), 80);
    let message = garment("scene-blender.glb", &group("coat")).unwrap_err().to_string();
    assert!(message.ends_with("no group \"coat\"; there are: avatar, shirt, front, back"), "{message}");
}

#[test]
fn the_metre_of_gltf_is_tried_first_and_not_taken_for_granted() {
    let wrong = import_body(&path("scene-trimesh-cm.glb"), &group("avatar")).unwrap();
    assert_eq!((wrong.report.frame.unit, wrong.report.frame.up), (Unit::Cm, Axis::Y));
    let [Remark::OtherThanDeclared { format: "glTF", declared_unit: Unit::M, .. }] = wrong.report.remarks[..] else {
        panic!("{:?}", wrong.report.remarks);
    };
    assert!(wrong.report.to_string().contains("glTF is in m, y up, and this file is not"), "{}", wrong.report);
    let right = import_body(&path("scene-blender.glb"), &group("avatar")).unwrap();
    assert!(right.report.frame.reason.starts_with("as glTF prescribes"), "{}", right.report);
    // A given unit overrides the one that the format prescribes.
    let given = ImportOptions { unit: Some(Unit::Mm), up: Some(Axis::Y), ..group("avatar") };
    assert_eq!(import_body(&path("scene-blender.glb"), &given).unwrap().report.frame.unit, Unit::Mm);
}

#[test]
fn a_garment_of_a_scene_lies_about_its_body_in_the_wrong_unit_of_both() {
    for (name, unit) in [("scene-blender.glb", "m"), ("scene-trimesh-cm.glb", "cm")] {
        let name = path(name).to_string_lossy().into_owned();
        let mut spec = partwise::SceneSpec::new(name.clone(), name);
        (spec.body_group, spec.garment_group) = (Some("avatar".to_owned()), Some("shirt".to_owned()));
        let loaded = spec.load().unwrap();
        assert!(loaded.reports.iter().all(|report| report.frame.unit.to_string() == unit), "{:?}", loaded.notes());
        let (low, high) = loaded.scene.garment.bounds().unwrap();
        assert!((low - DVec3::new(-0.2, -0.2, 0.7)).length() < 1e-6, "{low}");
        assert!((high - DVec3::new(0.2, 0.2, 1.1)).length() < 1e-6, "{high}");
    }
}

#[test]
fn skins_strips_sparse_values_and_mirrors_of_gltf_are_applied() {
    let options = ImportOptions { unit: Some(Unit::M), up: Some(Axis::Y), ..ImportOptions::default() };
    let found = garment("embedded-pygltflib.gltf", &options).unwrap().source;
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 5.0]].map(DVec3::from);
    // The joint lifts the first by a metre; the second is mirrored.
    let lifted = square.map(|p| p + DVec3::Y);
    let mirrored = square.map(|p| DVec3::new(-p.x, p.y, p.z + 3.0));
    assert_eq!(found.positions, [lifted, mirrored].concat());
    let corners: Vec<u32> = found.corners.iter().map(|corner| corner.vertex).collect();
    assert_eq!(corners, [0, 1, 2, 1, 3, 2, 2, 3, 4, 5, 7, 6, 6, 7, 8, 7, 9, 8]);
}

#[test]
fn other_contents_are_passed_over_and_named() {
    let found = garment("cloth-plyfile-big-endian.ply", &ImportOptions::default()).unwrap();
    assert_eq!(found.report.remarks, [Remark::Ignored { names: vec!["vertex.quality".to_owned()] }]);
}

#[test]
fn archives_without_a_mesh_say_what_to_save() {
    for (name, parts) in [
        ("poses-numpy.npz", vec!["betas, poses, trans", "poses of a body model", "numpy.savez"]),
        ("vertices-numpy.npz", vec!["the arrays vertices", "no surface", "faces"]),
        ("sequence-numpy.npz", vec!["array vertices", "[3, 158, 3]", "(n, 3)", "not a sequence"]),
        ("objects-numpy.npz", vec!["array v", "pickled Python objects", "array of floats"]),
        ("points-plyfile.ply", vec!["96 vertices and 0 faces", "a cloud of points has no surface"]),
    ] {
        let message = import_body(&path(name), &ImportOptions::default()).unwrap_err().to_string();
        parts.iter().for_each(|part| assert!(message.contains(part), "no \"{part}\" in: {message}"));
    }
}
