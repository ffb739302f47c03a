//! The pieces of a recording that viewers read, encoded once for all viewers on a separate thread while any viewer is connected.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::body::Bytes;
use glam::DVec3;
use tokio::sync::watch;

use super::access::random_token;
use crate::parts::Parts;
use crate::record::{LiveEncoder, LiveShape, PinnedView, RecordError};
use crate::session::{Pin, Session, Snapshot};
use crate::study::metrics::LevelCount;

/// Interval of the checks for a first viewer.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Shortest interval between two encodings.
const ENCODE_INTERVAL: Duration = Duration::from_millis(33);

/// The newest piece of each kind: layout and triangles, PARTs, preview, rest.
type Slots = [Option<(u64, Bytes)>; 4];

pub(super) struct Pieces {
    /// Name of the session in the viewer.
    name: String,
    /// Viewers keep one recording for each identifier.
    id: String,
    /// Direction from the body to the eye in the first layout.
    pub(super) front: DVec3,
    slots: Mutex<Slots>,
    newest: watch::Sender<u64>,
    /// Cloned by each viewer.
    viewers: Arc<()>,
    stopped: AtomicBool,
    error: Mutex<Option<String>>,
}

/// The inputs of the last encoding. They are held, so that equal pointers mean equal inputs.
#[derive(Default)]
struct Encoded {
    base: Option<(u64, Vec<u64>)>,
    parts: Option<(Arc<Parts>, Arc<Vec<DVec3>>)>,
    preview: Option<Arc<Vec<DVec3>>>,
    rest: Option<Arc<Vec<DVec3>>>,
}

impl Pieces {
    /// No pieces yet, of a session of this name, whose views are seen from `front` at first.
    pub(super) fn new(name: &str, front: DVec3) -> Self {
        Self {
            name: name.to_owned(),
            id: random_token().unwrap_or_default(),
            front,
            slots: Mutex::default(),
            newest: watch::Sender::default(),
            viewers: Arc::default(),
            stopped: AtomicBool::default(),
            error: Mutex::default(),
        }
    }

    /// Name and identifier of the viewers' recording.
    pub(super) fn recording(&self) -> (&str, &str) {
        (&self.name, &self.id)
    }

    /// Counts a viewer for as long as it holds the result.
    pub(super) fn attach(&self) -> Arc<()> {
        Arc::clone(&self.viewers)
    }

    fn has_viewers(&self) -> bool {
        Arc::strong_count(&self.viewers) > 1
    }

    pub(super) fn news(&self) -> watch::Receiver<u64> {
        self.newest.subscribe()
    }

    pub(super) fn stop(&self) {
        self.stopped.store(true, Ordering::SeqCst);
    }

    /// The error that ended the encoding, if any.
    pub(super) fn error(&self) -> Option<String> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The pieces that are newer than those `known`; all of them after a new layout.
    pub(super) fn since(&self, known: &mut [u64; 4]) -> Vec<Bytes> {
        let slots = self.slots().clone();
        let number = |slot: &Option<(u64, Bytes)>| slot.as_ref().map_or(0, |(number, _)| *number);
        if number(&slots[0]) != known[0] {
            *known = [0; 4];
        }
        let mut newer = Vec::new();
        for (slot, known) in slots.iter().zip(known) {
            if let Some((number, bytes)) = slot.as_ref().filter(|(number, _)| number != known) {
                *known = *number;
                newer.push(bytes.clone());
            }
        }
        newer
    }

    fn slots(&self) -> MutexGuard<'_, Slots> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Encodes changes until the server stops.
    pub(super) fn encode(&self, session: &Session) {
        let made = self.keep_encoding(session);
        *self.error.lock().unwrap_or_else(PoisonError::into_inner) = made.err().map(|e| e.to_string());
    }

