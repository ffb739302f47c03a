//! `--watch`: drapes again whenever a file changes, through a session whose edits come from the files.
//!
//! Length and modification time of each file are polled. Other files in its folder do not matter, and an editor may replace a file
//! instead of writing to it. A file is read once its length and time are stable, and compared by contents, so a save without a change
//! has no effect.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use crate::Job;
use crate::base::files::read_own;
use crate::mechanics::refine::Step;
use crate::record::Recorder;
use crate::session::{Finished, Session, Snapshot, Worker};
use crate::study::accuracy::rms_mm;
use crate::study::evaluate::EvaluateError;
use crate::study::job::{Against, Measured};

use super::{RunArgs, Solved};
use crate::commands::console;
use crate::commands::runtime::{UserError, interrupted, keep_results, reference_cache, refuse};

/// Interval at which files and Ctrl-C are polled.
const POLL: Duration = Duration::from_millis(40);

/// State of the recording.
#[derive(Default)]
struct Progress {
    recorder: Option<Recorder>,
    /// The next step of the timeline.
    index: i64,
    /// The last recorded state of the session, and the last one reported as impossible.
    recorded: u64,
    refused: u64,
    last: Option<Arc<Finished>>,
}

impl RunArgs {
    /// Drapes, and again after each change of a file. A file that cannot be read leaves the last valid state on the page.
    pub(super) fn keep_watching(&self) -> anyhow::Result<()> {
        let job = self.job()?;
        let measurements = self.input.measurements.measurements.clone();
        let meshes: Vec<PathBuf> = job.scene.files().into_iter().chain(measurements).collect();
        let files: Vec<PathBuf> = meshes.iter().cloned().chain(self.stages.files().map(Path::to_path_buf)).collect();
        if files.is_empty() {
            refuse!(
                "--watch has no file to watch: all inputs are built in. Give --table, --fabric, --body or --garment a file"
            );
        }
        self.sinks.refuse_unwritable(&job.scene.garment_name())?;
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        let mut watch = FileWatch::new(files);
        // An input that cannot be loaded at the start is an error, as without --watch.
        self.stages.model.fabric.check_used(&self.input.load(&job.scene)?)?;
        let session = Session::new(job, true);
        let (working, mut worker) = (session.clone(), Worker::new(self.input.meshes()));
        let worker = std::thread::spawn(move || worker.run(&working));
        keep_results();
        let mut progress = Progress::default();
        let mut serial = 0;
        let mut outcome = Ok(());
        while !interrupted() && outcome.is_ok() {
            let now = session.newer_than(serial, POLL);
            serial = now.serial;
            outcome = self.report(&session, &now, &mut progress, &names);
            let changed = watch.changed();
            if !changed.is_empty() {
                let meshes_unchanged = changed.iter().all(|file| !meshes.contains(file));
                if let Err(error) = self.submit(&session, meshes_unchanged) {
                    console::error(&error);
                    progress.notice(&format!("{error:#}"))?;
                }
            }
        }
        session.close();
        if worker.join().is_err() {
            outcome =
                outcome.and(Err(anyhow::anyhow!("the session ended unexpectedly; this is a defect of the program")));
        }
        outcome?;
        match progress.recorder.map(Recorder::finish).transpose()?.and_then(|summary| summary.file_line()) {
            Some(recording) => console::note(&recording),
            None if progress.recorded == 0 => console::note("interrupted before the first drape: nothing is recorded"),
            None => {}
        }
        Ok(())
    }

    /// Submits the present contents of the files to the session.
    fn submit(&self, session: &Session, meshes_unchanged: bool) -> anyhow::Result<()> {
        let job = self.job()?;
        if meshes_unchanged {
            session.submit_job(job)?
        } else {
            session.reload(job)?
        };
        Ok(())
    }

    /// Records and prints a state that is new.
    fn report(
        &self,
        session: &Session,
        now: &Snapshot,
        progress: &mut Progress,
        names: &[String],
    ) -> anyhow::Result<()> {
        if let Some(refused) = now.refused.as_ref().filter(|r| r.state != progress.refused) {
            progress.refused = refused.state;
            console::error(&UserError(refused.sentence.clone()).into());
            if progress.recorder.is_none() {
                refuse!("no drape was computed: correct the input and start again");
            }
            progress.notice(&refused.sentence)?;
        }
        let newest = now.finished.as_ref().filter(|f| f.state == now.state && f.state != progress.recorded);
        let Some(finished) = newest else { return Ok(()) };
        progress.recorded = finished.state;
        let Some(measured) = self.measure(session, &now.job, finished)? else { return Ok(()) };
        let mut solved = Solved::of_session(&now.job, finished, measured)?;
        solved.summary.since_last = progress.last.as_ref().map(|last| since(last, finished));
        progress.last = Some(Arc::clone(finished));
        let recorder = match &mut progress.recorder {
            Some(recorder) => recorder,
            none => none.insert(solved.open(&self.sinks)?),
        };
        solved.record(recorder, progress.index)?;
        if progress.index == 0 {
            self.export(&mut solved)?;
        }
        self.print(&solved)?;
        if progress.index == 0 {
            if let Some(url) = recorder.web_url() {
                console::note(&format!("view it in a browser: {url}"));
            }
            console::note(&format!("watching {}; Ctrl-C ends", names.join(", ")));
        }
        progress.index += 1;
        Ok(())
    }

