//! Waits for files to change on disk, for `--watch`.
//!
//! Editors replace a file as often as they write it, so the folders are watched and the files' contents compared: a save
//! that changes nothing wakes nobody.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::Context as _;
use notify::{RecursiveMode, Watcher as _};
use partwise::whole_file::folder_of;

use super::interrupt;

/// How often Ctrl-C is looked at while nothing happens.
const GLANCE: Duration = Duration::from_millis(100);
/// An editor's burst of events is over after this long a silence.
const SETTLE: Duration = Duration::from_millis(120);

/// Some files and what was last read in them.
pub(crate) struct FileWatch {
    _watcher: notify::RecommendedWatcher,
    events: Receiver<notify::Result<notify::Event>>,
    files: Vec<(PathBuf, Option<blake3::Hash>)>,
}

impl FileWatch {
    /// Starts watching `files`.
    pub(crate) fn new(files: Vec<PathBuf>) -> anyhow::Result<Self> {
        let (sender, events) = channel();
        let mut watcher = notify::recommended_watcher(sender).context("cannot watch files on this system")?;
        let mut folders: Vec<&Path> = files.iter().map(|f| folder_of(f)).collect();
        folders.sort();
        folders.dedup();
        for folder in folders {
            watcher
                .watch(folder, RecursiveMode::NonRecursive)
                .with_context(|| format!("cannot watch the folder {}", folder.display()))?;
        }
        let files = files.into_iter().map(|f| (fingerprint(&f), f)).map(|(h, f)| (f, h)).collect();
        Ok(Self { _watcher: watcher, events, files })
    }

    /// Blocks until the contents of at least one file changed, and names them; `None` after Ctrl-C.
    pub(crate) fn changed(&mut self) -> Option<Vec<PathBuf>> {
        loop {
            match self.events.recv_timeout(GLANCE) {
                Ok(_) => {
                    while self.events.recv_timeout(SETTLE).is_ok() {}
                    let changed = self.compare();
                    if !changed.is_empty() {
                        return Some(changed);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
            if interrupt::requested() {
                return None;
            }
        }
    }

    fn compare(&mut self) -> Vec<PathBuf> {
        let mut changed = Vec::new();
        for (file, known) in &mut self.files {
            let now = fingerprint(file);
            if now != *known {
                *known = now;
                changed.push(file.clone());
            }
        }
        changed
    }
}

/// What is in the file now; `None` while it is away, between an editor's delete and rename.
fn fingerprint(file: &Path) -> Option<blake3::Hash> {
    std::fs::read(file).ok().map(|bytes| blake3::hash(&bytes))
}
