//! A file that is there whole or not at all: the one place that writes and renames.
//!
//! Where inputs are protected (`protect_inputs`), a file that the process has read as an input is not replaced.
//!
//! What is written grows beside its place under a random name that nobody can have planted (created with `O_EXCL`), and
//! takes the place when it is complete. A symbolic link is followed and stays: the file it points at is replaced. What
//! is no regular file, a device or a pipe, is written straight to, as a rename would put a file where it was. Whoever ends the
//! program while files are in the making calls `abandon_all` first.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::TempPath;

use super::files;

/// Where files grow, of all threads.
static GROWING: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn growing() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    GROWING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes every file in the making, for a program that ends at once and drops nothing. From then on no file begins or gets its place:
/// whoever tries waits for the end.
pub(crate) fn abandon_all() {
    let growing = growing();
    for path in &*growing {
        // What cannot be removed stays under its hidden name, as it would after a power cut.
        let _ = fs::remove_file(path);
    }
    std::mem::forget(growing);
}

/// A file beside its place, known to be there as long as it is.
#[derive(Debug)]
struct Beside(Option<TempPath>);

impl Beside {
    fn begin(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> io::Result<(File, Self)> {
        let mut growing = growing();
        let (file, path) = builder.tempfile_in(folder)?.into_parts();
        growing.insert(path.to_path_buf());
        Ok((file, Self(Some(path))))
    }

    /// Takes its place, whole, or is removed.
    fn take_place(mut self, place: &Path) -> io::Result<()> {
        let Some(path) = self.0.take() else { return Ok(()) };
        let mut growing = growing();
        growing.remove::<Path>(&path);
        Ok(path.persist(place)?)
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if let Some(path) = self.0.take() {
            growing().remove::<Path>(&path);
        }
    }
}

/// Links to follow before a chain of them is taken for a circle: the system's own limit.
const MOST_LINKS: usize = 40;

/// A file in the making. Dropped before [`finish`](Self::finish), it removes what it wrote and leaves an older file as
/// it was.
#[derive(Debug)]
pub(crate) struct WholeFile {
    path: PathBuf,
    writer: BufWriter<File>,
    /// Where it grows; none for a device or a pipe.
    beside: Option<Beside>,
}

impl WholeFile {
    /// Begins a file that will be called `path`.
    ///
    /// # Errors
    /// What the system says where the folder is missing or not writable, where the path is a folder or a circle of
    /// links.
    pub(crate) fn create(path: impl AsRef<Path>) -> io::Result<Self> {
        let path = place(path.as_ref())?;
        let found = fs::metadata(&path).ok();
        if found.as_ref().is_some_and(fs::Metadata::is_dir) {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, expected a file name"));
        }
        files::refuse_input(&path)?;
        if found.as_ref().is_some_and(|found| !found.is_file()) {
            #[allow(clippy::disallowed_methods, reason = "a device or a pipe, which is written straight to")]
            let device = OpenOptions::new().write(true).open(&path)?;
            return Ok(Self { path, writer: BufWriter::new(device), beside: None });
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".partwise-").suffix(".part");
        // A new file is as readable as any other, less the user's umask; a replaced one keeps its permissions.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let (file, beside) = Beside::begin(&builder, folder_of(&path))?;
        if let Some(found) = found {
            file.set_permissions(found.permissions())?;
        }
        Ok(Self { path, writer: BufWriter::new(file), beside: Some(beside) })
    }

    /// Whether a file could begin at `path`; what is no plain file, a pipe or a device, is not tried. From then on `path` is an output, and
    /// not read as an input.
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

    /// Writes `bytes` as the whole of `path`.
    ///
    /// # Errors
    /// What the system says; `path` is then as it was.
    pub(crate) fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> io::Result<()> {
        let mut file = Self::create(path)?;
        file.write_all(bytes.as_ref())?;
        file.finish().map(|_| ())
    }

