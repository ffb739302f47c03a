//! The bundled web viewer: page and recording on one port of 127.0.0.1. Nothing has to be installed.

use std::fs::File;
use std::io::BufReader;
use std::net::{Ipv4Addr, TcpListener};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rerun::log::LogMsg;
use rerun::sink::LogSink as _;

use super::error::RecordError;
use super::page::{self, Limits, Recording, Server};

/// Port of the page unless another is given, if it is free: an open page then finds the program when it is run again. The
/// digits spell PART on a telephone.
const PAGE_PORT: u16 = 7278;

/// History of a recording from disk, bytes: it is kept whole.
const WHOLE_HISTORY: u64 = 1 << 30;

/// A page that shows a recording, served for as long as this lives.
pub struct WebViewer {
    url: String,
    pub(super) recording: Recording,
    _servers: Vec<Server>,
}

impl WebViewer {
    /// Serves an empty recording of about `history_bytes`, on ports as of [`Sink::Serve`](super::Sink::Serve).
    pub(super) fn start(
        web_port: Option<u16>,
        grpc_port: Option<u16>,
        history_bytes: u64,
    ) -> Result<Self, RecordError> {
        let own = if web_port.is_none() { listen(PAGE_PORT, "--web-port").ok() } else { None };
        let page = own.map_or_else(|| listen(web_port.unwrap_or(0), "--web-port"), Ok)?;
        let port = page.local_addr().map_or(0, |address| address.port());
        let further = grpc_port.map(|port| listen(port, "--grpc-port")).transpose()?;
        let recording = Recording::new(history_bytes);
        let failed = |reason: String| RecordError::Server { what: "the web viewer", port, reason };
        let router = page::router(&recording).map_err(failed)?;
        let start = |listener| Server::start("page", listener, router.clone(), Limits::default());
        let servers = std::iter::once(page).chain(further).map(start).collect::<Result<_, _>>();
        let servers = servers.map_err(|error| failed(error.to_string()))?;
        Ok(Self { url: format!("http://127.0.0.1:{port}/"), recording, _servers: servers })
    }

    /// The address to open in a browser.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }
}

fn listen(port: u16, option: &'static str) -> Result<TcpListener, RecordError> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|source| RecordError::PortInUse { port, option, source })
}

/// Checks that a recording can be served.
///
/// # Errors
/// An unreadable file, or one that is no recording.
pub(crate) fn check_file(path: &Path) -> Result<(), RecordError> {
    read(path).map(|_| ())
}

/// Serves an `.rrd` file in the bundled web viewer on 127.0.0.1, on ports as of [`Sink::Serve`](super::Sink::Serve). The file is
/// read once.
///
/// # Errors
/// An unreadable file, one that is no recording, a port in use.
pub fn serve_file(path: &Path, web_port: Option<u16>, grpc_port: Option<u16>) -> Result<WebViewer, RecordError> {
    let messages = read(path)?;
    let viewer = WebViewer::start(web_port, grpc_port, WHOLE_HISTORY)?;
    viewer.recording.send_all(messages);
    Ok(viewer)
}

/// The messages of a recording. Some kinds of damage make the decoder allocate more memory than there is, which ends the program.
fn read(path: &Path) -> Result<Vec<LogMsg>, RecordError> {
    let file = File::open(path).map_err(|source| RecordError::Unreadable { path: path.to_owned(), source })?;
    let none = |reason| RecordError::NotARecording { path: path.to_owned(), reason };
    let decode = || -> Result<Vec<LogMsg>, String> {
        let decoder = rerun::external::re_log_encoding::Decoder::decode_eager(BufReader::new(file));
        decoder.map_err(|e| e.to_string())?.map(|message| message.map_err(|e| e.to_string())).collect()
    };
    // The decoder does not validate the file, and panics on damage.
    let decoded = catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err("it is damaged".to_owned()));
    let messages = decoded.map_err(none)?;
    if messages.is_empty() { Err(none("it is empty".to_owned())) } else { Ok(messages) }
}
