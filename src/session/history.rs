//! Undo and redo over whole jobs: a drag is one step.

use std::sync::Arc;

use crate::study::job::Job;

/// Jobs remembered.
const MOST: usize = 200;

/// The jobs of a session, and which of them it stands at.
#[derive(Debug)]
pub(super) struct History {
    jobs: Vec<Arc<Job>>,
    at: usize,
    gesture: Option<u64>,
}

impl History {
    pub(super) fn new(job: Arc<Job>) -> Self {
        Self { jobs: vec![job], at: 0, gesture: None }
    }

    /// Takes the next job; those of one gesture are one step.
    pub(super) fn push(&mut self, job: Arc<Job>, gesture: Option<u64>) {
        self.jobs.truncate(self.at + 1);
        if gesture.is_some() && gesture == self.gesture && self.at > 0 {
            self.jobs[self.at] = job;
        } else {
            self.jobs.push(job);
            self.jobs.drain(..self.jobs.len().saturating_sub(MOST));
            self.at = self.jobs.len() - 1;
        }
        self.gesture = gesture;
    }

    /// The job one step back (`-1`) or on (`1`); the history stands there only after [`stand`](Self::stand).
    pub(super) fn beside(&self, by: isize) -> Option<Arc<Job>> {
        self.jobs.get(self.at.checked_add_signed(by)?).cloned()
    }

    pub(super) fn stand(&mut self, by: isize) {
        self.at = self.at.saturating_add_signed(by).min(self.jobs.len() - 1);
        self.gesture = None;
    }

    /// Puts `good` wherever a job turned out to be bad.
    pub(super) fn mend(&mut self, bad: impl Fn(&Job) -> bool, good: impl Fn(&Job) -> Job) {
        for job in self.jobs.iter_mut().filter(|job| bad(job)) {
            *job = Arc::new(good(job));
        }
        self.gesture = None;
    }

    /// Steps that can be taken back and on.
    pub(super) fn depth(&self) -> (usize, usize) {
        (self.at, self.jobs.len() - 1 - self.at)
    }
}
