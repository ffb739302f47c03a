//! The command line as a user meets it: what it prints, writes, refuses, and exits with.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod beside;
mod exported;
mod fabrics;
mod pictures;
mod verdict;

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use tempfile::TempDir;

/// A cube of half a metre around (0, 0, `z`), as OBJ text; closed, wound outwards, z up.
fn cube(z: f64) -> String {
    let mut obj = String::new();
    for i in 0..8 {
        let at = |bit: usize| if i >> bit & 1 == 1 { 0.25 } else { -0.25 };
        obj += &format!("v {} {} {}\n", at(0), at(1), z + 2.0 * at(2));
    }
    obj + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// A square sheet of `n` by `n` quads, 0.6 m wide, at height `z`.
fn sheet(n: usize, z: f64) -> String {
    let mut obj = String::from("vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\no sheet\n");
    for j in 0..=n {
        for i in 0..=n {
            let at = |k: usize| 0.6 * (k as f64 / n as f64 - 0.5);
            obj += &format!("v {} {} {z}\n", at(i), at(j));
        }
    }
    for j in 0..n {
        obj += if j < n / 2 { "g front\n" } else { "g back\n" };
        for i in 0..n {
            let a = j * (n + 1) + i + 1;
            obj += &format!("f {}/1 {}/2 {}/3 {}/4\n", a, a + 1, a + n + 2, a + n + 1);
        }
    }
    obj
}

struct Bench {
    folder: TempDir,
}

impl Bench {
    /// A folder with a cube to dress and a sheet a centimetre above it.
    fn new() -> Self {
        let bench = Self { folder: TempDir::new().unwrap() };
        bench.write("body.obj", &cube(1.0));
        bench.write("garment.obj", &sheet(12, 1.51));
        bench
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.folder.path().join(name), text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("partwise").unwrap();
        command.current_dir(self.folder.path()).args(arguments).timeout(std::time::Duration::from_secs(120));
        command.output().unwrap()
    }

    fn drape(&self, more: &[&str]) -> Output {
        let frame = ["run", "--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z"];
        self.run(&[&frame[..], more].concat())
    }

    /// The run is refused with exit code 2, names what it should, and leaves no recording, whole or half.
    fn refuses(&self, arguments: &[&str], words: &[&str]) {
        let output = self.run(arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{arguments:?} should say `{word}`: {message}");
        }
        assert!(!message.contains("panicked"), "{message}");
        let left: Vec<_> = walk(self.folder.path()).into_iter().filter(|f| f.contains(".rrd")).collect();
        assert!(left.is_empty(), "{arguments:?} left {left:?}");
    }
}

fn walk(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        if entry.path().is_dir() {
            found.extend(walk(&entry.path()));
        } else {
            found.push(entry.path().display().to_string());
        }
    }
    found
}

fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn one_json_object_with_the_promised_keys() {
    let bench = Bench::new();
    let report = json(&bench.drape(&["--format", "json"]));
    for key in [
        "vertices",
        "part_count",
        "parts_per_level",
        "unassigned_vertices",
        "contact_parts",
        "timings_ms",
        "penetrating_vertices",
        "warnings",
    ] {
        assert!(!report[key].is_null(), "{key} is missing: {report}");
    }
    for stage in ["load", "distance", "segment", "cloth", "mechanics", "other", "measure", "record"] {
        assert!(report["timings_ms"][stage].as_f64().unwrap() >= 0.0, "{stage}");
    }
    let times = report["timings_ms"].as_object().unwrap();
    let sum: f64 = times.iter().filter(|(name, _)| *name != "total").map(|(_, ms)| ms.as_f64().unwrap()).sum();
    let total = times["total"].as_f64().unwrap();
    assert!((sum - total).abs() < 1e-6 * total, "{times:?}");
    assert_eq!(report["vertices"], 169);
    assert_eq!(report["penetrating_vertices"], 0);
    let per_level: u64 = report["parts_per_level"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(report["part_count"].as_u64().unwrap(), per_level);
    assert!(bench.folder.path().join("recordings/garment.rrd").exists());
}

#[test]
fn vertices_in_no_level_are_warned_of_and_recorded() {
    let bench = Bench::new();
    bench.write("near.toml", "name = \"near\"\nunit = \"cm\"\nlevels = [[0.0, 3.0]]\n");
    let report = json(&bench.drape(&["--table", "near.toml", "--model", "paper", "--format", "json"]));
    assert!(report["unassigned_vertices"].as_u64().unwrap() > 0, "{report}");
    assert!(report["warnings"].to_string().contains("no level"), "{report}");
    assert!(bench.folder.path().join("recordings/garment.rrd").exists());
}

#[test]
fn the_same_bits_with_one_thread_and_with_two() {
    let bench = Bench::new();
    let mut exports = Vec::new();
    for (threads, name) in [("1", "a.obj"), ("2", "b.obj"), ("2", "c.obj")] {
        let output = bench.drape(&["--threads", threads, "--export", name, "--no-save"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        exports.push(fs::read(bench.path(name)).unwrap());
    }
    assert_eq!(exports[0], exports[1]);
    assert_eq!(exports[1], exports[2]);
}

#[test]
fn bad_meshes_are_refused_by_file_and_line() {
    let bench = Bench::new();
    bench.refuses(&["--garment", "nowhere.obj", "--body", "body.obj"], &["nowhere.obj"]);
    bench.write("empty.obj", "# nothing\n");
    bench.refuses(&["--garment", "empty.obj", "--body", "body.obj", "--unit", "m", "--up", "z"], &["empty.obj"]);
    let broken = sheet(2, 1.51).replacen("v 0 0 1.51", "v 0 nan 1.51", 1);
    bench.write("nan.obj", &broken);
    bench.refuses(&["--garment", "nan.obj", "--body", "body.obj"], &["nan.obj", "line 10", "nan"]);
    bench.write("range.obj", "v 0 0 1.6\nv 1 0 1.6\nv 0 1 1.6\nf 1 2 9\n");
    bench.refuses(&["--garment", "range.obj", "--body", "body.obj"], &["range.obj", "line 4", "9"]);
    bench.write("far.obj", &sheet(2, 40.0));
    let far = ["--garment", "far.obj", "--body", "body.obj", "--unit", "m", "--up", "z"];
    bench.refuses(&far, &["body", "--unit"]);
    bench.write("open.obj", &cube(1.0).replace("f 1 3 4 2\n", ""));
    let open = ["--garment", "garment.obj", "--body", "open.obj", "--unit", "m", "--up", "z"];
    bench.refuses(&open, &["open.obj", "not closed", "--open-body"]);
    bench.refuses(&["--body", "body.obj", "--garment", "garment.obj", "--garment-group", "cuff"], &["cuff", "front"]);
    bench.refuses(&["--garment", "ballgown"], &["ballgown", "low-cut-dress"]);
}

#[test]
fn bad_tables_are_refused_by_file_and_row() {
    let bench = Bench::new();
    for (levels, word) in [
        ("[[0.5, 1.0], [0.0, 0.5]]", "row 2"),
        ("[[0.0, 1.0], [0.5, 2.0]]", "row 2"),
        ("[[-1.0, 1.0]]", "row 1"),
        ("[[0.0, nan]]", "row 1"),
        ("[[0.0]]", "t.toml:2"),
        ("[]", "level"),
    ] {
        bench.write("t.toml", &format!("name = \"t\"\nlevels = {levels}\nunit = \"cm\"\n"));
        bench.refuses(
            &["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--table", "t.toml"],
            &["t.toml", word],
        );
    }
    bench.refuses(&["--table", "nope.toml"], &["nope.toml"]);
    bench.refuses(&["--table", "table-4"], &["table-4", "table-3"]);
    bench.refuses(&["--fabric", "unobtainium"], &["unobtainium"]);
}

#[test]
fn unavailable_sinks_are_reported() {
    let bench = Bench::new();
    let scene = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z"];
    bench.write("file", "");
    bench.refuses(&[&scene[..], &["--save", "file/x.rrd"]].concat(), &["file/x.rrd"]);
    bench.refuses(&[&scene[..], &["--no-save", "--export", "file/x.obj"]].concat(), &["file/x.obj"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    bench.refuses(&[&scene[..], &["--no-save", "--serve", "--web-port", &port]].concat(), &[&port, "in use"]);
    bench.refuses(&[&scene[..], &["--no-save", "--serve", "--grpc-port", &port]].concat(), &[&port, "in use"]);
    let nobody = "rerun+http://127.0.0.1:1/proxy";
    bench.refuses(&[&scene[..], &["--no-save", "--connect", nobody]].concat(), &["127.0.0.1:1"]);
}

#[test]
fn a_held_edge_stays_and_an_unknown_one_is_refused() {
    let bench = Bench::new();
    let steps = ["--refine", "3", "--no-save"];
    let held = bench.drape(&[&steps[..], &["--hold", "top", "--export", "held.obj"]].concat());
    assert!(held.status.success(), "{}", String::from_utf8_lossy(&held.stderr));
    let out = fs::read_to_string(bench.path("held.obj")).unwrap();
    let corner = "v -0.3 -0.3 1.51";
    assert!(out.lines().any(|l| l == corner), "the sheet's edge is held");
    let free = bench.drape(&[&steps[..], &["--export", "free.obj"]].concat());
    assert!(free.status.success());
    assert!(!fs::read_to_string(bench.path("free.obj")).unwrap().lines().any(|l| l == corner));
    bench.refuses(
        &["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--hold", "cuff"],
        &["cuff", "front", "top"],
    );
}

#[test]
fn the_table_alone_makes_the_parts_and_the_option_their_motion() {
    let bench = Bench::new();
    // A garment laid flat would stay as placed.
    let skirt = ["--garment", "flared-skirt@400", "--refine", "0", "--no-save", "--format", "json"];
    let preview = |more: &[&str]| json(&bench.run(&[&skirt[..], more].concat()));
    let plain = preview(&[]);
    assert_eq!((&plain["part_count"], &plain["motion"]), (&plain["level_part_count"], &"affine".into()));
    let same = preview(&["--max-extent", "0", "--motion", "affine"]);
    assert_eq!(same["displacement_rms_mm"], plain["displacement_rms_mm"]);
    let shifted = preview(&["--motion", "translation"]);
    assert_eq!((&shifted["part_count"], &shifted["motion"]), (&plain["part_count"], &"translation".into()));
    assert_ne!(shifted["displacement_rms_mm"], plain["displacement_rms_mm"]);
    let cut = preview(&["--max-extent", "20,10"]);
    assert!(cut["part_count"].as_u64() > plain["part_count"].as_u64(), "{cut}");
    bench.refuses(&["--max-extent", "6,12"], &["--max-extent 6,12", "12,6"]);
    bench.refuses(&["--max-extent=-1"], &["--max-extent", "centimetres"]);
    bench.refuses(&["--motion", "rigid"], &["--motion", "translation"]);
}

#[test]
fn the_representable_error_is_reported_in_words_and_numbers() {
    let bench = Bench::new();
    let cache = bench.path("cache");
    let measured = ["--refine", "0", "--accuracy", "--cache", &cache, "--no-save"];
    let figures = json(&bench.drape(&[&measured[..], &["--format", "json"]].concat()));
    let [affine, one] =
        ["representable_affine_rms_mm", "representable_rms_mm"].map(|key| figures[key].as_f64().unwrap());
    assert!(affine < one, "{affine} {one}");
    let message = String::from_utf8(bench.drape(&measured).stdout).unwrap();
    let words = format!(
        "{affine:.1} mm RMS to the canonical drape by the best affine map of each PART, {one:.1} by the best displacement, \
         without steps of single vertices"
    );
    assert!(message.contains(&words), "{words}: {message}");
    // A drape can be nearer than that bound. Each error names the drape that it is a distance to.
    let [own, canonical] = ["rms_mm", "canonical_rms_mm"].map(|key| figures[key].as_f64().unwrap());
    let words = format!("{own:.2} mm RMS to the rest it converges to by itself, {canonical:.1} to the canonical drape");
    assert!(message.contains(&words), "{words}: {message}");
}

#[test]
fn the_drape_test_takes_a_fabric_from_a_file() {
    let bench = Bench::new();
    bench.write("my, silk.toml", include_str!("../../assets/fabrics/silk.toml"));
    let test = |fabric: &str, csv: &str| {
        let output = bench.run(&["cusick", fabric, "--rows", "4", "--csv", csv]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut reader = csv::Reader::from_path(bench.path(csv)).unwrap();
        reader.records().next().unwrap().unwrap()
    };
    let (file, built_in) = (test("my, silk.toml", "file.csv"), test("silk", "built-in.csv"));
    assert_eq!((&file[0], &file[1], &file[6]), ("my, silk.toml", &built_in[1], "no published band"));
    bench.refuses(&["cusick", "nowhere.toml"], &["nowhere.toml", "cannot be read"]);
}

#[test]
fn help_teaches_and_mistakes_exit_with_two() {
    let bench = Bench::new();
    let help = String::from_utf8(bench.run(&["--help"]).stdout).unwrap();
    for word in ["Examples:", "Exit codes", "--table", "--serve", "--watch", "--export", "range table", "PART"] {
        assert!(help.contains(word), "--help should speak of {word}");
    }
    assert_eq!(bench.run(&["--no-such-flag"]).status.code(), Some(2));
    assert_eq!(bench.drape(&["--threads", "0"]).status.code(), Some(2));
    bench.refuses(&["view", "nowhere.rrd"], &["nowhere.rrd"]);
    bench.write("fake.rrd", "not a recording");
    let output = bench.run(&["view", "fake.rrd"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("fake.rrd"));
}

#[test]
fn completions_and_manual_pages_name_every_subcommand() {
    let bench = Bench::new();
    let stdout = |arguments: &[&str]| {
        let out = bench.run(arguments);
        assert!(out.status.success(), "{out:?}");
        String::from_utf8(out.stdout).unwrap()
    };
    let page = stdout(&["man"]);
    assert!(page.contains(".TH partwise 1"), "{page}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = stdout(&["completions", shell]);
        for command in ["sweep", "live", "compare", "completions"] {
            assert!(script.contains(command), "{shell}: {command}");
            assert!(page.contains(command), "{command}");
        }
    }
    let sweep = stdout(&["man", "sweep"]);
    assert!(sweep.contains("resume") && sweep.contains(".TH partwise-sweep 1"), "{sweep}");
    let refused = bench.run(&["man", "sweeep"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("found `sweeep`, expected one of run, live"));
}
