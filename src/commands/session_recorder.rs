//! A session recorded: every finished state as a step of a timeline, into a file, and to a viewer elsewhere that may come and go.

use std::time::{Duration, Instant};

use crate::Job;
use crate::record::{RecordError, RecordSummary, Recorder};
use crate::session::Session;
use crate::study::job::Against;

use super::solved::Solved;
use super::{SinkArgs, console};

/// How long to wait for news before it is looked whether the session goes on.
pub(super) const GLANCE: Duration = Duration::from_millis(100);

/// How often it is looked whether a viewer is still there, or there again.
const AGAIN: Duration = Duration::from_secs(2);

/// Records what is finished until the session is closed.
pub(super) fn keep(session: &Session, sinks: &SinkArgs) -> anyhow::Result<RecordSummary> {
    let kept = sinks.check_outputs(&[]).and_then(|()| follow(session, sinks, &mut || ()));
    if let Err(error) = &kept {
        console::error(error);
        console::note("the session goes on without the recording");
    }
    kept
}

/// Shows what is finished to a viewer elsewhere until the session is closed; one that comes back, or comes late, sees the newest state.
pub(super) fn show(session: &Session, sinks: &SinkArgs) {
    let mut told = false;
    while !session.is_closed() {
        let mut attached = || {
            if std::mem::take(&mut told) {
                console::note("a viewer is there");
            }
        };
        match follow(session, sinks, &mut attached) {
            Ok(_) => return,
            Err(error) if matches!(error.downcast_ref(), Some(RecordError::BadUrl { .. })) => {
                console::error(&error);
                return console::note("the session goes on without a viewer");
            }
            Err(error) => {
                if !std::mem::replace(&mut told, true) {
                    console::error(&error);
                    console::note("the session goes on, and a viewer that is there later sees it");
                }
            }
        }
        let since = Instant::now();
        while since.elapsed() < AGAIN && !session.is_closed() {
            std::thread::sleep(GLANCE);
        }
    }
}

/// Records what is finished, and calls `attached` when the first state is.
fn follow(session: &Session, sinks: &SinkArgs, attached: &mut dyn FnMut()) -> anyhow::Result<RecordSummary> {
    let mut recorder: Option<Recorder> = None;
    let (mut serial, mut last, mut index) = (0, 0, 0);
    let mut asked = Instant::now();
    while !session.is_closed() {
        let now = session.newer_than(serial, GLANCE);
        serial = now.serial;
        let Some(finished) = now.finished.as_ref().filter(|f| f.state > last && f.state == now.state) else {
            if let Some(recorder) = recorder.as_mut().filter(|_| asked.elapsed() > AGAIN) {
                recorder.flush()?;
                asked = Instant::now();
            }
            continue;
        };
        last = finished.state;
        let job = Job { accuracy: Against::None, ..(*now.job).clone() };
        let measured =
            job.measure(&finished.loaded_scene.input.scene, &finished.drape, None, &mut crate::drape::unobserved)?;
        let mut solved = Solved::of_session(&job, finished, measured)?;
        let recorder = match &mut recorder {
            Some(recorder) => recorder,
            none => none.insert(Recorder::open(solved.record_options(sinks, false, true))?),
        };
        solved.record(recorder, index, false)?;
        if index == 0 {
            attached();
        }
        index += 1;
    }
    Ok(recorder.map(Recorder::finish).transpose()?.unwrap_or_default())
}
