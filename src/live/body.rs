//! Answers: whole ones, and those that go on while somebody reads.

use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

use hyper::body::{Body, Bytes, Frame, SizeHint};
use hyper::header::HeaderValue;
use hyper::{Response, StatusCode};
use tokio::sync::mpsc::Receiver;

/// What a browser may do on the page. WebAssembly is compiled code, which needs leave of its own; the viewer sets styles and draws
/// pictures it made.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; font-src 'self' data:; worker-src 'self' blob:; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The body of an answer.
pub(super) enum Answer {
    /// All at once.
    Whole(Option<Bytes>),
    /// Piece by piece, as long as they come.
    Flow(Receiver<Bytes>),
}

impl Body for Answer {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        match &mut *self {
            Self::Whole(bytes) => Poll::Ready(bytes.take().map(|bytes| Ok(Frame::data(bytes)))),
            Self::Flow(pieces) => pieces.poll_recv(context).map(|piece| piece.map(|bytes| Ok(Frame::data(bytes)))),
        }
    }

    fn is_end_stream(&self) -> bool {
        matches!(self, Self::Whole(None))
    }

    fn size_hint(&self) -> SizeHint {
        match self {
            Self::Whole(bytes) => SizeHint::with_exact(bytes.as_ref().map_or(0, |bytes| bytes.len() as u64)),
            Self::Flow(_) => SizeHint::default(),
        }
    }
}

/// An answer of this kind.
pub(super) fn answer(status: StatusCode, kind: &'static str, body: Answer) -> Response<Answer> {
    let mut response = crate::record::answer(status, kind, POLICY, body);
    response.headers_mut().insert("cross-origin-resource-policy", HeaderValue::from_static("same-origin"));
    response
}

pub(super) fn whole(status: StatusCode, kind: &'static str, bytes: impl Into<Bytes>) -> Response<Answer> {
    answer(status, kind, Answer::Whole(Some(bytes.into())))
}

/// A refusal, as JSON: `{"error": sentence}`.
pub(super) fn refusal(status: StatusCode, sentence: &str) -> Response<Answer> {
    let text = serde_json::json!({ "error": crate::said::plain(sentence) }).to_string();
    whole(status, "application/json", text + "\n")
}
