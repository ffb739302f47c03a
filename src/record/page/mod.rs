//! The web viewer's page, served on 127.0.0.1 alone. Nothing on it asks anybody else for anything.
//!
//! The viewer is Rerun's, as its crate bundles it; the page around it is ours, as Rerun's own asks for fonts, news and
//! statistics elsewhere. The Content-Security-Policy forbids the browser every other host.

mod server;

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::Write as _;
use std::net;
use std::sync::OnceLock;

use flate2::Compression;
use flate2::write::GzEncoder;
use http_body_util::Full;
use hyper::body::Bytes;
use hyper::header::{self, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use re_web_viewer_server::WebViewerData;

pub(crate) use server::{Server, answer};

const INDEX: &str = include_str!("index.html");
const START: &str = include_str!("start.js");
/// What every page round the viewer needs.
const PROGRAM: &str = include_str!("program.js");

/// What a browser may do on the page. WebAssembly is compiled code, which needs leave of its own; the data comes from
/// another port of this machine; the viewer sets styles and draws pictures it made.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; \
    connect-src 'self' http://127.0.0.1:* http://localhost:*; style-src 'self' 'unsafe-inline'; \
    img-src 'self' blob: data:; font-src 'self' data:; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

/// Serves the page to whom `listener` hears; it opens the recording at `recording` (`rerun+http://...`).
pub(super) fn serve(listener: net::TcpListener, recording: &str) -> Result<Server, String> {
    let files = Files::new(recording)?;
    Server::start("page", listener, move |request| std::future::ready(files.answer(&request)))
}

/// What there is to be had.
#[derive(Clone)]
struct Files {
    index: Bytes,
    run: String,
    viewer: &'static WebViewerData,
}

/// A name that no other server has, by which a page knows its own again: what the standard library keys its hashers with is random.
pub(crate) fn name_of_run() -> String {
    format!("{:016x}", RandomState::new().build_hasher().finish())
}

impl Files {
    fn new(recording: &str) -> Result<Self, String> {
        let run = name_of_run();
        let index = INDEX.replace("{recording}", recording).replace("{run}", &run).into();
        Ok(Self { index, run, viewer: viewer()? })
    }

    fn answer<B>(&self, request: &Request<B>) -> Response<Full<Bytes>> {
        if request.method() != Method::GET && request.method() != Method::HEAD {
            return response(StatusCode::METHOD_NOT_ALLOWED, "text/plain", Bytes::from_static(b"expected GET\n"));
        }
        let viewer = self.viewer;
        let (kind, bytes) = match request.uri().path() {
            "/" | "/index.html" => ("text/html; charset=utf-8", self.index.clone()),
            "/run" => ("text/plain", Bytes::from(self.run.clone())),
            "/start.js" => ("text/javascript", Bytes::from_static(START.as_bytes())),
            "/program.js" => ("text/javascript", Bytes::from_static(PROGRAM.as_bytes())),
            "/re_viewer.js" => ("text/javascript", Bytes::from_static(viewer.viewer_js())),
            "/favicon.ico" => ("image/x-icon", Bytes::from_static(viewer.favicon())),
            "/re_viewer_bg.wasm" => return self.program(request),
            _ => return response(StatusCode::NOT_FOUND, "text/plain", Bytes::from_static(b"no such page\n")),
        };
        response(StatusCode::OK, kind, bytes)
    }

    fn program<B>(&self, request: &Request<B>) -> Response<Full<Bytes>> {
        let program = program(self.viewer, takes_gzip(request.headers()));
        program.measured(response(StatusCode::OK, program.kind, program.bytes.clone()))
    }
}

/// Whether who asks unpacks what comes packed.
pub(crate) fn takes_gzip(headers: &header::HeaderMap) -> bool {
    let accepted = headers.get(header::ACCEPT_ENCODING).and_then(|value| value.to_str().ok());
    accepted.is_some_and(|value| value.split(',').any(|name| name.trim().starts_with("gzip")))
}

/// A file of the bundled viewer, for a page around it.
#[derive(Debug, Clone)]
pub struct Bundled {
    /// Its media type.
    pub kind: &'static str,
    /// Its bytes, or these packed.
    pub bytes: Bytes,
    /// Whether they are packed (gzip).
    pub packed: bool,
    /// How many there are unpacked.
    pub whole: usize,
}

impl Bundled {
    /// An answer with these bytes, which says how they are packed and how many there are.
    pub(crate) fn measured<B>(&self, mut answer: Response<B>) -> Response<B> {
        if self.packed {
            answer.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        }
        // The page shows how much has come, and sees unpacked bytes only.
        answer.headers_mut().insert("rerun-final-length", self.whole.into());
        answer
    }
}

/// The viewer's file at this path (`/program.js`, `/re_viewer.js`, `/re_viewer_bg.wasm`, `/favicon.ico`); none elsewhere, or where this
/// program was built without the viewer.
#[must_use]
pub fn bundled(path: &str, packed: bool) -> Option<Bundled> {
    let viewer = viewer().ok()?;
    let plain = |kind, bytes: &'static [u8]| Bundled {
        kind,
        bytes: Bytes::from_static(bytes),
        packed: false,
        whole: bytes.len(),
    };
    match path {
        "/program.js" => Some(plain("text/javascript", PROGRAM.as_bytes())),
        "/re_viewer.js" => Some(plain("text/javascript", viewer.viewer_js())),
        "/re_viewer_bg.wasm" => Some(program(viewer, packed)),
        "/favicon.ico" => Some(plain("image/x-icon", viewer.favicon())),
        _ => None,
    }
}

fn program(viewer: &'static WebViewerData, takes_gzip: bool) -> Bundled {
    let wasm = viewer.viewer_wasm();
    let packed = PACKED.get().filter(|_| takes_gzip);
    let bytes = packed.cloned().unwrap_or_else(|| Bytes::from_static(wasm));
    Bundled { kind: "application/wasm", bytes, packed: packed.is_some(), whole: wasm.len() }
}

/// The viewer's files.
fn viewer() -> Result<&'static WebViewerData, String> {
    static VIEWER: OnceLock<WebViewerData> = OnceLock::new();
    if let Some(viewer) = VIEWER.get() {
        return Ok(viewer);
    }
    let loaded = WebViewerData::load(None).map_err(|e| e.to_string())?;
    let viewer = VIEWER.get_or_init(|| loaded);
    // A second of work that a fast connection need not wait for: until it is done the program goes out as it is.
    std::thread::spawn(|| packed(viewer.viewer_wasm()));
    Ok(viewer)
}

static PACKED: OnceLock<Bytes> = OnceLock::new();

/// The viewer's program packed, 42 MB to a third; once in the life of this process.
fn packed(wasm: &[u8]) {
    PACKED.get_or_init(|| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        // Writing to memory does not fail.
        let _ = encoder.write_all(wasm);
        encoder.finish().unwrap_or_default().into()
    });
}

fn response(status: StatusCode, kind: &'static str, bytes: Bytes) -> Response<Full<Bytes>> {
    answer(status, kind, POLICY, Full::new(bytes))
}
