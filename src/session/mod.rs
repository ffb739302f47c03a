//! A session: one owner of the scene, to whom everybody who steers hands edits.
//!
//! Every accepted edit makes a **state** with a number. Of a state, PARTs and forces are known when [`Session::submit`]
//! returns; the [`Workshop`], on a thread of its own, then goes on with the newest state alone, in pieces short enough that
//! the next edit need not wait, and each result says which state it belongs to:
//!
//! | an edit of | computes anew | keeps |
//! |---|---|---|
//! | the table, extents, the gap rule | PARTs, stage two | body, garment, distances, cloth, the drape at rest |
//! | the fabric | cloth, stage two, the drape at rest unless it was in that fabric before | body, garment, distances, PARTs |
//! | a measurement, the garment | all | nothing |
//!
//! **Warm starts.** Stage two first goes on from the preview before, which takes a few steps ([`Preview::warm`]), and the drape at rest
//! begins at the one before. Where a cloth rests does not depend on the range table, so an edit of the table leaves it, and the last few fabrics
//! of a garment hang as they did when one goes back to them ([`AtRest::kept`]). At the end the
//! two stages are computed from the undraped garment, as `run` does it: that is what the figures tell. Without warm starts all of it
//! is as `run` does it, bit for bit.
//!
//! An edit that cannot be is refused with a sentence, at once or when it turns out, and the last good state stands.
//! No socket, no viewer and no file is known here. Limits: measurements and another garment begin cold, as their meshes differ.

mod edit;
mod history;
mod pins;
mod presets;
mod results;
mod state;
mod worker;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

pub use edit::{Edit, EditError, FabricEdit, TableEdit};
pub use presets::preset_names;
pub use results::{AtRest, Finished, LoadedScene, Pin, Preview, Refusal, Segmented, Snapshot, TrailPoint};
use state::Desk;
pub use worker::Workshop;

use crate::study::job::Job;

/// Called with the serial number of what became known.
type Listener = Arc<dyn Fn(u64) + Send + Sync>;

/// A handle to the session; clones are the same session. What cannot be done fails with [`EditError`], and leaves the session as it was.
#[derive(Clone)]
pub struct Session(Arc<Shared>);

struct Shared {
    desk: Mutex<Desk>,
    changed: Condvar,
    /// The newest state, for those who look between two steps.
    newest: AtomicU64,
    closed: AtomicBool,
    listeners: Mutex<Vec<Listener>>,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("state", &self.0.newest.load(Ordering::SeqCst)).finish_non_exhaustive()
    }
}

impl Session {
    /// A session that begins with `job` as state 1; nothing is computed before a [`Workshop`] works for it.
    #[must_use]
    pub fn new(job: Job, warm: bool) -> Self {
        Self(Arc::new(Shared {
            desk: Mutex::new(Desk::new(job, warm)),
            changed: Condvar::new(),
            newest: AtomicU64::new(1),
            closed: AtomicBool::new(false),
            listeners: Mutex::new(Vec::new()),
        }))
    }

    /// Hands in an edit and returns the number of the state it makes; one that changes nothing makes none. Edits of one
    /// `gesture`, a drag, are one step for [`undo`](Self::undo).
    pub fn submit(&self, edit: &Edit, gesture: Option<u64>) -> Result<u64, EditError> {
        self.change(|desk| {
            let job = edit.applied(&desk.view.job)?;
            desk.check_fabric(edit, &job)?;
            desk.take(job, gesture)
        })
    }

    /// Hands in a whole job, as [`submit`](Self::submit).
    pub(crate) fn submit_job(&self, job: Job) -> Result<u64, EditError> {
        check(&job)?;
        self.change(|desk| desk.take(job, None))
    }

    /// Hands in a whole job whose files hold something else than before: body and garment are read again.
    pub fn reload(&self, job: Job) -> Result<u64, EditError> {
        check(&job)?;
        self.change(|desk| desk.take_anew(job))
    }

