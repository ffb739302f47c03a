//! The recording's file, written by us.
//!
//! Rerun's own file sink opens its file by name, ends its thread silently when the disk is full, and then blocks whoever
//! waits for it. Here the first failure is kept, nothing more is written, and the end says what it was.

use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::LogMsg;
use rerun::sink::{LogSink, SinkFlushError};

/// A writer of `.rrd` bytes; each clone writes to the same place.
pub(super) struct RrdWriter<W: Write>(Arc<Mutex<State<W>>>);

impl<W: Write> Clone for RrdWriter<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

enum State<W: Write> {
    Open(Box<Encoder<W>>),
    /// Why it is no longer.
    Broken(String),
    Ended,
}

impl<W: Write> RrdWriter<W> {
    pub(super) fn new(to: W) -> Result<Self, String> {
        let version = rerun::build_info().version;
        let encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, to);
        Ok(Self(Arc::new(Mutex::new(State::Open(Box::new(encoder.map_err(text)?))))))
    }

    /// What went wrong, if anything did.
    pub(super) fn check(&self) -> Result<(), String> {
        match &*self.state() {
            State::Broken(reason) => Err(reason.clone()),
            State::Open(_) | State::Ended => Ok(()),
        }
    }

    /// Ends the recording and gives back what it was written to.
    pub(super) fn end(&self) -> Result<W, String> {
        match std::mem::replace(&mut *self.state(), State::Ended) {
            State::Open(mut encoder) => {
                let finished = encoder.finish().map_err(text);
                // Taken out in any case: an encoder that is dropped whole tries to write its end once more.
                let mut to = encoder.into_inner().map_err(text)?;
                finished.and_then(|()| to.flush().map_err(text)).map(|()| to)
            }
            State::Broken(reason) => Err(reason),
            State::Ended => Err("it was ended before".to_owned()),
        }
    }

    /// Ends it as it is: nothing more is written.
    pub(super) fn discard(&self) {
        if let State::Open(encoder) = std::mem::replace(&mut *self.state(), State::Ended) {
            let _ = encoder.into_inner();
        }
    }

    fn state(&self) -> MutexGuard<'_, State<W>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn attempt<E: std::fmt::Display>(&self, act: impl FnOnce(&mut Encoder<W>) -> Result<(), E>) -> Result<(), String> {
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

impl<W: Write + Send + 'static> LogSink for RrdWriter<W> {
    fn send(&self, message: LogMsg) {
        // What went wrong is kept, and told by the next flush and at the end.
        let _ = self.attempt(|encoder| encoder.append(&message).map(|_| ()));
    }

    fn flush_blocking(&self, _: Duration) -> Result<(), SinkFlushError> {
        self.attempt(Encoder::flush_blocking).map_err(SinkFlushError::failed)
    }
}
