//! A process that is killed without a chance to clean up.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::study::sweep::{Point, Run, store, sweep};

use super::{RESUME, files, plan, rows_by, run_all, solve, uninterrupted};

const FOLDER: &str = "PARTWISE_TEST_SWEEP_FOLDER";

#[test]
#[ignore = "the work of the process that the test below starts and kills"]
fn child() {
    let folder = std::env::var_os(FOLDER).map(PathBuf::from).expect("a folder from the test that starts this");
    let slow = |point: &Point| {
        sleep(Duration::from_millis(2));
        solve(point)
    };
    let stop = false.into();
    let run = Run { jobs: 2, stop: &stop, progress: &|_| {} };
    sweep(&plan(), None, &folder, RESUME, &run, &rows_by(slow)).unwrap();
}

#[test]
fn killed_three_times_and_resumed_it_equals_the_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let rows = || store::read(folder.path()).map_or(0, |(_, rows)| rows.len());
    for least in [10, 60, 110] {
        let before = rows();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "study::sweep::tests::killed::child", "--ignored"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let deadline = Instant::now() + Duration::from_secs(60);
        while rows() < least && Instant::now() < deadline {
            sleep(Duration::from_millis(5));
        }
        assert!(child.try_wait().unwrap().is_none(), "the process ended before it was killed");
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success());
        let found = rows();
        assert!((least..200).contains(&found) && found > before, "{found} rows after the kill, {before} before");
    }
    let outcome = run_all(folder.path(), 2);
    assert!(outcome.skipped >= 100, "{}", outcome.skipped);
    assert_eq!(files(folder.path()), uninterrupted().1);
}
