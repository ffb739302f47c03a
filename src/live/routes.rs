//! The routes: the page's files, and the API that `assets/live/http.md` describes.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes, HttpBody as _};
use axum::extract::{DefaultBodyLimit, FromRequest as _, Request, State};
use axum::http::header::{self, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{delete, get, post};
use axum::{Extension, Router};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::mpsc::Receiver;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;

use super::access::{Right, check_site, may};
use super::events::{MAX_READERS, Site, events, stream};
use super::{garment, report};
use crate::base::error_text;
use crate::parts::range_table::RangeTable;
use crate::record::{Connection, Refused, file, query, whole};
use crate::scene::FileRole;
use crate::session::{Edit, EditError, Session, TableEdit};
use crate::study::job::Job;
use crate::study::sweep::sweep_file;

/// Largest request body, bytes.
const MAX_BODY: usize = 1 << 20;

/// Time in which a request body must arrive.
const BODY_TIMEOUT: Duration = Duration::from_secs(20);

/// The page's own files.
const FILES: [(&str, &str, &str); 10] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("/main.js", "text/javascript; charset=utf-8", include_str!("page/main.js")),
    ("/theme.js", "text/javascript; charset=utf-8", include_str!("page/theme.js")),
    ("/session.js", "text/javascript; charset=utf-8", include_str!("page/session.js")),
    ("/fields.js", "text/javascript; charset=utf-8", include_str!("page/fields.js")),
    ("/dial.js", "text/javascript; charset=utf-8", include_str!("page/dial.js")),
    ("/numbers.js", "text/javascript; charset=utf-8", include_str!("page/numbers.js")),
    ("/views.js", "text/javascript; charset=utf-8", include_str!("page/views.js")),
    ("/viewer.js", "text/javascript; charset=utf-8", include_str!("page/viewer.js")),
];

/// A refused request: status and sentence, sent as `{"error": sentence}`.
struct Refusal(StatusCode, String);

