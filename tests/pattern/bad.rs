//! Errors of patterns name the panel, the edge and the expected value.

use partwise::garment::pattern::{parse, sew};
use serde_json::{Value, json};

use crate::{pattern, stitch, straight};

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]];

fn error_of(text: &str) -> String {
    parse(text, "test").unwrap_err().to_string()
}

fn with(edit: impl Fn(&mut Value)) -> String {
    let mut panel = straight(&SQUARE, 20.0);
    edit(&mut panel);
    error_of(&pattern(&json!({ "left_front": panel }), &json!([])))
}

fn names(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{text:?} does not contain {part:?}");
    }
}

#[test]
fn errors_of_panels_name_panel_and_edge() {
    names(&with(|p| p["edges"][2]["endpoints"] = json!([2, 9])), &["left_front", "edge 2", "[2,9]", "0 to 3"]);
    names(&with(|p| p["edges"][2]["endpoints"] = json!([0, 3])), &["left_front", "edge 2", "vertex 0", "expected 2"]);
    names(&with(|p| p["vertices"][1] = json!([1e9, 0.0])), &["left_front", "vertex 1", "1000000000"]);
    names(&with(|p| p["vertices"][1] = json!(["x", 0.0])), &["left_front", "vertex 1"]);
    names(&with(|p| p["vertices"][1] = json!([0.0, 0.0])), &["left_front", "edge 0", "0.01 cm"]);
    names(&with(|p| p["vertices"][2] = json!([-5.0, 20.0])), &["left_front", "edges 1 and 3", "cross"]);
    names(&with(|p| p["vertices"][1] = json!([0.0, 60.0])), &["left_front", "cross"]);
    names(&with(|p| p["edges"] = json!([])), &["left_front", "0 edges"]);
    names(&with(|p| p["edges"][1]["curvature"] = json!({ "type": "spline", "params": [] })), &["edge 1", "spline"]);
    names(
        &with(|p| p["edges"][1]["curvature"] = json!({ "type": "circle", "params": [3.0, 0, 0] })),
        &["edge 1", "radius 3", "20"],
    );
    names(&with(|p| drop(p.as_object_mut().unwrap().remove("vertices"))), &["left_front", "vertices"]);
    // An edge that bulges over the opposite one.
    names(
        &with(|p| p["edges"][0]["curvature"] = json!({ "type": "quadratic", "params": [[0.5, 2.5]] })),
        &["left_front", "edges 0 and 2", "cross"],
    );
}

#[test]
fn errors_of_stitches_name_stitch_and_edges() {
    let panels = json!({ "a": straight(&SQUARE, 20.0), "b": straight(&SQUARE, -20.0) });
    let of = |stitches: Value| error_of(&pattern(&panels, &stitches));
    names(&of(json!([stitch(("a", 0), ("c", 0))])), &["stitch 0", "\"c\"", "a, b"]);
    names(&of(json!([stitch(("a", 0), ("b", 4))])), &["stitch 0", "panel b", "edge 4", "0 to 3"]);
    names(
        &of(json!([stitch(("a", 0), ("b", 0)), stitch(("b", 0), ("a", 1))])),
        &["stitches 0 and 1", "edge 0 of panel b"],
    );
    // Three edges sewn in a cycle.
    names(
        &of(json!([stitch(("a", 0), ("b", 0)), stitch(("b", 0), ("b", 1)), stitch(("b", 1), ("a", 0))])),
        &["stitches 0 and 1", "edge 0 of panel b"],
    );
    names(&of(json!([stitch(("a", 0), ("a", 0))])), &["edge 0 of panel a"]);
    names(&of(json!([[{ "panel": "a", "edge": -1 }, { "panel": "b", "edge": 0 }]])), &["stitch 0"]);
    names(&of(json!([[{ "panel": "a", "edge": 0 }]])), &["stitch 0", "two edges"]);
    let narrow = json!({ "a": straight(&SQUARE, 20.0), "b": straight(&[[0.0, 0.0], [3.0, 0.0], [3.0, 40.0], [0.0, 40.0]], -20.0) });
    names(
        &error_of(&pattern(&narrow, &json!([stitch(("a", 0), ("b", 0))]))),
        &["stitch 0", "a.0", "40.0 cm", "b.0", "3.0 cm"],
    );
}

#[test]
fn texts_that_are_no_pattern_are_rejected() {
    names(&error_of("v 0 0 0"), &["no JSON"]);
    names(&error_of("[1, 2]"), &["the file", "[1,2]"]);
    names(&error_of("{}"), &["\"pattern\""]);
    names(&error_of(&pattern(&json!({}), &json!([]))), &["0 panels"]);
    // Python writes NaN, which JSON does not have.
    let text = pattern(&json!({ "a": straight(&SQUARE, 20.0) }), &json!([])).replacen("40.0", "NaN", 1);
    names(&error_of(&text), &["no JSON", "line 1"]);
    let long = format!("{{\"pattern\": \"{}\"}}", "x".repeat(10 << 20));
    names(&error_of(&long), &["10.0 MB", "4 MB"]);
    let deep = "[".repeat(100_000);
    names(&error_of(&deep), &["no JSON"]);
}

#[test]
fn a_repeated_key_is_rejected_by_its_name() {
    let text = pattern(&json!({ "front": straight(&SQUARE, 20.0), "sleeve": straight(&SQUARE, -20.0) }), &json!([]));
    assert!(parse(&text, "test").is_ok());
    names(&error_of(&text.replace("\"sleeve\"", "\"front\"")), &["\"front\" twice", "line 1", "rename"]);
    names(&error_of(&text.replacen("\"rotation\"", "\"translation\"", 1)), &["\"translation\" twice"]);
    names(
        &error_of(&text.replacen("\"endpoints\":", "\"endpoints\":[0,1],\"endpoints\":", 1)),
        &["\"endpoints\" twice"],
    );
    names(&error_of(&text.replacen("\"stitches\":", "\"stitches\":[],\"stitches\":", 1)), &["\"stitches\" twice"]);
}

#[test]
fn unknown_keys_are_noted() {
    let mut panel = straight(&SQUARE, 20.0);
    panel["grain"] = json!(45);
    let read = parse(&pattern(&json!({ "a": panel }), &json!([])), "test").unwrap();
    names(&read.notes.join("\n"), &["panel a", "grain"]);
}

#[test]
fn a_coordinate_that_underflows_is_named_in_a_sentence() {
    let mut panel = straight(&SQUARE, 20.0);
    panel["vertices"][0] = json!([1e-300, 0.0]);
    let read = parse(&pattern(&json!({ "left": panel }), &json!([])), "test").unwrap();
    let error = sew(&read, 0.02).unwrap_err().to_string();
    names(&error, &["panel left", "nearer to 0", "write 0 for it"]);
    assert!(!error.contains("TooSmall"), "{error}");
}

#[test]
fn edge_lengths_out_of_range_are_rejected() {
    let read = parse(&pattern(&json!({ "a": straight(&SQUARE, 20.0) }), &json!([])), "test").unwrap();
    for wrong in [0.0, -1.0, f64::NAN, 1e-9, 3.0, f64::INFINITY] {
        names(&sew(&read, wrong).unwrap_err().to_string(), &["edge length", "0.2 to 20 cm"]);
    }
    let large: Vec<[f64; 2]> = SQUARE.iter().map(|v| v.map(|x| 50.0 * x)).collect();
    let read = parse(&pattern(&json!({ "a": straight(&large, 20.0) }), &json!([])), "test").unwrap();
    names(&sew(&read, 0.002).unwrap_err().to_string(), &["250000", "longer"]);
}
