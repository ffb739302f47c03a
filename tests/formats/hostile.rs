//! Damaged and hostile files: refused with a clear message before memory is reserved for counts that a file only states.

use std::fs;
use std::io::Write as _;

use glam::DVec3;
use partwise::mesh::import::{ImportOptions, import_body};
use zip::write::SimpleFileOptions;

use super::path;

/// The message about a file of these bytes, or the body that it is.
fn read(name: &str, bytes: &[u8]) -> Result<partwise::mesh::import::Imported, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let open = ImportOptions { open_body: true, ..ImportOptions::default() };
    let outcome = import_body(&path, &open);
    outcome.map_err(|error| {
        let message = error.to_string();
        assert!(message.contains(name), "no file name in: {message}");
        message
    })
}

fn refused(name: &str, bytes: &[u8], parts: &[&str]) {
    let message = read(name, bytes).unwrap_err();
    parts.iter().for_each(|part| assert!(message.contains(part), "no \"{part}\" in: {message}"));
}

/// A PLY of a tetrahedron, with these lines in its header before the vertices' and after the faces'.
fn ply(before: &str, vertices: &str, faces: &str, rows: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\n{before}element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{rows}"
    )
}

const CORNERS: &str = "0 0 0\n1 0 0\n0 1 0\n0 0 1.7\n";

#[test]
fn a_ply_states_no_more_than_it_holds() {
    let whole = ply("", "4", "4", &format!("{CORNERS}3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2"));
    assert_eq!(read("a.ply", whole.as_bytes()).unwrap().mesh.triangles.len(), 4);
    for count in ["5", "4000000000", "18446744073709551615"] {
        let most = ["rows of vertex in the header", "expected", "cut off"];
        let found = ply("", count, "0", CORNERS);
        refused("a.ply", found.as_bytes(), if count == "5" { &["vertex 5 of 5", "cut off"] } else { &most });
    }
    let endless = "element nothing 18446744073709551615\n";
    refused("a.ply", ply(endless, "4", "0", CORNERS).as_bytes(), &["rows of nothing", "expected 0 at most"]);
    let list = ply("", "4", "1", &format!("{CORNERS}3 0 1 7\n"));
    refused("a.ply", list.as_bytes(), &["face 1", "found vertex 7", "below 4"]);
    let negative = ply("", "4", "1", &format!("{CORNERS}3 0 1 -2\n"));
    refused("a.ply", negative.as_bytes(), &["face 1 of 1", "found vertex -2"]);
    refused("a.ply", ply("", "4", "1", "0 0 0\n1 nan 0\n").as_bytes(), &["vertex 2 of 4", "NaN", "finite"]);
    refused("a.ply", ply("", "4", "1", "0 0 0\n1 zero 0\n").as_bytes(), &["vertex 2 of 4", "f32", "expected", "again"]);
    refused("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", &["end_header", "cut off"]);
    refused("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty half x\nend_header\n", &["half", "header"]);
    refused("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty int x\nend_header\n", &["x, y and z"]);
    // A list of four thousand million vertices in a binary file.
    let mut binary = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n"
        .to_vec();
    binary.extend([0; 12]);
    binary.extend([0xff; 8]);
    refused("a.ply", &binary, &["face 1 of 1", "cut off"]);
}

#[test]
fn strips_of_scanners_and_old_comments_are_read() {
    let text = "ply\nformat ascii 1.0\ncomment caf\u{e9}\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0 1.7\n1 0 1.7\n\
        8 0 1 2 3 -1 0 1 3\n";
    let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let found = read("strip.ply", &latin).unwrap();
    let corners: Vec<u32> = found.source.corners.iter().map(|corner| corner.vertex).collect();
    assert_eq!(corners, [0, 1, 2, 2, 1, 3, 0, 1, 3]);
}

#[test]
fn an_stl_is_text_or_binary_by_its_length() {
    let binary = fs::read(path("body-trimesh-binary.stl")).unwrap();
    let mut named = binary.clone();
    named[..18].copy_from_slice(b"solid facet normal");
    assert_eq!(read("a.stl", &named).unwrap().mesh.triangles.len(), 312);
    refused("a.stl", &binary[..binary.len() - 1], &["found", "expected"]);
    let mut broken = binary;
    broken[84 + 12..84 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    refused("a.stl", &broken, &["triangle 1", "NaN"]);
    let facet = |z: f64| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex -0.0 1 {z}\nVERTEX 1 0 {z}\nendloop\nendfacet\n"
        )
    };
    let two = format!("solid left shoe\n{}endsolid\n\nsolid\n{}endsolid", facet(0.0), facet(1.5));
    let found = read("a.stl", two.as_bytes()).unwrap();
    assert_eq!(found.mesh.groups, ["left shoe", "(none)"]);
    assert_eq!(found.source.positions[0], DVec3::ZERO);
    refused("a.stl", b"solid\nfacet normal 0 0 1\nvertex 0 0\n", &["line 3", "vertex 0 0", "three numbers"]);
    refused("a.stl", b"solid\nfacet\nfacets are here\n", &["line 3", "facets are here", "endfacet"]);
    refused("a.stl", b"solid\nfacet normal 0 0 1\nvertex 0 0 1\n", &["line 3", "end of the file", "cut off"]);
}

