//! Answers: whole ones, and those that go on while somebody reads.

use std::convert::Infallible;

use http_body_util::combinators::UnsyncBoxBody;
use http_body_util::{BodyExt as _, Full, StreamBody};
use hyper::body::{Bytes, Frame};
use hyper::header::HeaderValue;
use hyper::{Response, StatusCode};
use tokio::sync::mpsc::Receiver;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;

/// What a browser may do on the page. WebAssembly is compiled code, which needs leave of its own; the viewer sets styles and draws
/// pictures it made.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; font-src 'self' data:; worker-src 'self' blob:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The body of an answer: all at once, or piece by piece as long as they come.
pub(super) type Answer = UnsyncBoxBody<Bytes, Infallible>;

/// An answer of this kind.
fn answer(status: StatusCode, kind: &'static str, body: Answer) -> Response<Answer> {
    let mut response = crate::record::answer(status, kind, POLICY, body);
    response.headers_mut().insert("cross-origin-resource-policy", HeaderValue::from_static("same-origin"));
    response
}

pub(super) fn whole(status: StatusCode, kind: &'static str, bytes: impl Into<Bytes>) -> Response<Answer> {
    answer(status, kind, Full::new(bytes.into()).boxed_unsync())
}

/// An answer that goes on.
pub(super) fn flowing(kind: &'static str, pieces: Receiver<Bytes>) -> Response<Answer> {
    let frames = ReceiverStream::new(pieces).map(|bytes| Ok(Frame::data(bytes)));
    answer(StatusCode::OK, kind, StreamBody::new(frames).boxed_unsync())
}

/// A refusal, as JSON: `{"error": sentence}`.
pub(super) fn refusal(status: StatusCode, sentence: &str) -> Response<Answer> {
    let text = serde_json::json!({ "error": crate::base::error_text::short(sentence) }).to_string();
    whole(status, "application/json", text + "\n")
}
