//! Whole runs of the program on mutated files and command lines: whatever it is given, it ends, in bounded time and memory, with an
//! exit code that says whose fault it is and words that say what to do.
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

#[path = "fuzz/mutate.rs"]
mod mutate;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

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
const LONGEST_SAID: usize = 20_000;

const BODY: &str = "v -0.3 -0.3 0.8\nv 0.5 0 0.8\nv -0.3 0.3 0.8\nv 0 0 1.6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const TABLE: &str = "name = \"mine\"\nunit = \"cm\"\ngap = \"extend-lower\"\nlevels = [[0.0, 0.5], [0.5, 2.0], [2.0, 6.0, 12.0], [6.0, inf, 8.0, 24.0]]\n";
const SWEEP: &str = "name = \"s\"\nrepeats = 1\n[base]\nbody = \"body.obj\"\ngarment = \"garment.obj\"\noptions = { unit = \"m\", up = \"z\" }\n\
    [grid]\ntables = [\"table-3\", { quantile = [2, 3] }, \"table.toml\"]\nextents_cm = [\"none\", 8]\n";

/// SplitMix64, for runs that are the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// A cape of rings over the body's tip, with a group and texture coordinates.
fn cape() -> String {
    let (rings, around) = (4, 8);
    let mut text = "mtllib none.mtl\no cape\ng collar\n".to_owned();
    for ring in 0..rings {
        for i in 0..around {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(around)).sin_cos();
            let (r, z) = (0.03 + 0.09 * f64::from(ring), 1.63 - 0.05 * f64::from(ring));
            text += &format!("v {:.4} {:.4} {z:.4}\nvt {:.4} {:.4}\n", r * c, r * s, r * c, r * s);
        }
    }
    for ring in 0..rings - 1 {
        if ring == 1 {
            text += "g skirt\n";
        }
        for i in 0..around {
            let corners = [ring * around + i, ring * around + (i + 1) % around].map(|v| v + 1);
            let [a, b] = corners;
            text += &format!("f {a}/{a} {0}/{0} {1}/{1} {b}/{b}\n", a + around, b + around);
        }
    }
    text
}

/// One kind of run: its command line, the files it needs, and how often it is drawn.
struct Kind {
    name: &'static str,
    line: &'static str,
    files: &'static [&'static str],
    share: usize,
}

const SCENE: &str = "--body body.obj --garment garment.obj --unit m --up z";

const KINDS: [Kind; 10] = [
    Kind {
        name: "run",
        line: "SCENE --table table.toml --fabric fabric.toml --refine 0 --format json --no-save --export out.obj",
        files: &["body.obj", "garment.obj", "table.toml", "fabric.toml"],
        share: 30,
    },
    Kind {
        name: "converge",
        line: "SCENE --hold collar --rest texture --format json --save out.rrd --export out.obj",
        files: &["body.obj", "garment.obj"],
        share: 14,
    },
    Kind {
        name: "paper",
        line: "run SCENE --model paper --min-part 2 --gap own-level --table table.toml --no-save",
        files: &["body.obj", "garment.obj", "table.toml"],
        share: 8,
    },
    Kind {
        name: "check",
        line: "check body.obj garment.obj --format json",
        files: &["body.obj", "garment.obj"],
        share: 16,
    },
    Kind {
        name: "compare",
        line: "compare table-3 table.toml --body body.obj --garment garment.obj --repeats 1 --accuracy none --no-save --csv out.csv",
        files: &["body.obj", "garment.obj", "table.toml"],
        share: 6,
    },
    Kind {
        name: "sweep",
        line: "sweep sweep.toml --out swept --no-save",
        files: &["sweep.toml", "body.obj", "garment.obj", "table.toml"],
        share: 6,
    },
    Kind { name: "merge", line: "merge done --out merged", files: &["done/rows.jsonl", "done/plan.json"], share: 6 },
    Kind { name: "cusick", line: "cusick fabric.toml --rows 4 --csv out.csv", files: &["fabric.toml"], share: 4 },
    Kind { name: "view", line: "view seen.rrd", files: &["seen.rrd"], share: 8 },
    Kind {
        name: "made",
        line: "check form spec.toml --measurements body.toml --no-cache",
        files: &["spec.toml", "body.toml"],
        share: 2,
    },
];

/// Flags that wait for somebody, or are asked of the window system.
const NOT_HERE: [&str; 9] =
    ["--serve", "--watch", "--spawn", "--connect", "--web-port", "--grpc-port", "--repeats", "--spread", "--accuracy"];

/// Everything that runs begin from.
struct Seeds {
    files: BTreeMap<&'static str, Vec<u8>>,
    /// Flags of every command, for command lines that nobody would write.
    flags: Vec<String>,
    folder: tempfile::TempDir,
}

/// The program: this build's, or for long runs a faster one.
fn program() -> String {
    std::env::var("PARTWISE_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_partwise").to_owned())
}

