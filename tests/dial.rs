//! Range tables as a dial, from the command line: sweeps that survive, shards that join, tables compared and tuned.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod inspect;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use partwise::parts::range_table::RangeTable;
use tempfile::TempDir;

const SWEEP: &str = r#"
name = "small"
[base]
garment = "flared-skirt@400"
extent_cm = 20
[grid]
tables = ["table-3", { scale = [0.5, 2] }, { quantile = [4, 8] }]
"#;

struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self { folder: TempDir::new().unwrap() };
        bench.write("sweep.toml", SWEEP);
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("partwise"));
        command.current_dir(self.folder.path()).args(arguments).env("XDG_CACHE_HOME", self.path("cache"));
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn does(&self, arguments: &[&str]) -> Output {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    }

    fn refuses(&self, arguments: &[&str], word: &str) {
        let output = self.run(arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.contains(word), "{arguments:?} should say `{word}`: {message}");
    }

    /// The rows of a sweep's CSV without what differs from run to run.
    fn rows(&self, folder: &str) -> Vec<Vec<String>> {
        let mut reader = csv::Reader::from_path(self.path(folder).join("rows.csv")).unwrap();
        let header = reader.headers().unwrap().clone();
        let kept: Vec<usize> = (0..header.len()).filter(|&i| !header[i].starts_with("time_")).collect();
        let rows = reader.records().map(|r| r.unwrap());
        rows.map(|row| kept.iter().map(|&i| row[i].to_owned()).collect()).collect()
    }

    fn recording(&self, folder: &str) -> inspect::Contents {
        inspect::read(&self.path(folder).join("flared-skirt@400.rrd"))
    }
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_sweep_leaves_rows_and_a_recording_and_is_not_run_twice() {
    let bench = Bench::new();
    let report = json(&bench.does(&["sweep", "sweep.toml", "--out", "a", "--format", "json"]));
    assert_eq!((&report["points"], &report["failed"]), (&5.into(), &0.into()));
    for row in report["rows"].as_array().unwrap() {
        for key in ["part_count", "rms_mm", "canonical_rms_mm", "representable_rms_mm", "time_total_ms"] {
            assert!(row[key].as_f64().unwrap() > 0.0, "{key} of {row}");
        }
    }
    let contents = bench.recording("a");
    for path in ["/parts/garment", "/force/garment", "/drape/garment", "/error/garment", "/report", "/rows"] {
        assert_eq!(contents.entities[path].rows, 5, "{path}");
    }
    assert_eq!(contents.entities["/body"].fixed_rows, 1);
    assert!(contents.entities.contains_key("/compare/4/garment") && contents.entities.contains_key("/scatter/points"));
    bench.refuses(&["sweep", "sweep.toml", "--out", "a"], "--resume");
    let again = json(&bench.does(&["sweep", "sweep.toml", "--out", "a", "--resume", "--format", "json"]));
    assert_eq!(again["skipped"], 5);
    // Another accuracy is another result: its rows are not mixed with these.
    bench.refuses(&["sweep", "sweep.toml", "--out", "a", "--resume", "--accuracy", "none"], "--adopt");
}

#[test]
fn threads_jobs_and_shards_change_no_row_and_no_step() {
    let bench = Bench::new();
    let sweep = |more: &[&str]| {
        bench.does(&[&["sweep", "sweep.toml", "--accuracy", "canonical"], more].concat());
    };
    sweep(&["--out", "one", "--threads", "1"]);
    sweep(&["--out", "two", "--threads", "2", "--jobs", "2"]);
    assert_eq!(bench.rows("one"), bench.rows("two"));
    assert_eq!(bench.recording("one"), bench.recording("two"));
    for shard in ["1", "2", "3"] {
        sweep(&["--shard", &format!("{shard}/3"), "--out", &format!("part-{shard}"), "--no-save"]);
    }
    bench.does(&["merge", "part-3", "part-1", "part-2", "--out", "whole"]);
    assert_eq!(bench.rows("one"), bench.rows("whole"));
    assert_eq!(bench.recording("one"), bench.recording("whole"));
    bench.refuses(&["merge", "part-1", "part-2", "--out", "most"], "missing");
}

