//! The sink of a remote viewer, with time limits.
//!
//! Rerun's client waits for ever, also when it is dropped, for a server that accepts a connection and does not answer. Here it
//! runs in a separate thread, and every wait for that thread has a time limit.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use rerun::external::re_uri::ProxyUri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink, SinkFlushError};

/// Longest wait for a viewer to take the last data.
const LAST_FLUSH: Duration = Duration::from_secs(10);

/// A request to the thread of the client.
enum Request {
    Send(LogMsg),
    Flush(Duration, Sender<Result<(), String>>),
}

/// A remote viewer.
pub(super) struct Remote {
    requests: Mutex<Option<Sender<Request>>>,
    ended: Mutex<Receiver<()>>,
}

impl Remote {
    /// Starts to connect.
    pub(super) fn new(uri: ProxyUri) -> Self {
        let (requests, received) = channel();
        let (end, ended) = channel();
        // If the viewer never answers, the thread ends with the program.
        thread::spawn(move || {
            let sink = GrpcSink::new(uri);
            for request in received {
                match request {
                    Request::Send(message) => sink.send(message),
                    Request::Flush(timeout, done) => {
                        let _ = done.send(sink.flush_blocking(timeout).map_err(|e| e.to_string()));
                    }
                }
            }
            drop(sink);
            let _ = end.send(());
        });
        Self { requests: Mutex::new(Some(requests)), ended: Mutex::new(ended) }
    }

    fn request(&self, request: Request) -> bool {
        let requests = self.requests.lock().unwrap_or_else(PoisonError::into_inner);
        requests.as_ref().is_some_and(|requests| requests.send(request).is_ok())
    }

    /// Sends no more data.
    fn give_up(&self) {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).take();
    }
}

impl LogSink for Remote {
    fn send(&self, message: LogMsg) {
        self.request(Request::Send(message));
    }

    fn flush_blocking(&self, timeout: Duration) -> Result<(), SinkFlushError> {
        // Rerun passes no limit when it changes sinks.
        let timeout = timeout.min(LAST_FLUSH);
        let (done, answer) = channel();
        if !self.request(Request::Flush(timeout, done)) {
            return Err(SinkFlushError::failed("the viewer was closed"));
        }
        match answer.recv_timeout(timeout) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(reason)) => {
                self.give_up();
                Err(SinkFlushError::failed(reason))
            }
            Err(RecvTimeoutError::Timeout) => {
                // Further data would accumulate in memory.
                self.give_up();
                Err(SinkFlushError::Timeout)
            }
            Err(RecvTimeoutError::Disconnected) => Err(SinkFlushError::failed("the viewer was closed")),
        }
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        let given_up = self.requests.get_mut().unwrap_or_else(PoisonError::into_inner).take().is_none();
        if !given_up {
            let ended = self.ended.get_mut().unwrap_or_else(PoisonError::into_inner);
            let _ = ended.recv_timeout(LAST_FLUSH);
        }
    }
}