fn partwise() -> Command {
    let mut command = Command::new(program());
    command.stdin(Stdio::null());
    command
}

impl Seeds {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
        let asset = |path: &str| fs::read(assets.join(path)).unwrap();
        let mut files: BTreeMap<&'static str, Vec<u8>> = BTreeMap::from([
            ("body.obj", BODY.into()),
            ("garment.obj", cape().into_bytes()),
            ("table.toml", TABLE.into()),
            ("sweep.toml", SWEEP.into()),
            ("fabric.toml", asset("fabrics/denim.toml")),
            ("spec.toml", asset("garments/flared-skirt.toml")),
            ("body.toml", toml::to_string(&partwise::shapes::BodySpec::default()).unwrap().into_bytes()),
        ]);
        for (name, bytes) in &files {
            fs::write(folder.path().join(name), bytes).unwrap();
        }
        // A sweep that is done and a recording, to be damaged.
        for line in ["sweep sweep.toml --out done --no-save", &format!("{SCENE} --refine 0 --save seen.rrd")] {
            let done = partwise().current_dir(folder.path()).args(line.split(' ')).output().unwrap();
            assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
        }
        for name in ["done/rows.jsonl", "done/plan.json", "seen.rrd"] {
            let path = folder.path().join(name);
            files.insert(name, fs::read(&path).unwrap_or_else(|e| panic!("{name}: {e}")));
        }
        let help = |command: &str| partwise().args([command, "--help"]).output().unwrap().stdout;
        let mut flags: Vec<String> = ["run", "check", "compare", "sweep", "merge", "cusick"]
            .iter()
            .flat_map(|command| {
                let text = String::from_utf8(help(command)).unwrap();
                let words = text.split(|c: char| c.is_whitespace() || c == ',').map(str::to_owned);
                words.filter(|word| word.starts_with("--") && word.len() > 3).collect::<Vec<_>>()
            })
            .collect();
        flags.sort();
        flags.dedup();
        flags.retain(|flag| !NOT_HERE.contains(&flag.as_str()));
        assert!(flags.len() > 30, "{flags:?}");
        Self { files, flags, folder }
    }
}

/// A run that is about to be.
struct Case {
    kind: &'static Kind,
    arguments: Vec<String>,
    files: BTreeMap<&'static str, Vec<u8>>,
    /// Whether the command line is as it was.
    plain: bool,
}

fn mutate_bytes(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len());
        match random.below(5) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes.truncate(at.max(1)),
            2 => bytes.splice(at..at, [0xff; 8]).for_each(drop),
            3 => bytes[at] = random.next() as u8,
            // Sizes stand in the first bytes of each message.
            _ => {
                let at = (12 + random.below(16)).min(bytes.len() - 1);
                bytes[at] = 0x7f;
            }
        }
    }
    bytes
}

impl Case {
    fn draw(seeds: &Seeds, number: u32) -> Self {
        let mut random = Random(u64::from(number));
        let mut place = random.below(KINDS.iter().map(|kind| kind.share).sum());
        let kind = KINDS
            .iter()
            .find(|kind| {
                let here = place < kind.share;
                place = place.saturating_sub(kind.share);
                here
            })
            .unwrap();
        let mut files: BTreeMap<&'static str, Vec<u8>> =
            kind.files.iter().map(|&name| (name, seeds.files[name].clone())).collect();
        let texts: Vec<String> =
            kind.files.iter().filter_map(|name| String::from_utf8(seeds.files[name].clone()).ok()).collect();
        // Mostly one change: of several one is the first to be refused, and the others are never met.
        let changes = [0, 1, 1, 1, 1, 2, 3][random.below(7)];
        for _ in 0..changes {
            let name = kind.files[random.below(kind.files.len())];
            let bytes = files.get_mut(name).unwrap();
            *bytes = match std::str::from_utf8(bytes) {
                Ok(text) if !name.ends_with(".rrd") => {
                    let change = ((random.next() % 16) as u8, random.next() as u32, random.next() as u32);
                    mutate::mutate(text, &texts, change).into_bytes()
                }
                _ => mutate_bytes(bytes, &mut random),
            };
        }
        let line = kind.line.replace("SCENE", SCENE);
        let mut arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let plain = changes > 0 && random.below(4) > 0;
        if !plain {
            for _ in 0..=random.below(2) {
                Self::change_line(&mut arguments, seeds, &mut random);
            }
        }
        Self { kind, arguments, files, plain }
    }

    /// The run as it should be.
    fn whole(seeds: &Seeds, kind: &'static Kind) -> Self {
        let files = kind.files.iter().map(|&name| (name, seeds.files[name].clone())).collect();
        let arguments = kind.line.replace("SCENE", SCENE).split(' ').map(str::to_owned).collect();
        Self { kind, arguments, files, plain: true }
    }

