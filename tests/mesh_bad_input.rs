//! Invalid mesh input is refused with one message: file, line, found, expected, remedy.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use partwise::mesh::export::write_mesh;
use partwise::mesh::import::{Beside, ImportOptions, MAX_BODY_FAN, MAX_GARMENT_FAN, import_body, import_garment};
use partwise::mesh::{Axis, Frame, MeshError, TriMesh, Unit};

fn refusal(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let frame = Frame::given(Unit::M, Axis::Z);
    let error = import_garment(&path, &ImportOptions::default(), &Beside::File(&frame)).unwrap_err();
    let message = error.to_string();
    assert!(message.contains(name), "no file name in: {message}");
    message
}

fn says(text: &str, parts: &[&str]) {
    let message = refusal("garment.obj", text.as_bytes());
    for part in parts {
        assert!(message.contains(part), "no \"{part}\" in: {message}");
    }
}

#[test]
fn coordinates_that_are_no_numbers_name_their_line() {
    says("v 0 0 0\nv 1 nan 0\n", &["line 2", "nan", "finite"]);
    says("v 0 0 0\n\nv 1 0 -inf\n", &["line 3", "-inf", "finite"]);
    says("v 0 0 0\nv 1 1e999 0\n", &["line 2", "1e999", "finite"]);
    says("v 0 0 0\nv 1 zwei 0\n", &["line 2", "\"zwei\"", "v x y z"]);
    says("v 0 0\n", &["line 1", "found 2", "expected 3"]);
    says("v 0 0 0\nvt inf 0\n", &["line 2", "inf"]);
}

#[test]
fn indices_out_of_range_name_their_line_and_the_range() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    says(&format!("{three}f 1 2 4\n"), &["line 4", "found 4", "1 to 3"]);
    says(&format!("{three}f 1 2 0\n"), &["line 4", "found 0", "1 to 3"]);
    says(&format!("{three}f 1 2 -4\n"), &["line 4", "found -4", "-1 to -3"]);
    says(&format!("{three}f 1/1 2/1 3/1\n"), &["line 4", "found 1", "no texture coordinates"]);
    says(&format!("{three}f 1 2 99999999999\n"), &["line 4", "99999999999"]);
    says(&format!("{three}f 1 2 3.5\n"), &["line 4", "\"3.5\"", "v/vt/vn"]);
    says(&format!("{three}f 1/2/3/4 2 3\n"), &["line 4", "1/2/3/4"]);
    says(&format!("{three}f 1/// 2 3\n"), &["line 4", "1///"]);
    says(&format!("{three}f /1 2 3\n"), &["line 4", "\"/1\""]);
    let textured = format!("{three}vt 0 0\n");
    for index in ["0", "-2", "-9223372036854775808", "9223372036854775807"] {
        let expected = format!("found {index}, expected 1 to 1, the texture coordinates");
        says(&format!("{textured}f 1/1 2/{index} 3/1\n"), &["line 5", &expected]);
    }
}

/// The OBJ text of `n` triangles about vertex 1, a closed fan.
fn fan(n: usize) -> String {
    let rim = (0..n).map(|i| (TAU * i as f64 / n as f64).sin_cos());
    let vertices: String = rim.map(|(y, x)| format!("v {x} {y} 0\n")).collect();
    let faces: String = (0..n).map(|i| format!("f 1 {} {}\n", i + 2, (i + 1) % n + 2)).collect();
    format!("v 0 0 1.5\n{vertices}{faces}")
}

