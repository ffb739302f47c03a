//! Joined shards equal a single run; shards of different sweeps are not joined.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::Job;
use crate::study::sweep::{Existing, MergeError, Plan, Run, Shard, StoreError, merge, sweep};

use super::{files, plan, rows_by, run_all, solve, uninterrupted};

fn run_shards(folder: &Path, plan: &Plan, count: usize) -> Vec<PathBuf> {
    let stop = AtomicBool::new(false);
    let run = Run { jobs: 2, stop: &stop, progress: &|_| {} };
    (1..=count)
        .map(|i| {
            let part = folder.join(i.to_string());
            let shard: Shard = format!("{i}/{count}").parse().unwrap();
            let outcome = sweep(plan, Some(shard), &part, Existing::Refuse, &run, &rows_by(solve)).unwrap();
            assert_eq!((outcome.total, outcome.stopped), (outcome.rows.len(), false));
            part
        })
        .collect()
}

#[test]
fn three_shards_in_any_order_merge_into_the_single_run() {
    let (_kept, whole) = uninterrupted();
    let folder = tempfile::tempdir().unwrap();
    let mut parts = run_shards(folder.path(), &plan(), 3);
    parts.rotate_left(1);
    let out = folder.path().join("joined");
    assert_eq!(merge(&parts, &out).unwrap().len(), 200);
    assert_eq!(files(&out), whole);
    // A joined sweep can be resumed and joined again, alone or with its shards.
    assert_eq!(run_all(&out, 1).skipped, 195);
    let again = folder.path().join("again");
    parts.push(out);
    merge(&parts, &again).unwrap();
    assert_eq!(files(&again), whole);
    assert!(matches!(merge(&parts, &again), Err(MergeError::Store(_))), "rows are there already");
}

#[test]
fn missing_points_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let parts = run_shards(folder.path(), &plan(), 3);
    let error = merge(&parts[..2], &folder.path().join("out")).unwrap_err().to_string();
    assert!(error.starts_with("66 of 200 points are missing: 2 (body form, garment low-cut-dress"), "{error}");
    assert!(error.contains("and 56 more"), "{error}");
    assert!(matches!(merge(&[], folder.path()), Err(MergeError::Nothing)));
}

#[test]
fn a_manifest_made_by_somebody_else_is_taken_for_no_path_and_does_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let parts = run_shards(folder.path(), &plan(), 2);
    let manifest = parts[0].join("plan.json");
    let text = fs::read_to_string(&manifest).unwrap();
    let id = text.split("\"id\": \"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    let out = folder.path().join("out");
    for hostile in ["../../../../escaped", "a/b", "..", "", "x".repeat(32).as_str(), "ABCDEF0123456789ABCDEF0123456789"]
    {
        fs::write(&manifest, text.replace(&id, hostile)).unwrap();
        let rows = fs::read_to_string(parts[0].join("rows.jsonl")).unwrap();
        fs::write(parts[0].join("rows.jsonl"), rows.replace(&id, hostile)).unwrap();
        let error = merge(&parts, &out).unwrap_err();
        assert!(matches!(&error, MergeError::Store(StoreError::BadId { .. })), "{error}");
        assert!(error.to_string().contains("plan.json") && error.to_string().contains("32 hexadecimal"), "{error}");
        fs::write(parts[0].join("rows.jsonl"), rows).unwrap();
    }
    // The identity shows eight letters of the hash; these letters have two bytes each.
    let hash = text.split("\"plan\": \"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    fs::write(&manifest, text.replace(&hash, "xéééééééééé")).unwrap();
    let error = merge(&parts, &out).unwrap_err().to_string();
    assert!(error.contains("plan xééééééé"), "{error}");
}

#[test]
fn shards_of_other_plans_and_versions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let parts = run_shards(folder.path(), &plan(), 2);
    let other =
        Plan::parse("name = \"other\"\n[grid]\nseeds = [1, 2]", "other.toml", Path::new(""), &Job::preview()).unwrap();
    let others = run_shards(&folder.path().join("other"), &other, 2);
    let out = folder.path().join("out");
    let error = merge(&[parts[0].clone(), others[1].clone()], &out).unwrap_err();
    assert!(matches!(&error, MergeError::OtherPlan { .. }), "{error}");
    let manifest = parts[1].join("plan.json");
    let version = format!("\"partwise\": \"{}\"", env!("CARGO_PKG_VERSION"));
    let text = fs::read_to_string(&manifest).unwrap();
    assert!(text.contains(&version));
    fs::write(&manifest, text.replace(&version, "\"partwise\": \"0.0.0\"")).unwrap();
    let error = merge(&parts, &out).unwrap_err().to_string();
    assert!(error.contains("of partwise 0.0.0"), "{error}");
}

#[test]
fn overlapping_shards_agree_or_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut parts = run_shards(folder.path(), &plan(), 2);
    parts.extend(run_shards(&folder.path().join("thirds"), &plan(), 3));
    let rows = parts[4].join("rows.jsonl");
    let text = fs::read_to_string(&rows).unwrap();
    // Different timings are accepted, different metrics are not.
    let slower = text.replace("\"time_total_ms\":0.", "\"time_total_ms\":10.");
    assert_ne!(slower, text);
    fs::write(&rows, slower).unwrap();
    merge(&parts, &folder.path().join("agreed")).unwrap();
    fs::write(&rows, text.replace("\"vertices\":4", "\"vertices\":5")).unwrap();
    let error = merge(&parts, &folder.path().join("out")).unwrap_err().to_string();
    assert!(error.starts_with("point 2 (body") && error.contains("disagree in vertices;"), "{error}");
}

#[test]
fn shards_are_every_nth_point_and_nonsense_is_none() {
    let shard: Shard = "2/3".parse().unwrap();
    assert_eq!((0..9).filter(|&i| shard.holds(i)).collect::<Vec<_>>(), [1, 4, 7]);
    for bad in ["0/3", "4/3", "3", "a/b", "1/0", "/", "-1/3"] {
        let error = bad.parse::<Shard>().unwrap_err().to_string();
        assert!(error.contains(&format!("found \"{bad}\"")), "{error}");
    }
}

#[test]
fn one_job_and_four_write_the_same() {
    let (_kept, whole) = uninterrupted();
    let folder = tempfile::tempdir().unwrap();
    run_all(folder.path(), 4);
    assert_eq!(files(folder.path()), whole);
}
