//! The viewer's page and its recording, served on 127.0.0.1. Nothing on it loads from another host.
//!
//! The viewer is Rerun's, as its crate bundles it. The page around it is ours: Rerun's own loads fonts, news and statistics from
//! elsewhere. The Content-Security-Policy forbids the browser every other host.

mod hosts;
mod recording;
mod server;

use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::Write as _;
use std::sync::{Arc, OnceLock};

use axum::Extension;
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::middleware::{Next, from_fn};
use axum::response::Response;
use axum::routing::get;
use flate2::Compression;
use flate2::write::GzEncoder;
use re_web_viewer_server::WebViewerData;

pub(crate) use hosts::{Hosts, Refused};
pub(super) use recording::Recording;
pub use server::Limits;
pub(crate) use server::{Connection, Server};

/// Content-Security-Policy of a page with the viewer. WebAssembly needs a separate permission; the viewer sets inline styles and
/// draws images from blobs.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; font-src 'self' data:; worker-src 'self' blob:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The page, the viewer and `recording`.
pub(super) fn router(recording: &Recording) -> Result<Router, String> {
    viewer()?;
    let run = name_of_run();
    let index = include_str!("index.html").replace("{run}", &run);
    let index = move || std::future::ready(whole(StatusCode::OK, "text/html; charset=utf-8", index.clone()));
    let start = || async { whole(StatusCode::OK, "text/javascript", include_str!("start.js")) };
    Ok(Router::new()
        .route("/", get(index.clone()))
        .route("/index.html", get(index))
        .route("/run", get(move || std::future::ready(whole(StatusCode::OK, "text/plain", run.clone()))))
        .route("/start.js", get(start))
        .fallback(|request: Request| async move { file(&request).map_err(refusal) })
        .merge(recording.router())
        .layer(from_fn(check)))
}

/// Refuses requests for other hosts and from other pages before any route sees them.
async fn check(Extension(connection): Extension<Arc<Connection>>, request: Request, next: Next) -> Response {
    if let Err(refused) = Hosts::default().check(request.headers(), request.uri()) {
        return refusal(refused);
    }
    // Pages of other sites load images and scripts without `Origin`, but their POST requests have one.
    if request.method() == Method::POST {
        connection.authorise();
    }
    next.run(request).await
}

fn refusal((status, sentence): Refused) -> Response {
    whole(status, "text/plain", sentence + "\n")
}

/// A file of the viewer; it contains no data of a recording or session.
pub(crate) fn file(request: &Request) -> Result<Response, Refused> {
    let (method, path) = (request.method(), request.uri().path());
    if ![Method::GET, Method::HEAD].contains(method) {
        return Err((StatusCode::METHOD_NOT_ALLOWED, format!("found {method} {path}, expected GET")));
    }
    let failed = |reason| (StatusCode::INTERNAL_SERVER_ERROR, reason);
    let viewer = viewer().map_err(failed)?;
    let (kind, bytes) = match path {
        "/program.js" => ("text/javascript", include_bytes!("program.js").as_slice()),
        "/re_viewer.js" => ("text/javascript", viewer.viewer_js()),
        "/favicon.ico" => ("image/x-icon", viewer.favicon()),
        "/re_viewer_bg.wasm" => return Ok(program(viewer.viewer_wasm(), takes_gzip(request.headers()))),
        _ => return Err((StatusCode::NOT_FOUND, format!("found {path}, expected a page of this server"))),
    };
    Ok(whole(StatusCode::OK, kind, bytes))
}

/// The program of the viewer. The page shows the progress of its download in uncompressed bytes, so their number is sent too.
fn program(wasm: &'static [u8], takes_gzip: bool) -> Response {
    let packed = PACKED.get().filter(|_| takes_gzip).cloned();
    let is_packed = packed.is_some();
    let bytes = packed.unwrap_or_else(|| Bytes::from_static(wasm));
    let mut response = whole(StatusCode::OK, "application/wasm", bytes);
    response.headers_mut().insert("rerun-final-length", wasm.len().into());
    if is_packed {
        response.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    response
}

/// A complete response with the headers of the security policy; browsers do not cache it.
pub(crate) fn whole(status: StatusCode, kind: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        // The next server on this port may have another version.
        (header::CACHE_CONTROL, "no-cache"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// A random name of this server, by which a page recognises it after a restart: the standard library keys its hashers at random.
pub(crate) fn name_of_run() -> String {
    format!("{:016x}", RandomState::new().build_hasher().finish())
}

/// The first value of a parameter of the address, decoded.
pub(crate) fn query(uri: &Uri, name: &str) -> Option<String> {
    let mut pairs = form_urlencoded::parse(uri.query()?.as_bytes());
    pairs.find(|(key, _)| key == name).map(|(_, value)| value.into_owned())
}

fn takes_gzip(headers: &HeaderMap) -> bool {
    let accepted = headers.get(header::ACCEPT_ENCODING).and_then(|value| value.to_str().ok());
    accepted.is_some_and(|value| value.split(',').any(|name| name.trim().starts_with("gzip")))
}

/// The viewer's files; an error where this program was built without them.
fn viewer() -> Result<&'static WebViewerData, String> {
    static VIEWER: OnceLock<WebViewerData> = OnceLock::new();
    if let Some(viewer) = VIEWER.get() {
        return Ok(viewer);
    }
    let loaded = WebViewerData::load(None).map_err(|e| e.to_string())?;
    let viewer = VIEWER.get_or_init(|| loaded);
    // Compression takes a second. Until it is done, the program is sent uncompressed.
    std::thread::spawn(|| pack(viewer.viewer_wasm()));
    Ok(viewer)
}

static PACKED: OnceLock<Bytes> = OnceLock::new();

/// Compresses the program of the viewer once per process, from 42 MB to a third.
fn pack(wasm: &[u8]) {
    PACKED.get_or_init(|| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        // Writing to memory does not fail.
        let _ = encoder.write_all(wasm);
        encoder.finish().unwrap_or_default().into()
    });
}