#[test]
fn a_fan_is_refused_above_the_number_of_triangles_that_a_drape_can_bear() {
    for n in [MAX_GARMENT_FAN + 1, 20_000] {
        let found = format!("found {n} triangles about vertex 1, at (0.0000, 0.0000, 1.5000)");
        says(&fan(n), &[&found, &format!("expected {MAX_GARMENT_FAN} at most"), "remesh"]);
    }
    // An edge of as many triangles.
    let rim: String = (0..20_000).map(|i| format!("v {i} 1 0\n")).collect();
    let pages: String = (0..20_000).map(|i| format!("f 1 2 {}\n", i + 3)).collect();
    says(&format!("v 0 0 0\nv 1 0 0\n{rim}{pages}"), &["found 20000 triangles about vertex 1", "remesh"]);
    // Loose triangles that share one vertex.
    let loose: String = (0..20_000).map(|i| format!("f 1 {} {}\n", i % 10_000 + 2, i + 10_002)).collect();
    let corners: String = (0..30_000).map(|i| format!("v {i} 1 {}\n", i % 7)).collect();
    says(&format!("v 0 0 0\n{corners}{loose}"), &["found 20000 triangles about vertex 1"]);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cap.obj");
    let frame = Frame::given(Unit::M, Axis::Z);
    fs::write(&path, fan(MAX_GARMENT_FAN)).unwrap();
    import_garment(&path, &ImportOptions::default(), &Beside::File(&frame)).unwrap();
    // A body may have more: it is not bent.
    fs::write(&path, fan(MAX_BODY_FAN)).unwrap();
    let open = ImportOptions { open_body: true, ..ImportOptions::default() };
    import_body(&path, &open).unwrap();
    fs::write(&path, fan(MAX_BODY_FAN + 1)).unwrap();
    assert!(import_body(&path, &open).unwrap_err().to_string().contains("found 4001 triangles"));
}

#[test]
fn an_empty_mesh_is_refused_with_its_contents() {
    says("", &["empty", "0 vertices"]);
    says("v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["empty", "3 vertices and 0 faces"]);
    says("v 0 0 0\nv 1 0 0\nf 1 2\nf 1 1 2\n", &["empty", "no triangle"]);
}

#[test]
fn other_formats_are_named() {
    let refused_as = |name: &str, bytes: &[u8], format: &str| {
        let message = refusal(name, bytes);
        assert!(message.contains(format) && message.contains("OBJ, PLY, STL, glTF"), "{message}");
    };
    refused_as("pattern.dxf", b"  0\nSECTION\n  2\nHEADER\n", "--pattern");
    refused_as("a.fbx", b"Kaydara FBX Binary  \0", "FBX");
    refused_as("a.usda", b"#usda 1.0\n", "USD");
    refused_as("smpl.pkl", b"\x80\x02}q\x00", "pickle");
    refused_as("a.npy", b"\x93NUMPY\x01\0", "numpy.savez");
    refused_as("a.3mf", b"PK\x03\x04rest", "ZIP");
}

#[test]
fn a_missing_file_and_a_folder_have_different_errors() {
    let read = |path: &Path| import_body(path, &ImportOptions::default()).unwrap_err();
    let missing = read(Path::new("no/such/body.obj"));
    assert!(matches!(missing, MeshError::Unreadable { .. }) && missing.to_string().contains("no/such/body.obj"));
    let folder = tempfile::tempdir().unwrap();
    assert!(read(folder.path()).to_string().contains("folder"));
}

#[test]
fn a_path_that_cannot_be_written_is_named_and_nothing_is_left_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = TriMesh::new(vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y], vec![[0, 1, 2]]);
    for path in [folder.path().join("missing/out.obj"), folder.path().to_owned()] {
        let message = write_mesh(&path, &mesh).unwrap_err().to_string();
        assert!(message.contains(&path.display().to_string()) && message.contains("cannot be written"), "{message}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_body_of_no_human_size_asks_for_its_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.obj");
    fs::write(&path, "v 0 0 0\nv 3 0 0\nv 0 3.2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n").unwrap();
    let message = import_body(&path, &ImportOptions::default()).unwrap_err().to_string();
    assert!(message.contains("units tall") && message.contains("--unit"), "{message}");
    assert!(import_body(&path, &ImportOptions { unit: Some(Unit::M), ..ImportOptions::default() }).is_ok());
}
