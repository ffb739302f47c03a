//! Clients that take places and give nothing: deaf, silent, idle and slow ones. Control is answered throughout.
//!
//! `PARTWISE_FUZZ_CONNECTIONS` sets the number of hostile connections, and then each answer must come within a second; the
//! default takes a few seconds and has no such limit, as the machine may be busy.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
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
    let (status, seconds) = timed(address, method, path, body);
    assert_eq!(status, 200, "{method} {path}");
    seconds
}

/// The status of a request on a new connection, and its time, s.
fn timed(address: SocketAddr, method: &str, path: &str, body: &str) -> (u16, f64) {
    let began = Instant::now();
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let head = format!("Host: {address}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n", body.len());
    stream.write_all(format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n{head}\r\n{body}").as_bytes()).unwrap();
    let (status, _) = answer(&mut BufReader::new(stream));
    (status, began.elapsed().as_secs_f64())
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

/// An edit by a number: tables, fabrics, sizes, motions, and some that are refused.
fn edit(i: u64) -> String {
    let random = blake3::hash(&i.to_le_bytes());
    let [kind, a, b] = [0, 1, 2].map(|k| f64::from(random.as_bytes()[k]) / 256.0);
    let fabrics = ["denim", "jersey", "silk", "cotton", "no such fabric", "/dev/zero"];
    match (kind * 8.0) as u32 {
        0 | 1 => format!(r#"{{"table": {{"levels": [[0, {}], [{}, "inf"]]}}}}"#, 0.1 + a, 0.1 + a + 9.0 * b),
        2 => format!(r#"{{"table": {{"quantile": {}}}}}"#, (a * 30.0) as u32),
        3 => format!(r#"{{"fabric": "{}"}}"#, fabrics[(a * 6.0) as usize]),
        4 => format!(r#"{{"measurements": {{"waist": {}, "hip": {}}}}}"#, 50.0 + 60.0 * a, 80.0 + 60.0 * b),
        5 => format!(r#"{{"garment": "flared-skirt@{}"}}"#, 400 + (a * 500.0) as u32),
        6 => format!(r#"{{"min_part": {}, "max_extent_cm": [{}]}}"#, (a * 20.0) as u32, 40.0 * b),
        _ => format!(r#"{{"motion": "translation", "refine": {{"steps": {}}}}}"#, (a * 20.0) as u32),
    }
}

/// Starts the program with `arguments`; returns it and the address that it prints.
fn program(arguments: &[&str]) -> (Child, SocketAddr) {
    let mut shell = Command::new("sh");
    shell.args(["-c", "exec \"$0\" \"$@\" 2>&1", env!("CARGO_BIN_EXE_partwise")]).args(arguments);
    let mut child = shell.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
    let address = lines.find_map(|line| line.split_once("http://")?.1.split('/').next()?.parse().ok()).unwrap();
    // A closed pipe would end the program.
    std::thread::spawn(move || lines.for_each(drop));
    (child, address)
}

/// 5,000 edits and 2,000 hostile connections against the program itself, each answered within a second.
#[test]
#[ignore = "takes minutes, and the limit of a second needs a machine that does nothing else"]
#[allow(clippy::print_stderr, reason = "a test that reports what it measured")]
fn live_and_serve_answer_within_a_second_under_edits_and_hostile_connections() {
    let garment = ["--garment", "flared-skirt@900"];
    let cases = [
        (&["live", "--port", "0"][..], "/api/state", [200, 403, 422]),
        (&["--no-save", "--refine", "0", "--serve", "--web-port", "0"][..], "/run", [405, 405, 405]),
    ];
    for (command, control, expected) in cases {
        let (mut child, address) = program(&[command, &garment].concat());
        let (mut edits, mut slowest) = (0, [0.0_f64; 2]);
        attack(address, 2000, || {
            for _ in 0..20 {
                let (status, edited_s) = timed(address, "PATCH", "/api/state", &edit(edits));
                assert!(expected.contains(&status), "{}: {status}", edit(edits));
                edits += 1;
                slowest = [slowest[0].max(edited_s), slowest[1].max(seconds(address, "GET", control, ""))];
            }
            0.0
        });
        let alive = child.try_wait().unwrap().is_none();
        let _ = child.kill();
        let _ = child.wait();
        let [edited_s, read_s] = slowest;
        eprintln!(
            "{command:?}: {edits} edits, the slowest answer after {edited_s:.3} s, {control} after {read_s:.3} s"
        );
        assert!(alive && edits == 5000 && edited_s < 1.0 && read_s < 1.0, "{command:?}");
    }
}
