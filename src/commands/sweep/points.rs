//! The points of a sweep as the command line runs them: rows made on a bench, what the recording needs kept of each.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::garment::MeshCache;
use crate::study::accuracy::ReferenceCache;
use crate::study::sweep::{Bench, Point, PointError, Row};

use super::store::{KeptPoint, PointStore};
use crate::commands::interrupt;

/// Runs points and keeps what the recording needs.
pub(crate) struct KeepingBench<'a> {
    /// What drapes and measures.
    pub(crate) bench: Bench<'static>,
    store: &'a PointStore,
    broken: Mutex<Option<std::io::Error>>,
    keeping_us: AtomicU64,
}

impl<'a> KeepingBench<'a> {
    /// A bench that keeps its points in `store` and its references in `cache`.
    pub(crate) fn new(store: &'a PointStore, cache: Option<ReferenceCache>) -> Self {
        let bench = Bench::new(cache, interrupt::flag()).with_meshes(MeshCache::in_user_cache());
        Self { bench, store, broken: Mutex::new(None), keeping_us: AtomicU64::new(0) }
    }

    /// Why points could no longer be kept, if so: a full disk.
    pub(crate) fn take_broken(&self) -> Option<std::io::Error> {
        self.broken.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Time spent on keeping points, ms.
    pub(crate) fn keeping_ms(&self) -> f64 {
        self.keeping_us.load(Ordering::Relaxed) as f64 / 1e3
    }

    /// The row of a point, kept before it is told.
    pub(crate) fn row(&self, point: &Point, passes: (usize, usize)) -> Option<Row> {
        if self.broken.lock().unwrap_or_else(PoisonError::into_inner).is_some() {
            return None;
        }
        self.bench.row(point, passes, |loaded, drape, measured| {
            let started = Instant::now();
            let kept = KeptPoint::of(point.scene_id(), drape, &measured.error_mm);
            let put = self.store.put(&point.id, kept, &loaded.scene);
            self.keeping_us.fetch_add(started.elapsed().as_micros() as u64, Ordering::Relaxed);
            put.map_err(|error| {
                // No row for a point that is not kept, and no use in further ones: the disk is full, most likely.
                *self.broken.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                PointError::Interrupted
            })
        })
    }
}
