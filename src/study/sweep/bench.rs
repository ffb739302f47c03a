//! Runs the points of a sweep: loads each scene once, times the passes and measures the result. A failure becomes a row.

use std::cell::Cell;
use std::collections::{BTreeMap, VecDeque};
use std::error::Error;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use super::{Point, Row, Timing};
use crate::base::error_text::{panic_text, with_causes};
use crate::drape::{Drape, Prepared, Refine, Settings, StageTimes};
use crate::garment::MeshCache;
use crate::mechanics::refine::{Step, Stop};
use crate::scene::Loaded;
use crate::study::accuracy::ReferenceCache;
use crate::study::evaluate::EvaluateError;
use crate::study::job::Measured;
use crate::study::metrics::Metrics;

/// Why a point has no result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PointError {
    /// The point failed: its row has the error, and the sweep continues.
    #[error("{0}")]
    Failed(String),
    /// The user interrupted it. It has no row and is computed again on resume.
    #[error("interrupted")]
    Interrupted,
}

impl PointError {
    /// A failure with the texts of an error and its causes.
    pub(crate) fn failed(error: &(dyn Error + 'static)) -> Self {
        Self::Failed(with_causes(error, ": "))
    }

    /// A garment that has fallen off the body, in part or as a whole.
    fn fallen(what: Option<String>) -> Self {
        let what = what.unwrap_or_else(|| "the garment has fallen off the body".to_owned());
        Self::Failed(format!("{what}; in a sweep file it is `hold` that holds an edge"))
    }
}

/// The outcome of one pass over a point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pass<T> {
    /// Data for the measurement, which is not timed.
    pub value: T,
    /// Times of the stages.
    pub times: StageTimes,
    /// [`result_hash`] of the displaced positions.
    pub result_hash: String,
}

/// blake3 over the bits of the positions (x, y, z, little-endian), hexadecimal: equal hashes are equal results, bit for bit.
#[must_use]
pub fn result_hash(positions: &[DVec3]) -> String {
    let mut hasher = blake3::Hasher::new();
    for position in positions {
        for coordinate in position.to_array() {
            hasher.update(&coordinate.to_bits().to_le_bytes());
        }
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// The row of a point after warm-up and timed passes, with the metrics of the last pass; `None` if it was interrupted.
pub(crate) fn row_of<T>(
    point: &Point,
    (warm_up, repeats): (usize, usize),
    pass: impl Fn() -> Result<Pass<T>, PointError>,
    measure: impl FnOnce(T) -> Result<Metrics, PointError>,
) -> Option<Row> {
    let work = || {
        for _ in 0..warm_up {
            pass()?;
        }
        let mut last = pass()?;
        let mut times = vec![last.times];
        for repeat in 2..=repeats {
            let again = pass()?;
            if again.result_hash != last.result_hash {
                let (first, other) = (&last.result_hash, &again.result_hash);
                let text = format!("not deterministic: repeat {repeat} gave {other}, the first {first}");
                return Err(PointError::Failed(text));
            }
            times.push(again.times);
            last = again;
        }
        let Pass { value, result_hash, .. } = last;
        Ok(Row::solved(point, &measure(value)?, &result_hash, &Timing::of(&times)))
    };
    // A panic may leave shared data inconsistent; a failure of a later point would become a row too.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(row)) => Some(row),
        Ok(Err(PointError::Failed(text))) => Some(Row::failed(point, text)),
        Ok(Err(PointError::Interrupted)) => None,
        Err(payload) => Some(Row::failed(point, format!("panicked: {}", panic_text(payload.as_ref())))),
    }
}

/// Drapes and measures points; with several jobs, from several threads at the same time.
pub struct Bench<'a> {
    cache: Option<ReferenceCache>,
    meshes: MeshCache,
    stop: &'a AtomicBool,
    scenes: Arc<Scenes>,
    prepared: Mutex<VecDeque<(String, Arc<Prepared>)>>,
}

/// Garments whose distances and cloth are kept: a grid that changes several fabrics before tables needs each again.
const KEPT: usize = 4;

/// Loaded scenes by the id of [`Point::scene_id`].
pub(crate) type Scenes = Mutex<BTreeMap<String, Arc<Loaded>>>;

impl<'a> Bench<'a> {
    /// A bench that stores references in `cache`, if there is one, and interrupts its work once `stop` is set.
    #[must_use]
    pub fn new(cache: Option<ReferenceCache>, stop: &'a AtomicBool) -> Self {
        Self { cache, meshes: MeshCache::default(), stop, scenes: Arc::default(), prepared: Mutex::default() }
    }

