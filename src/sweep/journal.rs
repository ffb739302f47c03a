//! A file that grows by whole lines, and the lock that keeps others off it.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use super::{Append, StoreError, disk};

/// Makes the media rows are appended to from opened files.
pub type Medium<'a> = dyn Fn(File) -> Box<dyn Append> + 'a;

/// A file that grows by whole lines.
pub(super) struct Journal {
    pub(super) path: PathBuf,
    medium: Box<dyn Append>,
    length: u64,
}

impl Journal {
    pub(super) fn open(path: PathBuf, medium: &Medium<'_>) -> Result<Self, StoreError> {
        let file = disk::open_end(&path)?;
        let length = file.metadata().map_err(StoreError::io(&path, "cannot be measured"))?.len();
        Ok(Self { path, medium: medium(file), length })
    }

    /// Appends a line after `kept` rows; what was written of it is cut off again if it fails.
    pub(super) fn append(&mut self, line: &[u8], kept: usize) -> Result<(), StoreError> {
        if let Err(source) = self.medium.append(line) {
            // What was written of the line is cut off again; where even that fails, resume drops it.
            let _ = self.medium.cut(self.length);
            return Err(StoreError::Write { path: self.path.clone(), kept, source });
        }
        self.length += line.len() as u64;
        Ok(())
    }
}

/// Takes the lock; the system lets go of it with the process.
pub(super) fn take_lock(path: &Path) -> Result<File, StoreError> {
    let file = disk::open_end(path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::Locked { path: path.to_owned() }),
        Err(TryLockError::Error(error)) => Err(StoreError::io(path, "cannot be locked")(error)),
    }
}
