//! The cases: command lines, their input files, and the mutations of both.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use super::mutate;

const BODY: &str = "v -0.3 -0.3 0.8\nv 0.5 0 0.8\nv -0.3 0.3 0.8\nv 0 0 1.6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const TABLE: &str = "name = \"mine\"\nunit = \"cm\"\ngap = \"extend-lower\"\nlevels = [[0.0, 0.5], [0.5, 2.0], [2.0, 6.0, 12.0], [6.0, inf, 8.0, 24.0]]\n";
const SWEEP: &str = "name = \"s\"\nrepeats = 1\n[base]\nbody = \"body.obj\"\ngarment = \"garment.obj\"\noptions = { unit = \"m\", up = \"z\" }\n\
    [grid]\ntables = [\"table-3\", { quantile = [2, 3] }, \"table.toml\"]\nextents_cm = [\"none\", 8]\n";

const CUT: &str = "default = \"cotton\"\n[panels]\nskirt_back = \"denim\"\n\"waist*\" = \"rib-knit\"\n";

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
pub(super) struct Kind {
    pub(super) name: &'static str,
    line: &'static str,
    files: &'static [&'static str],
    share: usize,
}

const SCENE: &str = "--body body.obj --garment garment.obj --unit m --up z";

pub(super) const KINDS: [Kind; 13] = [
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
    Kind {
        name: "tune",
        line: "tune --body body.obj --garment garment.obj --levels-only --tables 16 --max-parts 4 --out tuned --format json",
        files: &["body.obj", "garment.obj"],
        share: 5,
    },
    Kind {
        name: "pattern",
        line: "pattern skirt.json --svg flat.svg --edge-length 4 --format json",
        files: &["skirt.json"],
        share: 5,
    },
    Kind {
        name: "sewn",
        line: "--pattern skirt.json --fabrics cut.toml --edge-length 6 --refine 0 --no-save --format json",
        files: &["skirt.json", "cut.toml"],
        share: 3,
    },
];

/// Flags that wait for input, or need a window system.
const NOT_HERE: [&str; 10] = [
    "--serve",
    "--watch",
    "--spawn",
    "--connect",
    "--web-port",
    "--grpc-port",
    "--repeats",
    "--spread",
    "--accuracy",
    "--open",
];

/// Everything that runs begin from.
pub(super) struct Seeds {
    files: BTreeMap<&'static str, Vec<u8>>,
    /// Flags of every command, for command lines that nobody would write.
    flags: Vec<String>,
    pub(super) folder: tempfile::TempDir,
}

/// The program: this build's, or for long runs a faster one.
pub(super) fn program() -> String {
    std::env::var("PARTWISE_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_partwise").to_owned())
}

fn partwise() -> Command {
    let mut command = Command::new(program());
    command.stdin(Stdio::null());
    command
}

impl Seeds {
    pub(super) fn new() -> Self {
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
            ("skirt.json", asset("patterns/skirt.json")),
            ("cut.toml", CUT.into()),
            ("body.toml", toml::to_string(&partwise::body::BodySpec::default()).unwrap().into_bytes()),
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
        let mut flags: Vec<String> = ["run", "check", "compare", "sweep", "merge", "cusick", "tune", "pattern"]
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
pub(super) struct Case {
    pub(super) kind: &'static Kind,
    pub(super) arguments: Vec<String>,
    pub(super) files: BTreeMap<&'static str, Vec<u8>>,
    /// Whether the command line is as it was.
    pub(super) plain: bool,
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
    pub(super) fn draw(seeds: &Seeds, number: u32) -> Self {
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
    pub(super) fn whole(seeds: &Seeds, kind: &'static Kind) -> Self {
        let files = kind.files.iter().map(|&name| (name, seeds.files[name].clone())).collect();
        let arguments = kind.line.replace("SCENE", SCENE).split(' ').map(str::to_owned).collect();
        Self { kind, arguments, files, plain: true }
    }

    fn change_line(arguments: &mut Vec<String>, seeds: &Seeds, random: &mut Random) {
        let odd = |random: &mut Random| {
            let change = (0, 0, random.next() as u32);
            // A word without a flag is replaced by one of the odd values.
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
