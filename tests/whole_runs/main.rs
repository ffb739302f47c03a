//! Whole runs of the program on mutated files and command lines: every run ends in bounded time and memory, with a documented
//! exit code and, if it fails, an error message.
//!
//! `PARTWISE_FUZZ_RUNS` sets how many runs there are; without it a minute's worth. What shows something wrong is kept with its
//! files and command line under `target/whole-runs/`.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking, and tells counts"
)]

mod cases;
#[path = "../fuzz/mutate.rs"]
mod mutate;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use cases::{Case, KINDS, Seeds, program};
use partwise::SceneSpec;
use partwise::mesh::{Axis, Unit};
use partwise::scene::Placement;

/// Processor time that one run may take, s, and how long it may wait: far more than any does. A machine that is busy with other things
/// makes the second long, not the first.
const WORK: u64 = 60;
const LIMIT: Duration = Duration::from_secs(600);
/// Memory that one run may ask for, KiB: the program and its libraries map two gigabytes before anything is read.
const MEMORY: u64 = 6 << 20;
/// Longest message: errors quote, and cut what they quote.
const MAX_STDERR: usize = 20_000;

/// How a run ended, or what is wrong with it.
fn judge(case: &Case, folder: &Path) -> Result<&'static str, String> {
    for (name, bytes) in &case.files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("ulimit -v {MEMORY}; ulimit -t {WORK}; ulimit -c 0; exec \"$0\" \"$@\""), &program()])
        .args(&case.arguments);
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join("cache")).env("RAYON_NUM_THREADS", "2");
    let (out, err) = (folder.join(".stdout"), folder.join(".stderr"));
    command.stdin(Stdio::null()).stdout(fs::File::create(&out).unwrap()).stderr(fs::File::create(&err).unwrap());
    let began = Instant::now();
    let mut child = command.spawn().map_err(|e| format!("it cannot be started: {e}"))?;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        // A page is served until somebody ends it.
        if case.kind.name == "view" && fs::metadata(&out).is_ok_and(|out| out.len() > 0) {
            child.kill().unwrap();
            child.wait().unwrap();
            return Ok("done");
        }
        if began.elapsed() > LIMIT {
            child.kill().unwrap();
            child.wait().unwrap();
            return Err(format!("still at work after {LIMIT:?}"));
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let mut message = Vec::new();
    fs::File::open(&err).unwrap().read_to_end(&mut message).unwrap();
    let message = String::from_utf8(message).map_err(|_| "what it says is no text".to_owned())?;
    if message.contains("panicked") || message.contains("overflowed its stack") {
        return Err(format!("it panicked: {message}"));
    }
    if message.chars().any(|c| c.is_control() && c != '\n' && c != '\t') {
        return Err(format!("control characters in what it says: {message:?}"));
    }
    if message.len() > MAX_STDERR {
        return Err(format!("it says {} bytes", message.len()));
    }
    let outcome = match status.code() {
        Some(0) => "done",
        Some(2) => "refused",
        // A sweep of which points failed, each a row that says why.
        Some(1) if message.contains("points failed: the column `error`") => "failed points",
        // A certificate that is not given, which names what it is that fails.
        Some(1) if message.contains("not certified") => "not certified",
        // A drape that `--strict` does not accept.
        Some(3) if message.contains("--strict: found") => "not at rest",
        other => return Err(format!("it ended with {other:?} ({status}): {message}")),
    };
    if outcome != "done" && !message.contains("error: ") {
        return Err(format!("refused without a word: {message}"));
    }
    let half: Vec<PathBuf> =
        all_files(folder).into_iter().filter(|p| p.extension().is_some_and(|e| e == "part")).collect();
    if !half.is_empty() {
        return Err(format!("half-written files are left: {half:?}"));
    }
    if outcome == "done" && case.plain && case.arguments.contains(&"--export".to_owned()) {
        agrees(folder, &fs::read_to_string(&out).unwrap(), case.kind.name == "converge")?;
    }
    Ok(outcome)
}

fn all_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(all_files(&path)) } else { found.push(path) }
    }
    found
}