/// A `.gltf` with these members beside the asset.
fn gltf(members: &str) -> Vec<u8> {
    format!("{{\"asset\": {{\"version\": \"2.0\"}}, {members}}}").into_bytes()
}

/// One triangle from the accessor and the buffers in `members`.
fn triangle(members: &str) -> Vec<u8> {
    gltf(&format!(
        "\"nodes\": [{{\"mesh\": 0}}], \"meshes\": [{{\"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}}}]}}], {members}"
    ))
}

#[test]
fn nothing_is_fetched_from_a_uri() {
    let accessor = "\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}], \
        \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 36}]";
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path().join("a.bin");
    fs::write(&beside, [0; 36]).unwrap();
    for uri in ["a.bin", "file:///etc/passwd", "http://localhost:1/a.bin", "../a.bin"] {
        let file = folder.path().join("a.gltf");
        let buffers = format!("{accessor}, \"buffers\": [{{\"byteLength\": 36, \"uri\": \"{uri}\"}}]");
        fs::write(&file, triangle(&buffers)).unwrap();
        let message = import_body(&file, &ImportOptions::default()).unwrap_err().to_string();
        let parts = ["buffer 0", uri, "another file", "not opened", ".glb"];
        parts.iter().for_each(|part| assert!(message.contains(part), "no \"{part}\" in: {message}"));
    }
    let buffers =
        |uri: &str| triangle(&format!("{accessor}, \"buffers\": [{{\"byteLength\": 36, \"uri\": \"{uri}\"}}]"));
    refused("a.gltf", &buffers("data:;base64,AAAA*"), &["base64", "invalid"]);
    refused("a.gltf", &buffers("data:,AAAA"), &["data URI", "base64"]);
    refused("a.gltf", &buffers("data:;base64,AAAA"), &["accessor 0", "3 elements of 12 bytes", "3 bytes"]);
    refused("a.gltf", &triangle(accessor), &["found an index past the buffers"]);
}

#[test]
fn a_gltf_states_no_more_than_it_holds() {
    let accessor =
        |of: &str| triangle(&format!("\"accessors\": [{{\"componentType\": 5126, \"type\": \"VEC3\", {of}}}]"));
    for count in [1_000_000_u64, u64::MAX] {
        refused("a.gltf", &accessor(&format!("\"count\": {count}")), &["accessor 0", "16 times"]);
    }
    refused("a.gltf", &accessor("\"count\": -1"), &["JSON is invalid", "-1"]);
    refused("a.gltf", &accessor("\"count\": 3, \"bufferView\": 9"), &["index past the views"]);
    let other = triangle("\"accessors\": [{\"componentType\": 5130, \"type\": \"VEC3\", \"count\": 3}]");
    refused("a.gltf", &other, &["component type 5130"]);
    let other = triangle("\"accessors\": [{\"componentType\": 5126, \"type\": \"VEC2\", \"count\": 3}]");
    refused("a.gltf", &other, &["found the type VEC2, expected VEC3"]);
    // One mesh of the file drawn by thousands of nodes.
    let nodes = vec!["{\"mesh\": 0}"; 20_000].join(",");
    let many = format!(
        "\"nodes\": [{nodes}], \"meshes\": [{{\"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}}}]}}], \
         \"accessors\": [{{\"componentType\": 5126, \"type\": \"VEC3\", \"count\": 3000}}]"
    );
    refused("a.gltf", &gltf(&many), &["16 times"]);
}

#[test]
fn nodes_form_a_tree_of_any_depth() {
    refused(
        "a.gltf",
        &gltf(
            "\"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0, \"children\": [1]}, {\"children\": [0]}], \
        \"meshes\": [{}]",
        ),
        &["node 0", "its own ancestors", "tree"],
    );
    refused("a.gltf", &gltf("\"nodes\": [{\"children\": [2]}, {\"children\": [2]}, {}]"), &["node 2", "two parents"]);
    refused("a.gltf", &gltf("\"nodes\": [{\"children\": [7]}]"), &["past the nodes", "below 1"]);
    refused("a.gltf", &gltf("\"scene\": 3, \"scenes\": [{}]"), &["past the scenes"]);
    let chain: Vec<String> = (1..100_000).map(|child| format!("{{\"children\": [{child}]}}")).collect();
    refused("a.gltf", &gltf(&format!("\"nodes\": [{}, {{}}]", chain.join(","))), &["the mesh is empty"]);
    let nested = format!("{{\"asset\": {}", "[".repeat(100_000));
    refused("a.gltf", nested.as_bytes(), &["JSON is invalid"]);
}

