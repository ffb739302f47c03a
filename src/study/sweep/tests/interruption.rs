//! A resumed sweep equals an uninterrupted one.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use crate::study::sweep::disk::Append;
use crate::study::sweep::{
    Existing, Manifest, Plan, Point, PointError, Run, Status, Store, StoreError, SweepProgress, store, sweep,
};
use proptest::prelude::*;

use super::{RESUME, Unsynced, files, plan, rows_by, run_all, run_on, solve, uninterrupted};

#[test]
fn stopped_three_times_and_resumed_it_equals_the_uninterrupted_one() {
    let (_kept, whole) = uninterrupted();
    let folder = tempfile::tempdir().unwrap();
    for (stop_at, jobs) in [(1, 1), (70, 3), (155, 2)] {
        let stop = AtomicBool::new(false);
        let progress = |p: SweepProgress<'_>| stop.store(p.done >= stop_at, Ordering::SeqCst);
        let run = Run { jobs, stop: &stop, progress: &progress };
        let outcome = sweep(&plan(), None, folder.path(), RESUME, &run, &rows_by(solve)).unwrap();
        assert!(outcome.stopped && outcome.rows.len() >= stop_at && outcome.rows.len() < 200);
        assert!(
            outcome.rows.len() < stop_at + jobs,
            "points that are being computed are finished, no others are started"
        );
    }
    let outcome = run_all(folder.path(), 4);
    assert!(!outcome.stopped && outcome.skipped >= 150);
    assert_eq!(files(folder.path()), whole);
}

#[test]
fn finished_points_are_not_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let solved = Mutex::new(Vec::new());
    let counting = |point: &Point| {
        solved.lock().unwrap().push(point.index);
        solve(point)
    };
    let stop = AtomicBool::new(false);
    let progress = |p: SweepProgress<'_>| stop.store(p.done == 20, Ordering::SeqCst);
    let run = Run { jobs: 1, stop: &stop, progress: &progress };
    for _ in 0..2 {
        sweep(&plan(), None, folder.path(), RESUME, &run, &rows_by(&counting)).unwrap();
    }
    // Two repeats per point. The second run computes only the failed point again, because the flag stops it at 20 rows.
    let mut twice = solved.into_inner().unwrap();
    twice.dedup();
    assert_eq!(twice, (0..20).chain([7]).collect::<Vec<_>>());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// A killed process may leave any prefix of its output in either file.
    #[test]
    fn cut_anywhere_and_resumed_it_equals_the_uninterrupted_one(json in 0.0..1.0_f64, csv in 0.0..1.0_f64, jobs in 1..4_usize) {
        let (kept, whole) = shared();
        let folder = tempfile::tempdir().unwrap();
        copy(kept, folder.path());
        for (name, share) in [("rows.jsonl", json), ("rows.csv", csv)] {
            let file = OpenOptions::new().write(true).open(folder.path().join(name)).unwrap();
            let length = file.metadata().unwrap().len();
            file.set_len((share * length as f64) as u64).unwrap();
        }
        run_on(folder.path(), jobs, &|file| Box::new(Unsynced(file))).unwrap();
        prop_assert_eq!(&files(folder.path()), whole);
    }

    /// The disk is full after `room` bytes of rows.
    #[test]
    fn a_full_disk_loses_the_current_point_and_is_reported(room in 0..90_000_usize, jobs in 1..4_usize, cuts in any::<bool>()) {
        let (_, whole) = shared();
        let folder = tempfile::tempdir().unwrap();
        let left = Room::new(AtomicUsize::new(room));
        let error = run_on(folder.path(), jobs, &|file| Box::new(Full { file, left: left.clone(), cuts }));
        let message = match error {
            Err(error @ StoreError::Write { .. }) => error.to_string(),
            other => return Err(TestCaseError::fail(format!("{other:?}"))),
        };
        prop_assert!(message.contains("space") && message.contains("--resume"), "{}", message);
        let (_, rows) = store::read(folder.path()).unwrap();
        prop_assert!(message.contains(&format!("the {} rows", rows.len())), "{} but {}", message, rows.len());
        run_on(folder.path(), jobs, &|file| Box::new(Unsynced(file))).unwrap();
        prop_assert_eq!(&files(folder.path()), whole);
    }
}

#[test]
fn a_crash_loses_at_most_one_point_per_job() {
    for jobs in [1, 3] {
        let folder = tempfile::tempdir().unwrap();
        let begun = Mutex::new(BTreeSet::new());
        let watching = |point: &Point| {
            let mut begun = begun.lock().unwrap();
            begun.insert(point.index);
            let rows = fs::read_to_string(folder.path().join("rows.jsonl")).unwrap().lines().count();
            assert!(rows + jobs >= begun.len(), "{} points begun, {rows} rows on disk", begun.len());
            solve(point)
        };
        let stop = AtomicBool::new(false);
        let run = Run { jobs, stop: &stop, progress: &|_| {} };
        let outcome = sweep(&plan(), None, folder.path(), Existing::Refuse, &run, &rows_by(watching)).unwrap();
        assert_eq!((outcome.failed, outcome.rows.len()), (5, 200), "{}", outcome.rows[199].error);
    }
}

