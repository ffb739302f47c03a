//! The files a sweep names, read once each, and their contents' hashes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::choice::Input;
use super::error::PlanError;

/// Reader of the files a sweep names; paths count from the folder of the sweep file.
#[derive(Debug)]
pub(super) struct Inputs {
    folder: PathBuf,
    digests: BTreeMap<PathBuf, String>,
}

impl Inputs {
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), digests: BTreeMap::new() }
    }

    /// Whether an argument names a file rather than something built in.
    pub(super) fn names_a_file(argument: &str) -> bool {
        argument.contains(['/', '\\', '.'])
    }

    /// A body, garment or fabric as written.
    pub(super) fn input(&mut self, label: &str, place: &str) -> Result<Input, PlanError> {
        if !Self::names_a_file(label) {
            return Ok(Input::built_in(label));
        }
        let path = self.folder.join(label);
        let digest = match self.digests.get(&path) {
            Some(digest) => digest.clone(),
            None => {
                let bytes = fs::read(&path).map_err(|e| unreadable(&path, place, e))?;
                let digest = blake3::hash(&bytes).to_hex()[..32].to_owned();
                self.digests.insert(path.clone(), digest.clone());
                digest
            }
        };
        Ok(Input { label: label.to_owned(), file: Some(path), digest: Some(digest) })
    }

    /// A text file as written.
    pub(super) fn text(&self, label: &str, place: &str) -> Result<String, PlanError> {
        let path = self.folder.join(label);
        fs::read_to_string(&path).map_err(|e| unreadable(&path, place, e))
    }
}

fn unreadable(path: &Path, place: &str, source: std::io::Error) -> PlanError {
    PlanError::Read { place: place.to_owned(), path: path.to_owned(), source }
}
