//! Commands beside `run`: the paper's Table 4, the certificate of a drape, sewing patterns.

use std::fs;
use std::process::Output;

use super::{Bench, json, sheet};

#[test]
fn the_papers_table_is_run_again_and_goes_on_from_its_rows() {
    let bench = Bench::new();
    let rows = bench.path("rows.json");
    let run = |rounds: &str| {
        let of = ["--rows", "pullover-1@600", "--rounds", rounds, "--starts", "0", "--rows-file", &rows];
        bench.run(&[&["bench", "table-4", "--format", "json"], &of[..]].concat())
    };
    let first = json(&run("1"));
    let entries = first["rows"][0]["entries"].as_array().unwrap();
    let names: Vec<&str> = entries.iter().map(|e| e["entrant"].as_str().unwrap()).collect();
    assert_eq!(names, ["zhu2016", "gross2003", "thomaszewski2006", "paper", "preview", "converged"]);
    assert!(entries.iter().all(|e| e["error"].is_null() && e["median_ms"].as_f64().unwrap() > 0.0));
    // The very times of the first run: nothing was draped again.
    assert_eq!(json(&run("1")), first);
    // A recording of a row that is draped, and none of one that is found.
    let recorded = |rows_file: &str| {
        let of = ["bench", "table-4", "--rows", "pullover-1@600", "--rounds", "1", "--starts", "0", "--rows-file"];
        bench.run(&[&of[..], &[rows_file, "--recordings", "seen", "--csv", "rows.csv"]].concat())
    };
    let found = String::from_utf8_lossy(&recorded(&rows).stderr).into_owned();
    assert!(found.contains("1 rows were found in") && !found.contains("recording: "), "{found}");
    let made = recorded("others.json");
    assert!(String::from_utf8_lossy(&made.stderr).contains("recording: "));
    assert!(fs::metadata(bench.path("seen/pullover-1-600.rrd")).unwrap().len() > 50_000);
    let other = run("2");
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("1 counted rounds"));
    // Where nothing is recorded yet: a refusal leaves nothing.
    let bench = Bench::new();
    bench.refuses(&["bench", "table-4", "--rows", "pullover-1"], &["pullover-1@VERTICES"]);
    bench.refuses(&["bench", "table-4", "--growth", "pullover-1@600"], &["--growth pullover-1@600", "--rows"]);
}

#[test]
fn a_reference_method_drapes_and_is_recorded_and_has_no_parts() {
    let bench = Bench::new();
    for method in ["zhu2016", "gross2003", "thomaszewski2006"] {
        let file = format!("{method}.rrd");
        let of = ["--garment", "flared-skirt@600", "--method", method, "--save", &file, "--format", "json"];
        let report = json(&bench.run(&of));
        assert_eq!((report["method"].as_str(), report["ended"].as_str()), (Some(method), Some("at-rest")));
        assert_eq!(report["penetrating_vertices"], 0);
        assert!(report["timings_ms"]["method"].as_f64().unwrap() > 0.0 && report["part_count"].is_null());
        assert!(!report["counts"].as_object().unwrap().is_empty());
        assert!(fs::metadata(bench.path(&file)).unwrap().len() > 10_000);
    }
    // Where nothing is recorded yet: a refusal leaves nothing.
    let bench = Bench::new();
    let skirt = ["--garment", "flared-skirt@600", "--method", "zhu2016"];
    for (more, word) in [
        (&["--accuracy"][..], "--accuracy"),
        (&["--refine", "3"], "--refine"),
        (&["--model", "paper"], "--model"),
        (&["--garment", "pullover-1@600"], "2 garments"),
    ] {
        bench.refuses(&[&skirt[..], more].concat(), &[word, "zhu2016"]);
    }
    // A sheet has no seams, and so no pieces.
    let frame = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z"];
    bench.refuses(&[&frame[..], &["--method", "gross2003"]].concat(), &["gross2003 cannot run here", "--pattern"]);
}

#[test]
fn an_exported_drape_is_certified_and_the_undraped_garment_is_not() {
    let bench = Bench::new();
    json(&bench.drape(&["--no-save", "--export", "draped.obj", "--format", "json"]));
    let certified = |garment: &str| {
        let check = ["check", "body.obj", "garment.obj", "--unit", "m", "--up", "z"];
        bench.run(&[&check[..], &["--certificate", garment, "--format", "json"]].concat())
    };
    let passes = |output: &Output, name: &str| -> bool {
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let findings = report["certificate"]["findings"].as_array().unwrap();
        findings.iter().find(|f| f["name"] == name).unwrap()["passes"].as_bool().unwrap()
    };
    let at_rest = certified("draped.obj");
    for line in ["residual", "forces add up", "friction", "inside the body", "largest strain"] {
        assert!(passes(&at_rest, line), "{line}: {}", String::from_utf8_lossy(&at_rest.stdout));
    }
    let floating = certified("garment.obj");
    assert_eq!(floating.status.code(), Some(1));
    assert!(!passes(&floating, "residual"));
    assert!(String::from_utf8_lossy(&floating.stderr).contains("not certified"));
    bench.write("other.obj", &sheet(11, 1.51));
    let other = certified("other.obj");
    let message = String::from_utf8_lossy(&other.stderr);
    assert!(
        other.status.code() == Some(2) && message.contains("other.obj") && message.contains("121 faces, expected 144"),
        "{message}"
    );
    // Two faces replaced by others: the vertices and the number of faces stay the same.
    let draped = fs::read_to_string(bench.path("draped.obj")).unwrap();
    let faces: Vec<&str> = draped.lines().filter(|line| line.starts_with("f ")).collect();
    for (out, by) in [(10, 40), (30, 90)] {
        bench.write("faked.obj", &draped.replacen(faces[out], faces[by], 1));
        let faked = certified("faked.obj");
        let stderr = String::from_utf8_lossy(&faked.stderr);
        let place = format!("face {} has other vertices", out + 1);
        assert!(faked.status.code() == Some(2) && stderr.contains("faked.obj") && stderr.contains(&place), "{stderr}");
    }
}