    /// Measures a finished state; `None` if a newer edit interrupted the measurement.
    fn measure(&self, session: &Session, job: &Job, finished: &Finished) -> anyhow::Result<Option<Measured>> {
        let mut observe = |_: &Step<'_>| {
            let stale = interrupted() || session.snapshot().state != finished.state;
            if stale { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let scene = &finished.loaded_scene.input.scene;
        match job.measure(scene, &finished.drape, reference_cache(self.cache.as_ref()).as_ref(), &mut observe) {
            Ok(measured) => Ok(Some(measured)),
            Err(EvaluateError::Interrupted) if interrupted() => {
                let plain = Job { accuracy: Against::None, ..job.clone() };
                Ok(Some(plain.measure(scene, &finished.drape, None, &mut observe)?))
            }
            Err(EvaluateError::Interrupted) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}

/// The change from one state to the next.
fn since(before: &Finished, now: &Finished) -> String {
    let parts = match (before.drape.parts.len(), now.drape.parts.len()) {
        (before, now) if before == now => format!("{now} PARTs as before"),
        (before, now) => format!("{now} PARTs after {before}"),
    };
    let [was, is] = [&before.drape.positions, &now.drape.positions];
    if before.loaded_scene.input.scene.garment.triangles != now.loaded_scene.input.scene.garment.triangles {
        return format!("{parts}; another garment");
    }
    let largest = was.iter().zip(is).map(|(a, b)| 1e3 * a.distance(*b)).fold(0.0, f64::max);
    format!("{parts}; the drape moved by {:.1} mm RMS, {largest:.1} mm at most", rms_mm(is, was))
}

impl Progress {
    /// Shows a sentence above the last valid state.
    fn notice(&mut self, sentence: &str) -> anyhow::Result<()> {
        let last = (self.index - 1).max(0);
        Ok(self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.notice(last, sentence))?)
    }
}

/// A file is read once its length and time have been stable for this time. A longer time delays the reaction; a shorter one may read
/// a file that is still being written. A heuristic.
const STABLE_FOR: Duration = Duration::from_millis(60);

/// A file that keeps changing, or is missing, is read after this time.
const READ_AFTER: Duration = Duration::from_secs(1);

/// Files and the contents last read.
struct FileWatch {
    files: Vec<WatchedFile>,
}

struct WatchedFile {
    path: PathBuf,
    stamp: Option<Stamp>,
    contents: Option<blake3::Hash>,
    /// The times of the first and the last change of the stamp since the file was read.
    changing: Option<(Instant, Instant)>,
}

/// Length and modification time. `None` for a missing file, as between an editor's delete and rename.
type Stamp = (u64, Option<SystemTime>);

impl FileWatch {
    /// Watches `files` from their present contents on.
    fn new(files: Vec<PathBuf>) -> Self {
        let watched =
            |path: PathBuf| WatchedFile { stamp: stamp(&path), contents: contents(&path), changing: None, path };
        Self { files: files.into_iter().map(watched).collect() }
    }

    /// The files whose contents changed since the last call.
    fn changed(&mut self) -> Vec<PathBuf> {
        let now = Instant::now();
        self.files.iter_mut().filter_map(|file| file.changed(now).then(|| file.path.clone())).collect()
    }
}

impl WatchedFile {
    fn changed(&mut self, now: Instant) -> bool {
        let stamp = stamp(&self.path);
        if stamp != self.stamp {
            self.stamp = stamp;
            let first = self.changing.map_or(now, |(first, _)| first);
            self.changing = Some((first, now));
        }
        let Some((first, last)) = self.changing else { return false };
        let stable = self.stamp.is_some() && now - last >= STABLE_FOR;
        if !stable && now - first < READ_AFTER {
            return false;
        }
        self.changing = None;
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

    /// The number of changes found within `ms` milliseconds.
    fn changes(watch: &mut FileWatch, ms: u64) -> usize {
        let until = Instant::now() + Duration::from_millis(ms);
        let mut found = 0;
        while Instant::now() < until {
            found += watch.changed().len();
            std::thread::sleep(Duration::from_millis(5));
        }
        found
    }

    #[test]
    fn a_changed_save_is_found_once_and_an_unchanged_one_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("mine.toml");
        std::fs::write(&file, "a").unwrap();
        let mut watch = FileWatch::new(vec![file.clone()]);
        assert_eq!(changes(&mut watch, 100), 0);
        std::fs::write(&file, "ab").unwrap();
        assert_eq!(changes(&mut watch, 400), 1);
        std::fs::write(&file, "ab").unwrap();
        assert_eq!(changes(&mut watch, 400), 0);
        // Editors delete the file and rename another one to its name.
        std::fs::remove_file(&file).unwrap();
        assert_eq!(changes(&mut watch, 30), 0);
        std::fs::write(folder.path().join("new"), "abc").unwrap();
        std::fs::rename(folder.path().join("new"), &file).unwrap();
        assert_eq!(changes(&mut watch, 400), 1);
    }

    #[test]
    fn changes_are_found_beside_busy_files_and_in_a_file_that_keeps_changing() {
        let folder = tempfile::tempdir().unwrap();
        let (file, other) = (folder.path().join("mine.toml"), folder.path().join("other"));
        std::fs::write(&file, "a").unwrap();
        let mut watch = FileWatch::new(vec![file.clone()]);
        std::fs::write(&file, "ab").unwrap();
        let mut found = 0;
        for i in 0..60 {
            std::fs::write(&other, format!("{i}")).unwrap();
            found += changes(&mut watch, 10);
        }
        assert_eq!(found, 1);
        let mut text = "abc".to_owned();
        for _ in 0..130 {
            text.push('d');
            std::fs::write(&file, &text).unwrap();
            found += changes(&mut watch, 10);
        }
        assert!(found >= 2, "{found}");
    }
}
