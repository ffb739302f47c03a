//! The sinks of a recording: a file, the native viewer, a remote viewer, a browser; several at once.
//!
//! Rerun's own sinks report most failures late or only to the log, so each is tried before the first result is sent: a
//! port is bound, an address is dialled, a file is created. Servers listen on 127.0.0.1 alone. A file is written whole or not
//! at all.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rerun::external::re_uri::{ProxyUri, Scheme};
use rerun::sink::LogSink;

use super::error::RecordError;
use super::native;
use super::remote::Remote;
use super::web::WebViewer;
use super::writer::RrdWriter;
use crate::base::atomic_file::{AtomicFile, folder_of};

/// Longest wait for a viewer's answer.
const ANSWER: Duration = Duration::from_secs(3);
/// Port of a spawned native viewer: Rerun's own default.
const VIEWER_PORT: u16 = 9876;

/// A destination of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    /// An `.rrd` file; missing folders of a relative path are created.
    File(PathBuf),
    /// The native viewer, started if none listens on Rerun's port yet.
    Spawn,
    /// A remote viewer, `rerun+http://HOST:PORT/proxy`.
    Connect(String),
    /// The bundled web viewer on 127.0.0.1.
    Serve {
        /// Port of the page and of its recording; `None` is 7278 if that is free, or any.
        web_port: Option<u16>,
        /// A further port of the same.
        grpc_port: Option<u16>,
        /// History kept for viewers that connect late; beyond it the oldest steps go first, then the oldest static data.
        history_bytes: u64,
    },
}

impl Sink {
    /// Checks that the sink's file can be created, before its contents are computed; leaves no file.
    ///
    /// # Errors
    /// As [`Recorder::open`](super::Recorder::open).
    pub(crate) fn check(&self) -> Result<(), RecordError> {
        let Self::File(path) = self else { return Ok(()) };
        // Missing folders of a relative path will be created.
        if path.is_relative() && !folder_of(path).exists() {
            return Ok(());
        }
        AtomicFile::check(path).map_err(unwritable(path))
    }
}

/// A file that is being written.
pub(crate) struct Target {
    /// Its encoder.
    pub(super) writer: RrdWriter,
    /// Path of the complete file.
    pub(super) path: PathBuf,
}

impl Target {
    /// The error for a file that could not be completed.
    pub(super) fn unwritable(&self, reason: &str) -> RecordError {
        RecordError::Unwritable { path: self.path.clone(), source: std::io::Error::other(reason) }
    }
}

/// All open sinks of a recording.
#[derive(Default)]
pub(crate) struct OpenSinks {
    pub(crate) sinks: Vec<Box<dyn LogSink>>,
    pub(crate) targets: Vec<Target>,
    pub(crate) web: Option<WebViewer>,
}

impl OpenSinks {
    /// Opens every sink, or none: on an error, dropping the first ones removes their files.
    pub(crate) fn open(sinks: &[Sink]) -> Result<Self, RecordError> {
        let mut open = Self::default();
        sinks.iter().try_for_each(|sink| open.add(sink))?;
        Ok(open)
    }

    fn add(&mut self, sink: &Sink) -> Result<(), RecordError> {
        match sink {
            Sink::File(path) => {
                let target = file(path)?;
                self.sinks.push(Box::new(target.writer.clone()));
                self.targets.push(target);
            }
            Sink::Spawn => self.sinks.push(Box::new(spawn()?)),
            Sink::Connect(url) => self.sinks.push(Box::new(connect(url)?)),
            Sink::Serve { web_port, grpc_port, history_bytes } => {
                let viewer = WebViewer::start(*web_port, *grpc_port, *history_bytes)?;
                self.sinks.push(Box::new(viewer.recording.clone()));
                self.web = Some(viewer);
            }
        }
        Ok(())
    }
}

fn unwritable(path: &Path) -> impl Fn(std::io::Error) -> RecordError + '_ {
    move |source| RecordError::Unwritable { path: path.to_owned(), source }
}

fn file(path: &Path) -> Result<Target, RecordError> {
    // Below the current folder only: a mistake in an absolute path would leave folders anywhere.
    if let Some(folder) = path.parent().filter(|_| path.is_relative()) {
        std::fs::create_dir_all(folder).map_err(unwritable(path))?;
    }
    let file = AtomicFile::create(path).map_err(unwritable(path))?;
    let writer = RrdWriter::new(file).map_err(|reason| unwritable(path)(std::io::Error::other(reason)))?;
    Ok(Target { writer, path: path.to_owned() })
}

fn spawn() -> Result<Remote, RecordError> {
    native::start("rerun", VIEWER_PORT)?;
    connect(&format!("rerun+http://127.0.0.1:{VIEWER_PORT}/proxy"))
        .map_err(|error| RecordError::NoViewer { reason: error.to_string() })
}

fn connect(url: &str) -> Result<Remote, RecordError> {
    let bad = |reason: String| RecordError::BadUrl { url: url.to_owned(), reason };
    let uri: ProxyUri = url.parse().map_err(|e: rerun::external::re_uri::Error| bad(e.to_string()))?;
    let unreachable = |reason: String| RecordError::Unreachable { url: url.to_owned(), reason };
    let host = uri.origin.host.to_string();
    let addresses: Vec<SocketAddr> = (host.as_str(), uri.origin.port)
        .to_socket_addrs()
        .map_err(|e| unreachable(format!("the name {host} cannot be resolved ({e})")))?
        .collect();
    // Rerun's client connects in the background and does not report a missing server.
    let Some(dialled) = addresses.iter().find_map(|a| TcpStream::connect_timeout(a, ANSWER).ok()) else {
        let tried: Vec<String> = addresses.iter().map(ToString::to_string).collect();
        return Err(unreachable(format!("nothing listens at {}", tried.join(", "))));
    };
    let silent = |why: String| unreachable(format!("the server there does not answer as a viewer does ({why})"));
    if uri.origin.scheme == Scheme::RerunHttp {
        greet(dialled).map_err(|e| silent(e.to_string()))?;
    }
    let sink = Remote::new(uri);
    sink.flush_blocking(ANSWER).map_err(|e| silent(e.to_string()))?;
    Ok(sink)
}

/// Exchanges the HTTP/2 preface (RFC 9113, section 3.4), which a server answers with its settings. Rerun's client takes
/// any listener for a viewer, and then waits for ever.
fn greet(mut stream: TcpStream) -> std::io::Result<()> {
    const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
    const NO_SETTINGS: [u8; 9] = [0, 0, 0, SETTINGS, 0, 0, 0, 0, 0];
    const SETTINGS: u8 = 4;
    stream.set_read_timeout(Some(ANSWER))?;
    stream.set_write_timeout(Some(ANSWER))?;
    stream.write_all(PREFACE)?;
    stream.write_all(&NO_SETTINGS)?;
    let mut answer = [0; NO_SETTINGS.len()];
    stream.read_exact(&mut answer).map_err(|e| match e.kind() {
        ErrorKind::WouldBlock | ErrorKind::TimedOut => std::io::Error::other(format!("silent for {ANSWER:?}")),
        _ => e,
    })?;
    if answer[3] == SETTINGS { Ok(()) } else { Err(std::io::Error::other("it does not speak HTTP/2")) }
}
