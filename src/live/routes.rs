//! What is asked for and what is answered: the page's files, and the API.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use http_body_util::{BodyExt as _, LengthLimitError, Limited};
use hyper::body::{Body, Bytes, Incoming};
use hyper::header::{self, HeaderValue};
use hyper::{Method, Request, Response, StatusCode, Uri};
use serde_json::{Value, json};
use tokio::sync::mpsc::Receiver;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use super::access::{Access, Refused, Right, check_site, may, query};
use super::body::{Answer, flowing, refusal, whole};
use super::events::{MOST_FLOWS, events, stream};
use super::pieces::Pieces;
use super::{garment, report};
use crate::base::files::names_a_file;
use crate::parts::range_table::RangeTable;
use crate::record::{bundled, takes_gzip};
use crate::session::{Edit, EditError, Session, TableEdit};
use crate::study::job::Job;
use crate::study::sweep::sweep_file;

/// Bytes of the longest request.
const LONGEST: usize = 1 << 20;

/// How long a request's body may take.
const PATIENCE: Duration = Duration::from_secs(20);

/// The page's own files.
const FILES: [(&str, &str, &str); 7] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("page/style.css")),
    ("/main.js", "text/javascript; charset=utf-8", include_str!("page/main.js")),
    ("/session.js", "text/javascript; charset=utf-8", include_str!("page/session.js")),
    ("/dial.js", "text/javascript; charset=utf-8", include_str!("page/dial.js")),
    ("/numbers.js", "text/javascript; charset=utf-8", include_str!("page/numbers.js")),
    ("/viewer.js", "text/javascript; charset=utf-8", include_str!("page/viewer.js")),
];

/// What is served, and to whom.
pub(super) struct Site {
    pub(super) session: Session,
    pub(super) access: Access,
    pub(super) files: Vec<PathBuf>,
    pub(super) pieces: Arc<Pieces>,
    pub(super) news: watch::Receiver<u64>,
    /// Places of readers of what goes on.
    pub(super) flows: Arc<Semaphore>,
    /// By which a page knows this server again.
    pub(super) run: String,
}

