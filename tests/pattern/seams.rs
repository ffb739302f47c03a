//! Properties of sewn garments.

use partwise::garment::pattern::sew;
use partwise::mesh::Topology;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::{parse, pattern, stitch, straight};

/// A panel of n edges about a circle of some 20 cm, edges bulging by `bulge`, kinds in turn; clockwise if asked.
fn round(n: usize, radii: &[f64], bulge: f64, clockwise: bool, z: f64) -> Value {
    let at = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / n as f64;
        let (sin, cos) = (if clockwise { -turn } else { turn }).sin_cos();
        [20.0 * radii[k] * cos, 100.0 + 20.0 * radii[k] * sin]
    };
    let vertices: Vec<[f64; 2]> = (0..n).map(at).collect();
    let edge = |k: usize| {
        let (from, to) = (vertices[k], vertices[(k + 1) % n]);
        let chord = (from[0] - to[0]).hypot(from[1] - to[1]);
        let curvature = match k % 4 {
            0 => Value::Null,
            1 => json!({ "type": "quadratic", "params": [[0.5, bulge]] }),
            2 => json!({ "type": "cubic", "params": [[0.3, bulge], [0.8, 0.5 * bulge]] }),
            _ => json!({ "type": "circle", "params": [chord * 1.3, false, !clockwise] }),
        };
        json!({ "endpoints": [k, (k + 1) % n], "curvature": curvature })
    };
    let edges: Vec<Value> = (0..n).map(edge).collect();
    json!({ "translation": [0.0, 0.0, z], "rotation": [0.0, 0.0, 0.0], "vertices": vertices, "edges": edges })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_stitched_pair_meets_vertex_to_vertex(
        n in 3_usize..8,
        radii in prop::collection::vec(0.7_f64..1.3, 8),
        bulge in -0.12_f64..0.12,
        scale in 0.8_f64..1.25,
        sewn_edges in 1_usize..7,
        edge_cm in 1.0_f64..4.0,
        right_wrong in any::<bool>(),
    ) {
        let larger: Vec<f64> = radii.iter().map(|r| r * scale).collect();
        let panels = json!({ "a": round(n, &radii, bulge, false, 20.0), "b": round(n, &larger, bulge, true, -20.0) });
        // b runs the other way round: its edge n − 1 − k has the places of a's k.
        let count = sewn_edges.min(n - 1);
        let stitches: Vec<Value> = (0..count)
            .map(|k| {
                let mut pair = stitch(("a", k), ("b", n - 1 - k));
                if right_wrong {
                    pair.as_array_mut().unwrap().push(json!("right_wrong"));
                }
                pair
            })
            .collect();
        let read = parse(&pattern(&panels, &json!(stitches)));
        let sewn = sew(&read, 0.01 * edge_cm).unwrap();
        for (stitch, seam) in read.stitches.iter().zip(&sewn.seams) {
            let [a, b] = stitch.sides.map(|side| sewn.panels[side.panel].along(side.edge));
            let b: Vec<u32> = if right_wrong { b } else { b.into_iter().rev().collect() };
            prop_assert_eq!(&a, &b);
            prop_assert_eq!(&a, seam);
            let longest = read.lengths(stitch).into_iter().fold(0.0, f64::max);
            prop_assert!(longest / (a.len() - 1) as f64 <= 0.01 * edge_cm + 1e-12);
        }
        // Every panel is covered once, by triangles the right way round in the rest shape.
        for (panel, of) in sewn.panels.iter().zip(&read.panels) {
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| panel.flat[v as usize]);
                0.5 * (b - a).perp_dot(c - a)
            };
            let areas: Vec<f64> = panel.triangles.iter().map(area).collect();
            prop_assert!(areas.iter().all(|a| *a > 0.0));
            let outline_len = (0..of.edges.len()).map(|edge| panel.along(edge).len() - 1).sum();
            let outline = &panel.flat[..outline_len];
            let polygon: f64 = (0..outline.len()).map(|i| 0.5 * outline[i].perp_dot(outline[(i + 1) % outline.len()])).sum();
            prop_assert!((areas.iter().sum::<f64>() - polygon.abs()).abs() < 1e-12);
            // Chords against curves: a part in a hundred at these edges.
            prop_assert!((polygon - of.signed_area()).abs() < 0.03 * of.signed_area().abs());
        }
        prop_assert!(sewn.rest.areas().iter().all(|a| *a > 0.0));
        let topology = Topology::new(&sewn.mesh);
        prop_assert!(topology.edge_valence.iter().all(|&v| v <= 2));
        prop_assert_eq!(topology.components().1, 1);
        if !right_wrong {
            // Neighbours run along their common edge in opposite directions.
            let mut seen = std::collections::BTreeSet::new();
            for &[a, b, c] in &sewn.mesh.triangles {
                for edge in [(a, b), (b, c), (c, a)] {
                    prop_assert!(seen.insert(edge), "edge {:?} twice", edge);
                }
            }
        }
        prop_assert_eq!(sew(&read, 0.01 * edge_cm).unwrap(), sewn);
    }
}

#[test]
fn a_dart_closes() {
    let vertices = [[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [22.0, 30.0], [20.0, 18.0], [18.0, 30.0], [0.0, 30.0]];
    let read = parse(&pattern(&json!({ "one": straight(&vertices, 20.0) }), &json!([stitch(("one", 3), ("one", 4))])));
    let sewn = sew(&read, 0.01).unwrap();
    let panel = &sewn.panels[0];
    let (down, up) = (panel.along(3), panel.along(4));
    assert_eq!(down, up.into_iter().rev().collect::<Vec<_>>());
    let topology = Topology::new(&sewn.mesh);
    assert_eq!(topology.boundary_loops().len(), 1, "the dart is shut from its mouth to its point");
    let on_edge = topology.boundary_vertices();
    assert!(on_edge[down[0] as usize] && down[1..].iter().all(|&v| !on_edge[v as usize]));
}

#[test]
fn a_gathered_seam_keeps_both_lengths() {
    let panels = json!({
        "wide": straight(&[[-30.0, 60.0], [30.0, 60.0], [30.0, 100.0], [-30.0, 100.0]], 20.0),
        "band": straight(&[[-20.0, 101.0], [20.0, 101.0], [20.0, 105.0], [-20.0, 105.0]], 20.0),
    });
    let read = parse(&pattern(&panels, &json!([stitch(("wide", 2), ("band", 0))])));
    assert!((read.gathering(&read.stitches[0]) - 1.5).abs() < 1e-12);
    let sewn = sew(&read, 0.02).unwrap();
    let along = |panel: usize| {
        let of = |t: usize| sewn.mesh.triangle_group[t] as usize == panel;
        let seam = &sewn.seams[0];
        let mut length = 0.0;
        for (t, triangle) in sewn.mesh.triangles.iter().enumerate().filter(|(t, _)| of(*t)) {
            for k in 0..3 {
                let pair = [triangle[k], triangle[(k + 1) % 3]];
                if pair.iter().all(|v| seam.contains(v)) {
                    length += sewn.rest.corners[t][k].distance(sewn.rest.corners[t][(k + 1) % 3]);
                }
            }
        }
        length
    };
    let name = |name: &str| sewn.mesh.groups.iter().position(|g| g == name).unwrap();
    assert!((along(name("wide")) - 0.6).abs() < 1e-12 && (along(name("band")) - 0.4).abs() < 1e-12);
}
