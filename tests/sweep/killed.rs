//! A process that is really killed, with no chance to tidy up.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use partwise::sweep::{Existing, Point, Run, store, sweep};

use super::{files, plan, rows_by, run_all, solve, uninterrupted};

const FOLDER: &str = "PARTWISE_TEST_SWEEP_FOLDER";

/// The child's work: nothing unless this test program was started by the test below.
#[test]
fn child() {
    let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) else { return };
    let slow = |point: &Point| {
        sleep(Duration::from_millis(2));
        solve(point)
    };
    let stop = false.into();
    let run = Run { jobs: 2, stop: &stop, progress: &|_| {} };
    sweep(&plan(), None, &folder, Existing::RESUME, &run, &rows_by(slow)).unwrap();
}

#[test]
fn killed_three_times_and_resumed_it_equals_the_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let rows = || store::read(folder.path()).map_or(0, |(_, rows)| rows.len());
    for least in [10, 60, 110] {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "killed::child"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let patience = Instant::now() + Duration::from_secs(60);
        while rows() < least && Instant::now() < patience {
            sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let found = rows();
        assert!((least..200).contains(&found), "{found} rows after the kill");
    }
    let outcome = run_all(folder.path(), 2);
    assert!(outcome.skipped >= 100, "{}", outcome.skipped);
    assert_eq!(files(folder.path()), uninterrupted().1);
}
