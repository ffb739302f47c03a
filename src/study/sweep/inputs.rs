//! The files that a sweep names, each read once, and the hashes of their contents.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::PlanError;
use crate::base::files::{MAX_MESH, MAX_TEXT, bounded, bounded_text, names_a_file};
use crate::scene::SceneSpec;

/// A body or garment, built in by name or a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Input {
    /// As written in the sweep file: a built-in name (a garment's with `@vertices`) or a path.
    pub(super) label: String,
    /// The name, or the file's path from where the program runs.
    pub(super) name: String,
    /// Identity of an input: its name, or the hash of the file's contents.
    pub(super) key: String,
}

impl Input {
    /// A built-in body or garment.
    pub(super) fn built_in(label: impl Into<String>) -> Self {
        let label = label.into();
        Self { name: label.clone(), key: label.clone(), label }
    }

    pub(super) fn is_a_file(&self) -> bool {
        self.key != self.name
    }
}

/// Reads the files that a sweep names; paths are relative to the folder of the sweep file.
#[derive(Debug)]
pub(super) struct Inputs {
    folder: PathBuf,
    digests: BTreeMap<PathBuf, String>,
}

impl Inputs {
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), digests: BTreeMap::new() }
    }

    /// A body or garment by its label.
    pub(super) fn input(&mut self, label: &str, place: &str) -> Result<Input, PlanError> {
        if !names_a_file(label) {
            return Ok(Input::built_in(label));
        }
        let path = self.folder.join(label);
        if !self.digests.contains_key(&path) {
            let bytes = bounded(&path, MAX_MESH).map_err(|e| unreadable(&path, place, e))?;
            self.digests.insert(path.clone(), blake3::hash(&bytes).to_hex()[..32].to_owned());
        }
        let digest = &self.digests[&path];
        Ok(Input { label: label.to_owned(), name: path.display().to_string(), key: format!("blake3 {digest}") })
    }

    /// A garment by its label. Its key includes the files that assign fabrics to panels, because they affect the result.
    pub(super) fn garment(&mut self, label: &str, place: &str) -> Result<Input, PlanError> {
        let mut input = self.input(label, place)?;
        for file in SceneSpec::new("", &input.name).files_of_fabrics() {
            // Loading the scene reports a file that cannot be read.
            let bytes = bounded(&file, MAX_TEXT).unwrap_or_default();
            input.key += &format!(" {}", &blake3::hash(&bytes).to_hex()[..32]);
        }
        Ok(input)
    }

    /// A text file by its label.
    pub(super) fn text(&self, label: &str, place: &str) -> Result<String, PlanError> {
        let path = self.folder.join(label);
        bounded_text(&path).map_err(|e| unreadable(&path, place, e))
    }
}

fn unreadable(path: &Path, place: &str, source: std::io::Error) -> PlanError {
    PlanError::Read { place: place.to_owned(), path: path.to_owned(), source }
}
