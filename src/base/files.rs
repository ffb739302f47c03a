//! Reads files: regular ones only, up to a bound, and never one that the same run overwrites.
//!
//! Every read of the crate goes through this module (`clippy.toml` refuses the functions of `std::fs` elsewhere). A pipe or a
//! device is refused before it is opened, because opening a pipe waits for its writer and a device may have no end.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::{self, File, Metadata};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::error_text::shortened;

/// Size limit of text files, bytes; tables, fabrics, patterns and sweep files have some thousands.
pub(crate) const MAX_TEXT: u64 = 64 << 20;

/// Size limit of mesh files, bytes: about twenty million vertices as OBJ.
pub(crate) const MAX_MESH: u64 = 2 << 30;

/// A file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: cannot be read: {reason}")]
#[allow(missing_docs, reason = "the message says what each field is")]
pub struct Unreadable {
    pub path: PathBuf,
    pub reason: String,
}

impl Unreadable {
    /// The failure to read `path`; errors of the file system get a remedy, those of this module contain one.
    #[must_use]
    pub fn new(path: &Path, error: &io::Error) -> Self {
        let remedy = if error.raw_os_error().is_some() { "; check the path and its permissions" } else { "" };
        Self { path: path.to_owned(), reason: format!("{error}{remedy}") }
    }
}

/// Files that the process reads as inputs, and those that it will write.
#[derive(Default)]
struct Claims {
    inputs: BTreeSet<PathBuf>,
    outputs: BTreeSet<PathBuf>,
}

/// The claims so far; `None` if inputs are not protected.
static CLAIMS: Mutex<Option<Claims>> = Mutex::new(None);

/// Protects inputs for the rest of the process, as the command line does without `--force`: a file that is read as an input
/// ([`bounded`]) and is also an output ([`AtomicFile`](crate::base::atomic_file::AtomicFile)) is refused, whichever of the two is tried second.
pub(crate) fn protect_inputs() {
    CLAIMS.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
}

impl Claims {
    /// Registers that `path` is an input.
    fn input(&mut self, path: &Path) -> io::Result<()> {
        refuse(path, &self.outputs)?;
        self.inputs.insert(path.to_owned());
        Ok(())
    }

    /// Registers that `path` is an output.
    fn output(&mut self, path: &Path) -> io::Result<()> {
        refuse(path, &self.inputs)?;
        self.outputs.insert(path.to_owned());
        Ok(())
    }
}

/// Refuses `path` where it is one of `others`.
fn refuse(path: &Path, others: &BTreeSet<PathBuf>) -> io::Result<()> {
    match others.iter().find(|other| same_file(path, other)) {
        None => Ok(()),
        Some(other) => Err(io::Error::other(format!(
            "the run reads and writes this file (as {} too), expected two files; give the output another name, or add --force to \
             overwrite the input",
            other.display()
        ))),
    }
}

/// Applies `what` to the claims of the process.
fn with_claims(what: impl FnOnce(&mut Claims) -> io::Result<()>) -> io::Result<()> {
    CLAIMS.lock().unwrap_or_else(PoisonError::into_inner).as_mut().map_or(Ok(()), what)
}

/// Registers an output before anything is computed for it.
pub(crate) fn claim_output(path: &Path) -> io::Result<()> {
    with_claims(|claims| claims.output(path))
}

/// Refuses to replace an input.
pub(crate) fn refuse_input(path: &Path) -> io::Result<()> {
    with_claims(|claims| refuse(path, &claims.inputs))
}

/// Whether two paths lead to the same file, including links.
fn same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    let identity = |path| {
        use std::os::unix::fs::MetadataExt as _;
        fs::metadata(path).map(|found| (found.dev(), found.ino()))
    };
    #[cfg(not(unix))]
    let identity = fs::canonicalize;
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

/// A folder in the user's cache (`$XDG_CACHE_HOME/partwise`, or under `~/.cache`, on Linux; where the system keeps caches
/// elsewhere); `None` where the user has no home.
pub(crate) fn user_cache(folder: &str) -> Option<PathBuf> {
    Some(directories::ProjectDirs::from("", "", "partwise")?.cache_dir().join(folder))
}

/// Whether a name is that of a file rather than of something built in.
pub(crate) fn names_a_file(name: &str) -> bool {
    name.contains(['/', '\\', '.'])
}