    /// Takes the last step back, where there is one.
    pub fn undo(&self) -> Result<u64, EditError> {
        self.change(|desk| desk.go(-1))
    }

    /// Takes a step on that was taken back, where there is one.
    pub fn redo(&self) -> Result<u64, EditError> {
        self.change(|desk| desk.go(1))
    }

    /// Keeps the newest state beside those after it, where there is a drape of it already and not enough is pinned.
    pub fn pin(&self, label: Option<String>) -> Result<u64, EditError> {
        self.change(|desk| desk.pin(label))
    }

    /// Lets a pinned state go; whether there was one of this number.
    #[must_use]
    pub fn unpin(&self, id: u64) -> bool {
        self.change(|desk| Ok::<_, EditError>(desk.unpin(id))).unwrap_or(false)
    }

    /// All that is known now.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.desk().view.clone()
    }

    /// All that is known once more is than at `serial`, or after `at_most`.
    #[must_use]
    pub fn newer_than(&self, serial: u64, at_most: Duration) -> Snapshot {
        let known = |desk: &mut Desk| desk.view.serial <= serial && !self.is_closed();
        let waited = self.0.changed.wait_timeout_while(self.desk(), at_most, known);
        waited.unwrap_or_else(PoisonError::into_inner).0.view.clone()
    }

    /// Has `listener` called with its serial number whenever something became known, on the thread that found it; it must be
    /// quick.
    pub fn listen(&self, listener: impl Fn(u64) + Send + Sync + 'static) {
        self.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::new(listener));
    }

    /// Ends the session: work in hand stops at its next step, and whoever waits is woken.
    pub fn close(&self) {
        self.0.closed.store(true, Ordering::SeqCst);
        self.0.changed.notify_all();
        self.tell(u64::MAX);
    }

    /// Whether it was ended.
    #[must_use]
    pub(crate) fn is_closed(&self) -> bool {
        self.0.closed.load(Ordering::SeqCst)
    }

    /// Works until the session is closed; one thread is to do so.
    pub fn work(&self, workshop: &mut Workshop) {
        while !self.is_closed() {
            if !workshop.advance(self) {
                let idle = |desk: &mut Desk| !workshop.is_due(desk) && !self.is_closed();
                drop(self.0.changed.wait_timeout_while(self.desk(), Duration::from_secs(1), idle));
            }
        }
    }

    /// Whether work for `state` is no longer wanted.
    fn overtaken(&self, state: u64) -> bool {
        self.0.newest.load(Ordering::SeqCst) != state || self.is_closed()
    }

    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.0.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is known, and tells everybody.
    fn change<T, E>(&self, change: impl FnOnce(&mut Desk) -> Result<T, E>) -> Result<T, E> {
        let mut desk = self.desk();
        let done = change(&mut desk)?;
        desk.view.serial += 1;
        (desk.view.undo, desk.view.redo) = desk.history.depth();
        self.0.newest.store(desk.view.state, Ordering::SeqCst);
        let serial = desk.view.serial;
        drop(desk);
        self.0.changed.notify_all();
        self.tell(serial);
        Ok(done)
    }

    /// Makes something known of `state`, if it is still the newest.
    fn publish(&self, state: u64, add: impl FnOnce(&mut Desk)) {
        let done = self.change(|desk| {
            if desk.view.state != state {
                return Err(());
            }
            add(desk);
            Ok(())
        });
        // What nobody wants any more is dropped.
        done.unwrap_or_default();
    }

    fn tell(&self, serial: u64) {
        // A listener may hand in an edit, and tell others in turn.
        let listeners = self.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).clone();
        listeners.iter().for_each(|listener| listener(serial));
    }
}

/// Whether a whole job can be used, as far as can be told before it is tried.
fn check(job: &Job) -> Result<(), EditError> {
    job.scene.check_names()?;
    Ok(job.settings.fabric.check("settings.fabric")?)
}
