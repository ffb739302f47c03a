//! The served page: nothing on it asks anybody else for anything, and nobody can make it fall over.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use partwise::record::web::{WebViewer, serve_file};
use partwise::record::{RecordOptions, Recorder, Sink};

fn served(folder: &tempfile::TempDir) -> WebViewer {
    served_on(folder, None)
}

fn served_on(folder: &tempfile::TempDir, port: Option<u16>) -> WebViewer {
    let path = folder.path().join("x.rrd");
    let options = RecordOptions { sinks: vec![Sink::File(path.clone())], ..RecordOptions::default() };
    Recorder::open(options).unwrap().finish().unwrap();
    serve_file(&path, port, None).unwrap()
}

/// Host of an address, which has nothing else.
fn host(url: &str) -> &str {
    url.strip_prefix("http://").unwrap().strip_suffix('/').unwrap()
}

/// Head and body of the answer to a request.
fn ask(host: &str, request: &str) -> (String, Vec<u8>) {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream.write_all(request.replace('\n', "\r\n").as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap();
    (String::from_utf8(answer[..end].to_vec()).unwrap().to_lowercase(), answer[end + 4..].to_vec())
}

fn get(host: &str, path: &str) -> (String, Vec<u8>) {
    ask(host, &format!("GET {path} HTTP/1.1\nHost: {host}\nConnection: close\n\n"))
}

/// Addresses in a text that are not on this machine.
fn foreign(text: &str) -> Vec<String> {
    let addresses =
        text.split("//").skip(1).map(|rest| rest.split(['"', '\'', ' ', '<', ';']).next().unwrap_or_default());
    addresses
        .filter(|a| a.contains('.') && !a.starts_with("127.0.0.1") && !a.starts_with("${location.host}"))
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_page_opens_its_recording_without_a_query_and_names_no_foreign_host() {
    let folder = tempfile::tempdir().unwrap();
    let served = served(&folder);
    let host = host(served.url());
    let (head, body) = get(host, "/");
    assert!(head.starts_with("http/1.1 200"), "{head}");
    let page = String::from_utf8(body).unwrap();
    let [start, program] = ["/start.js", "/program.js"].map(|path| String::from_utf8(get(host, path).1).unwrap());
    assert!(
        start.contains("rerun+${location.protocol}//${location.host}/proxy")
            && program.contains("hide_welcome_screen: true")
    );
    for text in [&page, &start, &program] {
        assert_eq!(foreign(text), [""; 0]);
    }
    // The server has the files that the page loads, and no others.
    for path in ["/?url=anything", "/re_viewer.js", "/start.js", "/program.js", "/favicon.ico"] {
        assert!(get(host, path).0.starts_with("http/1.1 200"), "{path}");
    }
    for path in ["/sw.js", "/signed-in", "/../Cargo.toml", "/%2e%2e/Cargo.toml"] {
        assert!(get(host, path).0.starts_with("http/1.1 404"), "{path}");
    }
}

#[test]
fn the_browser_is_forbidden_every_other_host() {
    let folder = tempfile::tempdir().unwrap();
    let served = served(&folder);
    let host = host(served.url());
    for path in ["/", "/start.js", "/re_viewer.js", "/nowhere"] {
        let (head, _) = get(host, path);
        let policy = head.lines().find_map(|line| line.strip_prefix("content-security-policy: ")).unwrap();
        assert!(policy.starts_with("default-src 'none';"), "{policy}");
        for directive in policy.split(';').map(str::trim) {
            for source in directive.split(' ').skip(1) {
                let near = source.starts_with('\'') || ["blob:", "data:"].contains(&source);
                assert!(near, "{path}: {directive}");
            }
        }
        assert!(!policy.contains("'unsafe-eval'") && !policy.contains("script-src 'self' 'unsafe-inline'"), "{policy}");
    }
    // Rerun's own page does ask elsewhere: what is looked for can be found.
    let theirs = re_web_viewer_server::WebViewerData::load(None).unwrap();
    assert!(foreign(&String::from_utf8_lossy(theirs.index_html())).iter().any(|a| a.contains("fonts.g")));
}

#[test]
fn requests_of_any_size_and_kind_leave_the_server_standing() {
    let folder = tempfile::tempdir().unwrap();
    let served = served(&folder);
    let host = host(served.url());
    for length in ["99999999999", "18446744073709551615", "-1", "x"] {
        for method in ["GET", "POST"] {
            let request = format!("{method} / HTTP/1.1\nHost: {host}\nContent-Length: {length}\nConnection: close\n\n");
            let (head, _) = ask(host, &request);
            assert!(head.starts_with("http/1.1 "), "{head}");
        }
    }
    assert!(
        ask(host, &format!("DELETE / HTTP/1.1\nHost: {host}\nConnection: close\n\n")).0.starts_with("http/1.1 405")
    );
    assert!(ask(host, "nonsense\n\n").0.starts_with("http/1.1 400"));
    let long = format!("GET /{} HTTP/1.1\nHost: x\nConnection: close\n\n", "x".repeat(60_000));
    assert!(ask(host, &long).0.starts_with("http/1.1 4"));
    let silent: Vec<TcpStream> = (0..200).map(|_| TcpStream::connect(host).unwrap()).collect();
    assert!(get(host, "/").0.starts_with("http/1.1 200"));
    drop(silent);
}

#[test]
fn the_program_comes_packed_once_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let served = served(&folder);
    let host = host(served.url());
    let (head, plain) = get(host, "/re_viewer_bg.wasm");
    assert!(head.contains("content-type: application/wasm") && !head.contains("content-encoding"), "{head}");
    assert!(plain.starts_with(b"\0asm"));
    let request =
        format!("GET /re_viewer_bg.wasm HTTP/1.1\nHost: {host}\nAccept-Encoding: br, gzip\nConnection: close\n\n");
    let patience = Instant::now() + Duration::from_secs(120);
    let (head, packed) = loop {
        let (head, bytes) = ask(host, &request);
        if head.contains("content-encoding: gzip") {
            break (head, bytes);
        }
        assert_eq!(bytes.len(), plain.len());
        assert!(Instant::now() < patience, "never packed");
        std::thread::sleep(Duration::from_millis(500));
    };
    assert!(head.contains(&format!("rerun-final-length: {}", plain.len())), "{head}");
    assert!(packed.len() < plain.len() / 2, "{} of {} bytes", packed.len(), plain.len());
    let mut unpacked = Vec::new();
    flate2::read::GzDecoder::new(packed.as_slice()).read_to_end(&mut unpacked).unwrap();
    assert!(unpacked == plain);
}

#[test]
fn a_page_knows_its_server_from_one_that_comes_after_it() {
    let folder = tempfile::tempdir().unwrap();
    // Not on the usual port, which the tests beside this one take when it is left.
    let first = served_on(&folder, Some(0));
    let name = |served: &WebViewer| String::from_utf8(get(host(served.url()), "/run").1).unwrap();
    let page = |served: &WebViewer| String::from_utf8(get(host(served.url()), "/").1).unwrap();
    let before = name(&first);
    assert!(!before.is_empty() && page(&first).contains(&format!("data-run=\"{before}\"")));
    assert_eq!(name(&first), before);
    // On the very port that was left.
    let port: u16 = host(first.url()).split_once(':').unwrap().1.parse().unwrap();
    drop(first);
    let second = serve_file(&folder.path().join("x.rrd"), Some(port), None).unwrap();
    assert!(second.url().ends_with(&format!(":{port}/")), "{}", second.url());
    assert!(name(&second) != before && page(&second).contains(&format!("data-run=\"{}\"", name(&second))));
    // Asked for by two it is refused; not asked for, another is taken.
    let error = serve_file(&folder.path().join("x.rrd"), Some(port), None).err().unwrap().to_string();
    assert!(error.contains(&port.to_string()) && error.contains("--web-port"), "{error}");
    let (one, two) = (served(&folder), served(&folder));
    assert_ne!(one.url(), two.url());
}

/// A gRPC-Web call of Rerun's protocol with an empty message.
fn call(host: &str, method: &str, headers: &str) -> (String, Vec<u8>) {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(2))).unwrap();
    let path = format!("/rerun.sdk_comms.v1alpha1.MessageProxyService/{method}");
    let kind = "Content-Type: application/grpc-web+proto\r\nX-Grpc-Web: 1\r\nConnection: close\r\nContent-Length: 5";
    stream.write_all(format!("POST {path} HTTP/1.1\r\n{headers}{kind}\r\n\r\n\0\0\0\0\0").as_bytes()).unwrap();
    let mut answer = Vec::new();
    // A recording goes on, so that this ends by the time limit.
    let _ = stream.read_to_end(&mut answer);
    let end = answer.windows(4).position(|w| w == b"\r\n\r\n").unwrap_or(answer.len());
    (String::from_utf8_lossy(&answer[..end]).to_lowercase(), answer.split_off(end))
}

