//! The bundled web viewer: the page on one port of 127.0.0.1, the recording on another. Nothing has to be installed.

use std::fs::File;
use std::io::BufReader;
use std::net::TcpListener;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rerun::grpc_server::GrpcServerSink;
use rerun::log::LogMsg;
use rerun::sink::LogSink as _;

use super::error::RecordError;
use super::page::{self, Server};
use super::sinks::{WHOLE_HISTORY, listen_for_pages, serve};

/// A page that shows a recording; it is served for as long as this lives.
pub(crate) struct WebViewer {
    _page: Server,
    url: String,
}

impl WebViewer {
    /// Serves the page to whom `listener` hears, pointed at the data on `grpc_port`.
    pub(crate) fn start(listener: TcpListener, grpc_port: u16) -> Result<Self, RecordError> {
        let port = listener.local_addr().map_or(0, |address| address.port());
        let failed = |reason: String| RecordError::Server { what: "the web viewer", port, reason };
        let page = page::serve(listener, &format!("rerun+http://127.0.0.1:{grpc_port}/proxy")).map_err(failed)?;
        Ok(Self { _page: page, url: format!("http://127.0.0.1:{port}/") })
    }

    /// The address to open in a browser.
    #[must_use]
    pub(crate) fn url(&self) -> &str {
        &self.url
    }
}

/// A recording from disk, served to browsers for as long as this lives.
pub struct Served {
    viewer: WebViewer,
    _data: GrpcServerSink,
}

impl Served {
    /// The address to open in a browser.
    #[must_use]
    pub fn url(&self) -> &str {
        self.viewer.url()
    }
}

/// Reads a recording and forgets it: whether it can be served.
///
/// # Errors
/// An unreadable file, or one that is no recording.
pub(crate) fn check_file(path: &Path) -> Result<(), RecordError> {
    read(path).map(|_| ())
}

/// Serves any `.rrd` file in the bundled web viewer on 127.0.0.1, on ports as of [`Sink::Serve`](super::Sink::Serve). The file is read once.
///
/// # Errors
/// An unreadable file, one that is no recording, a port in use.
pub fn serve_file(path: &Path, web_port: Option<u16>, grpc_port: Option<u16>) -> Result<Served, RecordError> {
    let messages = read(path)?;
    let page = listen_for_pages(web_port)?;
    let (data, grpc_port) = serve(grpc_port, WHOLE_HISTORY)?;
    data.send_all(messages);
    let viewer = WebViewer::start(page, grpc_port)?;
    Ok(Served { viewer, _data: data })
}

/// The messages of a recording; damage of some kinds ends in an allocation that ends the program.
fn read(path: &Path) -> Result<Vec<LogMsg>, RecordError> {
    let file = File::open(path).map_err(|source| RecordError::Unreadable { path: path.to_owned(), source })?;
    let none = |reason| RecordError::NotARecording { path: path.to_owned(), reason };
    let decode = || -> Result<Vec<LogMsg>, String> {
        let decoder = rerun::external::re_log_encoding::Decoder::decode_eager(BufReader::new(file));
        decoder.map_err(|e| e.to_string())?.map(|message| message.map_err(|e| e.to_string())).collect()
    };
    // The decoder trusts what it reads, and panics where it should not have.
    let decoded = catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err("it is damaged".to_owned()));
    let messages = decoded.map_err(none)?;
    if messages.is_empty() { Err(none("it is empty".to_owned())) } else { Ok(messages) }
}