#[test]
fn a_killed_sweep_goes_on_where_it_was() {
    let bench = Bench::new();
    let whole = ["sweep", "sweep.toml", "--out", "whole", "--accuracy", "canonical"];
    bench.does(&whole);
    let broken = ["sweep", "sweep.toml", "--out", "broken", "--accuracy", "canonical", "--no-save"];
    let mut child = bench.command(&broken).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let began = Instant::now();
    let rows = bench.path("broken").join("rows.jsonl");
    while fs::read_to_string(&rows).map_or(0, |text| text.lines().count()) < 2 {
        assert!(began.elapsed() < Duration::from_secs(60), "no rows within a minute");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // A torn line, as a full disk leaves it, and a point whose drape is gone.
    let mut text = fs::read_to_string(&rows).unwrap();
    text.push_str("{\"point\":\"ab");
    fs::write(&rows, text).unwrap();
    let lost = fs::read_dir(bench.path("broken").join("points")).unwrap().next().unwrap().unwrap();
    fs::remove_file(lost.path()).unwrap();
    bench.does(&["sweep", "sweep.toml", "--out", "broken", "--accuracy", "canonical", "--resume"]);
    assert_eq!(bench.rows("whole"), bench.rows("broken"));
    assert_eq!(bench.recording("whole"), bench.recording("broken"));
}

#[test]
fn a_point_that_fails_is_a_row_and_the_rest_are_done() {
    let bench = Bench::new();
    bench.write("far.toml", "name = \"far\"\nunit = \"cm\"\nlevels = [[500.0, 600.0]]\n");
    bench.write("fails.toml", &format!("{SWEEP}\n[[points]]\ntable = \"far.toml\"\nextent_cm = \"none\"\n"));
    let output = bench.run(&["sweep", "fails.toml", "--out", "a", "--accuracy", "none", "--format", "json"]);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let report = json(&output);
    assert_eq!((&report["failed"], report["rows"].as_array().unwrap().len()), (&1.into(), 6));
    assert!(report["rows"][5]["error"].as_str().unwrap().contains("none of the garment"), "{}", report["rows"][5]);
    assert_eq!(bench.recording("a").entities["/drape/garment"].rows, 5);
    bench.write("odd.toml", "name = \"odd\"\n[base]\noptions = { speed = 3 }\n[grid]\n");
    bench.refuses(&["sweep", "odd.toml"], "speed");
    bench.refuses(&["sweep", "nowhere.toml"], "nowhere.toml");
    // Two garments are two recordings: refused before the first point.
    let two = SWEEP.replace("[grid]", "[grid]\ngarments = [\"flared-skirt@400\", \"pullover-1@400\"]");
    bench.write("two.toml", &two);
    bench.refuses(&["sweep", "two.toml", "--out", "two", "--save", "one.rrd"], "one recording");
    assert!(!bench.path("two").join("rows.csv").exists());
}

#[test]
fn compared_tables_list_split_and_merged_levels() {
    let bench = Bench::new();
    bench.write("coarse.toml", "name = \"coarse\"\nunit = \"cm\"\nlevels = [[0.0, 4.0], [4.0, inf]]\n");
    bench.write("fine.toml", "name = \"fine\"\nunit = \"cm\"\nlevels = [[0.0, 2.0], [2.0, 4.0], [4.0, inf]]\n");
    let common = ["compare", "coarse.toml", "fine.toml", "--garment", "flared-skirt@400", "--max-extent", "20"];
    let found = json(&bench.does(&[&common[..], &["--accuracy", "canonical", "--format", "json"]].concat()));
    let [coarse, fine] = &found.as_array().unwrap()[..] else { panic!("{found}") };
    assert_eq!(coarse["split"], 0);
    assert!(fine["split"].as_u64().unwrap() > 0 && fine["merged"] == 0, "{fine}");
    let counted: u64 = fine["per_level"].as_array().unwrap().iter().map(|l| l["parts"].as_u64().unwrap()).sum();
    assert_eq!(fine["level_part_count"], counted);
    let contents = inspect::read(&bench.path("recordings/compare/flared-skirt@400.rrd"));
    assert!(contents.entities.contains_key("/compare/1/garment"));
    let csv =
        bench.does(&[&common[..], &["--accuracy", "none", "--format", "csv", "--no-save", "--csv", "c.csv"]].concat());
    assert_eq!(fs::read(bench.path("c.csv")).unwrap(), csv.stdout);
    // A header, and a line for each level of each table.
    assert_eq!(String::from_utf8(csv.stdout).unwrap().lines().count(), 1 + 2 + 3);
    bench.refuses(&["compare", "table-3"], "2 to 6");
    bench.refuses(&["compare", "table-3", "nowhere.toml"], "nowhere.toml");
}

#[test]
fn a_tuned_table_has_a_smaller_error_with_no_more_parts_and_names_its_source() {
    let bench = Bench::new();
    let tune =
        ["tune", "--garment", "flared-skirt@400", "--hold-out", "pullover-1@400", "--tables", "160", "--out", "t"];
    let found = json(&bench.does(&[&tune[..], &["--format", "json"]].concat()));
    let verdicts = found["verdicts"].as_array().unwrap();
    // Each kind on each garment in two fabrics; and with its extents scaled, where that gives the garment held out more PARTs.
    for (i, v) in verdicts[..8].iter().enumerate() {
        assert!(v["extent_factor"] == 1.0 && v["fabric"] == ["interlock", "cotton"][i % 2], "{v}");
    }
    for fitted in &verdicts[8..] {
        assert!(fitted["held_out"] == true && fitted["kind"] == "levels and extents", "{fitted}");
        assert!(
            fitted["parts"].as_u64() <= fitted["table_3_parts"].as_u64() && fitted["extent_factor"] != 1.0,
            "{fitted}"
        );
    }
    let number = |of: &serde_json::Value, key: &str| of[key].as_f64().unwrap();
    let tuned_on: Vec<_> = verdicts.iter().filter(|v| v["held_out"] == false).collect();
    for pair in tuned_on.chunks(2) {
        assert!(pair[0]["parts"].as_u64() <= pair[0]["table_3_parts"].as_u64(), "{}", pair[0]);
        assert!(number(pair[0], "ratio").powi(2) + number(pair[1], "ratio").powi(2) < 2.0, "{pair:?}");
    }
    let path = bench.path("t/flared-skirt@400-levels.toml");
    let table = RangeTable::parse(&fs::read_to_string(&path).unwrap(), "tuned").unwrap();
    for word in ["partwise tune", "flared-skirt@400", "Table 3"] {
        assert!(table.source.contains(word), "{}", table.source);
    }
    // `compare` counts the PARTs that `tune` reported.
    let path = path.display().to_string();
    let common = ["compare", "table-3", &path, "--garment", "flared-skirt@400", "--accuracy", "none", "--no-save"];
    let compared = json(&bench.does(&[&common[..], &["--format", "json"]].concat()));
    assert_eq!(compared[0]["level_part_count"], tuned_on[0]["table_3_parts"]);
    assert_eq!(compared[1]["level_part_count"], tuned_on[0]["parts"]);
    // `run` without further flags makes the PARTs and the error that `tune` reported.
    let both = bench.path("t/flared-skirt@400-levels-and-extents.toml").display().to_string();
    assert!(RangeTable::parse(&fs::read_to_string(&both).unwrap(), "tuned").unwrap().has_extents());
    for promised in &tuned_on[2..] {
        let fabric = promised["fabric"].as_str().unwrap();
        let run = ["run", "--garment", "flared-skirt@400", "--table", &both, "--refine", "0", "--fabric", fabric];
        let measured = json(&bench.does(&[&run[..], &["--no-save", "--format", "json", "--accuracy"]].concat()));
        assert_eq!(measured["part_count"], promised["parts"]);
        let off = number(&measured, "canonical_rms_mm") - number(promised, "error_mm");
        assert!(off.abs() < 1e-9, "{measured}");
    }
    assert_eq!(fs::read_to_string(bench.path("t/verdicts.csv")).unwrap().lines().count(), 1 + verdicts.len());
    let contents = inspect::read(&bench.path("t/flared-skirt@400.rrd"));
    // Table 3 and at least one better table of each kind: a step each.
    assert!(contents.entities["/drape/garment"].rows >= 3);
    // Together each garment is within what Table 3 makes of it, not only their sum.
    let together = ["tune", "--garment", "flared-skirt@400", "--garment", "pullover-1@400", "--together"];
    let more = ["--tables", "60", "--fabric", "jersey", "--out", "u", "--no-save", "--format", "json"];
    let found = json(&bench.does(&[&together[..], &more].concat()));
    let verdicts = found["verdicts"].as_array().unwrap();
    assert_eq!(verdicts.len(), 4);
    for v in verdicts {
        assert!(v["tuned_on"] == "flared-skirt@400+pullover-1@400" && v["fabric"] == "jersey", "{v}");
        assert!(v["parts"].as_u64() <= v["table_3_parts"].as_u64(), "{v}");
    }
    bench.refuses(&["tune", "--garment", "toga", "--out", "v"], "toga");
    assert!(!Path::new(&bench.path("v")).exists());
    bench.refuses(&[&together[..], &["--max-parts", "1", "--tables", "16", "--out", "v"]].concat(), "--max-parts");
}
