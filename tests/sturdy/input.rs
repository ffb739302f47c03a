//! Inputs: numbers out of range, mistakes, escape codes, odd names, damaged recordings.

use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::ffi::OsStrExt as _;
use std::process::{Command, Stdio};

use super::{Bench, GARMENT, SCENE, ended};

#[test]
fn numbers_beyond_all_measure_are_refused_with_their_limit() {
    let bench = Bench::new();
    bench.drape(&["--no-save", "--threads", "100000"]).with(2, &["--threads", "1024"]);
    bench.run(&["sweep", "none.toml", "--jobs", "100000"]).with(2, &["--jobs", "1024"]);
    for rows in ["3", "100000", "18446744073709551615"] {
        bench.run(&["cusick", "silk", "--rows", rows]).with(2, &["--rows", "4..=100"]);
    }
    bench.write("huge.obj", &GARMENT.replace("1.65", "1e200"));
    let huge = ["--body", "body.obj", "--garment", "huge.obj", "--no-save"];
    bench.run(&huge).with(2, &["huge.obj, line 5", "1e200", "1e7"]);
}

#[test]
fn errors_of_the_user_exit_with_code_2() {
    let bench = Bench::new();
    bench.run(&["merge", "nope", "--out", "x"]).with(2, &["nope", "partwise sweep"]);
    bench.run(&["merge", "body.obj", "--out", "x"]).with(2, &["body.obj", "partwise sweep"]);
    bench.run(&["cusick", "nope"]).with(2, &["nope", "silk"]);
    bench.drape(&["--no-save", "--hold", "cuff"]).with(2, &["garment.obj", "cuff", "no groups"]);
    bench.write("square.obj", "g all\nv -0.2 -0.2 1.62\nv 0.2 -0.2 1.62\nv 0.2 0.2 1.62\nv -0.2 0.2 1.62\nf 1 2 3 4\n");
    let held =
        ["--body", "body.obj", "--garment", "square.obj", "--unit", "m", "--up", "z", "--no-save", "--hold", "all"];
    bench.run(&held).with(2, &["no vertex is free"]);
    let tables = ["compare", "table-3", "table-3", "--body", "body.obj", "--garment", "nowhere.obj", "--no-save"];
    bench.run(&tables).with(2, &["nowhere.obj"]);
    // A garment file of another program is named as such, for every body.
    bench.write("shirt.off", "OFF\n3 1 0\n");
    bench
        .run(&["--body", "body.obj", "--garment", "shirt.off", "--no-save"])
        .with(2, &["shirt.off", "an OFF mesh", "OBJ, PLY"]);
    bench.drape(&["--no-save", "--rest", "texture"]).with(2, &["garment.obj", "texture coordinates"]);
    bench.write("large.toml", "bust_cm = 900\n");
    bench.run(&["--no-save", "--measurements", "large.toml"]).with(2, &["large.toml", "900"]);
    bench.write("far.obj", &GARMENT.replace(" 1.6", " 41.6"));
    let far = ["--body", "body.obj", "--garment", "far.obj", "--unit", "m", "--up", "z", "--no-save"];
    bench.run(&far).with(2, &["far.obj", "no body near"]);
    bench.write("flat.obj", &GARMENT.replace("v 0 0 1.65", "v 0 -0.2 1.62"));
    // A sheet beside the body, that nothing holds.
    let beside: String = (0..21)
        .flat_map(|j| (0..21).map(move |i| (i, j)))
        .map(|(i, j)| format!("v {} {} 1.5\n", 0.5 + 0.02 * f64::from(i), 0.02 * f64::from(j)))
        .chain(
            (0..20)
                .flat_map(|j| (0..20).map(move |i| 21 * j + i + 1))
                .map(|a| format!("f {} {} {} {}\n", a, a + 1, a + 22, a + 21)),
        )
        .collect();
    bench.write("beside.obj", &beside);
    let tune =
        ["tune", "--body", "body.obj", "--garment", "beside.obj", "--levels-only", "--max-parts", "3", "--out", "t"];
    bench.run(&tune).with(2, &["beside.obj", "falls off the body"]);
    let flat = ["--body", "body.obj", "--garment", "flat.obj", "--unit", "m", "--up", "z", "--no-save"];
    bench.run(&flat).with(0, &["1 triangles that have no area at rest, the first of face 1"]);
}

