//! The bundled web viewer: the page on one port of 127.0.0.1, the recording on another. Nothing has to be installed.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use rerun::grpc_server::GrpcServerSink;
use rerun::log::LogMsg;
use rerun::sink::LogSink as _;

use super::error::RecordError;
use super::sinks::{free_port, serve};

/// A page that shows a recording; it is served for as long as this lives.
pub struct WebViewer {
    /// The server; Rerun does not export its type.
    _page: Box<dyn std::any::Any + Send + Sync>,
    url: String,
}

impl WebViewer {
    /// Serves the page on `web_port`, pointed at the data on `grpc_port`.
    pub(crate) fn start(web_port: u16, grpc_port: u16) -> Result<Self, RecordError> {
        let failed = |reason: String| RecordError::Server { what: "the web viewer", port: web_port, reason };
        let config = rerun::web_viewer::WebViewerConfig {
            bind_ip: "127.0.0.1".to_owned(),
            web_port: web_port.into(),
            open_browser: false,
            ..rerun::web_viewer::WebViewerConfig::default()
        };
        let page = config.host_web_viewer().map_err(|e| failed(e.to_string()))?;
        // %2B and the rest: the address of the data is a parameter of the page's.
        let data = format!("rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{grpc_port}%2Fproxy");
        let url = format!("{}/?url={data}", page.server_url());
        Ok(Self { _page: Box::new(page), url })
    }

    /// The address to open in a browser.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }
}

/// A recording from disk, served to browsers for as long as this lives.
pub struct Served {
    viewer: WebViewer,
    _data: GrpcServerSink,
    messages: usize,
}

impl Served {
    /// The address to open in a browser.
    #[must_use]
    pub fn url(&self) -> &str {
        self.viewer.url()
    }

    /// How many messages the recording holds.
    #[must_use]
    pub fn messages(&self) -> usize {
        self.messages
    }
}

/// Serves any `.rrd` file in the bundled web viewer on 127.0.0.1; `None` takes a free port. The file is read once.
///
/// # Errors
/// An unreadable file, one that is no recording, a port in use.
pub fn serve_file(path: &Path, web_port: Option<u16>, grpc_port: Option<u16>) -> Result<Served, RecordError> {
    let messages = read(path)?;
    let web_port = free_port(web_port, "--web-port")?;
    let (data, grpc_port) = serve(grpc_port)?;
    let count = messages.len();
    data.send_all(messages);
    let viewer = WebViewer::start(web_port, grpc_port)?;
    Ok(Served { viewer, _data: data, messages: count })
}

fn read(path: &Path) -> Result<Vec<LogMsg>, RecordError> {
    let file = File::open(path).map_err(|source| RecordError::Unreadable { path: path.to_owned(), source })?;
    let none = |reason: String| RecordError::NotARecording { path: path.to_owned(), reason };
    let decoder = rerun::external::re_log_encoding::Decoder::<LogMsg>::decode_eager(BufReader::new(file))
        .map_err(|e| none(e.to_string()))?;
    let messages = decoder.collect::<Result<Vec<LogMsg>, _>>().map_err(|e| none(e.to_string()))?;
    if messages.is_empty() { Err(none("it is empty".to_owned())) } else { Ok(messages) }
}
