//! Ctrl-C: the first asks the work in hand to stop and keep what is done, the second ends the program.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);
static KEEPING: AtomicBool = AtomicBool::new(false);

/// Listens from now on. Where no handler can be set, Ctrl-C just ends the program, as it would have.
pub(crate) fn listen() {
    keep();
    listen_at_once();
}

/// Listens from now on, while there is nothing to keep yet: until [`keep`] is called, Ctrl-C ends the program at once.
pub(crate) fn listen_at_once() {
    let _ = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) || !KEEPING.load(Ordering::SeqCst) {
            std::process::exit(130);
        }
        super::console::note("interrupted: keeping what is done (again to quit at once)");
    });
}

/// From now on there is something to keep: work in hand looks at [`requested`].
pub(crate) fn keep() {
    KEEPING.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// The same as a flag that work of its own looks at.
pub(crate) fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Blocks until Ctrl-C.
pub(crate) fn wait() {
    while !requested() {
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
}
