//! Sweeps: plans, rows that survive interruption, shards, jobs.

mod interruption;
mod killed;
mod metrics;
mod plan;
mod shards;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use crate::Job;
use crate::drape::StageTimes;
use crate::study::metrics::Metrics;
use crate::study::sweep::bench::{Pass, row_of};
use crate::study::sweep::disk::Append;
use crate::study::sweep::run::run_missing;
use crate::study::sweep::{
    Existing, Manifest, Medium, Outcome, Plan, Point, PointError, Row, Run, Store, StoreError, SweepProgress,
    result_hash, sweep,
};
use glam::DVec3;

/// Resumes a sweep as `--resume` does.
const RESUME: Existing = Existing::Resume { retry_failed: true, adopt: false };

/// 200 points.
const PLAN: &str = r#"
name = "synthetic"
repeats = 2
[grid]
tables = ["table-3", { scale = [0.5, 2] }, { levels = [4, 40] }, { quantile = [5, 10] }, { geometric = [6, 12, 24] }]
extents_cm = ["none", 8, 5, 3, [12, 6, 3]]
refine = [0, 5, 20, "converged"]
"#;

fn plan() -> Plan {
    let plan = Plan::parse(PLAN, "synthetic.toml", Path::new(""), &Job::preview()).unwrap();
    assert_eq!(plan.points.len(), 200);
    plan
}

/// A synthetic drape computed from the id of the point alone, the same on every machine.
fn solve(point: &Point) -> Result<Pass<Metrics>, PointError> {
    let byte = |i: usize| u8::from_str_radix(&point.id[2 * i..2 * i + 2], 16).unwrap();
    let x = |i: usize| (f64::from(byte(i)) + 0.1) / f64::from(byte(i + 1)).mul_add(3.0, 7.0);
    if point.index % 41 == 7 {
        return Err(PointError::Failed(format!("synthetic failure, \"quoted\",\nover two lines: ü {}", byte(0))));
    }
    let positions: Vec<DVec3> = (0..4).map(|i| DVec3::new(x(i), x(i + 4), x(i + 8))).collect();
    let value = Metrics {
        vertices: 4,
        part_count: usize::from(byte(3)),
        displacement_rms_mm: x(0),
        residual_over_weight: Some(x(1) * 1e-9),
        rms_mm: (byte(2) > 100).then(|| x(2) * 1e5),
        ..Metrics::default()
    };
    let times = StageTimes { total: Duration::from_micros(u64::from(byte(5))), ..StageTimes::default() };
    Ok(Pass { value, times, result_hash: result_hash(&positions) })
}

/// Rows from a function instead of a drape, with the two passes of the plan.
fn rows_by(
    solve: impl Fn(&Point) -> Result<Pass<Metrics>, PointError> + Sync,
) -> impl Fn(&Point) -> Option<Row> + Sync {
    move |point| row_of(point, (0, 2), || solve(point), Ok)
}

/// Runs all points.
fn run_all(folder: &Path, jobs: usize) -> Outcome {
    let stop = AtomicBool::new(false);
    let run = Run { jobs, stop: &stop, progress: &|_| {} };
    sweep(&plan(), None, folder, RESUME, &run, &rows_by(solve)).unwrap()
}

/// The files of a finished sweep. Synthetic times also depend on the id alone, so complete files can be compared.
fn files(folder: &Path) -> Vec<(&'static str, String)> {
    ["plan.json", "rows.jsonl", "rows.csv"].map(|name| (name, fs::read_to_string(folder.join(name)).unwrap())).to_vec()
}

/// A sweep that finished without interruption.
fn uninterrupted() -> (tempfile::TempDir, Vec<(&'static str, String)>) {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run_on(folder.path(), 1, &|file| Box::new(Unsynced(file))).unwrap();
    assert_eq!((outcome.0, outcome.1), (200, 5));
    let written = files(folder.path());
    (folder, written)
}

/// Runs all points with `medium` between journal and file.
fn run_on(folder: &Path, jobs: usize, medium: &Medium<'_>) -> Result<(usize, usize), StoreError> {
    let plan = plan();
    let (stop, failed) = (AtomicBool::new(false), AtomicUsize::new(0));
    let mut store = Store::open_on(folder, Manifest::of(&plan, None), RESUME, medium)?;
    let progress = |p: SweepProgress<'_>| failed.store(p.failed, Ordering::SeqCst);
    run_missing(&plan, &mut store, &Run { jobs, stop: &stop, progress: &progress }, &rows_by(solve))?;
    Ok((store.finish()?.len(), failed.into_inner()))
}

/// A file whose appends are not synced, to keep tests without power cuts short.
struct Unsynced(File);

impl Append for Unsynced {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.0.cut(length)
    }
}
