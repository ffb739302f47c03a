//! Time and memory of a body of a million triangles: `cargo test --release --no-default-features --test formats -- --ignored --nocapture`.
#![allow(clippy::print_stderr, reason = "it prints what it measures")]

use std::f64::consts::{PI, TAU};
use std::fs;

use glam::DVec3;
use partwise::body::distance::Body;
use partwise::mesh::import::{ImportOptions, import_body};

const AROUND: u32 = 1000;
const ROWS: u32 = 501;

/// An egg 1.7 m tall, z up, of two poles and [`ROWS`] - 1 rings.
fn egg() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let ring = |j: u32, i: u32| 1 + (j - 1) * AROUND + i % AROUND;
    let mut positions = vec![DVec3::ZERO];
    for j in 1..ROWS {
        let angle = PI * f64::from(j) / f64::from(ROWS);
        let height = 0.85 * (1.0 - angle.cos());
        let radius = (0.3 - 0.1 * height) * angle.sin();
        let point = |i| TAU * f64::from(i) / f64::from(AROUND);
        positions.extend((0..AROUND).map(|i| DVec3::new(radius * point(i).cos(), radius * point(i).sin(), height)));
    }
    positions.push(DVec3::new(0.0, 0.0, 1.7));
    let mut triangles = Vec::new();
    for i in 0..AROUND {
        triangles.push([0, ring(1, i + 1), ring(1, i)]);
        triangles.push([ring(ROWS - 1, i), ring(ROWS - 1, i + 1), positions.len() as u32 - 1]);
        for j in 1..ROWS - 1 {
            let [a, b, c, d] = [ring(j, i), ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions.iter().map(|p| p.to_array().map(|x| x as f32)).collect(), triangles)
}

fn ply(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    let mut bytes = header.into_bytes();
    bytes.extend(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    for triangle in triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

fn glb(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let (n, m) = (positions.len(), triangles.len());
    let (places, length) = (12 * n, 12 * (n + m));
    let mut text = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"nodes\": [{{\"mesh\": 0}}], \"buffers\": [{{\"byteLength\": {length}}}], \
         \"meshes\": [{{\"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}, \"indices\": 1}}]}}], \"bufferViews\": \
         [{{\"buffer\": 0, \"byteLength\": {places}}}, {{\"buffer\": 0, \"byteOffset\": {places}, \"byteLength\": {}}}], \
         \"accessors\": [{{\"bufferView\": 0, \"componentType\": 5126, \"count\": {n}, \"type\": \"VEC3\"}}, \
         {{\"bufferView\": 1, \"componentType\": 5125, \"count\": {}, \"type\": \"SCALAR\"}}]}}",
        12 * m,
        3 * m
    )
    .into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + (text.len() + length) as u32).to_le_bytes());
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((length as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(positions.iter().flat_map(|&[x, y, z]| [x, z, -y]).flat_map(f32::to_le_bytes));
    bytes.extend(triangles.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// Largest memory of the process so far, MB (Linux).
fn peak_mb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|kb| kb.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kb| kb / 1024)
}

/// Processor time of all threads so far, s (Linux). It does not depend on what else the machine does.
fn seconds() -> f64 {
    let status = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = status.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    // User and system time in hundredths of a second.
    [11, 12].map(|field| fields.get(field).and_then(|text| text.parse::<f64>().ok()).unwrap_or(0.0)).iter().sum::<f64>()
        / 100.0
}

/// `PARTWISE_LARGE` names one of the two files, for its memory alone.
#[test]
#[ignore = "measures"]
fn a_million_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let only = std::env::var("PARTWISE_LARGE").ok();
    for ending in ["ply", "glb"].into_iter().filter(|ending| only.as_ref().is_none_or(|only| only == ending)) {
        let path = folder.path().join(format!("egg.{ending}"));
        {
            let (positions, triangles) = egg();
            fs::write(&path, if ending == "ply" { ply(&positions, &triangles) } else { glb(&positions, &triangles) })
                .unwrap();
        }
        let (made, began) = (peak_mb(), seconds());
        // The name of no group is refused after the file is parsed.
        let parsed = import_body(&path, &ImportOptions { group: Some("none".to_owned()), ..ImportOptions::default() });
        assert!(parsed.unwrap_err().to_string().contains("no group"));
        let (parse, began) = (seconds() - began, seconds());
        let imported = import_body(&path, &ImportOptions::default()).unwrap();
        let (import, began) = (seconds() - began, seconds());
        assert_eq!((imported.mesh.triangles.len(), imported.report.is_closed()), (1_000_000, true));
        let peak = peak_mb();
        let body = Body::new(&imported.mesh).unwrap();
        let index = seconds() - began;
        assert!(body.nearest(DVec3::new(0.0, 0.0, 2.0)).signed_distance > 0.29);
        eprintln!(
            "{ending}: parsed in {parse:.2} s, parsed and checked in {import:.2} s, indexed in {index:.2} s of processor time"
        );
        eprintln!("{ending}: {made} MB to make it, {peak} MB checked, {} MB indexed", peak_mb());
    }
}