/// Whether the exported garment loads and has the reported figures.
fn agrees(folder: &Path, report: &str, converged: bool) -> Result<(), String> {
    let report: serde_json::Value = serde_json::from_str(report).map_err(|e| format!("no JSON: {e}: {report}"))?;
    let exported = fs::read_to_string(folder.join("out.obj")).map_err(|e| format!("no export: {e}"))?;
    let coordinates = exported.lines().filter(|line| line.starts_with('v')).flat_map(str::split_whitespace).skip(1);
    if coordinates.filter_map(|word| word.parse::<f64>().ok()).any(|x| !x.is_finite()) {
        return Err("the export holds what is no number".to_owned());
    }
    if converged && (report["strain_max"].is_null() || report["residual_over_weight"].is_null()) {
        return Err(format!("a figure is no number: {report}"));
    }
    let place = |name: &str| folder.join(name).to_string_lossy().into_owned();
    // A face may have an area by its own edges and none by its texture coordinates, or the reverse.
    let by_texture = report["command_line"].as_str().is_some_and(|line| line.contains("--rest texture"));
    let spec = SceneSpec {
        unit: Some(Unit::M),
        up: Some(Axis::Z),
        rest: if by_texture { "texture" } else { "auto" }.to_owned(),
        push_out: false,
        ..SceneSpec::new(place("body.obj"), place("out.obj"))
    };
    let again = match spec.load() {
        // A garment that has fallen off is no longer near its body.
        Err(_) if report["verdict"].as_str().is_some_and(|verdict| verdict.contains("fallen off the body")) => {
            return Ok(());
        }
        // Cloth that crumples has an area far from that of its pattern.
        Err(refused) if by_texture && refused.to_string().contains("no metric pattern") => return Ok(()),
        loaded => loaded.map_err(|e| format!("the export does not load: {e}"))?,
    };
    let found = Placement::new(&again.scene.garment, &again.scene.body);
    let count = |key: &str| report[key].as_u64().unwrap_or(u64::MAX);
    let vertices = again.scene.garment.vertex_count() as u64;
    // An export has all faces of its file. Vertices of faces without area alone are no part of the garment and stay where they were.
    let repairs = report["repairs"].as_array().into_iter().flatten();
    let without_area = repairs.filter_map(|repair| repair.as_str()).any(|repair| repair.contains("no area"));
    if without_area && count("vertices") <= vertices {
        return Ok(());
    }
    if count("vertices") != vertices {
        return Err(format!("{} vertices were reported, the export has {vertices}", count("vertices")));
    }
    // A vertex closer to the surface than the written digits may count either way.
    let inside = found.penetrating_vertices as u64;
    if count("penetrating_vertices").abs_diff(inside) > 1 {
        return Err(format!(
            "{} vertices inside the body were reported, the export has {inside}",
            count("penetrating_vertices")
        ));
    }
    Ok(())
}

/// Keeps a run's files and command line, and says how it ended.
fn keep(case: &Case, number: u32, reason: &str) {
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("../whole-runs/{number}"));
    fs::create_dir_all(&kept).unwrap();
    for (name, bytes) in &case.files {
        fs::write(kept.join(name.replace('/', "-")), bytes).unwrap();
    }
    let report = format!("run {number}: partwise {}\n{reason}\n", case.arguments.join(" "));
    fs::write(kept.join("report.txt"), &report).unwrap();
    eprintln!("{report}");
}

#[test]
fn every_mutated_run_ends_with_a_known_outcome() {
    let runs = std::env::var("PARTWISE_FUZZ_RUNS").map_or(120, |text| text.parse::<u32>().unwrap());
    let first = std::env::var("PARTWISE_FUZZ_FIRST").map_or(0, |text| text.parse::<u32>().unwrap());
    let seeds = Seeds::new();
    for kind in &KINDS {
        let folder = seeds.folder.path().join(kind.name).join("a/b/c");
        fs::create_dir_all(&folder).unwrap();
        let ended = judge(&Case::whole(&seeds, kind), &folder);
        assert_eq!(ended, Ok("done"), "{}: {}", kind.name, fs::read_to_string(folder.join(".stderr")).unwrap());
    }
    let (next, counts, wrong) = (AtomicU32::new(first), Mutex::new(BTreeMap::new()), Mutex::new(Vec::new()));
    let work = |worker: usize| {
        loop {
            let number = next.fetch_add(1, Ordering::SeqCst);
            if number >= first + runs {
                break;
            }
            let case = Case::draw(&seeds, number);
            // Deep enough that `../../x` stays in here.
            let folder = seeds.folder.path().join(format!("{worker}/a/b/c"));
            let _ = fs::remove_dir_all(seeds.folder.path().join(worker.to_string()));
            fs::create_dir_all(&folder).unwrap();
            let ended = judge(&case, &folder);
            // A single run is always kept, for inspection.
            if let (Err(reason), _) | (Ok(reason), 1) = (ended.as_deref().map_err(String::as_str), runs) {
                keep(&case, number, reason);
            }
            match ended {
                Ok(outcome) => *counts.lock().unwrap().entry((case.kind.name, outcome)).or_insert(0_u32) += 1,
                Err(reason) => wrong.lock().unwrap().push(format!("run {number}: {reason}")),
            }
        }
    };
    std::thread::scope(|scope| {
        for worker in 0..std::thread::available_parallelism().map_or(2, usize::from) {
            let work = &work;
            scope.spawn(move || work(worker));
        }
    });
    eprintln!("{:?}", counts.lock().unwrap());
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{} of {runs} runs; the first:\n{}", wrong.len(), wrong[0]);
}