    fn change_line(arguments: &mut Vec<String>, seeds: &Seeds, random: &mut Random) {
        let odd = |random: &mut Random| {
            let change = (0, 0, random.next() as u32);
            // What replaces a lone word is one of the odd values.
            mutate::mutate("word", &["word".to_owned()], change)
        };
        let at = random.below(arguments.len());
        match random.below(6) {
            // `--repeats 4000000000` asks for years of work, and gets them.
            0 | 1 if at > 0 && !["--repeats", "--rows"].contains(&arguments[at - 1].as_str()) => {
                arguments[at] = odd(random);
            }
            2 => drop(arguments.remove(at)),
            3 => {
                let flag = seeds.flags[random.below(seeds.flags.len())].clone();
                arguments.push(flag);
                if random.below(2) == 0 {
                    arguments.push(odd(random));
                }
            }
            4 => {
                let again = arguments[at].clone();
                arguments.push(again);
            }
            _ => {
                let other = random.below(arguments.len());
                arguments.swap(at, other);
            }
        }
        arguments.retain(|argument| !NOT_HERE.contains(&argument.as_str()) || argument == "--repeats");
        // No argument can hold a zero byte: the system would not start the program.
        arguments.iter_mut().for_each(|argument| *argument = argument.replace('\0', "0"));
    }
}

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
    let mut said = Vec::new();
    fs::File::open(&err).unwrap().read_to_end(&mut said).unwrap();
    let said = String::from_utf8(said).map_err(|_| "what it says is no text".to_owned())?;
    if said.contains("panicked") || said.contains("overflowed its stack") {
        return Err(format!("it panicked: {said}"));
    }
    if said.chars().any(|c| c.is_control() && c != '\n' && c != '\t') {
        return Err(format!("control characters in what it says: {said:?}"));
    }
    if said.len() > LONGEST_SAID {
        return Err(format!("it says {} bytes", said.len()));
    }
    let outcome = match status.code() {
        Some(0) => "done",
        Some(2) => "refused",
        // A sweep of which points failed, each a row that says why.
        Some(1) if said.contains("points failed: the column `error`") => "failed points",
        other => return Err(format!("it ended with {other:?} ({status}): {said}")),
    };
    if outcome != "done" && !said.contains("error: ") {
        return Err(format!("refused without a word: {said}"));
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

/// Whether the exported garment has the figures that were told of it.
fn agrees(folder: &Path, told: &str, converged: bool) -> Result<(), String> {
    let report: serde_json::Value = serde_json::from_str(told).map_err(|e| format!("no JSON: {e}: {told}"))?;
    let exported = fs::read_to_string(folder.join("out.obj")).map_err(|e| format!("no export: {e}"))?;
    let coordinates = exported.lines().filter(|line| line.starts_with('v')).flat_map(str::split_whitespace).skip(1);
    if coordinates.filter_map(|word| word.parse::<f64>().ok()).any(|x| !x.is_finite()) {
        return Err("the export holds what is no number".to_owned());
    }
    if converged && (report["strain_max"].is_null() || report["residual_over_weight"].is_null()) {
        return Err(format!("a figure is no number: {told}"));
    }
    let place = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let spec = SceneSpec {
        unit: Some(Unit::M),
        up: Some(Axis::Z),
        push_out: false,
        ..SceneSpec::new(place("body.obj"), place("out.obj"))
    };
    let again = match spec.load() {
        Ok(loaded) => loaded,
        // Draped, it may have lost the area of a triangle, or have gone far off.
        Err(_) => return Ok(()),
    };
    let found = Placement::new(&again.scene.garment, &again.scene.body);
    let count = |key: &str| report[key].as_u64().unwrap_or(u64::MAX);
    if count("vertices") != again.scene.garment.vertex_count() as u64 {
        return Ok(());
    }
    // A vertex nearer the surface than the digits written may count either way.
    let inside = found.penetrating_vertices as u64;
    if count("penetrating_vertices").abs_diff(inside) > 1 {
        return Err(format!("{} vertices inside were told, the export has {inside}", count("penetrating_vertices")));
    }
    Ok(())
}

#[test]
fn whatever_it_is_given_it_ends_well() {
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
            match judge(&case, &folder) {
                Ok(outcome) => *counts.lock().unwrap().entry((case.kind.name, outcome)).or_insert(0_u32) += 1,
                Err(reason) => {
                    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("../whole-runs/{number}"));
                    fs::create_dir_all(&kept).unwrap();
                    for (name, bytes) in &case.files {
                        fs::write(kept.join(name.replace('/', "-")), bytes).unwrap();
                    }
                    let told = format!("run {number}: partwise {}\n{reason}\n", case.arguments.join(" "));
                    fs::write(kept.join("told.txt"), &told).unwrap();
                    eprintln!("{told}");
                    wrong.lock().unwrap().push(told);
                }
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
