//! Errors of a recording's sinks.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;

use partwise::record::{RecordError, RecordOptions, Recorder, Sink};

/// A port in use, until the listener is dropped.
fn taken_port() -> (TcpListener, u16) {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    (listener, port)
}

fn open_error(sinks: Vec<Sink>) -> RecordError {
    Recorder::open(RecordOptions { sinks, ..RecordOptions::default() }).err().expect("it must not open")
}

#[test]
fn an_unwritable_path_is_a_user_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    std::fs::write(&file, "no folder").unwrap();
    for path in [file.join("x.rrd"), folder.path().to_owned(), PathBuf::from("/proc/none/x.rrd")] {
        let error = open_error(vec![Sink::File(path.clone())]);
        assert!(matches!(error, RecordError::Unwritable { .. }), "{error}");
        assert!(error.is_users());
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
}

#[test]
fn a_port_in_use_is_named_and_no_file_is_begun() {
    let folder = tempfile::tempdir().unwrap();
    let (_listener, port) = taken_port();
    let serve = |web_port, grpc_port| Sink::Serve { web_port, grpc_port, history_bytes: 1 << 28 };
    for (sink, option) in [(serve(Some(port), None), "--web-port"), (serve(None, Some(port)), "--grpc-port")] {
        let error = open_error(vec![Sink::File(folder.path().join("x.rrd")), sink]);
        assert!(matches!(error, RecordError::PortInUse { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains(&port.to_string()) && text.contains(option), "{text}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn a_missing_viewer_is_reported_when_the_recording_opens() {
    let (listener, port) = taken_port();
    drop(listener);
    let url = format!("rerun+http://127.0.0.1:{port}/proxy");
    let error = open_error(vec![Sink::Connect(url.clone())]);
    assert!(matches!(error, RecordError::Unreachable { .. }), "{error}");
    assert!(error.to_string().contains(&url), "{error}");
    let error = open_error(vec![Sink::Connect("127.0.0.1".into())]);
    assert!(matches!(error, RecordError::BadUrl { .. }), "{error}");
}
