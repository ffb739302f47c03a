//! What every command that computes needs: threads, references, progress that Ctrl-C is heard beside.

use std::io;
use std::path::{Path, PathBuf};

use crate::base::atomic_file::WholeFile;
use crate::mechanics::refine::Observer;
use crate::study::accuracy::ReferenceCache;

use super::{UserError, console, interrupt};

/// The folder of references: the one given, else the user's.
pub(crate) fn cache(given: Option<&PathBuf>) -> Option<ReferenceCache> {
    given.cloned().map(ReferenceCache::new).or_else(ReferenceCache::in_user_cache)
}

/// More threads than any machine has cores: the system runs out of them before they do any good.
pub(crate) const MOST_THREADS: usize = 1024;

/// Sets the size of the thread pool.
pub(crate) fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    match threads {
        None => Ok(()),
        Some(0) => Err(UserError::new("--threads 0: found 0, expected at least 1; leave it out for one per core")),
        Some(n) if n > MOST_THREADS => Err(UserError::new(format!(
            "--threads {n}: found {n}, expected 1 to {MOST_THREADS}; leave it out for one per core"
        ))),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}

/// Refuses an output that cannot be written, or is an input, before anything is computed.
pub(crate) fn check(path: &Path, flag: &str) -> anyhow::Result<()> {
    WholeFile::check(path).map_err(unwritable(path, flag))
}

/// Writes an output that the user asked for by `flag`.
pub(crate) fn write(path: &Path, text: impl AsRef<[u8]>, flag: &str) -> anyhow::Result<()> {
    WholeFile::write(path, text).map_err(unwritable(path, flag))
}

/// The error of an output that cannot be written; the user can choose another place with `flag`.
pub(crate) fn unwritable<'a>(path: &'a Path, flag: &'a str) -> impl FnOnce(io::Error) -> anyhow::Error + 'a {
    move |e| UserError::new(format!("{}: cannot be written: {e}; choose another place with {flag}", path.display()))
}

/// Makes a folder that was asked for.
pub(crate) fn make_folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).map_err(|e| UserError::new(format!("{}: cannot be made: {e}", path.display())))
}

/// Runs `work` with the solver's progress shown and Ctrl-C heard.
pub(crate) fn refining<T>(what: &str, work: impl FnOnce(Observer<'_>) -> T) -> T {
    interrupt::keep();
    let bar = console::progress(None, what);
    let out = work(&mut |step| {
        bar.set_message(format!("{what}: step {}, residual {:.1e}", step.iteration, step.residual_over_weight));
        interrupt::go_on()
    });
    bar.finish_and_clear();
    out
}
