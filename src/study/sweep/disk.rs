//! Crash-safe files of a sweep: atomic replacement, a journal that grows by whole lines, and the lock against concurrent writers.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::StoreError;
use crate::base::atomic_file::AtomicFile;
use crate::base::files::read_own;

/// The target of a journal: a file, or a simulated disk in tests.
pub(crate) trait Append: Send {
    /// Appends the bytes and returns once they are on disk.
    ///
    /// # Errors
    /// An error of the file system; some of the bytes may have been written.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Truncates to this length, bytes.
    fn cut(&mut self, length: u64) -> io::Result<()>;
}

impl Append for File {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.write_all(bytes)?;
        self.sync_data()
    }

    fn cut(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)?;
        self.seek(SeekFrom::Start(length)).map(|_| ())
    }
}

/// Opens a file at its end for appending; creates it if it does not exist.
#[allow(
    clippy::disallowed_methods,
    reason = "opening to read and write does not block on a pipe, and seeking to the end of a pipe fails"
)]
pub(super) fn open_end(path: &Path) -> Result<File, StoreError> {
    let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    let at_end = opened.and_then(|mut file| file.seek(SeekFrom::End(0)).map(|_| file));
    at_end.map_err(StoreError::io(path, "cannot be opened for writing"))
}

/// The contents of the file; `None` if it does not exist.
pub(super) fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>, StoreError> {
    match read_own(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(None),
        Err(error) => Err(StoreError::io(path, "cannot be read")(error)),
    }
}

/// Replaces a file atomically.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    AtomicFile::write(path, bytes).map_err(StoreError::io(path, "cannot be written"))
}

/// Gives the file the contents `text`. If the file only has an incomplete line in excess, it is truncated, which needs no free
/// space; otherwise it is replaced.
pub(super) fn make(path: &Path, text: &[u8]) -> Result<(), StoreError> {
    let found = read_if_there(path)?;
    match found {
        Some(found) if found == text => Ok(()),
        Some(found) if found.starts_with(text) => {
            open_end(path)?.cut(text.len() as u64).map_err(StoreError::io(path, "a torn line cannot be cut off"))
        }
        _ => replace(path, text),
    }
}

/// Wraps the opened file that rows are appended to.
pub(crate) type Medium<'a> = dyn Fn(File) -> Box<dyn Append> + 'a;

/// A file that grows by whole lines only.
pub(super) struct Journal {
    pub(super) path: PathBuf,
    medium: Box<dyn Append>,
    length: u64,
}

impl Journal {
    pub(super) fn open(path: PathBuf, medium: &Medium<'_>) -> Result<Self, StoreError> {
        let file = open_end(&path)?;
        let length = file.metadata().map_err(StoreError::io(&path, "cannot be measured"))?.len();
        Ok(Self { path, medium: medium(file), length })
    }

    /// Appends a line after `kept` rows. On failure the file is truncated to its previous length.
    pub(super) fn append(&mut self, line: &[u8], kept: usize) -> Result<(), StoreError> {
        if let Err(source) = self.medium.append(line) {
            // If truncation fails too, resuming drops the incomplete line.
            let _ = self.medium.cut(self.length);
            return Err(StoreError::Write { path: self.path.clone(), kept, source });
        }
        self.length += line.len() as u64;
        Ok(())
    }
}

/// Takes the lock; the operating system releases it at the end of the process.
pub(super) fn take_lock(path: &Path) -> Result<File, StoreError> {
    let file = open_end(path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked { path: path.to_owned() }),
        Err(TryLockError::Error(error)) => Err(StoreError::io(path, "cannot be locked")(error)),
    }
}
