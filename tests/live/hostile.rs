//! Clients that take places and give nothing: deaf, silent, idle and slow ones. Control is answered throughout.
//!
//! `PARTWISE_FUZZ_CONNECTIONS` sets the number of hostile connections, and then each answer must come within a second; the
//! default takes a few seconds and has no such limit, as the machine may be busy.

use std::io::{BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use partwise::live::{Limits, LiveOptions};
use partwise::record::web::serve_file;
use partwise::record::{RecordOptions, Recorder, Sink};

use crate::client::{Live, answer, options};

/// Connections to open, and the longest time in which control may be answered, s.
fn size() -> (usize, f64) {
    std::env::var("PARTWISE_FUZZ_CONNECTIONS").map_or((300, f64::INFINITY), |text| (text.parse().unwrap(), 1.0))
}

/// Bytes that a hostile client sends before it goes quiet.
fn opening(kind: usize, address: SocketAddr) -> String {
    let host = format!("Host: {address}\r\n");
    match kind % 6 {
        // Deaf: asks for 42 MB, and reads none of it.
        0 | 1 => format!("GET /re_viewer_bg.wasm HTTP/1.1\r\n{host}\r\n"),
        // Silent.
        2 => String::new(),
        // Half a request.
        3 => format!("GET / HTTP/1.1\r\n{host}X-Slow: "),
        // Idle after one answer that it does not read.
        4 => format!("GET / HTTP/1.1\r\n{host}\r\n"),
        // HTTP/2 without a request.
        _ => "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_owned(),
    }
}

/// Time that the server takes for a request on a new connection, s.
fn seconds(address: SocketAddr, method: &str, path: &str, body: &str) -> f64 {
    let began = Instant::now();
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let head = format!("Host: {address}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n", body.len());
    stream.write_all(format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n{head}\r\n{body}").as_bytes()).unwrap();
    assert_eq!(answer(&mut BufReader::new(stream)).0, 200, "{method} {path}");
    began.elapsed().as_secs_f64()
}

/// Opens `count` hostile connections, which stay open on their side, and sends a byte on earlier ones now and then; returns the
/// longest time of `control` after every eighth.
fn attack(address: SocketAddr, count: usize, mut control: impl FnMut() -> f64) -> f64 {
    let mut held: Vec<TcpStream> = Vec::new();
    let mut longest = 0.0_f64;
    for i in 0..count {
        let mut stream = TcpStream::connect(address).unwrap();
        // The server may have closed any of these by now.
        let _ = stream.write_all(opening(i, address).as_bytes());
        if let Some(mut slow) = held.get(i / 2) {
            let _ = slow.write_all(b"x");
        }
        held.push(stream);
        // File handles of this process have a limit too.
        if held.len() > 280 {
            held.drain(..20);
        }
        if i % 8 == 0 {
            longest = longest.max(control());
        }
    }
    longest
}

#[test]
#[allow(clippy::print_stderr, reason = "a test that reports what it measured")]
fn live_answers_control_among_more_hostile_connections_than_it_has_places() {
    let live = Live::start(&options());
    let ((count, limit_s), address, mut asked) = (size(), live.address, 0);
    let longest = attack(address, count, || {
        asked += 1;
        let edit = format!(r#"{{"table": {{"levels": [[0, {}], [4, "inf"]]}}}}"#, 1.0 + 0.01 * f64::from(asked % 100));
        seconds(address, "PATCH", "/api/state", &edit).max(seconds(address, "GET", "/api/state", ""))
    });
    eprintln!("live: {count} hostile connections, {asked} edits, the slowest answer after {longest:.3} s");
    assert!(longest < limit_s, "{longest} s");
}

#[test]
#[allow(clippy::print_stderr, reason = "a test that reports what it measured")]
fn a_served_recording_answers_among_more_hostile_connections_than_it_has_places() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.rrd");
    let sinks = vec![Sink::File(path.clone())];
    Recorder::open(RecordOptions { sinks, ..RecordOptions::default() }).unwrap().finish().unwrap();
    let served = serve_file(&path, Some(0), None).unwrap();
    let address: SocketAddr = served.url()["http://".len()..].trim_end_matches('/').parse().unwrap();
    let (count, limit_s) = size();
    let longest = attack(address, count, || seconds(address, "GET", "/run", "").max(seconds(address, "GET", "/", "")));
    eprintln!("view: {count} hostile connections, the slowest answer after {longest:.3} s");
    assert!(longest < limit_s, "{longest} s");
}

#[test]
fn an_open_page_keeps_its_events_while_hostile_connections_come_and_go() {
    let limits = Limits { connections: 8, per_peer: 8, ..Limits::default() };
    let live = Live::start(&LiveOptions { limits, ..options() });
    let mut events = BufReader::new(live.open("GET", "/api/events", &[]));
    assert_eq!(crate::client::head(&mut events).0, 200);
    crate::client::chunk(&mut events);
    attack(live.address, 40, || 0.0);
    live.session.submit(&serde_json::from_str(r#"{"fabric": "denim"}"#).unwrap(), None).unwrap();
    assert!(String::from_utf8(crate::client::chunk(&mut events)).unwrap().contains("denim"));
}

#[test]
fn a_client_that_does_not_read_or_write_is_cut_off() {
    let limits = Limits { stall: Duration::from_millis(300), ..Limits::default() };
    let live = Live::start(&LiveOptions { limits, ..options() });
    for kind in [0, 2, 3] {
        let mut stream = TcpStream::connect(live.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream.write_all(opening(kind, live.address).as_bytes()).unwrap();
        let mut bytes = 0;
        if kind == 0 {
            // Until the buffers between are full and the write has waited; the server has closed once no more arrives.
            std::thread::sleep(Duration::from_secs(2));
        }
        let mut buffer = vec![0; 1 << 16];
        while let Ok(read) = stream.read(&mut buffer)
            && read > 0
        {
            bytes += read;
        }
        assert!(bytes < 30_000_000, "kind {kind}: all of the response arrived, {bytes} bytes");
    }
}