#[test]
fn glb_files_that_are_cut_or_compressed_are_refused() {
    let whole = fs::read(path("body-trimesh.glb")).unwrap();
    for end in [12, 20, 300, whole.len() - 1] {
        refused("a.glb", &whole[..end], &["expected"]);
    }
    let mut other = whole;
    other[16..20].copy_from_slice(b"NONE");
    refused("a.glb", &other, &["without a JSON chunk"]);
    let draco = gltf("\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]");
    refused("a.gltf", &draco, &["KHR_draco_mesh_compression", "without compression"]);
    refused("a.gltf", b"{\"asset\": {\"version\": \"1.0\"}}", &["version \"1.0\"", "2.0"]);
}

/// An archive of arrays, each by its name, the dictionary in its header, and its bytes.
pub(crate) fn npz(arrays: &[(&str, &str, &[u8])]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, header, bytes) in arrays {
        archive.start_file(format!("{name}.npy"), SimpleFileOptions::default()).unwrap();
        archive.write_all(b"\x93NUMPY\x01\0").unwrap();
        archive.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        archive.write_all(header.as_bytes()).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

#[test]
fn an_array_states_no_more_than_it_holds() {
    let faces =
        ("f", "{'descr': '|u1', 'fortran_order': False, 'shape': (4, 3), }", &[0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2][..]);
    let corners: Vec<u8> =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.7_f64].iter().flat_map(|x| x.to_be_bytes()).collect();
    let of = |descr: &str, shape: &str, bytes: &[u8]| {
        let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
        npz(&[("v", &header, bytes), faces])
    };
    assert!(read("a.npz", &of("'>f8'", "(4, 3)", &corners)).unwrap().report.is_closed());
    assert!(read("a.npz", &of("'>f8'", "(1L, 4L, 3L)", &corners)).unwrap().report.is_closed());
    refused("a.npz", &of("'<f8'", "(5, 3)", &corners), &["array v", "found 96 bytes, expected 120", "cut off"]);
    for shape in ["(1000000000, 3)", "(4294967296, 4294967296, 3)"] {
        refused("a.npz", &of("'<f8'", shape, &corners), &["array v", "numbers at most"]);
    }
    refused("a.npz", &of("'<f8'", "(12,)", &corners), &["array v", "[12]", "(n, 3)"]);
    refused("a.npz", &of("'<c16'", "(2, 3)", &corners), &["array v", "<c16", "float64"]);
    refused("a.npz", &of("[('x', '<f8')]", "(4, 3)", &corners), &["array v", "several fields"]);
    refused("a.npz", &of("'<f8'", "(-4, 3)", &corners), &["array v", "header"]);
    refused("a.npz", &of("'|O'", "(4, 3)", &corners), &["array v", "pickled"]);
    let past = npz(&[("v", "{'descr': '>f8', 'fortran_order': False, 'shape': (3, 3), }", &corners[..72]), faces]);
    refused("a.npz", &past, &["array f, row 1", "found vertex 3", "below 3"]);
    let halves: Vec<u8> = [0.0, 1.0, 1.5_f32].iter().flat_map(|x| x.to_le_bytes()).collect();
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }";
    let half =
        npz(&[("v", "{'descr': '>f8', 'fortran_order': False, 'shape': (4, 3), }", &corners), ("f", header, &halves)]);
    refused("a.npz", &half, &["array f, row 0", "1.5", "whole number"]);
    // A kilobyte that unpacks to more than is read.
    let zeros = vec![0; 1 << 24];
    let bomb = of("'|u1'", "(16777217, 3)", &zeros);
    assert!(bomb.len() < 40_000_000);
    refused("a.npz", &bomb, &["array v", "numbers at most"]);
}

#[test]
fn truncations_of_every_file_are_refused_or_read() {
    for entry in fs::read_dir(path("")).unwrap() {
        let file = entry.unwrap().path();
        let bytes = fs::read(&file).unwrap();
        for part in 0..40 {
            let cut = &bytes[..bytes.len() * part / 40];
            if let Err(message) = read("cut.bin", cut) {
                assert!(
                    ["found", "expected", "cannot be guessed"].iter().any(|word| message.contains(word)),
                    "{}: {message}",
                    file.display()
                );
            }
        }
    }
}
