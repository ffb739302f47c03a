//! `--fabric` for each garment and `--fabrics` for panels, as a user meets them.

use super::{Bench, json};

const OUTFIT: [&str; 5] = ["run", "--garment", "flared-skirt@400", "--garment", "pullover-1@500"];

#[test]
fn a_fabric_for_each_garment_is_listed_and_certified() {
    let bench = Bench::new();
    let cloth = ["--fabric", "denim", "--fabric", "interlock"];
    let more = ["--refine", "0", "--no-save", "--format", "json"];
    let report = json(&bench.run(&[&OUTFIT[..], &cloth, &more].concat()));
    assert_eq!(report["fabric"], "denim + interlock");
    let cut = |k: usize| (report["cut"][k]["garment"].as_str(), report["cut"][k]["fabric"].as_str());
    assert_eq!([cut(0), cut(1)], [(Some("flared-skirt"), Some("denim")), (Some("pullover-1"), Some("interlock"))]);
    // One for all says nothing of the kind.
    let report = json(&bench.run(&[&OUTFIT[..], &["--fabric", "denim"], &more].concat()));
    assert!(report["fabric"] == "denim" && report["cut"].is_null());
}

#[test]
fn fabrics_that_do_not_go_round_are_refused() {
    let bench = Bench::new();
    let three = ["--fabric", "denim", "--fabric", "silk", "--fabric", "wool"];
    bench.refuses(&[&OUTFIT[..], &three].concat(), &["3 fabrics for 2 garments", "one for all"]);
    bench.refuses(&[&OUTFIT[..], &["--fabric", "denim", "--fabric", "tweed"]].concat(), &["tweed", "denim"]);
    let twice = ["--fabric", "denim", "--fabric", "silk"];
    bench.refuses(&[&["live", "--garment", "flared-skirt@400"], &twice[..]].concat(), &["live", "2 times --fabric"]);
    let compare = ["compare", "table-3", "table-3", "--garment", "flared-skirt@400"];
    bench.refuses(&[&compare[..], &twice].concat(), &["compare", "2 times --fabric"]);
}

const MESHES: [&str; 8] = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z"];

fn run<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["run"], &MESHES[..], more].concat()
}

#[test]
fn groups_of_a_mesh_get_the_fabrics_of_a_file() {
    let bench = Bench::new();
    bench.write("other.toml", "[panels]\nback = \"denim\"\n");
    let given = ["--fabrics", "other.toml", "--no-save"];
    let report = json(&bench.run(&run(&[&given[..], &["--export", "draped.obj", "--format", "json"]].concat())));
    assert_eq!(report["fabric"], "interlock + denim");
    assert_eq!(report["cut"][1]["panels"][0], "back");
    let certify = |more: &[&str]| {
        let output =
            bench.run(&[&["check"], &MESHES[..], &["--certificate", "draped.obj", "--format", "json"], more].concat());
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let findings = report["certificate"]["findings"].as_array().unwrap().clone();
        findings.iter().find(|f| f["name"] == "residual").unwrap()["passes"].as_bool().unwrap()
    };
    assert!(
        certify(&["--fabrics", "other.toml"]) && !certify(&[]),
        "the fabrics of the drape are those of its certificate"
    );
    bench.refuses(&run(&["--fabrics", "other.toml", "--method", "zhu2016"]), &["zhu2016", "2 fabrics", "expected one"]);
    bench.refuses(&run(&["--fabrics", "nowhere.toml"]), &["nowhere.toml", "cannot be read"]);
    bench.write("other.toml", "[panels]\nsleeve = \"denim\"\n");
    bench.refuses(&run(&["--fabrics", "other.toml"]), &["other.toml", "line 2", "sleeve", "front, back"]);
    // Beside the garment it is found, and every panel named leaves nothing to cut from another.
    bench.write("garment.fabrics.toml", "default = \"silk\"\n");
    bench.refuses(&run(&["--fabric", "denim"]), &["--fabric denim", "garment.fabrics.toml", "take --fabric away"]);
}
