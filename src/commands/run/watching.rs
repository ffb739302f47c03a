//! `--watch`: a session whose edits come from files alone.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::Job;
use crate::record::Recorder;
use crate::session::{Finished, Session, Snapshot, Worker};
use crate::study::accuracy::rms_mm;
use crate::study::job::{Against, Measured};

use super::{RunArgs, Solved};
use crate::commands::runtime::cache;
use crate::commands::watch::FileWatch;
use crate::commands::{UserError, console, interrupt};

/// How often files and Ctrl-C are looked at.
const GLANCE: Duration = Duration::from_millis(40);

/// The recording so far.
#[derive(Default)]
struct Told {
    recorder: Option<Recorder>,
    /// The next step of the timeline.
    index: i64,
    /// The state that was recorded last, and the one that was said to be impossible.
    recorded: u64,
    refused: u64,
    /// What was told last.
    last: Option<Arc<Finished>>,
}

impl RunArgs {
    /// Drapes, and again whenever a file changes; one that does not read leaves the last good state on the page.
    pub(super) fn keep_watching(&self) -> anyhow::Result<()> {
        let job = self.job()?;
        let of_meshes: Vec<PathBuf> =
            job.scene.files().into_iter().chain(self.input.measurements.file().map(Path::to_path_buf)).collect();
        let files: Vec<PathBuf> =
            of_meshes.iter().cloned().chain(self.stages.files().into_iter().map(Path::to_path_buf)).collect();
        if files.is_empty() {
            return Err(UserError::new(
                "--watch has no file to watch: everything is built in. Give --table, --fabric, --body or --garment a file",
            ));
        }
        self.sinks.refuse_unwritable(&job.scene.garment_name())?;
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        let mut watch = FileWatch::new(files);
        // What cannot be from the start is an error, as without --watch.
        self.stages.dials.cloth.check_used(&self.input.load(&job.scene)?)?;
        let session = Session::new(job, true);
        let mut session_worker = Worker::new(self.input.meshes());
        let working = session.clone();
        let worker = std::thread::spawn(move || session_worker.run(&working));
        interrupt::keep();
        let mut told = Told::default();
        let mut serial = 0;
        let mut outcome = Ok(());
        while !interrupt::requested() && outcome.is_ok() {
            let now = session.newer_than(serial, GLANCE);
            serial = now.serial;
            outcome = self.tell(&session, &now, &mut told, &names);
            let changed = watch.changed();
            if !changed.is_empty() {
                let meshes_stand = changed.iter().all(|file| !of_meshes.contains(file));
                if let Err(error) = self.take(&session, meshes_stand) {
                    console::error(&error);
                    told.notice(&format!("{error:#}"))?;
                }
            }
        }
        session.close();
        if worker.join().is_err() {
            outcome = outcome.and(Err(anyhow::anyhow!("the session broke off; this is a mistake of the program")));
        }
        outcome?;
        match told.recorder.map(Recorder::finish).transpose()?.and_then(|summary| summary.file_line()) {
            Some(said) => console::note(&said),
            None if told.recorded == 0 => console::note("interrupted before the first drape: nothing is recorded"),
            None => {}
        }
        Ok(())
    }

    /// Hands what the files say now to the session.
    fn take(&self, session: &Session, meshes_stand: bool) -> anyhow::Result<()> {
        let job = self.job()?;
        if meshes_stand {
            session.submit_job(job)?
        } else {
            session.reload(job)?
        };
        Ok(())
    }

    /// Records and prints what is new.
    fn tell(&self, session: &Session, now: &Snapshot, told: &mut Told, names: &[String]) -> anyhow::Result<()> {
        if let Some(refused) = now.refused.as_ref().filter(|r| r.state != told.refused) {
            told.refused = refused.state;
            console::error(&UserError::new(refused.sentence.clone()));
            if told.recorder.is_none() {
                return Err(UserError::new("nothing could be draped: mend it and start again"));
            }
            told.notice(&refused.sentence)?;
        }
        let Some(finished) = now.finished.as_ref().filter(|f| f.state == now.state && f.state != told.recorded) else {
            return Ok(());
        };
        told.recorded = finished.state;
        let Some(measured) = self.measure(session, &now.job, finished)? else { return Ok(()) };
        let mut solved = Solved::of_session(&now.job, finished, measured)?;
        solved.summary.since_last = told.last.as_ref().map(|last| since(last, finished));
        told.last = Some(Arc::clone(finished));
        let recorder = match &mut told.recorder {
            Some(recorder) => recorder,
            none => none.insert(Recorder::open(solved.record_options(&self.sinks, false, true))?),
        };
        solved.record(recorder, told.index, false)?;
        if told.index == 0 {
            self.export(&mut solved)?;
        }
        self.print(&solved)?;
        if told.index == 0 {
            if let Some(url) = recorder.web_url() {
                console::note(&format!("look at it: {url}"));
            }
            console::note(&format!("watching {}; Ctrl-C ends", names.join(", ")));
        }
        told.index += 1;
        Ok(())
    }

    /// What is asked to be measured; none where a newer edit came in between.
    fn measure(&self, session: &Session, job: &Job, finished: &Finished) -> anyhow::Result<Option<Measured>> {
        let state = finished.state;
        let mut go_on = |_: &crate::mechanics::refine::Step<'_>| {
            let stale = interrupt::requested() || session.snapshot().state != state;
            if stale { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let scene = &finished.loaded_scene.input.scene;
        match job.measure(scene, &finished.drape, cache(self.cache.as_ref()).as_ref(), &mut go_on) {
            Ok(measured) => Ok(Some(measured)),
            Err(crate::study::evaluate::EvaluateError::Interrupted) if interrupt::requested() => {
                let plain = Job { accuracy: Against::None, ..job.clone() };
                Ok(Some(plain.measure(scene, &finished.drape, None, &mut go_on)?))
            }
            Err(crate::study::evaluate::EvaluateError::Interrupted) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}

/// What has changed from one save to the next.
fn since(before: &Finished, now: &Finished) -> String {
    let parts = match (before.drape.parts.len(), now.drape.parts.len()) {
        (before, now) if before == now => format!("{now} PARTs as before"),
        (before, now) => format!("{now} PARTs after {before}"),
    };
    let [was, is] = [&before.drape.positions, &now.drape.positions];
    if before.loaded_scene.input.scene.garment.triangles != now.loaded_scene.input.scene.garment.triangles {
        return format!("{parts}; another garment");
    }
    let most = was.iter().zip(is).map(|(a, b)| 1e3 * a.distance(*b)).fold(0.0, f64::max);
    format!("{parts}; the drape moved by {:.1} mm RMS, {most:.1} mm at most", rms_mm(is, was))
}

impl Told {
    /// Puts a sentence above the last good state.
    fn notice(&mut self, sentence: &str) -> anyhow::Result<()> {
        let last = (self.index - 1).max(0);
        Ok(self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.notice(last, sentence))?)
    }
}