#[test]
fn failed_points_are_rows_and_are_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let run = Run { jobs: 2, stop: &stop, progress: &|_| {} };
    let panicking = |point: &Point| {
        assert!(point.index != 11, "point eleven");
        solve(point)
    };
    let outcome = sweep(&plan(), None, folder.path(), Existing::Refuse, &run, &rows_by(panicking)).unwrap();
    assert_eq!((outcome.failed, outcome.rows.len(), outcome.stopped), (6, 200, false));
    assert_eq!((outcome.rows[11].status, outcome.rows[11].error.as_str()), (Status::Error, "panicked: point eleven"));
    assert!(outcome.rows[7].error.starts_with("synthetic failure") && outcome.rows[7].metrics.is_none());

    let kept = Existing::Resume { retry_failed: false, adopt: false };
    assert_eq!(sweep(&plan(), None, folder.path(), kept, &run, &rows_by(solve)).unwrap().failed, 6);
    assert_eq!(sweep(&plan(), None, folder.path(), RESUME, &run, &rows_by(solve)).unwrap().failed, 5);
    assert_eq!(files(folder.path()), uninterrupted().1);
}

#[test]
fn an_interrupted_point_leaves_no_row_and_a_failed_point_has_its_cause() {
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let run = Run { jobs: 1, stop: &stop, progress: &|_| {} };
    let interrupted = |point: &Point| match point.index {
        5 => Err(PointError::Interrupted),
        _ => solve(point),
    };
    let outcome = sweep(&plan(), None, folder.path(), Existing::Refuse, &run, &rows_by(interrupted)).unwrap();
    assert!(outcome.stopped && outcome.rows.len() == 5);

    let passes = Mutex::new(0);
    let odd = |point: &Point| {
        let mut solved = solve(point)?;
        let mut passes = passes.lock().unwrap();
        *passes += 1;
        match point.index {
            5 => solved.result_hash = passes.to_string(),
            6 => solved.value.displacement_rms_mm = f64::NAN,
            _ => {}
        }
        Ok(solved)
    };
    let outcome = sweep(&plan(), None, folder.path(), RESUME, &run, &rows_by(odd)).unwrap();
    assert_eq!(outcome.rows[5].error, "not deterministic: repeat 2 gave 2, the first 1");
    assert!(outcome.rows[6].error.starts_with("displacement_rms_mm is NaN"), "{}", outcome.rows[6].error);
}

#[test]
fn a_store_is_not_mixed_shared_or_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let open = |plan: &Plan, how| Store::open(folder.path(), Manifest::of(plan, None), how);
    let whole = plan();
    let mut held = open(&whole, Existing::Refuse).unwrap();
    assert!(matches!(open(&whole, RESUME), Err(StoreError::Locked { .. })));
    for point in &whole.points[..10] {
        held.append(crate::study::sweep::Row::failed(point, "x")).unwrap();
    }
    let twice = held.append(crate::study::sweep::Row::failed(&whole.points[3], "x"));
    assert!(matches!(twice, Err(StoreError::Damaged { .. })));
    drop(held);
    let error = open(&whole, Existing::Refuse).err().unwrap().to_string();
    assert!(error.contains("found 10 rows") && error.contains("--resume"), "{error}");

    // Another plan that has the first four tables of this one, in another order, and two more.
    let text = super::PLAN.replace("\"table-3\", { scale = [0.5, 2] }", "{ scale = [2, 3, 4] }, \"table-3\"");
    let other = Plan::parse(&text, "other.toml", Path::new(""), &crate::Job::preview()).unwrap();
    let error = open(&other, RESUME).err().unwrap();
    assert!(matches!(error, StoreError::OtherPlan { .. }), "{error}");
    let adopted = open(&other, Existing::Resume { retry_failed: false, adopt: true }).unwrap();
    let kept: Vec<_> = adopted.rows.iter().map(|r| (r.index, r.table.clone())).collect();
    assert_eq!(kept, (0..10).map(|i| (i + 60, "table-3".to_owned())).collect::<Vec<_>>());
    assert!(
        adopted.rows.iter().all(|r| other.points[r.index].id == r.point) && !adopted.lacks(60) && adopted.lacks(70)
    );
}

#[test]
fn damage_in_the_middle_is_refused_with_its_line() {
    let (kept, _) = shared();
    let folder = tempfile::tempdir().unwrap();
    copy(kept, folder.path());
    let path = folder.path().join("rows.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines[4] = "{}";
    fs::write(&path, lines.join("\n")).unwrap();
    let error = store::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains("rows.jsonl:5: not a row"), "{error}");
    lines[4] = lines[3];
    fs::write(&path, lines.join("\n")).unwrap();
    assert!(store::read(folder.path()).unwrap_err().to_string().contains("its point has an earlier row"));
    fs::remove_file(folder.path().join("plan.json")).unwrap();
    let error = Store::open(folder.path(), Manifest::of(&plan(), None), RESUME).err().unwrap();
    assert!(matches!(error, StoreError::Orphans { .. }), "{error}");
    assert!(matches!(store::read(folder.path()), Err(StoreError::Missing { .. })));
}

/// One finished sweep, shared by the tests that copy it.
fn shared() -> &'static (tempfile::TempDir, Vec<(&'static str, String)>) {
    static WHOLE: std::sync::OnceLock<(tempfile::TempDir, Vec<(&'static str, String)>)> = std::sync::OnceLock::new();
    WHOLE.get_or_init(uninterrupted)
}

fn copy(from: &tempfile::TempDir, to: &Path) {
    for name in ["plan.json", "rows.jsonl", "rows.csv"] {
        fs::copy(from.path().join(name), to.join(name)).unwrap();
    }
}

/// Free bytes of a disk that both files share.
type Room = Arc<AtomicUsize>;

struct Full {
    file: File,
    left: Room,
    cuts: bool,
}

impl Append for Full {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let taken = bytes.len().min(self.left.load(Ordering::SeqCst));
        self.left.fetch_sub(taken, Ordering::SeqCst);
        self.file.write_all(&bytes[..taken])?;
        if taken < bytes.len() { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        if self.cuts { self.file.cut(length) } else { Err(io::ErrorKind::StorageFull.into()) }
    }
}
