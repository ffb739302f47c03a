//! Errors of recordings: writing, streaming, serving and reading.

use std::path::PathBuf;

/// Version of the viewer that recordings are made for.
pub(super) const RERUN_VERSION: &str = "0.36.3";

/// Why a recording could not be written, streamed, served or read.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message names each field")]
pub enum RecordError {
    /// The recording's file cannot be written.
    #[error(
        "cannot write the recording to {path}: {source}; choose a folder that exists, is writable and has room (--save FILE)"
    )]
    Unwritable { path: PathBuf, source: std::io::Error },
    /// A port is in use.
    #[error("port {port} on 127.0.0.1 is in use ({source}); stop what listens there, or choose another ({option})")]
    PortInUse { port: u16, option: &'static str, source: std::io::Error },
    /// The address of a remote viewer is invalid.
    #[error("{url:?} is not a viewer address: {reason}; expected rerun+http://HOST:PORT/proxy (--connect URL)")]
    BadUrl { url: String, reason: String },
    /// No viewer answers at the address.
    #[error("no viewer answers at {url}: {reason}; start one there (`rerun --port PORT`) or leave out --connect")]
    Unreachable { url: String, reason: String },
    /// The native viewer could not be started.
    #[error(
        "cannot start the Rerun viewer: {reason}; install it with `pip install rerun-sdk=={version}` or view the \
         recording in a browser (--serve, or `partwise view FILE.rrd`)",
        version = RERUN_VERSION
    )]
    NoViewer { reason: String },
    /// A server did not start.
    #[error("cannot serve {what} on 127.0.0.1:{port}: {reason}")]
    Server { what: &'static str, port: u16, reason: String },
    /// A file to view cannot be opened.
    #[error("cannot read {path}: {source}")]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// A file to view is not a recording.
    #[error(
        "{path} is not a Rerun recording: {reason}; expected an .rrd file, as `partwise run --save FILE.rrd` writes"
    )]
    NotARecording { path: PathBuf, reason: String },
    /// A viewer did not take the data.
    #[error("the recording is incomplete: {reason}")]
    Incomplete { reason: String },
    /// Two inputs of a step have different lengths.
    #[error("{what}: {found} values for {expected} {of}")]
    Mismatch { what: String, found: usize, expected: usize, of: &'static str },
    /// Rerun rejected the data.
    #[error("Rerun: {0}")]
    Rerun(#[from] Box<rerun::RecordingStreamError>),
}

impl From<rerun::RecordingStreamError> for RecordError {
    fn from(error: rerun::RecordingStreamError) -> Self {
        Self::Rerun(Box::new(error))
    }
}

impl RecordError {
    /// Fails unless each list has one value per vertex of the garment.
    pub(super) fn unless_per_vertex(vertices: usize, lists: &[(&str, usize)]) -> Result<(), Self> {
        match lists.iter().find(|(_, found)| *found != vertices) {
            None => Ok(()),
            Some(&(what, found)) => {
                Err(Self::Mismatch { what: what.to_owned(), found, expected: vertices, of: "vertices of the garment" })
            }
        }
    }

    /// Whether another input avoids the error (exit code 2) or not (1).
    #[must_use]
    pub fn is_users(&self) -> bool {
        !matches!(self, Self::Incomplete { .. } | Self::Mismatch { .. } | Self::Rerun(_))
    }
}