/// Whether the extension of a file is `ending`, ignoring case.
pub(crate) fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// A file's name without folder and ending; any other name as it is.
pub(crate) fn stem(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| name.to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Names in a sentence, the first twenty of many.
pub(crate) fn listed(names: &[String]) -> String {
    first_of(names, 20)
}

/// Names in a sentence: the first `limit`, and the number of the others.
pub(crate) fn first_of(names: &[String], limit: usize) -> String {
    let shown: Vec<Cow<'_, str>> = names.iter().take(limit).map(|name| shortened(name, [60, 20])).collect();
    let shown = shown.join(", ");
    match names.len().saturating_sub(limit) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Line number, from 1, of a byte offset in a text.
pub(crate) fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// Reads an input that is text.
pub(crate) fn read_text(path: &Path) -> Result<String, Unreadable> {
    bounded_text(path).map_err(|e| Unreadable::new(path, &e))
}

/// The text of an input of at most [`MAX_TEXT`] bytes.
///
/// # Errors
/// As [`bounded`], or the text is not UTF-8.
pub(crate) fn bounded_text(path: &Path) -> io::Result<String> {
    let utf8 =
        |e| io::Error::new(io::ErrorKind::InvalidData, format!("found bytes that are not UTF-8: {e}, expected text"));
    String::from_utf8(bounded(path, MAX_TEXT)?).map_err(|e| utf8(e.utf8_error()))
}

/// The bytes of an input of at most `limit` bytes.
///
/// # Errors
/// It cannot be read, is not a regular file, is larger, or is an output of this run ([`protect_inputs`]).
pub(crate) fn bounded(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    with_claims(|claims| claims.input(path))?;
    read(path, limit)
}

/// The bytes of a file that the program writes and reads: rows, points, cached meshes, references.
///
/// # Errors
/// As [`bounded`], but for outputs.
pub(crate) fn read_own(path: &Path) -> io::Result<Vec<u8>> {
    read(path, MAX_MESH)
}

fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let mut bytes = Vec::new();
    // Files in /proc report a length of 0 and are not empty.
    if file.metadata()?.len() <= limit {
        file.take(limit + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 <= limit {
            return Ok(bytes);
        }
    }
    let larger = format!("found more than {} MB, expected no more than that", limit >> 20);
    Err(io::Error::new(io::ErrorKind::FileTooLarge, larger))
}

/// Opens a regular file to read.
///
/// # Errors
/// An error of the file system, or that it is a folder, a pipe or a device.
#[allow(clippy::disallowed_methods, reason = "the only function that opens files to read")]
pub(crate) fn open(path: &Path) -> io::Result<File> {
    regular(&fs::metadata(path)?)?;
    let file = File::open(path)?;
    // Again: another file may have taken the place in between.
    regular(&file.metadata()?)?;
    Ok(file)
}

/// Refuses a folder, a pipe or a device.
pub(crate) fn regular(found: &Metadata) -> io::Result<()> {
    match (found.is_file(), found.is_dir()) {
        (true, _) => Ok(()),
        (_, true) => Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, expected a file")),
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is a pipe or a device, expected a regular file; write what it holds to a file first (the shell's `<(...)` is a \
             pipe, too)",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_bound() {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), "four").unwrap();
        assert_eq!(bounded(file.path(), 4).unwrap(), b"four");
        assert_eq!(bounded(file.path(), 3).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        fs::write(file.path(), b"a\xff").unwrap();
        assert!(read_text(file.path()).unwrap_err().to_string().contains("not UTF-8"));
        // Larger than the memory, and empty: refused by its length.
        file.as_file().set_len(1 << 40).unwrap();
        assert_eq!(read_own(file.path()).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
    }

    #[cfg(unix)]
    #[test]
    fn an_input_is_no_output_and_an_output_no_input_under_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("garment.obj"), "").unwrap();
        fs::write(path("other.obj"), "").unwrap();
        fs::create_dir(path("below")).unwrap();
        std::os::unix::fs::symlink("garment.obj", path("link.obj")).unwrap();
        fs::hard_link(path("garment.obj"), path("below/hard.obj")).unwrap();
        let (mut read, mut written) = (Claims::default(), Claims::default());
        read.input(&path("garment.obj")).unwrap();
        written.output(&path("garment.obj")).unwrap();
        for name in ["garment.obj", "link.obj", "below/hard.obj", "below/../garment.obj"] {
            for refused in [read.output(&path(name)), written.input(&path(name))] {
                let message = refused.unwrap_err().to_string();
                assert!(message.contains("reads and writes") && message.contains("--force"), "{name}: {message}");
            }
            read.input(&path(name)).unwrap();
            written.output(&path(name)).unwrap();
        }
        for name in ["other.obj", "new.obj"] {
            read.output(&path(name)).unwrap();
            written.input(&path(name)).unwrap();
        }
        // Another file under the same name is not the input.
        fs::rename(path("other.obj"), path("link.obj")).unwrap();
        Claims { inputs: [path("garment.obj")].into(), ..Claims::default() }.output(&path("link.obj")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_and_folders_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.obj");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [&*pipe, Path::new("/dev/zero"), folder.path()] {
            let message = read_text(path).unwrap_err().to_string();
            assert!(message.contains("expected a") && message.contains("file"), "{message}");
            assert!(!message.contains("permissions"), "{message}");
        }
        assert!(read_own(&pipe).unwrap_err().to_string().contains("write what it holds to a file first"));
        let missing = read_text(&folder.path().join("none")).unwrap_err().to_string();
        assert!(missing.contains("check the path and its permissions"), "{missing}");
    }
}
