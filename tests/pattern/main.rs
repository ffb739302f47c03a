//! Sewing patterns: edges on their curves, seams that meet, invalid files, and shapes in closed form.

#![allow(clippy::unwrap_used, clippy::panic)]

mod bad;
mod closed_forms;
mod curves;
mod cut;
mod dxf;
mod seams;
mod worn;

use partwise::garment::pattern::SewingPattern;
use serde_json::{Value, json};

/// A pattern of these panels and stitches, lengths in cm.
fn pattern(panels: &Value, stitches: &Value) -> String {
    json!({
        "pattern": { "panels": panels, "stitches": stitches },
        "properties": { "curvature_coords": "relative", "units_in_meter": 100,
            "normalize_panel_translation": false, "normalized_edge_loops": true },
    })
    .to_string()
}

/// A panel of straight edges, placed at `z` cm in front of the body's middle.
fn straight(vertices: &[[f64; 2]], z: f64) -> Value {
    let n = vertices.len();
    let edges: Vec<Value> = (0..n).map(|k| json!({ "endpoints": [k, (k + 1) % n] })).collect();
    json!({ "translation": [0.0, 0.0, z], "rotation": [0.0, 0.0, 0.0], "vertices": vertices, "edges": edges })
}

fn stitch(a: (&str, usize), b: (&str, usize)) -> Value {
    json!([{ "panel": a.0, "edge": a.1 }, { "panel": b.0, "edge": b.1 }])
}

fn parse(text: &str) -> SewingPattern {
    partwise::garment::pattern::parse(text, "test").unwrap()
}
