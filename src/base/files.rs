//! What a name on the command line or in a file stands for: something built in, or a file.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Most bytes of a text that is read: tables, fabrics, patterns and sweep files have thousands.
pub(crate) const MOST_TEXT: u64 = 64 << 20;

/// Most bytes of a mesh's file: some twenty million vertices as OBJ.
pub(crate) const MOST_MESH: u64 = 2 << 30;

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
pub(crate) fn user_cache(folder: &str) -> Option<PathBuf> {
    Some(directories::ProjectDirs::from("", "", "partwise")?.cache_dir().join(folder))
}

/// Whether a name is that of a file rather than of something built in.
#[must_use]
pub(crate) fn names_a_file(name: &str) -> bool {
    name.contains(['/', '\\', '.'])
}

/// Whether a file's name ends so, in large letters or small; `ending` without its dot.
#[must_use]
pub(crate) fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// A file's name without folder and ending; any other name as it is.
#[must_use]
pub(crate) fn stem(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| name.to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Names in a sentence, the first twenty of many.
#[must_use]
pub(crate) fn listed(names: &[String]) -> String {
    first_of(names, 20)
}

/// Names in a sentence, the first so many of more.
#[must_use]
pub(crate) fn first_of(names: &[String], most: usize) -> String {
    let shown = names[..names.len().min(most)].join(", ");
    match names.len().saturating_sub(most) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Line number, from 1, of a byte offset in a text.
#[must_use]
pub(crate) fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// Reads a text file.
pub(crate) fn read_text(path: &Path) -> Result<String, Unreadable> {
    bounded_text(path).map_err(|e| Unreadable { path: path.to_owned(), reason: e.to_string() })
}

/// The text of a file of at most [`MOST_TEXT`] bytes.
///
/// # Errors
/// As [`bounded`]; or that it is not UTF-8.
pub(crate) fn bounded_text(path: &Path) -> io::Result<String> {
    let utf8 = |e| io::Error::new(io::ErrorKind::InvalidData, format!("found what is no UTF-8 text: {e}"));
    String::from_utf8(bounded(path, MOST_TEXT)?).map_err(|e| utf8(e.utf8_error()))
}

/// The bytes of a file of at most `most`: a device may have no end, and would take all memory.
///
/// # Errors
/// That it cannot be read, or is larger.
pub(crate) fn bounded(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let larger = format!("found more than {} MB, expected no more than that", most >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, larger));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_bound_and_an_endless_one_is_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "four").unwrap();
        assert_eq!(bounded(file.path(), 4).unwrap(), b"four");
        assert_eq!(bounded(file.path(), 3).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        std::fs::write(file.path(), b"a\xff").unwrap();
        assert!(read_text(file.path()).unwrap_err().to_string().contains("no UTF-8 text"));
        #[cfg(unix)]
        assert!(read_text(Path::new("/dev/zero")).unwrap_err().to_string().contains("more than 64 MB"));
    }
}
