//! The displaced garment as a file.

use std::collections::BTreeSet;
use std::fs;

use glam::DVec3;
use partwise::mesh::{Topology, TriMesh};

use super::{Bench, sheet};

#[test]
fn the_export_keeps_faces_groups_and_texture_coordinates() {
    let bench = Bench::new();
    let output = bench.drape(&["--export", "out.obj", "--no-save"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let out = fs::read_to_string(bench.path("out.obj")).unwrap();
    let faces = |text: &str| text.lines().filter(|l| l.starts_with("f ")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(faces(&out), faces(&sheet(12, 1.51)), "quads stay quads, vt stay where they were");
    assert!(out.contains("g front") && out.contains("g back"));
    assert_eq!(out.lines().filter(|l| l.starts_with("vt ")).count(), 4);
    assert!(!out.contains("v 0 0 1.51"), "the garment moved");
}

/// Colours of the vertices of a `.glb`.
fn colours(glb: &[u8]) -> Vec<[u8; 4]> {
    let number = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let document: serde_json::Value = serde_json::from_slice(&glb[20..20 + number(12)]).unwrap();
    let accessor = document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64().unwrap() as usize;
    let view = document["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
    let [from, bytes] =
        ["byteOffset", "byteLength"].map(|of| document["bufferViews"][view][of].as_u64().unwrap() as usize);
    let binary = 28 + number(12) + from;
    glb[binary..binary + bytes].chunks_exact(4).map(|c| c.try_into().unwrap()).collect()
}

#[test]
fn a_coloured_export_has_the_colours_of_parts_and_of_strain() {
    let bench = Bench::new();
    for (what, least) in [("parts", 2), ("strain", 8)] {
        let output = bench.drape(&["--no-save", "--export", "out.glb", "--export-colours", what]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let all = colours(&fs::read(bench.path("out.glb")).unwrap());
        let different: BTreeSet<_> = all.iter().collect();
        // A vertex of several texture coordinates is there once for each.
        assert!(all.len() > 169 && different.len() >= least, "{what}: {} colours", different.len());
    }
    let scene = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--no-save"];
    bench
        .refuses(&[&scene[..], &["--export", "out.obj", "--export-colours", "parts"]].concat(), &["out.obj", "`.glb`"]);
    bench.refuses(&[&scene[..], &["--export-colours", "parts"]].concat(), &["--export"]);
}

/// Length of the boundary loop that lies lowest, m.
fn hem_m(obj: &str) -> f64 {
    let rows = |key: &str| -> Vec<Vec<String>> {
        let lines = obj.lines().filter_map(|line| line.strip_prefix(key));
        lines.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
    };
    let coordinate = |text: &String| text.parse::<f64>().unwrap();
    let vertex = |row: &Vec<String>| DVec3::new(coordinate(&row[0]), coordinate(&row[1]), coordinate(&row[2]));
    let corner = |text: &String| text.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
    let positions: Vec<DVec3> = rows("v ").iter().map(vertex).collect();
    let triangles = rows("f ").iter().map(|row| [0, 1, 2].map(|k| corner(&row[k]))).collect();
    let mesh = TriMesh::new(positions, triangles);
    let at = |v: &u32| mesh.positions[*v as usize];
    let height = |hem: &[u32]| hem.iter().map(|v| at(v).z).sum::<f64>() / hem.len() as f64;
    let loops = Topology::new(&mesh).boundary_loops();
    let hem = loops.into_iter().min_by(|a, b| height(a).total_cmp(&height(b))).unwrap();
    hem.iter().zip(hem.iter().cycle().skip(1)).map(|(a, b)| at(a).distance(at(b))).sum()
}

#[test]
fn a_preview_is_exported_with_its_folds() {
    let bench = Bench::new();
    let scene = ["--garment", "flared-skirt@1500", "--no-save"];
    let export = |more: &[&str]| {
        let output = bench.run(&[&scene[..], more, &["--refine", "0", "--export", "skirt.obj"]].concat());
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (hem_m(&fs::read_to_string(bench.path("skirt.obj")).unwrap()), text)
    };
    let ((tube_m, tube), (folded_m, folded)) = (export(&[]), export(&["--folds"]));
    assert!(!tube.contains("folds drawn") && folded.contains("folds drawn"), "{folded}");
    // Cut at 2.7 m.
    assert!(tube_m < 1.5 && (2.4..2.8).contains(&folded_m), "{tube_m} and {folded_m} m");
    let converged = [&scene[..], &["--folds", "--export", "skirt.obj"]].concat();
    bench.refuses(&converged, &["--folds", "expected --refine 0"]);
}

#[test]
fn every_format_reads_back_with_its_groups() {
    let bench = Bench::new();
    for ending in ["ply", "glb", "usda"] {
        let out = format!("out.{ending}");
        let output = bench.drape(&["--no-save", "--export", &out, "--export-colours", "strain"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let bytes = fs::read(bench.path(&out)).unwrap();
        if ending == "usda" {
            let text = String::from_utf8(bytes).unwrap();
            for part in ["upAxis = \"Z\"", "def GeomSubset \"front\"", "primvars:st = [", "primvars:displayColor"] {
                assert!(text.contains(part), "no {part}");
            }
            continue;
        }
        let output = bench.run(&["check", "body.obj", &out, "--body-unit", "m", "--body-up", "z", "--format", "json"]);
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["garment"]["vertices"], 169, "{ending}: {report}");
    }
    let scene = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--no-save"];
    let export = |file: &'static str| [&scene[..], &["--export", file, "--export-body"]].concat();
    bench.refuses(&export("out.ply"), &["out.ply", "--export-body", "`.glb`"]);
    bench.refuses(&[&scene[..], &["--export", "out.stl"]].concat(), &["`.stl`", "`.usda`"]);
    let output = bench.run(&export("both.glb"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = bench.run(&["check", "both.glb", "both.glb", "--body-group", "body", "--garment-group", "garment"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("169"), "{}", String::from_utf8_lossy(&output.stderr));
}