/// Answers a request, whatever it is.
pub(super) async fn respond(site: &Arc<Site>, request: Request<Incoming>) -> Response<Answer> {
    match decide(site, request).await {
        Ok(response) => response,
        Err((status, sentence)) => {
            let mut response = refusal(status, &sentence);
            if status == StatusCode::UNAUTHORIZED {
                response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            response
        }
    }
}

async fn decide(site: &Arc<Site>, request: Request<Incoming>) -> Result<Response<Answer>, Refused> {
    site.access.check_origin(request.headers())?;
    // The address as it is printed ends in a slash, and what is put behind it begins with one.
    let path = format!("/{}", request.uri().path().trim_start_matches('/'));
    let Some(of_api) = path.strip_prefix("/api/") else { return file(&request, &path) };
    check_site(request.headers())?;
    let right = site.access.right(request.headers(), request.uri())?;
    may(right, request.method())?;
    let method = request.method().clone();
    match (&method, of_api) {
        (&Method::GET, "state") => {
            let mut state = report::state(&site.session.snapshot());
            state["may_steer"] = json!(right == Right::Control);
            state["run"] = json!(site.run);
            Ok(json_of(&state))
        }
        (&Method::GET, "choices") => Ok(json_of(&report::choices())),
        (&Method::GET, "events") => flow(site, "text/event-stream", events),
        (&Method::GET, "stream") => match site.pieces.broken() {
            None => flow(site, "application/octet-stream", stream),
            Some(why) => Err((StatusCode::INTERNAL_SERVER_ERROR, format!("nothing to show: {why}"))),
        },
        (&Method::GET, "drape.obj" | "part" | "job.toml" | "table.toml" | "sweep.toml") => {
            let (site, uri, what) = (Arc::clone(site), request.uri().clone(), of_api.to_owned());
            apart(move || read(&site.session, &what, &uri)).await
        }
        (&Method::PATCH, "state") => patch(site, request).await,
        (&Method::POST, "undo" | "redo") => {
            let undo = of_api == "undo";
            changed(site, move |session| if undo { session.undo() } else { session.redo() }).await
        }
        (&Method::POST, "pins") => {
            let label = label(&body(request).await?)?;
            changed(site, move |session| session.pin(label)).await
        }
        (&Method::DELETE, pin) if pin.starts_with("pins/") => {
            let id = pin.trim_start_matches("pins/").parse().ok();
            if id.is_some_and(|id| site.session.unpin(id)) {
                return Ok(json_of(&report::event(&site.session.snapshot())));
            }
            Err((StatusCode::NOT_FOUND, format!("found {path}, expected a pin there is")))
        }
        (_, "state" | "choices" | "events" | "stream" | "drape.obj" | "part" | "job.toml" | "table.toml" | "undo")
        | (_, "redo" | "pins" | "sweep.toml") => {
            let expected =
                if of_api == "state" { "GET or PATCH" } else { "another method; see `partwise live --help`" };
            Err((StatusCode::METHOD_NOT_ALLOWED, format!("found {method} {path}, expected {expected}")))
        }
        _ => Err((StatusCode::NOT_FOUND, format!("found {path}, expected what `partwise live --help` lists"))),
    }
}

/// The page's files and the viewer's; they hold nothing of the session, so whoever may reach the server may have them.
fn file(request: &Request<Incoming>, path: &str) -> Result<Response<Answer>, Refused> {
    if ![Method::GET, Method::HEAD].contains(request.method()) {
        return Err((StatusCode::METHOD_NOT_ALLOWED, format!("found {} {path}, expected GET", request.method())));
    }
    if let Some((_, kind, text)) = FILES.iter().find(|(known, _, _)| *known == path) {
        return Ok(whole(StatusCode::OK, kind, Bytes::from_static(text.as_bytes())));
    }
    let none = || (StatusCode::NOT_FOUND, format!("found {path}, expected / or what `partwise live --help` lists"));
    let bundled = bundled(path, takes_gzip(request.headers())).ok_or_else(none)?;
    Ok(bundled.measured(whole(StatusCode::OK, bundled.kind, bundled.bytes.clone())))
}

fn flow(
    site: &Arc<Site>,
    kind: &'static str,
    open: fn(&Arc<Site>, OwnedSemaphorePermit) -> Receiver<Bytes>,
) -> Result<Response<Answer>, Refused> {
    let full = |_| (StatusCode::SERVICE_UNAVAILABLE, format!("{MOST_FLOWS} readers are there already; close a page"));
    let place = Arc::clone(&site.flows).try_acquire_owned().map_err(full)?;
    Ok(flowing(kind, open(site, place)))
}

/// An edit as JSON, or a range table or a whole job as TOML.
async fn patch(site: &Arc<Site>, request: Request<Incoming>) -> Result<Response<Answer>, Refused> {
    let gesture = query(request.uri(), "gesture").map(|text| {
        let wrong = || (StatusCode::BAD_REQUEST, format!("found gesture={text}, expected a whole number"));
        text.parse::<u64>().map_err(|_| wrong())
    });
    let gesture = gesture.transpose()?;
    let kind = request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    let kind = kind.split(';').next().unwrap_or("").trim().to_owned();
    let files = site.files.clone();
    let bytes = match kind.as_str() {
        "application/json" | "application/toml" => body(request).await?,
        found => {
            let said = format!("found Content-Type: {found}, expected application/json or application/toml");
            return Err((StatusCode::UNSUPPORTED_MEDIA_TYPE, said));
        }
    };
    if kind == "application/json" {
        // A list would do for a structure.
        if bytes.trim_ascii_start().first() != Some(&b'{') {
            return Err((StatusCode::BAD_REQUEST, "expected an object such as {\"fabric\": \"denim\"}".to_owned()));
        }
        let edit: Edit = serde_json::from_slice(&bytes).map_err(|e| malformed(&e))?;
        edit.names().into_iter().try_for_each(|name| known(name, &files))?;
        return changed(site, move |session| session.submit(&edit, gesture)).await;
    }
    let text = String::from_utf8(bytes.to_vec()).map_err(|e| malformed(&e))?;
    let fields: toml::Table = text.parse().map_err(|e: toml::de::Error| malformed(&e.message()))?;
    if fields.contains_key("levels") {
        let table = RangeTable::parse(&text, "the table").map_err(|e| unusable(&e))?;
        let edit = Edit { table: Some(TableEdit::Rule(table.into())), ..Edit::default() };
        return changed(site, move |session| session.submit(&edit, gesture)).await;
    }
    let job: Job = toml::from_str(&text).map_err(|e| malformed(&e.message()))?;
    [&job.scene.body, &job.scene.garment, &job.scene.rest].into_iter().try_for_each(|name| known(name, &files))?;
    changed(site, move |session| session.submit_job(job)).await
}

/// A request can name what is built in and what the command line named; no other file is opened for it.
fn known(name: &str, files: &[PathBuf]) -> Result<(), Refused> {
    if !names_a_file(name) || files.iter().any(|file| file.as_os_str() == name) {
        return Ok(());
    }
    let said = format!("found the file {name}, expected something built in, or a file of the command line");
    Err((StatusCode::FORBIDDEN, said))
}

/// Changes the session apart from the thread that serves, and answers with the state it is in then.
async fn changed(
    site: &Arc<Site>,
    change: impl FnOnce(&Session) -> Result<u64, EditError> + Send + 'static,
) -> Result<Response<Answer>, Refused> {
    let session = site.session.clone();
    apart(move || {
        change(&session).map_err(|e| unusable(&e))?;
        Ok(json_of(&report::event(&session.snapshot())))
    })
    .await
}

async fn apart(
    work: impl FnOnce() -> Result<Response<Answer>, Refused> + Send + 'static,
) -> Result<Response<Answer>, Refused> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|e| Err((StatusCode::INTERNAL_SERVER_ERROR, e.to_string())))
}

