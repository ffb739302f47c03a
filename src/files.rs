//! What a name on the command line or in a file stands for: something built in, or a file.

use std::path::{Path, PathBuf};

/// A file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: cannot be read: {reason}; check the path and its permissions")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub struct Unreadable {
    pub path: PathBuf,
    pub reason: String,
}

/// A folder in the user's cache (`$XDG_CACHE_HOME/partwise`, or under `~/.cache`, on Linux; where the system keeps caches
/// elsewhere); `None` where the user has no home.
#[must_use]
pub fn user_cache(folder: &str) -> Option<PathBuf> {
    Some(directories::ProjectDirs::from("", "", "partwise")?.cache_dir().join(folder))
}

/// Whether a name is that of a file rather than of something built in.
#[must_use]
pub fn names_a_file(name: &str) -> bool {
    name.contains(['/', '\\', '.'])
}

/// Whether a file's name ends so, in large letters or small; `ending` without its dot.
#[must_use]
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// A file's name without folder and ending; any other name as it is.
#[must_use]
pub fn stem(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| name.to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Names in a sentence, the first twenty of many.
#[must_use]
pub fn listed(names: &[String]) -> String {
    first_of(names, 20)
}

/// Names in a sentence, the first so many of more.
#[must_use]
pub fn first_of(names: &[String], most: usize) -> String {
    let shown = names[..names.len().min(most)].join(", ");
    match names.len().saturating_sub(most) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Line number, from 1, of a byte offset in a text.
#[must_use]
pub fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// Reads a text file.
pub fn read_text(path: &Path) -> Result<String, Unreadable> {
    std::fs::read_to_string(path).map_err(|e| Unreadable { path: path.to_owned(), reason: e.to_string() })
}
