//! Looks whether files changed on disk, for `--watch`.
//!
//! Each file is asked for its length and date, a few times a second: whatever else happens in its folder is no concern, and
//! editors that replace a file instead of writing it need no special care. A file that is being written is left alone until it is
//! still; what counts then are its contents, so a save that changes nothing wakes nobody.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::base::files::read_own;

/// A file is read once it has been still for so long.
const SETTLE: Duration = Duration::from_millis(60);
/// One that never is, or stays away, is read after so long.
const PATIENCE: Duration = Duration::from_secs(1);

/// Some files and what was last read in them.
pub(crate) struct FileWatch {
    files: Vec<Watched>,
}

struct Watched {
    path: PathBuf,
    stamp: Option<Stamp>,
    contents: Option<blake3::Hash>,
    /// When its stamp first differed, and when it last did.
    moving: Option<(Instant, Instant)>,
}

/// Length and date; none of a file that is away, between an editor's delete and rename.
type Stamp = (u64, Option<SystemTime>);

impl FileWatch {
    /// Starts watching `files` as they are now.
    pub(crate) fn new(files: Vec<PathBuf>) -> Self {
        let watched = |path: PathBuf| Watched { stamp: stamp(&path), contents: contents(&path), moving: None, path };
        Self { files: files.into_iter().map(watched).collect() }
    }

    /// The files whose contents are others than when last asked.
    pub(crate) fn changed(&mut self) -> Vec<PathBuf> {
        let now = Instant::now();
        self.files.iter_mut().filter_map(|file| file.changed(now).then(|| file.path.clone())).collect()
    }
}

impl Watched {
    fn changed(&mut self, now: Instant) -> bool {
        let stamp = stamp(&self.path);
        if stamp != self.stamp {
            self.stamp = stamp;
            let since = self.moving.map_or(now, |(since, _)| since);
            self.moving = Some((since, now));
        }
        let Some((since, last)) = self.moving else { return false };
        let still = self.stamp.is_some() && now - last >= SETTLE;
        if !still && now - since < PATIENCE {
            return false;
        }
        self.moving = None;
        let contents = contents(&self.path);
        std::mem::replace(&mut self.contents, contents) != contents
    }
}

fn stamp(file: &Path) -> Option<Stamp> {
    let found = std::fs::metadata(file).ok()?;
    Some((found.len(), found.modified().ok()))
}

fn contents(file: &Path) -> Option<blake3::Hash> {
    read_own(file).ok().map(|bytes| blake3::hash(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asks for so long, as the session does.
    fn ask(watch: &mut FileWatch, ms: u64) -> usize {
        let until = Instant::now() + Duration::from_millis(ms);
        let mut found = 0;
        while Instant::now() < until {
            found += watch.changed().len();
            std::thread::sleep(Duration::from_millis(5));
        }
        found
    }

    #[test]
    fn a_save_is_told_once_and_one_that_changes_nothing_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mine.toml");
        std::fs::write(&file, "a").unwrap();
        let mut watch = FileWatch::new(vec![file.clone()]);
        assert_eq!(ask(&mut watch, 100), 0);
        std::fs::write(&file, "ab").unwrap();
        assert_eq!(ask(&mut watch, 400), 1);
        std::fs::write(&file, "ab").unwrap();
        assert_eq!(ask(&mut watch, 400), 0);
        // As editors do it: away, and another file by the same name.
        std::fs::remove_file(&file).unwrap();
        assert_eq!(ask(&mut watch, 30), 0);
        std::fs::write(folder.path().join("new"), "abc").unwrap();
        std::fs::rename(folder.path().join("new"), &file).unwrap();
        assert_eq!(ask(&mut watch, 400), 1);
    }

    #[test]
    fn other_files_in_the_folder_starve_nobody_and_neither_does_one_that_never_rests() {
        let folder = tempfile::tempdir().unwrap();
        let (file, other) = (folder.path().join("mine.toml"), folder.path().join("other"));
        std::fs::write(&file, "a").unwrap();
        let mut watch = FileWatch::new(vec![file.clone()]);
        std::fs::write(&file, "ab").unwrap();
        let mut told = 0;
        for i in 0..60 {
            std::fs::write(&other, format!("{i}")).unwrap();
            told += ask(&mut watch, 10);
        }
        assert_eq!(told, 1);
        let mut text = "abc".to_owned();
        for _ in 0..130 {
            text.push('d');
            std::fs::write(&file, &text).unwrap();
            told += ask(&mut watch, 10);
        }
        assert!(told >= 2, "{told}");
    }
}
