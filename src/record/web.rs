//! The bundled web viewer: page and recording on one port of 127.0.0.1. Nothing has to be installed.

use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom};
use std::net::{Ipv4Addr, TcpListener};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use rerun::log::LogMsg;
use rerun::sink::LogSink as _;

use super::error::RecordError;
use super::page::{self, Limits, Recording, Server};
use crate::base::files;

/// Port of the page unless another is given, if it is free: an open page then finds the program when it is run again. The
/// digits spell PART on a telephone.
const PAGE_PORT: u16 = 7278;

/// History of a recording from disk, bytes: it is kept whole.
const WHOLE_HISTORY: u64 = 1 << 30;

/// A page that shows a recording, served for as long as this lives.
pub struct WebViewer {
    url: String,
    pub(super) recording: Recording,
    warning: Option<String>,
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
        Ok(Self { url: format!("http://127.0.0.1:{port}/"), recording, warning: None, _servers: servers })
    }

    /// The address to open in a browser.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Set where the recording is incomplete.
    pub(crate) fn warning(&self) -> Option<&str> {
        self.warning.as_deref()
    }
}

fn listen(port: u16, option: &'static str) -> Result<TcpListener, RecordError> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(|source| RecordError::PortInUse { port, option, source })
}

/// Checks that a recording can be served. Returns a warning where it is incomplete.
///
/// # Errors
/// An unreadable file, or one that is no recording.
pub(crate) fn check_file(path: &Path) -> Result<Option<String>, RecordError> {
    read(path).map(|(_, warning)| warning)
}

/// Serves an `.rrd` file in the bundled web viewer on 127.0.0.1, on ports as of [`Sink::Serve`](super::Sink::Serve). The file is
/// read once.
///
/// # Errors
/// An unreadable file, one that is no recording, a port in use.
pub fn serve_file(path: &Path, web_port: Option<u16>, grpc_port: Option<u16>) -> Result<WebViewer, RecordError> {
    let (messages, warning) = read(path)?;
    let viewer = WebViewer::start(web_port, grpc_port, WHOLE_HISTORY)?;
    viewer.recording.send_all(layout_first(messages));
    Ok(WebViewer { warning, ..viewer })
}

/// The messages with those of the layout before the data. A file ends with its layout, and a viewer that has loaded only a part of the data
/// would arrange every entity by itself until then.
fn layout_first(mut messages: Vec<LogMsg>) -> Vec<LogMsg> {
    messages.sort_by_key(|message| message.store_id().is_recording());
    messages
}

/// The messages of a recording, and a warning where it is incomplete. Some kinds of damage make the decoder allocate more memory
/// than there is, which ends the program.
fn read(path: &Path) -> Result<(Vec<LogMsg>, Option<String>), RecordError> {
    let unreadable = |source| RecordError::Unreadable { path: path.to_owned(), source };
    let mut file = files::open(path).map_err(unreadable)?;
    let ended = has_end(&mut file).map_err(unreadable)?;
    let bytes = file.metadata().map_err(unreadable)?.len();
    let none = |reason| RecordError::NotARecording { path: path.to_owned(), reason };
    let decode = || -> Result<Vec<LogMsg>, String> {
        let decoder = rerun::external::re_log_encoding::Decoder::decode_eager(BufReader::new(file));
        decoder.map_err(|e| e.to_string())?.map(|message| message.map_err(|e| e.to_string())).collect()
    };
    // The decoder does not validate the file, and panics on damage.
    let decoded = catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err("it is damaged".to_owned()));
    let messages = decoded.map_err(none)?;
    if messages.is_empty() {
        return Err(none("it is empty".to_owned()));
    }
    let warning = (!ended).then(|| {
        format!(
            "{}: the recording is incomplete: it breaks off after {bytes} bytes, before the end that Rerun writes last; only its \
             first {} messages are shown. Make it again, or copy it again",
            path.display(),
            messages.len()
        )
    });
    Ok((messages, warning))
}

/// Whether a file ends as Rerun ends a recording: `RRF2`, `FOOT`, and the number of footers in four bytes.
fn has_end(file: &mut File) -> io::Result<bool> {
    let mut end = [0; 12];
    let length = file.seek(SeekFrom::End(0))?;
    if length < end.len() as u64 {
        return Ok(false);
    }
    file.seek(SeekFrom::End(-(end.len() as i64)))?;
    file.read_exact(&mut end)?;
    file.rewind()?;
    Ok(end.starts_with(b"RRF2FOOT"))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::{RecordOptions, Recorder, Sink};
    use super::*;
    use crate::mesh::TriMesh;

    #[test]
    fn a_viewer_has_the_layout_before_the_data() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.rrd");
        let options = RecordOptions { sinks: vec![Sink::File(path.clone())], ..RecordOptions::default() };
        let mut recorder = Recorder::open(options).unwrap();
        // The layout is sent with the first garment.
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Z];
        recorder.garment(0, &TriMesh::new(corners, vec![[0, 1, 2]])).unwrap();
        recorder.finish().unwrap();
        let (messages, _) = read(&path).unwrap();
        let count = messages.len();
        let of_data = |message: &LogMsg| message.store_id().is_recording();
        let sent = layout_first(messages);
        let layout = sent.iter().position(of_data).unwrap();
        assert!(layout > 1 && sent.len() == count && sent[layout..].iter().all(of_data));
        // The command that shows the layout is the last of it.
        assert!(matches!(sent[layout - 1], LogMsg::BlueprintActivationCommand(_)));
    }

    #[test]
    fn a_truncated_recording_is_refused_or_reported_as_incomplete() {
        let folder = tempfile::tempdir().unwrap();
        let [path, cut] = ["whole.rrd", "cut.rrd"].map(|name| folder.path().join(name));
        let recording = rerun::RecordingStreamBuilder::new("cut").save(&path).unwrap();
        recording.log("a", &rerun::Points3D::new([[0.0, 0.5, 1.0]])).unwrap();
        recording.flush_blocking().unwrap();
        drop(recording);
        let whole = std::fs::read(&path).unwrap();
        assert_eq!(check_file(&path).unwrap(), None);
        let mut shown = 0;
        for length in 0..whole.len() {
            std::fs::write(&cut, &whole[..length]).unwrap();
            match check_file(&cut) {
                Err(error) => assert!(matches!(error, RecordError::NotARecording { .. }), "{length}: {error}"),
                Ok(message) => {
                    let message = message.unwrap_or_else(|| panic!("{length} of {} bytes pass for whole", whole.len()));
                    assert!(
                        message.contains("cut.rrd") && message.contains(&format!("after {length} bytes")),
                        "{message}"
                    );
                    shown += 1;
                }
            }
        }
        assert!(shown > whole.len() / 4, "{shown} of {} cuts are shown", whole.len());
        assert!(serve_file(&cut, None, None).unwrap().warning().is_some());
    }
}
