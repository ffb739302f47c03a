//! Runs the points of a plan that have no row yet, several at a time, and writes each row to disk when it is complete.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use super::{Existing, Manifest, Plan, Point, Row, Shard, Status, Store, StoreError};

/// Progress of a sweep.
#[derive(Debug, Clone, Copy)]
pub struct SweepProgress<'a> {
    /// Points of this sweep or shard.
    pub total: usize,
    /// Rows on disk, including those of earlier runs.
    pub done: usize,
    /// Rows that are errors.
    pub failed: usize,
    /// The row just written; `None` in the first call, before any work.
    pub row: Option<&'a Row>,
}

/// Options of a run that do not affect results.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Points at a time, at least 1. Several at a time make the timings longer.
    pub jobs: usize,
    /// Set to stop: points that are being computed are finished, no others are started.
    pub stop: &'a AtomicBool,
    /// Called before the first point, and after every row by the thread that wrote it, one at a time.
    pub progress: &'a (dyn Fn(SweepProgress<'_>) + Sync),
}

/// Computes the row of a point; `None` if it was interrupted. With several jobs it is called from several threads, never from a
/// thread of rayon, so that it may hold a lock around parallel work.
pub(crate) type Maker<'a> = dyn Fn(&Point) -> Option<Row> + Sync + 'a;

/// Result of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Points of this sweep or shard.
    pub total: usize,
    /// Rows at the start.
    pub skipped: usize,
    /// Rows that are errors; the exit code is not 0 if there are any.
    pub failed: usize,
    /// Whether it was stopped before the end.
    pub stopped: bool,
    /// All rows so far, in the plan's order.
    pub rows: Vec<Row>,
}

impl Outcome {
    /// The outcome of a sweep whose rows all existed.
    pub(crate) fn found(rows: Vec<Row>) -> Self {
        let total = rows.len();
        Self { total, skipped: total, failed: count_failed(&rows), stopped: false, rows }
    }
}

/// Opens the folder, runs the missing points and finishes the files, as `partwise sweep` does.
///
/// # Errors
/// [`StoreError`] as [`Store::open`] and [`Store::append`]; earlier rows stay intact. A failed point is not an error but a row.
pub fn sweep(
    plan: &Plan,
    shard: Option<Shard>,
    folder: &Path,
    existing: Existing,
    run: &Run<'_>,
    row: &Maker<'_>,
) -> Result<Outcome, StoreError> {
    let mut store = Store::open(folder, Manifest::of(plan, shard), existing)?;
    let skipped = store.rows.len();
    run_missing(plan, &mut store, run, row)?;
    let total = store.manifest.share();
    let rows = store.finish()?;
    let failed = count_failed(&rows);
    Ok(Outcome { total, skipped, failed, stopped: rows.len() < total, rows })
}

/// Runs the points of `plan` that `store` lacks. Each thread writes its row to disk before it starts another point, so that a
/// crash loses at most one point per job.
///
/// # Errors
/// [`StoreError::Write`] if a row cannot be written. The points that are being computed are lost then, earlier rows are not.
pub(crate) fn run_missing(plan: &Plan, store: &mut Store, run: &Run<'_>, row: &Maker<'_>) -> Result<(), StoreError> {
    let todo: Vec<_> = plan.points.iter().filter(|p| store.lacks(p.index)).collect();
    let (total, done) = (store.manifest.share(), store.rows.len());
    let progress = SweepProgress { total, done, failed: count_failed(&store.rows), row: None };
    (run.progress)(progress);
    let next = AtomicUsize::new(0);
    let broken = AtomicBool::new(false);
    let writer = Mutex::new(RowWriter { store, progress, written: Ok(()) });
    let work = || {
        while !run.stop.load(Ordering::SeqCst) && !broken.load(Ordering::SeqCst) {
            let Some(point) = todo.get(next.fetch_add(1, Ordering::SeqCst)) else { break };
            let Some(row) = row(point) else { break };
            if !writer.lock().unwrap_or_else(PoisonError::into_inner).write(row, run) {
                broken.store(true, Ordering::SeqCst);
            }
        }
    };
    // Separate threads, because a point uses rayon itself: a waiting rayon thread could start another point, which would distort
    // timings and deadlock solvers that hold a lock.
    thread::scope(|scope| {
        for _ in 0..run.jobs.clamp(1, todo.len().max(1)) {
            scope.spawn(work);
        }
    });
    writer.into_inner().unwrap_or_else(PoisonError::into_inner).written
}

/// Writes finished rows, one at a time.
struct RowWriter<'a> {
    store: &'a mut Store,
    progress: SweepProgress<'static>,
    written: Result<(), StoreError>,
}

impl RowWriter<'_> {
    /// Writes a row; false after the first row that could not be written.
    fn write(&mut self, row: Row, run: &Run<'_>) -> bool {
        if self.written.is_ok() {
            let failed = usize::from(row.status == Status::Error);
            self.written = self.store.append(row);
            if self.written.is_ok() {
                self.progress.done += 1;
                self.progress.failed += failed;
                (run.progress)(SweepProgress { row: self.store.rows.last(), ..self.progress });
            }
        }
        self.written.is_ok()
    }
}

fn count_failed(rows: &[Row]) -> usize {
    rows.iter().filter(|r| r.status == Status::Error).count()
}
