//! Recordings in the web viewer, while they grow and from a file.

use super::super::web;
use super::scene::{PAPER_LIKE, Scene};
use super::{Folder, Layout, RecordError, Recorder, Sink, inspect, options, paths, record_one, step};

#[test]
fn a_served_recording_has_a_page_and_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.rrd");
    let serve = Sink::Serve { web_port: None, grpc_port: None, history_bytes: 1 << 28 };
    let mut both = options(&path, Layout { follow: true, ..Layout::default() });
    both.sinks.push(serve);
    let mut recorder = Recorder::open(both).unwrap();
    let url = recorder.web_url().unwrap().to_owned();
    assert!(url.starts_with("http://127.0.0.1:") && url.ends_with('/'), "{url}");
    let scene = Scene::new(1);
    let solved = scene.solve("Table 3", &PAPER_LIKE);
    recorder.body(0, &scene.body).unwrap();
    recorder.garment(0, &scene.garment).unwrap();
    recorder.step(&step(0, &scene, &solved, &[])).unwrap();
    let page = get(&url);
    assert!(page.contains("200 OK") && page.contains("<html"), "{page}");
    recorder.finish().unwrap();
    assert!(inspect::read(&path).entities.contains_key(paths::DRAPE));
}

#[test]
fn recordings_are_served_and_other_files_are_refused() {
    let folder = Folder::new();
    let path = folder.file("viewed.rrd");
    record_one(&path, 1);
    let served = web::serve_file(&path, None, None).unwrap();
    assert!(get(served.url()).contains("200 OK"));
    for (name, content) in [("text.rrd", "not a recording"), ("empty.rrd", "")] {
        let other = folder.file(name);
        std::fs::write(&other, content).unwrap();
        let error = web::serve_file(&other, None, None).err().unwrap();
        assert!(matches!(error, RecordError::NotARecording { .. }), "{error}");
    }
    let error = web::serve_file(&folder.file("none.rrd"), None, None).err().unwrap();
    assert!(matches!(error, RecordError::Unreadable { .. }), "{error}");
}

/// The answer to one HTTP request, headers and all.
fn get(url: &str) -> String {
    use std::io::{Read as _, Write as _};
    let (host, path) = url.trim_start_matches("http://").split_once('/').unwrap();
    let mut stream = std::net::TcpStream::connect(host).unwrap();
    write!(stream, "GET /{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}