#[test]
fn the_recording_is_read_by_its_own_page_alone_and_written_by_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let served = served_on(&folder, Some(0));
    let host = host(served.url());
    let own = format!("Host: {host}\r\nOrigin: http://{host}\r\n");
    let (head, body) = call(host, "ReadMessages", &own);
    assert!(head.starts_with("http/1.1 200") && head.contains("application/grpc-web"), "{head}");
    assert!(body.len() > 200, "the recording arrives: {} bytes", body.len());
    assert!(!head.contains("access-control"), "{head}");
    for (headers, status) in [
        (format!("Host: {host}\r\nOrigin: http://evil.example\r\n"), "403"),
        (format!("Host: {host}\r\nOrigin: null\r\n"), "403"),
        (format!("Host: {host}\r\nOrigin: http://127.0.0.1:1\r\n"), "403"),
        ("Host: evil.example\r\nOrigin: http://evil.example\r\n".to_owned(), "421"),
        (format!("Host: {host}\r\nHost: evil.example\r\n"), "400"),
        (format!("Host: {host}\r\nHost: {host}\r\n"), "400"),
    ] {
        for method in ["ReadMessages", "WriteMessages", "WriteTable"] {
            let (head, body) = call(host, method, &headers);
            assert!(head.starts_with(&format!("http/1.1 {status}")) && body.len() < 300, "{headers}: {head}");
        }
        for path in ["/", "/run", "/re_viewer.js"] {
            let (head, _) =
                ask(host, &format!("GET {path} HTTP/1.1\n{}Connection: close\n\n", headers.replace('\r', "")));
            assert!(head.starts_with(&format!("http/1.1 {status}")), "{path} {headers}: {head}");
        }
    }
    for method in ["WriteMessages", "WriteTable"] {
        let (head, body) = call(host, method, &own);
        let all = head + &String::from_utf8_lossy(&body);
        // 7: permission denied.
        assert!(all.contains("grpc-status: 7") || all.contains("grpc-status:7"), "{method}: {all}");
    }
}
