//! A viewer elsewhere that may be slow, silent or gone.
//!
//! Rerun's client waits for ever, when it is dropped too, for a server that accepts a connection and says nothing. Here it
//! lives in a thread of its own that nobody waits for longer than the patience of the caller.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use rerun::external::re_uri::ProxyUri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink, SinkFlushError};

/// How long the last data may take to reach a viewer.
const LAST: Duration = Duration::from_secs(10);

enum Order {
    Send(LogMsg),
    Flush(Duration, Sender<Result<(), String>>),
}

/// A viewer elsewhere.
pub(super) struct Remote {
    orders: Mutex<Option<Sender<Order>>>,
    ended: Mutex<Receiver<()>>,
}

impl Remote {
    /// Begins to connect.
    pub(super) fn new(uri: ProxyUri) -> Self {
        let (orders, taken) = channel();
        let (end, ended) = channel();
        // Left behind where the viewer never answers: it ends with the program.
        thread::spawn(move || {
            let sink = GrpcSink::new(uri);
            for order in taken {
                match order {
                    Order::Send(message) => sink.send(message),
                    Order::Flush(patience, done) => {
                        let _ = done.send(sink.flush_blocking(patience).map_err(|e| e.to_string()));
                    }
                }
            }
            drop(sink);
            let _ = end.send(());
        });
        Self { orders: Mutex::new(Some(orders)), ended: Mutex::new(ended) }
    }

    fn order(&self, order: Order) -> bool {
        let orders = self.orders.lock().unwrap_or_else(PoisonError::into_inner);
        orders.as_ref().is_some_and(|orders| orders.send(order).is_ok())
    }

    /// Sends no more: nobody takes it.
    fn give_up(&self) {
        self.orders.lock().unwrap_or_else(PoisonError::into_inner).take();
    }
}

impl LogSink for Remote {
    fn send(&self, message: LogMsg) {
        self.order(Order::Send(message));
    }

    fn flush_blocking(&self, patience: Duration) -> Result<(), SinkFlushError> {
        // Rerun itself would wait for ever when it changes sinks.
        let patience = patience.min(LAST);
        let (done, answer) = channel();
        if !self.order(Order::Flush(patience, done)) {
            return Err(SinkFlushError::failed("the viewer went away"));
        }
        match answer.recv_timeout(patience) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(reason)) => {
                self.give_up();
                Err(SinkFlushError::failed(reason))
            }
            Err(RecvTimeoutError::Timeout) => {
                // What is left would pile up in memory.
                self.give_up();
                Err(SinkFlushError::Timeout)
            }
            Err(RecvTimeoutError::Disconnected) => Err(SinkFlushError::failed("the viewer went away")),
        }
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        let given_up = self.orders.get_mut().unwrap_or_else(PoisonError::into_inner).take().is_none();
        if !given_up {
            let ended = self.ended.get_mut().unwrap_or_else(PoisonError::into_inner);
            let _ = ended.recv_timeout(LAST);
        }
    }
}
