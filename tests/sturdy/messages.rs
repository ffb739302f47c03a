//! Invalid options are refused before any computation; an interrupted run keeps its results.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::Bench;

#[test]
fn options_that_cannot_be_are_refused_before_anything_is_solved() {
    let bench = Bench::new();
    for extent in ["nan", "inf", "-3"] {
        bench
            .drape(&["--no-save", &format!("--max-extent={extent}")])
            .with(2, &["--max-extent", extent, "centimetres"]);
    }
    // Both end within moments; the garment of the first would take longer to make.
    for line in [&["--watch", "--no-save", "--garment", "long-sleeved-dress@60000"][..], &["--watch", "--no-save"]] {
        let refused = bench.run(line);
        refused.with(2, &["--watch has no file to watch", "--table"]);
        assert!(refused.took < Duration::from_secs(5), "{:?}", refused.took);
    }
    let denim = include_str!("../../assets/fabrics/denim.toml");
    bench.write("stiff.toml", &denim.replace("shear_n_per_m = 27.0", "shear_n_per_m = 1e308"));
    bench
        .drape(&["--no-save", "--fabric", "stiff.toml"])
        .with(2, &["stiff.toml", "shear_n_per_m is 1e308", "expected"]);
}

#[test]
fn one_part_alone_is_solved_by_the_papers_equations_too() {
    let bench = Bench::new();
    bench.write("whole.toml", "name = \"whole\"\nunit = \"cm\"\nlevels = [[0, inf]]\n");
    let ended = bench.drape(&["--no-save", "--model", "paper", "--table", "whole.toml"]);
    ended.with(0, &[]);
    assert!(!ended.stderr.contains("no three of"), "{}", ended.stderr);
}

#[test]
fn a_search_takes_no_more_parts_than_there_are_vertices() {
    let bench = Bench::new();
    for most in ["100000000", "18446744073709551615"] {
        let tuned = bench.run(&[
            "tune",
            "--garment",
            "flared-skirt@400",
            "--levels-only",
            "--tables",
            "16",
            "--max-parts",
            most,
            "--out",
            "t",
        ]);
        tuned.with(0, &[]);
        assert!(!tuned.stderr.contains("memory allocation"), "{}", tuned.stderr);
    }
}

#[test]
fn check_prints_a_verdict_and_compare_the_reasons_of_failed_tables() {
    let bench = Bench::new();
    let run_check = |arguments: &[&str]| {
        let done = bench.command().args(arguments).output().unwrap();
        (String::from_utf8(done.stdout).unwrap(), done.status.code())
    };
    let (message, code) = run_check(&["check", "form", "flared-skirt@400"]);
    assert!(message.contains("verdict: no defect affects a drape") && code == Some(0), "{message}");
    bench.write("low.obj", &super::GARMENT.replace("v 0 0 1.65", "v 0 0 1.55"));
    let (message, _) = run_check(&["check", "body.obj", "low.obj"]);
    assert!(message.contains("verdict: found 1 garment vertices inside the body"), "{message}");
    // A ring with nothing under it falls with every table; the row of each table has the reason.
    let ring: String = (0..2)
        .flat_map(|j| (0..12).map(move |i| (f64::from(i) * std::f64::consts::TAU / 12.0, j)))
        .map(|(a, j)| format!("v {:.4} {:.4} {}\n", 0.9 * a.cos(), 0.9 * a.sin(), 1.5 - 0.1 * f64::from(j)))
        .chain((0..12).map(|i| format!("f {} {} {} {}\n", i + 1, i + 13, (i + 1) % 12 + 13, (i + 1) % 12 + 1)))
        .collect();
    bench.write("ring.obj", &ring);
    let scene = ["--body", "body.obj", "--garment", "ring.obj", "--repeats", "1", "--no-save", "--refine", "converged"];
    let (message, code) = run_check(&[&["compare", "table-3", "table-3"], &scene[..]].concat());
    assert!(message.contains("fallen off the body; hold its edge (--hold top)") && code == Some(2), "{message}");
}

