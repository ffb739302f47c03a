//! What can go wrong between the results and whoever looks at them.

use std::path::PathBuf;

/// Why a recording could not be written, streamed, served or read.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum RecordError {
    /// The recording's file cannot be written.
    #[error(
        "cannot write the recording to {path}: {source}; choose a folder that exists and is writable (--save FILE)"
    )]
    Unwritable { path: PathBuf, source: std::io::Error },
    /// A port to serve on is taken.
    #[error("port {port} on 127.0.0.1 is in use ({source}); stop what listens there, or choose another ({option})")]
    PortInUse { port: u16, option: &'static str, source: std::io::Error },
    /// The address of a remote viewer cannot be read.
    #[error("{url:?} is no viewer address: {reason}; expected rerun+http://HOST:PORT/proxy (--connect URL)")]
    BadUrl { url: String, reason: String },
    /// Nobody answers at a remote viewer's address.
    #[error("no viewer answers at {url}: {reason}; start one there (`rerun --port PORT`) or leave out --connect")]
    Unreachable { url: String, reason: String },
    /// The native viewer could not be started.
    #[error(
        "cannot start the Rerun viewer: {reason}; install it with `pip install rerun-sdk=={version}` or look at the \
         recording in a browser (--serve, or `partwise view FILE.rrd`)"
    )]
    NoViewer { reason: String, version: &'static str },
    /// A server did not start.
    #[error("cannot serve {what} on 127.0.0.1:{port}: {reason}")]
    Server { what: &'static str, port: u16, reason: String },
    /// A file given to be viewed cannot be opened.
    #[error("cannot read {path}: {source}")]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// A file given to be viewed is no recording.
    #[error("{path} is no Rerun recording: {reason}; expected an .rrd file, as `partwise run --save FILE.rrd` writes")]
    NotARecording { path: PathBuf, reason: String },
    /// Writing broke off: a full disk, a viewer that went away.
    #[error("the recording is incomplete: {reason}")]
    Incomplete { reason: String },
    /// Two inputs of a step do not fit each other.
    #[error("{what}: {found} values for {expected} {of}")]
    Mismatch { what: String, found: usize, expected: usize, of: &'static str },
    /// Rerun refused the data.
    #[error("Rerun: {0}")]
    Rerun(#[from] Box<rerun::RecordingStreamError>),
}

impl From<rerun::RecordingStreamError> for RecordError {
    fn from(error: rerun::RecordingStreamError) -> Self {
        Self::Rerun(Box::new(error))
    }
}

impl RecordError {
    /// Refuses lists that have not one value for each vertex of the garment.
    pub(super) fn unless_per_vertex(vertices: usize, lists: &[(&str, usize)]) -> Result<(), Self> {
        match lists.iter().find(|(_, found)| *found != vertices) {
            None => Ok(()),
            Some(&(what, found)) => {
                Err(Self::Mismatch { what: what.to_owned(), found, expected: vertices, of: "vertices of the garment" })
            }
        }
    }

    /// Whether the user can set it right by asking for something else (exit code 2) or not (1).
    #[must_use]
    pub fn is_users(&self) -> bool {
        !matches!(self, Self::Mismatch { .. } | Self::Rerun(_))
    }
}
