//! Ctrl-C: the first asks the work in hand to stop and keep what is done, the second ends the program.

use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// One press that comes twice: `timeout` and its like signal the program and then all of its group.
const ONE_PRESS: Duration = Duration::from_millis(300);

static REQUESTED: AtomicBool = AtomicBool::new(false);
static KEEPING: AtomicBool = AtomicBool::new(false);
static FIRST: OnceLock<Instant> = OnceLock::new();

/// Listens from now on, while there is nothing to keep yet: until [`keep`] is called, Ctrl-C ends the program at once, and leaves no
/// file half written. Where no handler can be set, Ctrl-C just ends the program, as it would have.
pub(crate) fn listen() {
    let _ = ctrlc::set_handler(|| {
        let since = FIRST.get_or_init(Instant::now).elapsed();
        let again = REQUESTED.swap(true, Ordering::SeqCst);
        if !KEEPING.load(Ordering::SeqCst) || (again && since > ONE_PRESS) {
            crate::base::atomic_file::abandon_all();
            std::process::exit(130);
        }
        if !again {
            super::console::note("interrupted: keeping what is done (again to quit at once)");
        }
    });
}

/// Makes a write beyond `ulimit -f` an error, as on a full disk. Its signal would end the program, with files in the making left behind.
pub(crate) fn outlive_file_limits() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        /// Its number on Linux (but for MIPS), macOS and the BSDs.
        const SIGXFSZ: i32 = 25;
        // Tokio's handler stays for good, whether or not anybody listens.
        if let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() {
            let _ = runtime.block_on(async { signal(SignalKind::from_raw(SIGXFSZ)) });
        }
    }
}

/// From now on there is something to keep: work in hand looks at [`requested`].
pub(crate) fn keep() {
    KEEPING.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// The same, as whoever takes step by step is told.
pub(crate) fn go_on() -> ControlFlow<()> {
    if requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// The same as a flag that work of its own looks at.
pub(crate) fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Blocks until Ctrl-C.
pub(crate) fn wait() {
    while !requested() {
        std::thread::sleep(Duration::from_millis(100));
    }
}