impl From<Refused> for Refusal {
    fn from((status, sentence): Refused) -> Self {
        Self(status, sentence)
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let text = json!({ "error": error_text::short(&self.1) }).to_string();
        let mut response = whole(self.0, "application/json", text + "\n");
        if self.0 == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

type Answer = Result<Response, Refusal>;

/// All routes of a site. The page's files hold nothing of the session and need no token.
pub(super) fn router(site: Arc<Site>) -> Router {
    let mut router = Router::new()
        .route("/api/state", get(state).patch(patch))
        .route("/api/choices", get(async || json_of(&report::choices())))
        .route("/api/events", get(async |State(site): State<Arc<Site>>| flow(&site, "text/event-stream", events)))
        .route("/api/stream", get(pieces))
        .route("/api/undo", post(async |State(site): State<Arc<Site>>| changed(site, Session::undo).await))
        .route("/api/redo", post(async |State(site): State<Arc<Site>>| changed(site, Session::redo).await))
        .route("/api/pins", post(pin))
        .route("/api/pins/{id}", delete(unpin));
    for path in [
        "/api/drape.obj",
        "/api/part",
        "/api/outline",
        "/api/eye",
        "/api/fit",
        "/api/job.toml",
        "/api/table.toml",
        "/api/sweep.toml",
    ] {
        router = router.route(path, get(read));
    }
    router = router.route_layer(from_fn_with_state(Arc::clone(&site), authorise));
    for (path, kind, text) in FILES {
        router = router.route(path, get(move || std::future::ready(whole(StatusCode::OK, kind, text))));
    }
    router
        .method_not_allowed_fallback(wrong_method)
        .fallback(async |request: Request| file(&request).map_err(Refusal::from))
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(from_fn_with_state(Arc::clone(&site), check_host))
        .with_state(site)
}

async fn check_host(State(site): State<Arc<Site>>, request: Request, next: Next) -> Answer {
    site.access.hosts.check(request.headers(), request.uri())?;
    Ok(next.run(request).await)
}

async fn authorise(
    State(site): State<Arc<Site>>,
    Extension(connection): Extension<Arc<Connection>>,
    mut request: Request,
    next: Next,
) -> Answer {
    check_site(request.headers())?;
    let right = site.access.right(request.headers(), request.uri())?;
    may(right, request.method())?;
    connection.authorise();
    request.extensions_mut().insert(right);
    Ok(next.run(request).await)
}

async fn wrong_method(method: Method, uri: Uri) -> Refusal {
    let path = uri.path();
    let expected = match path {
        "/api/state" => "GET or PATCH",
        path if path.starts_with("/api/") => "another method; see `partwise live --help`",
        _ => "GET",
    };
    Refusal(StatusCode::METHOD_NOT_ALLOWED, format!("found {method} {path}, expected {expected}"))
}

async fn state(State(site): State<Arc<Site>>, Extension(right): Extension<Right>) -> Response {
    let mut state = report::state(&site.session.snapshot());
    state["may_steer"] = json!(right == Right::Control);
    state["run"] = json!(site.run);
    json_of(&state)
}

async fn pieces(State(site): State<Arc<Site>>) -> Answer {
    match site.pieces.error() {
        None => flow(&site, "application/octet-stream", stream),
        Some(why) => Err(Refusal(StatusCode::INTERNAL_SERVER_ERROR, format!("nothing to show: {why}"))),
    }
}

/// A streamed response.
fn flow(site: &Arc<Site>, kind: &'static str, open: fn(&Arc<Site>, OwnedSemaphorePermit) -> Receiver<Bytes>) -> Answer {
    let Ok(permit) = Arc::clone(&site.readers).try_acquire_owned() else {
        let full = format!("found {MAX_READERS} readers already; close a page");
        return Err(Refusal(StatusCode::SERVICE_UNAVAILABLE, full));
    };
    let pieces = ReceiverStream::new(open(site, permit)).map(Ok::<_, std::convert::Infallible>);
    Ok(whole(StatusCode::OK, kind, Body::from_stream(pieces)))
}

/// An edit as JSON, or a range table or a whole job as TOML.
async fn patch(State(site): State<Arc<Site>>, request: Request) -> Answer {
    let gesture = query(request.uri(), "gesture").map(|text| {
        let wrong = |_| (StatusCode::BAD_REQUEST, format!("found gesture={text}, expected a whole number"));
        text.parse::<u64>().map_err(wrong)
    });
    let gesture = gesture.transpose()?;
    let kind = request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    let kind = kind.split(';').next().unwrap_or("").trim().to_owned();
    if !["application/json", "application/toml"].contains(&kind.as_str()) {
        let refused = format!("found Content-Type: {kind}, expected application/json or application/toml");
        return Err(Refusal(StatusCode::UNSUPPORTED_MEDIA_TYPE, refused));
    }
    let bytes = body(request).await?;
    if kind == "application/json" {
        // Serde would read a list as a structure.
        if bytes.trim_ascii_start().first() != Some(&b'{') {
            return Err(malformed(&"expected an object such as {\"fabric\": \"denim\"}"));
        }
        let edit: Edit = serde_json::from_slice(&bytes).map_err(|e| {
            let text = e.to_string();
            // The place in the request helps with syntax alone; the page shows the rest to readers who wrote no JSON.
            malformed(&if e.is_data() {
                text.rsplit_once(" at line ").map_or(&*text, |(reason, _)| reason)
            } else {
                &*text
            })
        })?;
        let named = known(&edit.file_names(), &site.files)?;
        return changed_by(site, named, move |session| session.submit(&edit, gesture)).await;
    }
    let text = String::from_utf8(bytes.to_vec()).map_err(|e| malformed(&e))?;
    let fields: toml::Table = text.parse().map_err(|e: toml::de::Error| malformed(&e.message()))?;
    if fields.contains_key("levels") {
        let table = RangeTable::parse(&text, "the table").map_err(|e| unusable(&e))?;
        let edit = Edit { table: Some(TableEdit::Rule(table.into())), ..Edit::default() };
        return changed(site, move |session| session.submit(&edit, gesture)).await;
    }
    let job: Job = toml::from_str(&text).map_err(|e| malformed(&e.message()))?;
    let named = known(&job.file_names(), &site.files)?;
    changed_by(site, named, move |session| session.submit_job(job)).await
}

/// Refuses every file but those that the command line named in the same field, without opening it; returns one that is named.
fn known(named: &[(FileRole, &str)], files: &[(FileRole, String)]) -> Result<Option<String>, Refusal> {
    let given = |role: FileRole, name: &str| files.iter().any(|(of, file)| (*of, file.as_str()) == (role, name));
    match named.iter().find(|(role, name)| !given(*role, name)) {
        None => Ok(named.first().map(|(_, name)| (*name).to_owned())),
        Some((role, name)) => {
            let expected = "a built-in name, or the file of the command line in the same field";
            Err(Refusal(StatusCode::FORBIDDEN, format!("found the file {name} as {role:?}, expected {expected}")))
        }
    }
}

/// Changes the session on another thread, and answers with the state after it.
async fn changed(site: Arc<Site>, change: impl FnOnce(&Session) -> Result<u64, EditError> + Send + 'static) -> Answer {
    changed_by(site, None, change).await
}

/// The same by an edit that may name a `file`: its refusal does not quote the file.
async fn changed_by(
    site: Arc<Site>,
    file: Option<String>,
    change: impl FnOnce(&Session) -> Result<u64, EditError> + Send + 'static,
) -> Answer {
    apart(move || {
        change(&site.session).map_err(|error| match file {
            None => unusable(&error),
            Some(file) => Refusal(StatusCode::UNPROCESSABLE_ENTITY, report::unusable_file(&file)),
        })?;
        Ok(json_of(&report::event(&site.session.snapshot())))
    })
    .await
}

async fn apart(work: impl FnOnce() -> Answer + Send + 'static) -> Answer {
    // A panic's message stays on the terminal.
    let failed =
        |_| Err(Refusal(StatusCode::INTERNAL_SERVER_ERROR, "this request failed by a fault of the program".into()));
    tokio::task::spawn_blocking(work).await.unwrap_or_else(failed)
}

/// Results of the newest state: files, and PARTs one by one.
async fn read(State(site): State<Arc<Site>>, uri: Uri) -> Answer {
    apart(move || {
        let snapshot = site.session.snapshot();
        let toml = |text: String| whole(StatusCode::OK, "application/toml", text);
        match uri.path() {
            "/api/drape.obj" => Ok(whole(StatusCode::OK, "model/obj", garment::obj(&snapshot, &uri)?)),
            "/api/part" => Ok(json_of(&garment::part(&snapshot, &uri)?)),
            "/api/outline" => {
                let bytes = garment::outline(&snapshot, &uri, site.pieces.recording())?;
                Ok(whole(StatusCode::OK, "application/octet-stream", bytes))
            }
            "/api/eye" => {
                let bytes = garment::eye(&snapshot, &uri, &site.pieces)?;
                Ok(whole(StatusCode::OK, "application/octet-stream", bytes))
            }
            "/api/fit" => {
                let (bytes, high) = garment::fit(&snapshot, &uri, site.pieces.recording())?;
                let mut response = whole(StatusCode::OK, "application/octet-stream", bytes);
                let high = HeaderValue::from_str(&format!("{high}")).unwrap_or(HeaderValue::from_static("0"));
                response.headers_mut().insert("Fit-High", high);
                Ok(response)
            }
            "/api/job.toml" => Ok(toml(toml::to_string(&*snapshot.job).map_err(|e| unusable(&e))?)),
            "/api/sweep.toml" => {
                let pins: Vec<(String, Job)> =
                    snapshot.pins.iter().map(|p| (p.label.clone(), Job::clone(&p.job))).collect();
                if pins.is_empty() {
                    let none = "found no pinned state, expected one for each point of the sweep; POST /api/pins pins the newest";
                    return Err(Refusal(StatusCode::CONFLICT, none.to_owned()));
                }
                let text = sweep_file("pinned states", &pins);
                Ok(toml(text.map_err(|e| Refusal(StatusCode::CONFLICT, e.to_string()))?))
            }
            _ => match &snapshot.segmented {
                Some(found) => Ok(toml(found.table.to_toml())),
                None => Err(Refusal(StatusCode::CONFLICT, "no table yet: the garment is still being made".to_owned())),
            },
        }
    })
    .await
}

/// The body of a pin.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Pin {
    label: Value,
}

/// Pins the newest state under `{"label": "..."}`, or without a body under its number.
async fn pin(State(site): State<Arc<Site>>, request: Request) -> Answer {
    let bytes = body(request).await?;
    let Pin { label } =
        if bytes.is_empty() { Pin::default() } else { serde_json::from_slice(&bytes).map_err(|e| malformed(&e))? };
    let label = match label {
        Value::Null => None,
        Value::String(label) => Some(label.chars().filter(|c| !c.is_control()).take(60).collect()),
        other => return Err(malformed(&format!("found label = {other}, expected a text"))),
    };
    changed(site, move |session| session.pin(label)).await
}

async fn unpin(State(site): State<Arc<Site>>, uri: Uri) -> Answer {
    let id = uri.path().trim_start_matches("/api/pins/");
    if id.parse().is_ok_and(|id| site.session.unpin(id)) {
        return Ok(json_of(&report::event(&site.session.snapshot())));
    }
    Err(Refusal(StatusCode::NOT_FOUND, format!("found pin {id}, expected the number of a pin of `GET /api/state`")))
}

/// The body of a request, up to [`MAX_BODY`] bytes.
async fn body(request: Request) -> Result<Bytes, Refusal> {
    let long = || Refusal(StatusCode::PAYLOAD_TOO_LARGE, format!("found more than {MAX_BODY} bytes, expected an edit"));
    if request.body().size_hint().lower() > MAX_BODY as u64 {
        return Err(long());
    }
    match tokio::time::timeout(BODY_TIMEOUT, Bytes::from_request(request, &())).await {
        Ok(Ok(bytes)) => Ok(bytes),
        Ok(Err(error)) if error.status() == StatusCode::PAYLOAD_TOO_LARGE => Err(long()),
        Ok(Err(error)) => Err(malformed(&format!("the request broke off: {error}"))),
        Err(_) => {
            let late = format!("the body did not arrive in {} s", BODY_TIMEOUT.as_secs());
            Err(Refusal(StatusCode::REQUEST_TIMEOUT, late))
        }
    }
}

fn json_of(value: &Value) -> Response {
    whole(StatusCode::OK, "application/json", value.to_string() + "\n")
}

fn malformed(error: &dyn std::fmt::Display) -> Refusal {
    Refusal(StatusCode::BAD_REQUEST, error.to_string())
}

fn unusable(error: &dyn std::error::Error) -> Refusal {
    Refusal(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
}
