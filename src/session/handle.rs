//! The handle through which clients edit a session and read its results.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::edit::{Edit, EditError};
use super::results::Snapshot;
use super::state::SessionState;
use crate::study::job::Job;

/// Called with the serial number of each new result.
type Listener = Arc<dyn Fn(u64) + Send + Sync>;

/// A handle to a session; clones refer to the same session. A method that fails with [`EditError`] leaves the session unchanged.
#[derive(Clone)]
pub struct Session(Arc<Shared>);

struct Shared {
    state: Mutex<SessionState>,
    changed: Condvar,
    /// The newest state's number, which the solver's observers read between two steps without the lock.
    newest: AtomicU64,
    closed: AtomicBool,
    listeners: Mutex<Vec<Listener>>,
}

impl Session {
    /// A session whose state 1 is `job`. A [`Worker`](super::Worker) computes it. With `warm`, later states start from earlier results.
    #[must_use]
    pub fn new(job: Job, warm: bool) -> Self {
        Self(Arc::new(Shared {
            state: Mutex::new(SessionState::new(job, warm)),
            changed: Condvar::new(),
            newest: AtomicU64::new(1),
            closed: AtomicBool::new(false),
            listeners: Mutex::new(Vec::new()),
        }))
    }

    /// Submits an edit and returns the number of the state that it makes; an edit that changes nothing makes none. Edits of one
    /// `gesture`, such as a drag, are a single step for [`undo`](Self::undo).
    pub fn submit(&self, edit: &Edit, gesture: Option<u64>) -> Result<u64, EditError> {
        self.change(|state| {
            let job = edit.applied(&state.snapshot.job)?;
            state.check_fabric(edit, &job)?;
            state.submit(job, gesture)
        })
    }

    /// Submits a whole job, as [`submit`](Self::submit).
    pub(crate) fn submit_job(&self, job: Job) -> Result<u64, EditError> {
        check(&job)?;
        self.change(|state| state.submit(job, None))
    }

    /// Submits a whole job whose files have changed: body and garment are read again.
    pub fn reload(&self, job: Job) -> Result<u64, EditError> {
        check(&job)?;
        self.change(|state| state.reload(job))
    }

    /// Undoes the last edit.
    pub fn undo(&self) -> Result<u64, EditError> {
        self.change(|state| state.step_history(-1))
    }

    /// Redoes the last edit that was undone.
    pub fn redo(&self) -> Result<u64, EditError> {
        self.change(|state| state.step_history(1))
    }

    /// Pins the newest state, so that it is kept beside later ones. Fails before it has a drape, and when too many are pinned.
    pub fn pin(&self, label: Option<String>) -> Result<u64, EditError> {
        self.change(|state| state.pin(label))
    }

    /// Removes a pin; returns whether there was one of this number.
    #[must_use]
    pub fn unpin(&self, id: u64) -> bool {
        self.change(|state| Ok::<_, EditError>(state.unpin(id))).unwrap_or(false)
    }

    /// All results so far.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.lock().snapshot.clone()
    }

    /// All results as soon as there are newer ones than `serial`, or after `timeout`.
    #[must_use]
    pub fn newer_than(&self, serial: u64, timeout: Duration) -> Snapshot {
        let unchanged = |state: &mut SessionState| state.snapshot.serial <= serial && !self.is_closed();
        let waited = self.0.changed.wait_timeout_while(self.lock(), timeout, unchanged);
        waited.unwrap_or_else(PoisonError::into_inner).0.snapshot.clone()
    }

    /// Calls `listener` with the serial number of every new result, on the thread that made it. It must return quickly.
    pub fn listen(&self, listener: impl Fn(u64) + Send + Sync + 'static) {
        self.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::new(listener));
    }

    /// Ends the session: the current computation stops at its next step, and waiting threads wake.
    pub fn close(&self) {
        self.0.closed.store(true, Ordering::SeqCst);
        self.0.changed.notify_all();
        self.notify(u64::MAX);
    }

    /// Whether the session was closed.
    pub(crate) fn is_closed(&self) -> bool {
        self.0.closed.load(Ordering::SeqCst)
    }

    /// Waits while `idle` holds, for a second at most.
    pub(super) fn wait_while(&self, mut idle: impl FnMut(&SessionState) -> bool) {
        let wait = |state: &mut SessionState| idle(state) && !self.is_closed();
        drop(self.0.changed.wait_timeout_while(self.lock(), Duration::from_secs(1), wait));
    }

    /// Whether `state` is no longer the newest.
    pub(super) fn is_superseded(&self, state: u64) -> bool {
        self.0.newest.load(Ordering::SeqCst) != state || self.is_closed()
    }

    /// Waits for a state newer than `state`, for `timeout` at most; returns whether there is one.
    pub(super) fn superseded_within(&self, state: u64, timeout: Duration) -> bool {
        let newest = |_: &mut SessionState| !self.is_superseded(state);
        drop(self.0.changed.wait_timeout_while(self.lock(), timeout, newest));
        self.is_superseded(state)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, SessionState> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state and notifies all waiting threads and listeners.
    fn change<T, E>(&self, change: impl FnOnce(&mut SessionState) -> Result<T, E>) -> Result<T, E> {
        let mut state = self.lock();
        let done = change(&mut state)?;
        state.count_change();
        self.0.newest.store(state.snapshot.state, Ordering::SeqCst);
        let serial = state.snapshot.serial;
        drop(state);
        self.0.changed.notify_all();
        self.notify(serial);
        Ok(done)
    }

    /// Adds a result of state number `of`, if that is still the newest; drops it otherwise.
    pub(super) fn publish(&self, of: u64, add: impl FnOnce(&mut SessionState)) {
        let done = self.change(|state| {
            if state.snapshot.state != of {
                return Err(());
            }
            add(state);
            Ok(())
        });
        done.unwrap_or_default();
    }

    fn notify(&self, serial: u64) {
        // A copy, because a listener may submit an edit, which notifies again.
        let listeners = self.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).clone();
        listeners.iter().for_each(|listener| listener(serial));
    }
}

/// Checks a whole job as far as that is possible without computing it.
fn check(job: &Job) -> Result<(), EditError> {
    job.scene.check_names()?;
    Ok(job.settings.fabric.check("settings.fabric")?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_for_a_newer_state_ends_with_one_and_with_the_session() {
        let session = Session::new(Job::default(), true);
        assert!(!session.superseded_within(1, Duration::ZERO));
        let long = Duration::from_secs(600);
        assert!(session.superseded_within(0, long));
        let other = session.clone();
        let waits = std::thread::spawn(move || other.superseded_within(1, long));
        session.close();
        assert!(waits.join().unwrap());
    }
}
