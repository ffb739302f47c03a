//! Foreign input, full disks, silent peers and odd names: the program reports them and exits.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod browser;
mod input;
mod messages;
mod outputs;
mod waiting;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// A tetrahedron half a metre wide, as OBJ text; closed, z up.
const BODY: &str = "v -0.3 -0.3 0.8\nv 0.5 0 0.8\nv -0.3 0.3 0.8\nv 0 0 1.6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
/// A strip of cloth over its tip.
const GARMENT: &str = "v -0.2 -0.2 1.62\nv 0.2 -0.2 1.62\nv 0.2 0.2 1.62\nv -0.2 0.2 1.62\nv 0 0 1.65\n\
    f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
const SCENE: [&str; 8] = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z"];

struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(TempDir::new().unwrap());
        bench.write("body.obj", BODY);
        bench.write("garment.obj", GARMENT);
        bench
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_partwise"));
        command.current_dir(self.0.path()).env("XDG_CACHE_HOME", self.0.path()).stdin(Stdio::null());
        command
    }

    fn run<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Ended {
        ended(self.command().args(arguments))
    }

    fn drape(&self, more: &[&str]) -> Ended {
        self.run(&[&SCENE, more].concat())
    }

    /// Names in the folder, hidden ones too.
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.0.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

struct Ended {
    code: Option<i32>,
    stderr: String,
    took: Duration,
}

impl Ended {
    #[track_caller]
    fn with(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "should say `{word}`: {}", self.stderr);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
    }
}

fn ended(command: &mut Command) -> Ended {
    let started = Instant::now();
    let Output { status, stderr, .. } = command.output().unwrap();
    Ended { code: status.code(), stderr: String::from_utf8_lossy(&stderr).into_owned(), took: started.elapsed() }
}