/// Bounds and PARTs of the levels in a table: `cells` takes them from the words of a row.
fn levels(text: &str, cells: impl Fn(&[&str]) -> Option<(String, u32)>) -> Vec<(String, u32)> {
    let row = |line: &str| {
        let words: Vec<&str> = line.split(['│', '┆', ' ']).filter(|word| !word.is_empty()).collect();
        cells(&words)
    };
    text.lines().skip_while(|line| !line.contains("level ")).skip(1).filter_map(row).collect()
}

#[test]
fn levels_have_the_same_bounds_and_parts_in_run_and_compare() {
    let bench = Bench::new();
    let output_of = |arguments: &[&str]| {
        let mut command = bench.command();
        let done = command.args(arguments).args(["--garment", "flared-skirt@400", "--no-save"]).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap()
    };
    let by_run = levels(&output_of(&["run", "--refine", "0"]), |words| match words {
        [level, from, to, parts, _] if level.parse::<u32>().is_ok() => {
            Some((format!("{from}–{to}"), parts.parse().ok()?))
        }
        _ => None,
    });
    let compare = ["compare", "table-3", "table-3", "--repeats", "1", "--accuracy", "none"];
    let by_compare = levels(&output_of(&compare), |words| match words {
        [bounds, parts] if bounds.contains('–') => Some((bounds.to_string(), parts.parse().ok()?)),
        _ => None,
    });
    assert!(by_run.len() > 8 && by_run == by_compare, "{by_run:?} and {by_compare:?}");
}

#[test]
fn repairs_of_the_mesh_stand_beside_the_count_of_parts() {
    let bench = Bench::new();
    bench.write("twice.obj", &format!("{}f 1 2 5\n", super::GARMENT));
    let mut command = bench.command();
    command.args([
        "--body",
        "body.obj",
        "--garment",
        "twice.obj",
        "--unit",
        "m",
        "--up",
        "z",
        "--refine",
        "0",
        "--no-save",
    ]);
    let found = String::from_utf8(command.output().unwrap().stdout).unwrap();
    let line = found.lines().find(|line| line.starts_with("stage one")).unwrap_or_else(|| panic!("{found}"));
    assert!(line.contains("counted after repairs of the mesh: dropped 1 triangles that were there already"), "{line}");
}

#[test]
fn the_times_of_a_row_add_up() {
    let bench = Bench::new();
    let sweep = "name = \"s\"\nrepeats = 1\n[base]\ngarment = \"flared-skirt@400\"\n[grid]\ntables = [\"table-3\"]\n";
    bench.write("s.toml", sweep);
    bench.run(&["sweep", "s.toml", "--out", "s", "--no-save"]).with(0, &[]);
    let rows = fs::read_to_string(bench.path("s/rows.csv")).unwrap();
    let lines: Vec<csv::StringRecord> = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(rows.as_bytes())
        .records()
        .map(Result::unwrap)
        .collect();
    let time = |name: &str| {
        let column = lines[0].iter().position(|title| title == format!("time_{name}_ms")).unwrap();
        lines[1][column].parse::<f64>().unwrap()
    };
    let stages: f64 = ["distance", "segment", "cloth", "mechanics", "refine", "other"].map(time).iter().sum();
    assert!((stages - time("total")).abs() < 1e-3 * time("total"), "{stages} of {} ms", time("total"));
}

#[test]
fn ctrl_c_while_the_error_is_measured_keeps_the_drape() {
    let bench = Bench::new();
    let line =
        ["--garment", "flared-skirt@400", "--accuracy", "--spread", "2000", "--save", "x.rrd", "--export", "x.obj"];
    // On a slow machine nothing may be draped by then; the run is repeated with a later interrupt.
    for patience in [4, 30, 120] {
        let mut command = bench.command();
        let mut child = command.args(line).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_secs(patience));
        let asked = Instant::now();
        // Twice at once, as `timeout -s INT` does: that is one press.
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id, &id]).status().unwrap().success());
        let mut message = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut message).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130), "{message}");
        if !message.contains("the drape is kept without its error") {
            continue;
        }
        assert!(asked.elapsed() < Duration::from_secs(30), "{:?}", asked.elapsed());
        assert!(
            fs::read_to_string(bench.path("x.obj")).unwrap().lines().filter(|l| l.starts_with("v ")).count() == 400
        );
        return bench.run(&["view", "--check", "x.rrd"]).with(0, &[]);
    }
    panic!("never came so far");
}
