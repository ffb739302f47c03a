//! `--picture`, and a garment on a body in several poses.

use std::fs;

use super::{Bench, cube};

const SCENE: [&str; 9] = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--no-save"];

/// Width and height of a PNG.
fn size(bench: &Bench, name: &str) -> [u32; 2] {
    let bytes = fs::read(bench.path(name)).unwrap();
    assert_eq!(&bytes[1..4], b"PNG");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

#[test]
fn eyes_are_columns_and_quantities_are_rows_and_bad_ones_are_refused() {
    let bench = Bench::new();
    let draws = |more: &[&str]| {
        let output = bench.drape(&[&["--no-save", "--refine", "0", "--picture", "out.png"], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        size(&bench, "out.png")
    };
    let one = draws(&[]);
    let two = draws(&["--eye", "front", "--eye", "back"]);
    let four = draws(&["--eye", "front", "--eye", "back", "--picture-of", "parts", "--picture-of", "strain"]);
    assert!(two[0] > one[0] && two[1] == one[1], "{one:?} {two:?}");
    assert!(four[0] == two[0] && four[1] > 3 * two[1] / 2, "{two:?} {four:?}");
    for (more, pieces) in [
        (&["--picture", "out.jpg"][..], &["out.jpg", "`.png`"][..]),
        (&["--picture", "a.png", "--eye", "left"], &["`left`", "front, side, back"]),
        (&["--picture", "a.png", "--picture-of", "heat"], &["`heat`", "drape, placed"]),
        (&["--picture", "a.png", "--picture-of", "error"], &["--picture-of error", "no --accuracy"]),
        (&["--picture", "a.png", "--eye", "flat"], &["--eye flat", "--pattern"]),
    ] {
        bench.refuses(&[&SCENE[..], more].concat(), pieces);
    }
}

#[test]
fn a_sheet_on_a_cube_follows_it_and_another_mesh_is_refused() {
    let bench = Bench::new();
    for (name, z) in [("pose-2.obj", 1.05), ("pose-10.obj", 1.1)] {
        fs::create_dir_all(bench.path("poses")).unwrap();
        bench.write(&format!("poses/{name}"), &cube(z));
    }
    let poses = |body: &str| {
        let arguments = ["--from-body", "body.obj", "--body", body, "--format", "json"];
        let output = bench.run(&[&SCENE[2..], &arguments].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        found["poses"].as_array().unwrap().clone()
    };
    let found = poses("poses");
    let bodies: Vec<&str> = found.iter().map(|pose| pose["body"].as_str().unwrap()).collect();
    assert_eq!(bodies, ["body", "pose-2", "pose-10"], "numbers count by value");
    for pose in &found[1..] {
        assert_eq!(pose["penetrating_vertices"], 0, "{pose}");
        assert!(pose["preview_rms_mm"].as_f64().unwrap() < 5.0, "{pose}");
    }
    // A vertex in the middle of one side.
    let bigger = cube(1.0).replace("f 1 3 4 2\n", "v 0 0 0.5\nf 1 3 9\nf 3 4 9\nf 4 2 9\nf 2 1 9\n");
    bench.write("bigger.obj", &bigger);
    let moved = |body| [&SCENE[2..], &["--from-body", "body.obj", "--body", body]].concat();
    bench.refuses(
        &moved("bigger.obj"),
        &["bigger.obj", "9 vertices and 14 triangles, expected 8 vertices and 12 triangles"],
    );
    bench.refuses(&[&moved("poses")[..], &["--method", "zhu2016"]].concat(), &["--method", "several poses"]);
}

/// The positions and the faces of an OBJ, vertices from 0.
fn parsed(obj: &str) -> (Vec<&str>, Vec<Vec<usize>>) {
    let corners = |line: &str| line.split(' ').map(|v| v.parse::<usize>().unwrap() - 1).collect();
    let lines = |key: &'static str| obj.lines().filter_map(move |line| line.strip_prefix(key));
    (lines("v ").collect(), lines("f ").map(corners).collect())
}

/// A mesh of an OBJ in another format.
type Written = fn(&str) -> String;

fn as_ply(obj: &str) -> String {
    let (positions, faces) = parsed(obj);
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        positions.len(),
        faces.len()
    );
    positions.iter().for_each(|position| ply += &format!("{position}\n"));
    faces.iter().for_each(|f| ply += &format!("4 {} {} {} {}\n", f[0], f[1], f[2], f[3]));
    ply
}

fn as_stl(obj: &str) -> String {
    let (positions, faces) = parsed(obj);
    let mut stl = "solid cube\n".to_owned();
    for corners in faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]) {
        stl += "facet normal 0 0 0\nouter loop\n";
        corners.iter().for_each(|&v| stl += &format!("vertex {}\n", positions[v]));
        stl += "endloop\nendfacet\n";
    }
    stl + "endsolid cube\n"
}

fn as_gltf(obj: &str) -> String {
    use base64::Engine as _;
    let (positions, faces) = parsed(obj);
    let numbers = positions.iter().flat_map(|position| position.split(' ').map(|x| x.parse::<f32>().unwrap()));
    let mut bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    let corners = faces.iter().flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]]);
    bytes.extend(corners.flat_map(|v| (v as u32).to_le_bytes()));
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"nodes\": [{{\"mesh\": 0}}], \"meshes\": [{{\"primitives\": [{{\"attributes\": \
         {{\"POSITION\": 0}}, \"indices\": 1}}]}}], \"buffers\": [{{\"byteLength\": {}, \"uri\": \"data:;base64,{data}\"}}], \
         \"bufferViews\": [{{\"buffer\": 0, \"byteLength\": 96}}, {{\"buffer\": 0, \"byteOffset\": 96, \"byteLength\": 144}}], \
         \"accessors\": [{{\"bufferView\": 0, \"componentType\": 5126, \"count\": 8, \"type\": \"VEC3\"}}, \
         {{\"bufferView\": 1, \"componentType\": 5125, \"count\": 36, \"type\": \"SCALAR\"}}]}}",
        bytes.len()
    )
}

#[test]
fn a_folder_of_poses_may_have_any_format_of_bodies() {
    let bench = Bench::new();
    let formats: [(&str, Written); 3] = [("ply", as_ply), ("stl", as_stl), ("gltf", as_gltf)];
    for (ending, written) in formats {
        fs::create_dir_all(bench.path(ending)).unwrap();
        for (number, z) in [(1, 1.0), (2, 1.05)] {
            bench.write(&format!("{ending}/{number}.{ending}"), &written(&cube(z)));
        }
        let output = bench.run(&[&SCENE[2..], &["--body", ending, "--format", "json"]].concat());
        assert!(output.status.success(), "{ending}: {}", String::from_utf8_lossy(&output.stderr));
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let bodies: Vec<&str> =
            found["poses"].as_array().unwrap().iter().map(|p| p["body"].as_str().unwrap()).collect();
        assert_eq!(bodies, ["1", "2"], "{ending}");
    }
}
