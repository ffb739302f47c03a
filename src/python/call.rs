//! Runs a computation for Python: without the GIL, in a separate pool of threads, until a signal arrives.
//!
//! The global pool of rayon does not survive a fork, and two computations in one pool could wait for each other's locks. Each call
//! therefore takes a pool that no other call uses and returns it afterwards.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::error::{Error, exception};
use crate::base::error_text::panic_text;

/// Interval at which signals are handled. A person does not notice it, and it costs nothing beside a drape.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Idle pools with the process that made them.
static IDLE: Mutex<Vec<(u32, ThreadPool)>> = Mutex::new(Vec::new());

fn take_pool() -> PyResult<ThreadPool> {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    while let Some((owner, pool)) = idle.pop() {
        if owner == process::id() {
            return Ok(pool);
        }
        // The threads of a pool from before a fork do not exist here, so it cannot be shut down either.
        std::mem::forget(pool);
    }
    drop(idle);
    ThreadPoolBuilder::new().build().map_err(|e| exception(&e))
}

fn return_pool(pool: ThreadPool) {
    IDLE.lock().unwrap_or_else(PoisonError::into_inner).push((process::id(), pool));
}

/// The result of `work`, which should end soon once its flag is set. A signal handler that raises (Ctrl-C) sets the flag, and its
/// exception is returned after `work` has ended.
#[allow(clippy::redundant_closure_for_method_calls, reason = "the method alone is not general enough in its lifetime")]
pub(super) fn run<T: Send>(py: Python<'_>, work: impl FnOnce(&AtomicBool) -> PyResult<T> + Send) -> PyResult<T> {
    let pool = take_pool()?;
    let stop = AtomicBool::new(false);
    let (outcome, raised) = py.detach(|| {
        let (done, finished) = mpsc::channel();
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                // The receiver outlives this scope.
                let _ = done.send(catch_unwind(AssertUnwindSafe(|| work(&stop))));
            });
            let mut raised = None;
            loop {
                match finished.recv_timeout(SIGNAL_INTERVAL) {
                    Err(RecvTimeoutError::Timeout) => {
                        if let (None, Err(exception)) = (&raised, Python::attach(|py| py.check_signals())) {
                            stop.store(true, Ordering::SeqCst);
                            raised = Some(exception);
                        }
                    }
                    outcome => return (outcome, raised),
                }
            }
        })
    });
    return_pool(pool);
    // A signal during the last interval.
    py.check_signals()?;
    match (raised, outcome) {
        (Some(exception), _) => Err(exception),
        (None, Ok(Ok(result))) => result,
        (None, Ok(Err(panic))) => {
            let text = panic_text(panic.as_ref());
            Err(Error::new_err(format!("the computation panicked: {text}; please report it with its inputs")))
        }
        (None, Err(_)) => {
            Err(Error::new_err("the computation ended without a result; please report it with its inputs"))
        }
    }
}

/// Panics, for the test that a panic becomes an exception.
#[pyfunction]
#[allow(clippy::panic, reason = "its purpose")]
pub(super) fn panics(py: Python<'_>) -> PyResult<()> {
    run(py, |_| panic!("as requested"))
}
