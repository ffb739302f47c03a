//! Atomic writes: a file appears complete or not at all. No other module writes or renames files.
//!
//! The contents are written to a temporary file in the same folder under a random name (created with `O_EXCL`, so that it cannot exist
//! already) and renamed when complete. A symbolic link is followed and kept; its target is replaced. A device or a
//! pipe is written directly, because a rename would replace it by a regular file.
//!
//! If inputs are protected (`protect_inputs`), a file that the process has read as an input is not replaced. Code that exits the
//! process without dropping values calls `abandon_all` first.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use super::files;

/// The temporary files of all threads.
static TEMPORARY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn temporary() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes all temporary files before the process exits without dropping values. The lock stays taken, so that later writes block
/// until the exit.
pub(crate) fn abandon_all() {
    let temporary = temporary();
    for path in &*temporary {
        // On failure the hidden file stays, as after a power cut.
        let _ = fs::remove_file(path);
    }
    std::mem::forget(temporary);
}

/// A temporary file, listed in [`TEMPORARY`] while it exists.
#[derive(Debug)]
struct Temporary(Option<TempPath>);

impl Temporary {
    fn create(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> io::Result<(File, Self)> {
        let mut temporary = temporary();
        let (file, path) = builder.tempfile_in(folder)?.into_parts();
        temporary.insert(path.to_path_buf());
        Ok((file, Self(Some(path))))
    }

    /// Renames the file to `target`, or removes it on failure.
    fn persist(mut self, target: &Path) -> io::Result<()> {
        let Some(path) = self.0.take() else { return Ok(()) };
        let mut temporary = temporary();
        temporary.remove::<Path>(&path);
        Ok(path.persist(target)?)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(path) = self.0.take() {
            temporary().remove::<Path>(&path);
        }
    }
}

/// Largest number of symbolic links to follow; a longer chain is reported as a cycle. This is the limit of Linux.
const MAX_LINKS: usize = 40;

/// A file that is being written. Dropping it before [`finish`](Self::finish) removes the temporary file and leaves an existing file
/// unchanged.
#[derive(Debug)]
pub(crate) struct AtomicFile {
    path: PathBuf,
    writer: BufWriter<File>,
    /// The temporary file; `None` for a device or a pipe.
    temporary: Option<Temporary>,
}

impl AtomicFile {
    /// Starts to write the file `path`.
    ///
    /// # Errors
    /// The folder is missing or not writable; the path is a folder, a cycle of symbolic links or a protected input.
    pub(crate) fn create(path: impl AsRef<Path>) -> io::Result<Self> {
        let path = follow_links(path.as_ref())?;
        let found = fs::metadata(&path).ok();
        if found.as_ref().is_some_and(fs::Metadata::is_dir) {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, expected a file name"));
        }
        files::refuse_input(&path)?;
        if found.as_ref().is_some_and(|found| !found.is_file()) {
            #[allow(clippy::disallowed_methods, reason = "a device or a pipe is written directly")]
            let device = OpenOptions::new().write(true).open(&path)?;
            return Ok(Self { path, writer: BufWriter::new(device), temporary: None });
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".partwise-").suffix(".part");
        // A new file gets the usual permissions less the umask; a replaced file keeps its permissions.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let (file, temporary) = Temporary::create(&builder, folder_of(&path))?;
        if let Some(found) = found {
            file.set_permissions(found.permissions())?;
        }
        Ok(Self { path, writer: BufWriter::new(file), temporary: Some(temporary) })
    }

    /// Checks that `path` can be written, and marks it as an output, which is not read as an input from then on. Devices and pipes
    /// are not checked.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub(crate) fn check(path: impl AsRef<Path>) -> io::Result<()> {
        let path = path.as_ref();
        let found = fs::metadata(path);
        if found.is_ok_and(|found| !found.is_file() && !found.is_dir()) {
            return Ok(());
        }
        Self::create(path)?;
        files::claim_output(path)
    }