#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let bench = Bench::new();
    let pipe = |path: &str| assert!(Command::new("mkfifo").arg(bench.path(path)).status().unwrap().success());
    for name in ["pipe.obj", "pipe.toml", "pipe.json", "pipe.rrd"] {
        pipe(name);
    }
    std::os::unix::fs::symlink("/dev/zero", bench.path("endless.json")).unwrap();
    let sweep = |name: &str, base: &str, tables: &str| {
        bench.write(name, &format!("name = \"s\"\nrepeats = 1\n[base]\n{base}\n[grid]\ntables = [{tables}]\n"));
    };
    sweep("whole.toml", "garment = \"flared-skirt@400\"", "\"table-3\"");
    sweep("garment.toml", "garment = \"pipe.obj\"", "\"table-3\"");
    sweep("body.toml", "body = \"pipe.obj\"\ngarment = \"garment.obj\"", "\"table-3\"");
    sweep("fabric.toml", "garment = \"flared-skirt@400\"\nfabric = \"pipe.toml\"", "\"table-3\"");
    sweep("table.toml", "garment = \"flared-skirt@400\"", "\"pipe.toml\"");
    bench.run(&["sweep", "whole.toml", "--out", "whole", "--no-save", "--accuracy", "none"]).with(0, &[]);
    for (folder, file) in [("rows", "rows.jsonl"), ("plan", "plan.json")] {
        fs::create_dir(bench.path(folder)).unwrap();
        for name in ["rows.jsonl", "plan.json"] {
            if name == file {
                pipe(&format!("{folder}/{name}"));
            } else {
                fs::copy(bench.path(format!("whole/{name}")), bench.path(format!("{folder}/{name}"))).unwrap();
            }
        }
    }
    // A test that hangs says less than one that fails.
    let run = |line: &str| {
        ended(
            Command::new("timeout")
                .arg("60")
                .arg(env!("CARGO_BIN_EXE_partwise"))
                .args(line.split(' '))
                .current_dir(bench.0.path())
                .env("XDG_CACHE_HOME", bench.0.path()),
        )
    };
    for line in [
        "--no-save --body pipe.obj --garment garment.obj",
        "--no-save --body body.obj --garment pipe.obj",
        "--no-save --body body.obj --garment garment.obj --rest pipe.obj",
        "--no-save --body body.obj --garment garment.obj --fabrics pipe.toml",
        "--no-save --body pipe.toml",
        "--no-save --garment pipe.toml",
        "--no-save --pattern pipe.json",
        "--no-save --pattern endless.json",
        "--no-save --table pipe.toml",
        "--no-save --table /dev/zero",
        "--no-save --table pipe.toml --watch",
        "--no-save --fabric pipe.toml",
        "--no-save --measurements pipe.toml",
        "check body.obj pipe.obj",
        "check body.obj garment.obj --unit m --up z --certificate pipe.obj",
        "pattern pipe.json",
        "compare table-3 pipe.toml --no-save",
        "tune --fabric pipe.toml --garment flared-skirt@400 --no-save",
        "cusick pipe.toml",
        "bench table-4 --rows-file pipe.json",
        "live --table pipe.toml",
        "sweep pipe.toml",
        "sweep garment.toml --out none",
        "sweep body.toml --out none",
        "sweep fabric.toml --out none",
        "sweep table.toml --out none",
        "sweep whole.toml --out rows --resume",
        "sweep whole.toml --out plan --resume",
        "merge rows --out none",
        "merge plan --out none",
        "view pipe.rrd",
        "view --check /dev/zero",
    ] {
        run(line).with(2, &["it is a pipe or a device, expected a regular file"]);
    }
    // Invalid cache entries are written again.
    let cached =
        |folder: &str| fs::read_dir(bench.path(folder)).unwrap().map(|entry| entry.unwrap().path()).collect::<Vec<_>>();
    run("--no-save --garment flared-skirt@400 --accuracy --cache kept").with(0, &[]);
    for entry in cached("partwise/meshes").into_iter().chain(cached("kept")) {
        fs::remove_file(&entry).unwrap();
        pipe(entry.to_str().unwrap());
    }
    run("--no-save --garment flared-skirt@400 --accuracy --cache kept").with(0, &["kept", "pipe"]);
    for entry in cached("whole/points") {
        fs::remove_file(&entry).unwrap();
        pipe(entry.to_str().unwrap());
    }
    run("sweep whole.toml --out whole --resume --accuracy none").with(0, &["missing from the recording"]);
}