    fn keep_encoding(&self, session: &Session) -> Result<(), RecordError> {
        let mut encoder = LiveEncoder::new(&self.name, &self.id, self.front)?;
        let mut encoded = Encoded::default();
        let (mut serial, mut number) = (0, 0);
        while !self.stopped.load(Ordering::SeqCst) {
            let wait = if self.has_viewers() { POLL_INTERVAL } else { Duration::ZERO };
            let now = session.newer_than(serial, wait);
            if !self.has_viewers() {
                // The slots keep what they hold until there is a viewer.
                std::thread::sleep(POLL_INTERVAL);
                continue;
            }
            serial = now.serial;
            let made = encode(&mut encoder, &mut encoded, &now)?;
            if made.iter().all(Option::is_none) {
                continue;
            }
            let mut slots = self.slots();
            if made[0].is_some() {
                *slots = Slots::default();
            }
            for (slot, bytes) in slots.iter_mut().zip(made) {
                if let Some(bytes) = bytes {
                    number += 1;
                    *slot = Some((number, bytes.into()));
                }
            }
            drop(slots);
            self.newest.send_replace(number);
            std::thread::sleep(ENCODE_INTERVAL);
        }
        Ok(())
    }
}

/// Pins that have views: with more columns, the titles of the views do not fit in a window of 1280 pixels.
const MAX_SHOWN_PINS: usize = 2;

/// The newest pins, which have views.
pub(super) fn shown_pins(snapshot: &Snapshot) -> &[Arc<Pin>] {
    &snapshot.pins[snapshot.pins.len().saturating_sub(MAX_SHOWN_PINS)..]
}

/// Encodes the changes since `encoded`.
fn encode(
    encoder: &mut LiveEncoder,
    encoded: &mut Encoded,
    now: &Snapshot,
) -> Result<[Option<Vec<u8>>; 4], RecordError> {
    let mut made = [None, None, None, None];
    let Some(loaded_scene) = &now.loaded_scene else { return Ok(made) };
    let (generation, scene) = (loaded_scene.generation, &loaded_scene.input.scene);
    let base = Some((generation, shown_pins(now).iter().map(|pin| pin.id).collect()));
    if encoded.base != base {
        let pins = shown_pins(now);
        let levels: Vec<Vec<LevelCount>> =
            pins.iter().map(|pin| LevelCount::all(&pin.segmented.table, &pin.segmented.parts)).collect();
        let pins: Vec<PinnedView<'_>> = (pins.iter().zip(&levels))
            .map(|(pin, levels)| PinnedView {
                body: pin.loaded_scene.input.scene.body.mesh(),
                garment: &pin.loaded_scene.input.scene.garment,
                parts: &pin.segmented.parts,
                levels,
                preview: &pin.preview,
            })
            .collect();
        made[0] = Some(encoder.base(scene.body.mesh(), &scene.garment, &pins)?);
        *encoded = Encoded { base, ..Encoded::default() };
    }
    if let Some(found) = now.segmented.as_ref().filter(|s| s.loaded_scene.generation == generation) {
        let known = encoded.parts.as_ref();
        if !known.is_some_and(|(p, f)| Arc::ptr_eq(p, &found.parts) && Arc::ptr_eq(f, &found.force_n)) {
            let levels = LevelCount::all(&found.table, &found.parts);
            made[1] = Some(encoder.parts(&found.parts.part_of_vertex, &levels, found.parts.len(), &found.force_n)?);
            encoded.parts = Some((Arc::clone(&found.parts), Arc::clone(&found.force_n)));
        }
    }
    let preview = now.preview.as_ref().filter(|p| p.loaded_scene.generation == generation).map(|p| &p.positions);
    let rest = now.rest.as_ref().filter(|r| r.loaded_scene.generation == generation).map(|r| &r.positions);
    for (slot, which, found, known) in
        [(2, LiveShape::Preview, preview, &mut encoded.preview), (3, LiveShape::Rest, rest, &mut encoded.rest)]
    {
        if let Some(found) = found.filter(|found| !known.as_ref().is_some_and(|known| Arc::ptr_eq(known, found))) {
            made[slot] = Some(encoder.shape(which, found)?);
            *known = Some(Arc::clone(found));
        }
    }
    Ok(made)
}
