//! A server with a session behind it, and a client that can misbehave.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::thread::JoinHandle;
use std::time::Duration;

use partwise::garment::MeshCache;
use partwise::live::{Limits, LiveOptions, LiveServer};
use partwise::session::{Session, Worker};
use partwise::{DVec3, Job, SceneSpec};
use serde_json::Value;

/// A small garment, so that a whole drape takes a moment.
pub(crate) const GARMENT: &str = "flared-skirt@900";

pub(crate) struct Live {
    pub(crate) session: Session,
    pub(crate) address: SocketAddr,
    server: Option<LiveServer>,
    worker: Option<JoinHandle<()>>,
}

pub(crate) fn options() -> LiveOptions {
    LiveOptions {
        address: "127.0.0.1:0".parse().unwrap(),
        host: None,
        control: None,
        read_only: None,
        files: Vec::new(),
        limits: Limits::default(),
        name: "test".to_owned(),
        front: DVec3::NEG_Y,
    }
}

impl Live {
    /// Serves a session, whose first state is finished.
    pub(crate) fn start(options: &LiveOptions) -> Self {
        let session = Session::new(Job { scene: SceneSpec::new("form", GARMENT), ..Job::default() }, true);
        let server = LiveServer::start(&session, options).unwrap();
        let working = session.clone();
        let worker = std::thread::spawn(move || Worker::new(MeshCache::in_user_cache()).run(&working));
        let live = Self { address: server.address(), session, server: Some(server), worker: Some(worker) };
        live.idle();
        live
    }

    /// Waits until nothing is left to compute.
    pub(crate) fn idle(&self) -> Value {
        let mut now = self.session.snapshot();
        while !now.idle {
            now = self.session.newer_than(now.serial, Duration::from_secs(120));
        }
        self.get("/api/state").1
    }

    pub(crate) fn get(&self, path: &str) -> (u16, Value) {
        self.ask("GET", path, &[], "")
    }

    pub(crate) fn patch(&self, json: &str) -> (u16, Value) {
        self.ask("PATCH", "/api/state", &["Content-Type: application/json"], json)
    }

    /// A request, and the status and JSON of its answer.
    pub(crate) fn ask(&self, method: &str, path: &str, headers: &[&str], body: &str) -> (u16, Value) {
        let (status, text) = self.text(method, path, headers, body);
        (status, serde_json::from_str(&text).unwrap_or(Value::String(text)))
    }

    pub(crate) fn text(&self, method: &str, path: &str, headers: &[&str], body: &str) -> (u16, String) {
        let mut lines: Vec<String> = headers.iter().map(|&h| h.to_owned()).collect();
        if !lines.iter().any(|h| h.starts_with("Content-Length") || h.starts_with("Transfer-Encoding")) {
            lines.push(format!("Content-Length: {}", body.len()));
        }
        let mut stream = self.open(method, path, &lines);
        // One that has heard enough may have closed already.
        let _ = stream.write_all(body.as_bytes());
        answer(&mut BufReader::new(stream))
    }

    /// Sends the head of a request and leaves the rest to the caller.
    pub(crate) fn open(&self, method: &str, path: &str, headers: &[String]) -> TcpStream {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        if !headers.iter().any(|h| h.starts_with("Host:")) {
            head += &format!("Host: {}\r\n", self.address);
        }
        for header in headers {
            head += &format!("{header}\r\n");
        }
        stream.write_all((head + "\r\n").as_bytes()).unwrap();
        stream
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.session.close();
        drop(self.server.take());
        self.worker.take().map(JoinHandle::join);
    }
}

/// Status and whole body of an answer.
pub(crate) fn answer(stream: &mut BufReader<TcpStream>) -> (u16, String) {
    let (status, length) = head(stream);
    let mut bytes = Vec::new();
    match length {
        Some(length) => {
            bytes.resize(length, 0);
            stream.read_exact(&mut bytes).unwrap();
        }
        None => {
            let _ = stream.read_to_end(&mut bytes);
        }
    }
    (status, String::from_utf8_lossy(&bytes).into_owned())
}

/// Status and length of an answer.
pub(crate) fn head(stream: &mut BufReader<TcpStream>) -> (u16, Option<usize>) {
    let mut line = String::new();
    stream.read_line(&mut line).unwrap();
    let status = line.split(' ').nth(1).unwrap().parse().unwrap();
    let mut length = None;
    loop {
        line.clear();
        stream.read_line(&mut line).unwrap();
        if line == "\r\n" {
            return (status, length);
        }
        if let Some(value) = line.to_lowercase().strip_prefix("content-length: ") {
            length = value.trim().parse().ok();
        }
    }
}

/// The next chunk of an answer that goes on.
pub(crate) fn chunk(stream: &mut BufReader<TcpStream>) -> Vec<u8> {
    let mut line = String::new();
    stream.read_line(&mut line).unwrap();
    let mut bytes = vec![0; usize::from_str_radix(line.trim(), 16).unwrap() + 2];
    stream.read_exact(&mut bytes).unwrap();
    bytes.truncate(bytes.len() - 2);
    bytes
}
