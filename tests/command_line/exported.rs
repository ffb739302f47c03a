//! The displaced garment as a file.

use std::collections::BTreeSet;
use std::fs;

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
        assert!(all.len() == 169 && different.len() >= least, "{what}: {} colours", different.len());
    }
    let scene = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--no-save"];
    bench
        .refuses(&[&scene[..], &["--export", "out.obj", "--export-colours", "parts"]].concat(), &["out.obj", "`.glb`"]);
    bench.refuses(&[&scene[..], &["--export-colours", "parts"]].concat(), &["--export"]);
}
