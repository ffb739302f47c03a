//! The sink that writes a recording to a file.
//!
//! Rerun's own file sink opens its file by name, ends its thread silently when the disk is full, and then blocks its callers.
//! This sink stores the first error, stops writing, and reports the error at the end.

use std::io::Write as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

use crate::base::atomic_file::AtomicFile;

/// A writer of `.rrd` bytes; clones write to the same file.
#[derive(Clone)]
pub(super) struct RrdWriter(Arc<Mutex<State>>);

enum State {
    Open(Box<Encoder<AtomicFile>>),
    /// Writing failed with this error.
    Broken(String),
    Ended,
}

impl RrdWriter {
    pub(super) fn new(to: AtomicFile) -> Result<Self, String> {
        let version = rerun::build_info().version;
        let encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, to);
        Ok(Self(Arc::new(Mutex::new(State::Open(Box::new(encoder.map_err(text)?))))))
    }

    /// The stored error, if writing has failed.
    pub(super) fn check(&self) -> Result<(), String> {
        match &*self.state() {
            State::Broken(reason) => Err(reason.clone()),
            State::Open(_) | State::Ended => Ok(()),
        }
    }

    /// Ends the recording and returns its file.
    pub(super) fn end(&self) -> Result<AtomicFile, String> {
        match std::mem::replace(&mut *self.state(), State::Ended) {
            State::Open(mut encoder) => {
                let finished = encoder.finish().map_err(text);
                // The encoder is consumed even after an error, because dropping it would write the end again.
                let mut to = encoder.into_inner().map_err(text)?;
                finished.and_then(|()| to.flush().map_err(text)).map(|()| to)
            }
            State::Broken(reason) => Err(reason),
            State::Ended => Err("it has already ended".to_owned()),
        }
    }

    /// Ends the recording without writing more.
    pub(super) fn discard(&self) {
        if let State::Open(encoder) = std::mem::replace(&mut *self.state(), State::Ended) {
            let _ = encoder.into_inner();
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn attempt<E: std::fmt::Display>(
        &self,
        act: impl FnOnce(&mut Encoder<AtomicFile>) -> Result<(), E>,
    ) -> Result<(), String> {
        let mut state = self.state();
        match &mut *state {
            State::Open(encoder) => {
                let Err(error) = act(encoder).map_err(text) else { return Ok(()) };
                if let State::Open(encoder) = std::mem::replace(&mut *state, State::Broken(error.clone())) {
                    let _ = encoder.into_inner();
                }
                Err(error)
            }
            State::Broken(reason) => Err(reason.clone()),
            State::Ended => Ok(()),
        }
    }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

impl LogSink for RrdWriter {
    fn send(&self, message: LogMsg) {
        // An error is stored and reported by the next flush and at the end.
        let _ = self.attempt(|encoder| encoder.append(&message).map(|_| ()));
    }

    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        self.attempt(Encoder::flush_blocking).map_err(SinkFlushError::failed)
    }
}