    /// Puts the file in its place, on the disk and not only on its way there; returns its length in bytes.
    ///
    /// # Errors
    /// What the system says; the place is then as it was.
    pub(crate) fn finish(self) -> io::Result<u64> {
        let file = self.writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        // A device has no length, and many cannot be synced.
        let Some(beside) = self.beside else { return Ok(0) };
        file.sync_all()?;
        let length = file.metadata()?.len();
        drop(file);
        beside.take_place(&self.path)?;
        sync_folder(&self.path);
        Ok(length)
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Whether two paths are one place, links followed: what is written to the one would replace the other.
#[must_use]
pub(crate) fn same_place(a: &Path, b: &Path) -> bool {
    let known = |path: &Path| {
        let path = place(path).ok()?;
        // The folder is there even where the file is not yet; a device may have several names in it.
        let folder = folder_of(&path);
        let folder = fs::canonicalize(folder).or_else(|_| std::path::absolute(folder)).ok()?;
        Some(folder.join(path.file_name()?))
    };
    let device = |path: &Path| fs::metadata(path).is_ok_and(|found| !found.is_file());
    !device(a) && !device(b) && known(a).is_some_and(|a| known(b) == Some(a))
}

/// Where a path leads, whether or not there is anything.
fn place(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        // Links to what is there are the system's to follow: those of `/dev/stdout` have no readable target.
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

/// The folder a path lies in.
#[must_use]
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes a rename last through a power cut where the system can (a folder cannot be opened everywhere).
#[allow(clippy::disallowed_methods, reason = "a folder, of which nothing is read")]
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
    fn an_unfinished_file_leaves_the_old_one_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        WholeFile::write(&path, "old").unwrap();
        let mut file = WholeFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(&folder), ["a.obj"]);
        WholeFile::write(&path, "new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(&folder), ["a.obj"]);
    }

    #[test]
    fn a_folder_or_a_missing_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(WholeFile::write(folder.path(), "x").is_err());
        assert!(WholeFile::write(folder.path().join("no/such/a.obj"), "x").is_err());
        assert!(names(&folder).is_empty());
    }

    #[test]
    fn two_that_write_one_path_at_a_time_do_not_share_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let (mut one, mut other) = (WholeFile::create(&path).unwrap(), WholeFile::create(&path).unwrap());
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
    fn links_stay_and_what_they_point_at_is_replaced() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("elsewhere")).unwrap();
        let [link, chain, target] = ["link", "chain", "elsewhere/target"].map(|name| folder.path().join(name));
        symlink("elsewhere/target", &link).unwrap();
        symlink(&link, &chain).unwrap();
        // First where nothing is, then over what is there.
        for text in ["first", "second"] {
            WholeFile::write(&chain, text).unwrap();
            assert_eq!(fs::read_to_string(&target).unwrap(), text);
            assert!(link.is_symlink() && chain.is_symlink() && !target.is_symlink());
            fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
        }
        WholeFile::write(&chain, "third").unwrap();
        assert_eq!(target.metadata().unwrap().permissions().mode() & 0o777, 0o640);
        assert!(same_place(&link, &target) && same_place(&chain, &link));
        assert!(!same_place(&link, &folder.path().join("target")));
        symlink("round", folder.path().join("round")).unwrap();
        assert!(WholeFile::write(folder.path().join("round"), "x").is_err());
        // What somebody planted under a name we might have taken is left alone.
        symlink(&target, folder.path().join("a.obj.part")).unwrap();
        WholeFile::write(folder.path().join("a.obj"), "mine").unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), "third");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_and_pipes_are_written_to_and_stay() {
        use std::os::unix::fs::FileTypeExt as _;
        WholeFile::write("/dev/null", "x").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        let full = WholeFile::write("/dev/full", "x").unwrap_err();
        assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        assert!(fs::metadata("/dev/full").unwrap().file_type().is_char_device());
        assert!(
            !same_place(Path::new("/dev/null"), Path::new("/dev/null")),
            "what is no file takes any number of writers"
        );
    }
}