    /// Writes the file `path` with the contents `bytes`.
    ///
    /// # Errors
    /// An error of the file system; the file `path` is unchanged then.
    pub(crate) fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        let mut file = Self::create(path)?;
        file.write_all(bytes.as_ref())?;
        file.finish().map(|_| ())
    }

    /// Flushes the file to disk and renames it to its path; returns its length in bytes.
    ///
    /// # Errors
    /// An error of the file system; an existing file is unchanged then.
    pub(crate) fn finish(self) -> io::Result<u64> {
        let file = self.writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        // A device has no length, and many cannot be synced.
        let Some(temporary) = self.temporary else { return Ok(0) };
        file.sync_all()?;
        let length = file.metadata()?.len();
        drop(file);
        temporary.persist(&self.path)?;
        sync_folder(&self.path);
        Ok(length)
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Whether two paths, after following links, name the same file; writing one would replace the other.
pub(crate) fn same_place(a: &Path, b: &Path) -> bool {
    let resolved = |path: &Path| {
        let path = follow_links(path).ok()?;
        // Compares folder and file name, because the file may not exist yet.
        let folder = folder_of(&path);
        let folder = fs::canonicalize(folder).or_else(|_| std::path::absolute(folder)).ok()?;
        Some(folder.join(path.file_name()?))
    };
    let device = |path: &Path| fs::metadata(path).is_ok_and(|found| !found.is_file());
    !device(a) && !device(b) && resolved(a).is_some_and(|a| resolved(b) == Some(a))
}

/// Follows the symbolic links of a path; the target need not exist.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        // Links to devices and pipes are kept: the target of `/dev/stdout` is not a readable path.
        if fs::metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Ok(path);
        }
        match fs::read_link(&path) {
            Ok(target) => path = folder_of(&path).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("it is a circle of symbolic links, expected a file name"))
}

/// The folder that contains `path`.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes a rename durable against power loss on systems that can open a folder.
#[allow(clippy::disallowed_methods, reason = "opens a folder and reads nothing")]
fn sync_folder(path: &Path) {
    if let Ok(folder) = File::open(folder_of(path)) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &tempfile::TempDir) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn an_unfinished_file_leaves_the_existing_file_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        AtomicFile::write(&path, "old").unwrap();
        let mut file = AtomicFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(&folder), ["a.obj"]);
        AtomicFile::write(&path, "new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(&folder), ["a.obj"]);
    }

    #[test]
    fn a_folder_or_a_missing_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(AtomicFile::write(folder.path(), "x").is_err());
        assert!(AtomicFile::write(folder.path().join("no/such/a.obj"), "x").is_err());
        assert!(names(&folder).is_empty());
    }

    #[test]
    fn concurrent_writers_of_one_path_do_not_share_a_temporary_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let (mut one, mut other) = (AtomicFile::create(&path).unwrap(), AtomicFile::create(&path).unwrap());
        one.write_all(b"one").unwrap();
        other.write_all(b"the other").unwrap();
        assert_eq!(one.finish().unwrap(), 3);
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert_eq!(other.finish().unwrap(), 9);
        assert_eq!(fs::read(&path).unwrap(), b"the other");
        assert_eq!(names(&folder), ["a"]);
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_are_kept_and_their_targets_replaced() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("elsewhere")).unwrap();
        let [link, chain, target] = ["link", "chain", "elsewhere/target"].map(|name| folder.path().join(name));
        symlink("elsewhere/target", &link).unwrap();
        symlink(&link, &chain).unwrap();
        // First without an existing file, then over one.
        for text in ["first", "second"] {
            AtomicFile::write(&chain, text).unwrap();
            assert_eq!(fs::read_to_string(&target).unwrap(), text);
            assert!(link.is_symlink() && chain.is_symlink() && !target.is_symlink());
            fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        }
        AtomicFile::write(&chain, "third").unwrap();
        assert_eq!(target.metadata().unwrap().permissions().mode() & 0o777, 0o640);
        assert!(same_place(&link, &target) && same_place(&chain, &link));
        assert!(!same_place(&link, &folder.path().join("target")));
        symlink("round", folder.path().join("round")).unwrap();
        assert!(AtomicFile::write(folder.path().join("round"), "x").is_err());
        // A link under a predictable temporary name is not followed.
        symlink(&target, folder.path().join("a.obj.part")).unwrap();
        AtomicFile::write(folder.path().join("a.obj"), "mine").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "third");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_and_pipes_are_written_directly() {
        use std::os::unix::fs::FileTypeExt as _;
        AtomicFile::write("/dev/null", "x").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        let full = AtomicFile::write("/dev/full", "x").unwrap_err();
        assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        assert!(fs::metadata("/dev/full").unwrap().file_type().is_char_device());
        assert!(!same_place(Path::new("/dev/null"), Path::new("/dev/null")), "a device accepts several writers");
    }
}