    /// The same with a cache of built-in meshes.
    pub(crate) fn with_meshes(self, meshes: MeshCache) -> Self {
        Self { meshes, ..self }
    }

    /// The same with scenes that other benches share.
    #[cfg(feature = "python")]
    pub(crate) fn with_scenes(self, scenes: Arc<Scenes>) -> Self {
        Self { scenes, ..self }
    }

    /// The scene of a point. Other threads wait while a scene is loaded, since they usually need the same one.
    pub(crate) fn scene(&self, point: &Point) -> Result<Arc<Loaded>, PointError> {
        let mut made = self.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        let id = point.scene_id();
        if let Some(loaded) = made.get(&id) {
            return Ok(loaded.clone());
        }
        let loaded = Arc::new(point.job.scene.load_with(&self.meshes).map_err(|e| PointError::failed(&e))?);
        made.insert(id, loaded.clone());
        Ok(loaded)
    }

    /// Distances and cloth of a point, from another point of the same garment if there was one.
    fn prepared(&self, point: &Point, loaded: &Loaded) -> Result<Arc<Prepared>, PointError> {
        let Settings { model, refine, fabric, .. } = &point.job.settings;
        // Only these settings count, and serialising plain data cannot fail.
        let of = serde_json::to_string(&(point.scene_id(), model.name(), *refine == Refine::Steps(0), fabric));
        let of = of.map_err(|e| PointError::failed(&e))?;
        let mut kept = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, prepared)) = kept.iter().find(|(kept, _)| *kept == of) {
            return Ok(prepared.clone());
        }
        let prepared = Prepared::new(&loaded.scene, &point.job.settings).map_err(|e| PointError::failed(&e))?;
        let prepared = Arc::new(prepared);
        kept.truncate(KEPT - 1);
        kept.push_front((of, prepared.clone()));
        Ok(prepared)
    }

    /// Warnings of the loaded scenes, by garment.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let made = self.scenes.lock().unwrap_or_else(PoisonError::into_inner);
        made.values().flat_map(|loaded| loaded.warnings()).collect()
    }

    /// The row of a point after warm-up and timed passes; `keep` receives the last drape, untimed.
    pub fn row(
        &self,
        point: &Point,
        passes: (usize, usize),
        keep: impl FnOnce(&Loaded, &Drape, &Measured) -> Result<(), PointError>,
    ) -> Option<Row> {
        let cut_from = Cell::new(None);
        let measure = |(loaded, drape): (Arc<Loaded>, Drape)| {
            let measured =
                point.job.measure(&loaded.scene, &drape, self.cache.as_ref(), &mut |_: &Step<'_>| self.listen());
            let measured = measured.map_err(|e| match e {
                EvaluateError::Interrupted => PointError::Interrupted,
                other => PointError::failed(&other),
            })?;
            keep(&loaded, &drape, &measured)?;
            cut_from.set(Some(loaded.scene.fabric_names(&point.job.settings.fabric)));
            Ok(measured.metrics)
        };
        let row = row_of(point, passes, || self.pass(point), measure)?;
        // A garment with its own fabrics reports those.
        let fabric = cut_from.take().unwrap_or(row.fabric);
        Some(Row { fabric, ..row })
    }

    fn pass(&self, point: &Point) -> Result<Pass<(Arc<Loaded>, Drape)>, PointError> {
        if self.listen().is_break() {
            return Err(PointError::Interrupted);
        }
        let loaded = self.scene(point)?;
        let prepared = self.prepared(point, &loaded)?;
        let drape = point.job.drape_again(&loaded.scene, &prepared, &mut |_: &Step<'_>| self.listen());
        let drape = drape.map_err(|e| PointError::failed(&e))?;
        if drape.state.as_ref().is_some_and(|s| s.stop == Stop::Interrupted) {
            // A garment that falls past the feet ends its own solve, not the sweep.
            return Err(if self.listen().is_break() {
                PointError::Interrupted
            } else {
                PointError::fallen(loaded.scene.fallen(&drape.positions))
            });
        }
        let (times, result_hash) = (drape.times, result_hash(&drape.positions));
        Ok(Pass { value: (loaded, drape), times, result_hash })
    }

    fn listen(&self) -> ControlFlow<()> {
        if self.stop.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