fn read(session: &Session, what: &str, uri: &Uri) -> Result<Response<Answer>, Refused> {
    let snapshot = session.snapshot();
    match what {
        "drape.obj" => garment::obj(&snapshot, uri).map(|bytes| whole(StatusCode::OK, "model/obj", bytes)),
        "part" => garment::part(&snapshot, uri).map(|found| json_of(&found)),
        "job.toml" => {
            let text = toml::to_string(&*snapshot.job).map_err(|e| unusable(&e))?;
            Ok(whole(StatusCode::OK, "application/toml", text))
        }
        "sweep.toml" => {
            let pins: Vec<(String, Job)> =
                snapshot.pins.iter().map(|p| (p.label.clone(), Job::clone(&p.job))).collect();
            if pins.is_empty() {
                let said =
                    "nothing is pinned yet: a sweep file has a point for each pinned state; POST /api/pins pins one";
                return Err((StatusCode::CONFLICT, said.to_owned()));
            }
            let text = sweep_file("pinned states", &pins).map_err(|e| (StatusCode::CONFLICT, e.to_string()))?;
            Ok(whole(StatusCode::OK, "application/toml", text))
        }
        _ => match &snapshot.sectioned {
            Some(found) => Ok(whole(StatusCode::OK, "application/toml", found.table.to_toml())),
            None => Err((StatusCode::CONFLICT, "no table yet: the garment is still being made".to_owned())),
        },
    }
}

/// A request's body, as long as it may be.
async fn body(request: Request<Incoming>) -> Result<Bytes, Refused> {
    let long = || (StatusCode::PAYLOAD_TOO_LARGE, format!("found more than {LONGEST} bytes, expected an edit"));
    if request.body().size_hint().lower() > LONGEST as u64 {
        return Err(long());
    }
    match tokio::time::timeout(PATIENCE, Limited::new(request.into_body(), LONGEST).collect()).await {
        Ok(Ok(all)) => Ok(all.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(long()),
        Ok(Err(error)) => Err((StatusCode::BAD_REQUEST, format!("the request broke off: {error}"))),
        Err(_) => Err((StatusCode::REQUEST_TIMEOUT, format!("the body did not come in {} s", PATIENCE.as_secs()))),
    }
}

/// The label of a pin: `{"label": "..."}` or nothing.
fn label(bytes: &Bytes) -> Result<Option<String>, Refused> {
    if bytes.is_empty() {
        return Ok(None);
    }
    let given: Value = serde_json::from_slice(bytes).map_err(|e| malformed(&e))?;
    match given.get("label") {
        None => Ok(None),
        Some(Value::String(label)) => Ok(Some(label.chars().filter(|c| !c.is_control()).take(60).collect())),
        Some(other) => Err((StatusCode::BAD_REQUEST, format!("found label = {other}, expected a text"))),
    }
}

fn json_of(value: &Value) -> Response<Answer> {
    whole(StatusCode::OK, "application/json", value.to_string() + "\n")
}

fn malformed(error: &dyn std::fmt::Display) -> Refused {
    (StatusCode::BAD_REQUEST, format!("{error}"))
}

fn unusable(error: &dyn std::error::Error) -> Refused {
    (StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
}