#[test]
fn an_input_beyond_its_bound_is_refused_before_it_fills_the_memory() {
    let bench = Bench::new();
    for (name, mb) in [("large.toml", 65), ("large.json", 65), ("large.obj", 2049)] {
        fs::File::create(bench.path(name)).unwrap().set_len(mb << 20).unwrap();
    }
    bench.run(&["--pattern", "large.json", "--no-save"]).with(2, &["large.json", "more than 64 MB"]);
    bench.run(&["--pattern", "large.obj", "--no-save"]).with(2, &["large.obj", "ends in `.json` or `.dxf`"]);
    bench.run(&["--garment", "large.obj", "--no-save"]).with(2, &["large.obj", "more than 2048 MB"]);
    for flag in ["--table", "--fabric", "--measurements"] {
        bench.run(&[flag, "large.toml", "--no-save"]).with(2, &["large.toml", "more than 64 MB"]);
    }
    bench.run(&["sweep", "large.toml"]).with(2, &["large.toml: cannot be read", "more than 64 MB"]);
    // A terabyte of rows: more than any memory.
    fs::create_dir(bench.path("rows")).unwrap();
    fs::File::create(bench.path("rows/plan.json")).unwrap().set_len(1 << 40).unwrap();
    bench.run(&["merge", "rows", "--out", "none"]).with(2, &["rows/plan.json", "more than 2048 MB"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_memory_that_is_too_low_is_refused_with_the_memory_needed() {
    let bench = Bench::new();
    for (kb, vertices, needed) in [(300_000, 400, "448 MB"), (500_000, 20_000, "760 MB")] {
        let program = env!("CARGO_BIN_EXE_partwise");
        let script = format!("ulimit -v {kb}; exec {program} --garment flared-skirt@{vertices} --refine 0 --no-save");
        let mut command = Command::new("sh");
        ended(command.arg("-c").arg(script).env("XDG_CACHE_HOME", bench.0.path())).with(2, &["ulimit -v", needed]);
    }
}

/// Puts `number` in the place of every number of a row but its index.
fn all_numbers(row: &mut serde_json::Value, number: f64) {
    match row {
        serde_json::Value::Object(object) => {
            object.iter_mut().filter(|(key, _)| *key != "index").for_each(|(_, value)| all_numbers(value, number));
        }
        serde_json::Value::Array(list) => list.iter_mut().for_each(|value| all_numbers(value, number)),
        serde_json::Value::Number(found) if found.is_f64() => *row = number.into(),
        _ => {}
    }
}

#[test]
fn figures_beyond_all_measure_in_a_row_are_merged_in_little_memory() {
    let bench = Bench::new();
    bench.write(
        "s.toml",
        "name = \"s\"\nrepeats = 1\n[base]\ngarment = \"flared-skirt@400\"\n[grid]\ntables = [\"table-3\", { quantile = 4 }]\n",
    );
    bench.run(&["sweep", "s.toml", "--out", "s", "--no-save"]).with(0, &[]);
    let rows = fs::read_to_string(bench.path("s/rows.jsonl")).unwrap();
    for (i, number) in [1e308, 5e-324, 1e300, 1e-300].into_iter().enumerate() {
        let (first, rest) = rows.split_once('\n').unwrap();
        let mut row: serde_json::Value = serde_json::from_str(first).unwrap();
        all_numbers(&mut row, number);
        bench.write("s/rows.jsonl", &format!("{row}\n{rest}"));
        let script = format!("ulimit -v 16000000; exec {} merge s --out m{i}", env!("CARGO_BIN_EXE_partwise"));
        let mut command = Command::new("sh");
        ended(command.current_dir(bench.0.path()).arg("-c").arg(script)).with(0, &[]);
        let left = bench.names();
        assert!(!left.iter().any(|name| name.ends_with(".part")), "{number}: {left:?}");
    }
}

#[test]
fn a_group_named_like_an_edge_is_held_with_a_note_and_a_long_name_is_shortened() {
    let bench = Bench::new();
    bench.write("named.obj", &GARMENT.replacen("f 1 2 5", "g top\nf 1 2 5\ng rest", 1));
    let named =
        ["--body", "body.obj", "--garment", "named.obj", "--unit", "m", "--up", "z", "--no-save", "--refine", "0"];
    bench.run(&[&named[..], &["--hold", "top"]].concat()).with(0, &["--hold top: the group `top`", "rename the group"]);
    bench.write("long.obj", &GARMENT.replacen("f 1 2 5", &format!("g {}\nf 1 2 5\ng rest", "x".repeat(2_000_000)), 1));
    let long = ["--body", "body.obj", "--garment", "long.obj", "--unit", "m", "--up", "z", "--no-save"];
    let refused = bench.run(&[&long[..], &["--hold", "cuff"]].concat());
    refused.with(2, &["cuff", "bytes in all", "rest"]);
    assert!(refused.stderr.len() < 1000, "{} bytes", refused.stderr.len());
}

#[test]
fn constants_of_no_cloth_are_warned_of() {
    let bench = Bench::new();
    let denim = include_str!("../../assets/fabrics/denim.toml");
    let line = denim.lines().find(|line| line.starts_with("bending_nm")).unwrap();
    bench.write("stiff.toml", &denim.replace(line, "bending_nm = [100, 100, 100]"));
    bench
        .drape(&["--no-save", "--fabric", "stiff.toml", "--refine", "0"])
        .with(0, &["bending_nm, warp is 100, which no cloth has"]);
}

#[test]
fn a_negative_number_is_refused_with_the_allowed_range() {
    let bench = Bench::new();
    let pattern = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/patterns/skirt.json");
    for (line, expected) in [
        (vec!["--pattern", pattern, "--edge-length", "-1"], "an edge length of -1 cm, expected 0.2 to 20 cm"),
        (vec!["--max-extent", "-3"], "expected centimetres"),
        (vec!["--bust", "-88"], "60 to 150 cm"),
        (vec!["--threads", "-1"], "--threads"),
        (vec!["tune", "--max-parts", "0"], "a whole number, 1 or more"),
        (vec!["tune", "--max-parts", "-5"], "found `-5`"),
    ] {
        let refused = bench.run(&line);
        refused.with(2, &[expected]);
        assert!(!refused.stderr.contains("unexpected argument"), "{}", refused.stderr);
    }
}

#[test]
fn messages_neither_move_the_cursor_nor_fill_the_screen() {
    let bench = Bench::new();
    bench.write("escape.obj", "v 0 0 0\nv \u{1b}]0;title\u{7} 0 0\n");
    let escape = bench.run(&["--body", "body.obj", "--garment", "escape.obj", "--no-save"]);
    escape.with(2, &["escape.obj, line 2", "\\u{1b}]0;title"]);
    assert!(!escape.stderr.contains(|c: char| c.is_control() && c != '\n'), "{:?}", escape.stderr);
    bench.write("long.obj", &format!("v 0 0 0\nv {} 0 0\n", "x".repeat(3_000_000)));
    let long = bench.run(&["--body", "body.obj", "--garment", "long.obj", "--no-save"]);
    long.with(2, &["long.obj, line 2", "3000000 bytes"]);
    assert!(long.stderr.len() < 1000, "{} bytes", long.stderr.len());
    bench.write("table.toml", &format!("levels = \"{}\"\n", "y".repeat(3_000_000)));
    let table = bench.drape(&["--no-save", "--table", "table.toml"]);
    table.with(2, &["table.toml"]);
    assert!(table.stderr.len() < 5000, "{} bytes", table.stderr.len());
}

#[test]
fn names_of_files_need_not_be_unicode() {
    let bench = Bench::new();
    let name = |text: &[u8]| OsStr::from_bytes(text).to_owned();
    let mut arguments: Vec<_> = SCENE.iter().map(|a| OsStr::new(a).to_owned()).collect();
    arguments.extend([name(b"--save"), name(b"a\xff.rrd"), name(b"--export"), name(b"a\xff.obj")]);
    arguments.extend([name(b"--format"), name(b"json")]);
    bench.run(&arguments).with(0, &[]);
    assert!(bench.path(name(b"a\xff.rrd")).is_file() && bench.path(name(b"a\xff.obj")).is_file());
    bench.run(&[name(b"view"), name(b"b\xff.rrd")]).with(2, &["No such file"]);
    bench.run(&[name(b"--garment"), name(b"c\xff.obj")]).with(2, &["UTF-8"]);
    let tune = ["tune", "--body", "body.obj", "--garment", "garment.obj", "--levels-only", "--tables", "16"];
    let mut arguments: Vec<_> = tune.iter().map(|a| OsStr::new(a).to_owned()).collect();
    arguments.extend([name(b"--format"), name(b"json"), name(b"--out"), name(b"d\xff")]);
    let tuned = bench.run(&arguments);
    assert!(!tuned.stderr.contains("panicked"), "{}", tuned.stderr);
}

/// SplitMix64, for mutations that are the same everywhere.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

#[test]
fn mutated_recordings_are_viewed_or_refused() {
    let bench = Bench::new();
    bench.drape(&["--save", "whole.rrd"]).with(0, &[]);
    let whole = fs::read(bench.path("whole.rrd")).unwrap();
    let mut random = Random(13);
    let mut refused = 0;
    for i in 0..60 {
        let mut bytes = whole.clone();
        for _ in 0..=random.below(8) {
            let at = random.below(bytes.len());
            match random.below(4) {
                0 => bytes[at] ^= 1 << random.below(8),
                1 => bytes.truncate(at.max(1)),
                2 => bytes.splice(at..at, [0xff; 8]).for_each(drop),
                // Sizes stand in the first bytes of each message.
                _ => bytes[12 + random.below(16)] = 0x7f,
            }
        }
        fs::write(bench.path("mutated.rrd"), &bytes).unwrap();
        let mut child = bench.command();
        child.args(["view", "mutated.rrd"]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = child.spawn().unwrap();
        let mut address = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut address).unwrap();
        if address.is_empty() {
            let mut message = String::new();
            child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
            assert_eq!(child.wait().unwrap().code(), Some(2), "mutation {i}: {message}");
            assert!(message.contains("mutated.rrd") && !message.contains("panicked"), "mutation {i}: {message}");
            refused += 1;
        } else {
            assert!(address.starts_with("http://127.0.0.1:"), "{address}");
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }
    assert!((10..60).contains(&refused), "{refused} of 60 were refused");
}
