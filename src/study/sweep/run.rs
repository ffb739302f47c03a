//! Runs the points of a plan that have no row yet, several at a time, and puts each row on disk as it comes.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use super::{Existing, Manifest, Plan, Point, Row, Shard, Status, Store, StoreError};

/// How far a sweep is.
#[derive(Debug, Clone, Copy)]
pub struct SweepProgress<'a> {
    /// Points of this sweep or shard.
    pub total: usize,
    /// Rows on disk, those found there included.
    pub done: usize,
    /// Rows that are errors.
    pub failed: usize,
    /// The row just written; none in the first call, before any work.
    pub row: Option<&'a Row>,
}

/// How a sweep is run; nothing here changes a result.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Points at a time, at least 1. More than one makes the timings of all of them worse.
    pub jobs: usize,
    /// Set to stop: points in hand are finished, no others begun.
    pub stop: &'a AtomicBool,
    /// Called before the first point, and after every row by the thread that wrote it, one at a time.
    pub progress: &'a (dyn Fn(SweepProgress<'_>) + Sync),
}

/// Makes the row of a point; `None` where it was interrupted. Called from several threads at once where there are several
/// jobs; not from rayon's, so that it may hold a lock around work that rayon spreads.
pub(crate) type Maker<'a> = dyn Fn(&Point) -> Option<Row> + Sync + 'a;

/// Result of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Points of this sweep or shard.
    pub total: usize,
    /// Rows found at the start.
    pub skipped: usize,
    /// Rows that are errors: not 0 means a non-zero exit.
    pub failed: usize,
    /// Whether it was stopped before the end.
    pub stopped: bool,
    /// All rows so far, in the plan's order.
    pub rows: Vec<Row>,
}

impl Outcome {
    /// Of a sweep all of whose rows were there.
    pub(crate) fn found(rows: Vec<Row>) -> Self {
        let total = rows.len();
        Self { total, skipped: total, failed: count_failed(&rows), stopped: false, rows }
    }
}

/// Opens the folder, runs what is missing, and puts the files in order: the whole of `partwise sweep`.
///
/// # Errors
/// [`StoreError`] as [`Store::open`] and [`Store::append`]: rows written before stay intact. A failed point is no error
/// but a row.
pub fn sweep(
    plan: &Plan,
    shard: Option<Shard>,
    folder: &Path,
    existing: Existing,
    run: &Run<'_>,
    row: &Maker<'_>,
) -> Result<Outcome, StoreError> {
    let mut store = Store::open(folder, Manifest::of(plan, shard), existing)?;
    let skipped = store.rows().len();
    run_missing(plan, &mut store, run, row)?;
    let total = store.manifest().share();
    let rows = store.finish()?;
    let failed = count_failed(&rows);
    Ok(Outcome { total, skipped, failed, stopped: rows.len() < total, rows })
}

/// Runs the points of `plan` that `store` lacks. Each thread puts its row on disk before it takes up another point, so that a
/// crash loses no more than the points in hand, one a job.
///
/// # Errors
/// [`StoreError::Write`] when a row cannot be written; the points in hand are then lost, the rows before are not.
pub(crate) fn run_missing(plan: &Plan, store: &mut Store, run: &Run<'_>, row: &Maker<'_>) -> Result<(), StoreError> {
    let todo: Vec<_> = plan.points.iter().filter(|p| store.lacks(p.index)).collect();
    let (total, done) = (store.manifest().share(), store.rows().len());
    let progress = SweepProgress { total, done, failed: count_failed(store.rows()), row: None };
    (run.progress)(progress);
    let next = AtomicUsize::new(0);
    let broken = AtomicBool::new(false);
    let desk = Mutex::new(Desk { store, progress, written: Ok(()) });
    let work = || {
        while !run.stop.load(Ordering::SeqCst) && !broken.load(Ordering::SeqCst) {
            let Some(point) = todo.get(next.fetch_add(1, Ordering::SeqCst)) else { break };
            let Some(row) = row(point) else { break };
            if !desk.lock().unwrap_or_else(PoisonError::into_inner).take(row, run) {
                broken.store(true, Ordering::SeqCst);
            }
        }
    };
    // Threads of their own, not rayon's: a point uses rayon itself, and a rayon thread that waits for its share may take
    // up another point in the meantime, which would spoil timings and deadlock solvers that hold a lock.
    thread::scope(|scope| {
        for _ in 0..run.jobs.clamp(1, todo.len().max(1)) {
            scope.spawn(work);
        }
    });
    desk.into_inner().unwrap_or_else(PoisonError::into_inner).written
}

/// Where finished points are handed in, one at a time.
struct Desk<'a> {
    store: &'a mut Store,
    progress: SweepProgress<'static>,
    written: Result<(), StoreError>,
}

impl Desk<'_> {
    /// Writes a row; false once one could not be written: then no more are taken.
    fn take(&mut self, row: Row, run: &Run<'_>) -> bool {
        if self.written.is_ok() {
            let failed = usize::from(row.status == Status::Error);
            self.written = self.store.append(row);
            if self.written.is_ok() {
                self.progress.done += 1;
                self.progress.failed += failed;
                (run.progress)(SweepProgress { row: self.store.rows().last(), ..self.progress });
            }
        }
        self.written.is_ok()
    }
}

fn count_failed(rows: &[Row]) -> usize {
    rows.iter().filter(|r| r.status == Status::Error).count()
}