#[test]
fn a_curtain_is_certified_where_it_was_hung_and_nowhere_else() {
    let bench = Bench::new();
    let curtain = || {
        let mut obj = String::new();
        for (i, j) in (0..9).flat_map(|j| (0..16).map(move |i| (i, j))) {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 16.0).sin_cos();
            obj += &format!("v {} {} {}\n", 0.6 + 0.1 * cos, 0.1 * sin, 1.2 + 0.03 * f64::from(j));
        }
        for (i, j) in (0..8).flat_map(|j| (0..16).map(move |i| (i, j))) {
            let [a, b] = [16 * j + i + 1, 16 * j + (i + 1) % 16 + 1];
            obj += &format!("f {a} {b} {}\nf {a} {} {}\n", b + 16, b + 16, a + 16);
        }
        obj
    };
    bench.write("garment.obj", &curtain());
    let hold = ["--hold", "top"];
    json(&bench.drape(&[&hold[..], &["--no-save", "--export", "hung.obj", "--format", "json"]].concat()));
    let hung = fs::read_to_string(bench.path("hung.obj")).unwrap();
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').skip(1).map(|n| n.parse().unwrap()).collect() };
    let certified = |place: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let moved = hung.lines().map(|line| match line.starts_with("v ") {
            true => {
                let [x, y, z] = place(numbers(line).try_into().unwrap());
                format!("v {x} {y} {z}\n")
            }
            false => format!("{line}\n"),
        });
        bench.write("moved.obj", &moved.collect::<String>());
        let check = ["check", "body.obj", "garment.obj", "--unit", "m", "--up", "z", "--certificate", "moved.obj"];
        bench.run(&[&check[..], &hold].concat())
    };
    let here = certified(&|p| p);
    assert!(here.status.success(), "{}", String::from_utf8_lossy(&here.stdout));
    let (sin, cos) = 40f64.to_radians().sin_cos();
    let moves: [&dyn Fn([f64; 3]) -> [f64; 3]; 4] =
        [&|[x, y, z]| [x, y, z + 0.3], &|[x, y, z]| [x, y, z - 0.4], &|[x, y, z]| [x + 0.1, y, z], &|[x, y, z]| {
            [0.6 + (x - 0.6) * cos - y * sin, (x - 0.6) * sin + y * cos, z]
        }];
    for place in moves {
        let there = certified(place);
        let stdout = String::from_utf8_lossy(&there.stdout);
        assert!(there.status.code() == Some(1) && stdout.contains("held edges"), "{stdout}");
    }
    // The same file as garment and as drape says nothing about where the edge was held.
    let check = ["check", "body.obj", "moved.obj", "--unit", "m", "--up", "z", "--certificate", "moved.obj"];
    bench.refuses(&[&check[..], &hold].concat(), &["moved.obj", "held edges cannot be judged"]);
}

#[test]
fn a_pattern_is_summed_up_and_drawn_and_a_bad_one_refused() {
    let bench = Bench::new();
    let skirt = format!("{}/assets/patterns/skirt.json", env!("CARGO_MANIFEST_DIR"));
    let out = bench.run(&["pattern", &skirt, "--svg", "flat.svg", "--format", "json", "--edge-length", "3"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["panels"].as_array().unwrap().len(), 4);
    assert_eq!(report["seams"][4]["sides"][1], "skirt_front.2");
    assert!((report["seams"][4]["gathered_percent"].as_f64().unwrap() - 100.0 * (48.0 / 35.0 - 1.0)).abs() < 1e-9);
    assert!(fs::read_to_string(bench.folder.path().join("flat.svg")).unwrap().contains("5 +37 %"));
    bench.write("bad.json", &fs::read_to_string(&skirt).unwrap().replace("[3, 0]", "[3, 7]"));
    for arguments in [&["pattern", "bad.json"][..], &["--pattern", "bad.json", "--no-save"][..]] {
        let out = bench.run(arguments);
        let message = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{message}");
        assert!(message.contains("bad.json") && message.contains("edge 3") && message.contains("[3,7]"), "{message}");
    }
}
