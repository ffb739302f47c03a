//! The session over HTTP: edits, results, what viewers are sent, and every kind of bad input.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod client;
mod files;
mod hostile;
#[path = "../fuzz/mutate.rs"]
mod mutate;
mod mutated;
mod watching;

use std::io::{BufReader, Write as _};
use std::process::Command;
use std::time::{Duration, Instant};

use client::{Live, answer, chunk, head, options};
use partwise::live::{LiveError, LiveOptions, LiveServer};
use partwise::session::Session;
use serde_json::{Value, json};

/// Method, path, headers, body; status, and a word of the sentence.
type Case<'a> = (&'a str, &'a str, Vec<&'a str>, &'a str, u16, &'a str);

#[test]
fn edits_answer_with_the_state_and_results_follow() {
    let live = Live::start(&options());
    let before = live.get("/api/state").1;
    assert_eq!(
        (before["state"].as_u64(), &before["idle"], &before["may_steer"]),
        (Some(1), &json!(true), &json!(true))
    );
    assert_eq!(
        before["histogram"]["counts"].as_array().unwrap().len() + 1,
        before["histogram"]["edges_cm"].as_array().unwrap().len()
    );
    let (status, edited) = live.patch(r#"{"table": {"levels": [[0, 2], [2, "inf", 12]]}}"#);
    assert_eq!((status, &edited["state"], &edited["parts"]["state"]), (200, &json!(2), &json!(2)));
    // The answer can be handed in again.
    let again = json!({"table": edited["job"]["table"], "measurements": edited["job"]["measurements"], "fabric": edited["job"]["fabric"]});
    assert_eq!(live.patch(&again.to_string()).1["state"], 2);
    let done = live.idle();
    assert_eq!((&done["figures"]["state"], &done["rest"]["kept"]), (&json!(2), &json!(true)));
    assert!(
        done["figures"]["preview_error_mm"].as_f64().unwrap() > 0.0
            && done["figures"]["bound_mm"].as_f64().unwrap() > 0.0
    );
    assert_eq!(live.ask("POST", "/api/undo", &[], "").1["job"]["table"], before["job"]["table"]);
    assert_eq!(live.ask("POST", "/api/redo", &[], "").1["job"]["table"], edited["job"]["table"]);

    let table = live.text("GET", "/api/table.toml", &[], "").1;
    assert!(table.contains("[2.0, inf, 12.0]"), "{table}");
    let toml = ["Content-Type: application/toml"];
    assert_eq!(
        live.ask("PATCH", "/api/state", &toml, &table.replace("2.0", "3.0")).1["job"]["table"]["levels"][0][1],
        3.0
    );
    let job = live.text("GET", "/api/job.toml", &[], "").1;
    live.patch(r#"{"fabric": "denim"}"#);
    assert_eq!(live.ask("PATCH", "/api/state", &toml, &job).1["job"]["fabric"], "interlock");

    live.idle();
    let obj = live.text("GET", "/api/drape.obj", &[], "").1;
    let vertices = done["garment"]["vertices"].as_u64().unwrap() as usize;
    assert_eq!(obj.lines().filter(|line| line.starts_with("v ")).count(), vertices);
    assert_ne!(live.text("GET", "/api/drape.obj?of=preview", &[], "").1, obj);
    let part = live.get("/api/part?number=1").1;
    assert!(
        part["part"] == 1
            && part["level"] == 1
            && part["vertices"].as_u64().unwrap() > 0
            && part["area_cm2"].as_f64().unwrap() > 0.0
    );
    assert!(part["force_size_n"].is_number() && part["rest_displacement_mm"][2].is_number());
    let first = obj.lines().find(|line| line.starts_with("v ")).unwrap()[2..].replace(' ', ",");
    let at = live.get(&format!("/api/part?on=rest&at={first}")).1;
    let of_first = live.session.snapshot().segmented.unwrap().parts.part_of_vertex[0];
    assert_eq!(at["part"], of_first + 1);

    let pinned = live.ask("POST", "/api/pins", &["Content-Type: application/json"], r#"{"label": "as it was"}"#).1;
    assert_eq!(pinned["pins"][0]["label"], "as it was");
    assert_eq!(live.text("GET", "/api/drape.obj?pin=1", &[], "").1, obj);
    assert_eq!(live.ask("DELETE", "/api/pins/1", &[], "").1["pins"], json!([]));
    assert!(live.get("/api/choices").1["tables"].as_array().unwrap().contains(&json!("flared-skirt-levels")));
}

#[test]
fn levels_and_views_show_the_parts_that_the_model_moves() {
    let live = Live::start(&options());
    let uncut = live.get("/api/state").1;
    let count = |state: &Value| {
        let levels = state["parts"]["levels"].as_array().unwrap();
        (state["parts"]["count"].as_u64().unwrap(), levels.iter().map(|l| l["parts"].as_u64().unwrap()).sum::<u64>())
    };
    assert_eq!(count(&uncut), (uncut["preview"]["count"].as_u64().unwrap(), count(&uncut).0));
    // Of a cascade the finest cut counts.
    for extents in ["[12]", "[24, 8]"] {
        let at_once = live.patch(&format!(r#"{{"max_extent_cm": {extents}}}"#)).1;
        let done = live.idle();
        assert!(count(&done).0 > count(&uncut).0, "{extents}");
        assert_eq!(count(&at_once), (done["preview"]["count"].as_u64().unwrap(), count(&done).0), "{extents}");
        assert_eq!(count(&done), count(&at_once));
        assert_eq!(done["parts"]["table_count"], uncut["parts"]["count"]);
        assert_eq!(done["figures"]["level_part_count"], done["parts"]["table_count"]);
    }
    let last = live.get("/api/state").1["parts"]["count"].as_u64().unwrap();
    assert_eq!(live.get(&format!("/api/part?number={last}")).0, 200);
    let outline = |query: &str| live.text("GET", &format!("/api/outline{query}"), &[], "");
    let (one, none) = (outline(&format!("?number={last}")), outline(""));
    assert!(one.0 == 200 && none.0 == 200 && one.1.len() > none.1.len());
}

#[test]
fn the_two_newest_pins_have_views_of_their_own_stages() {
    let live = Live::start(&options());
    for fabric in ["interlock", "denim", "jersey"] {
        live.patch(&format!(r#"{{"fabric": "{fabric}"}}"#));
        live.idle();
        live.ask("POST", "/api/pins", &[], "");
    }
    let state = live.get("/api/state").1;
    let shown: Vec<&Value> = state["pins"].as_array().unwrap().iter().map(|pin| &pin["shown"]).collect();
    assert_eq!(shown, [false, true, true]);
    let pins = live.session.snapshot().pins.clone();
    assert!(pins.iter().all(|pin| pin.preview != pin.positions), "the two stages, not the drape at rest");
}

#[test]
fn tab_reaches_the_range_table_before_the_viewer_and_every_field_has_a_unit() {
    let live = Live::start(&options());
    let page = live.text("GET", "/", &[], "").1;
    let place = |piece: &str| page.find(piece).unwrap_or_else(|| panic!("{piece}"));
    for field in ["id=\"dial\"", "id=\"extent\"", "id=\"levels\"", "id=\"measurements\"", "id=\"pins\""] {
        assert!(place(field) < place("<canvas"), "{field}");
    }
    for target in ["panel", "viewer"] {
        assert!(page.contains(&format!("href=\"#{target}\"")) && page.contains(&format!("id=\"{target}\"")));
    }
    assert!(place("class=\"skip\"") < place("<header"));
    assert!(page.contains("<span class=\"unit\"><input id=\"extent\"") && page.contains("cut to, cm"));
    assert!(!live.text("GET", "/main.js", &[], "").1.contains("type: \"number\""), "letters would be read as nothing");
}

#[test]
fn a_refusal_says_nothing_of_the_request_to_readers_of_the_page() {
    let live = Live::start(&options());
    let (status, answer) = live.patch(r#"{"table": {"name": "t", "levels": [[0, 0.06], [0.5, 0.085]]}}"#);
    let sentence = answer["error"].as_str().unwrap();
    assert_eq!(status, 400);
    assert!(sentence.contains("row 2") && !sentence.contains("column") && !sentence.contains("quantile"), "{sentence}");
}

#[test]
fn invalid_edits_are_refused_and_the_session_continues() {
    let live = Live::start(&options());
    let json = "Content-Type: application/json";
    let deep = "[".repeat(100_000);
    let long = format!("{{\"fabric\": \"{}\"}}", "x".repeat(100_000));
    let cases: Vec<Case<'_>> = vec![
        ("PATCH", "/api/state", vec![json], "{\"fabric\": ", 400, "line 1"),
        ("PATCH", "/api/state", vec![json], "{\"max_extent_cm\": [NaN]}", 400, "line 1"),
        ("PATCH", "/api/state", vec![json], "{\"max_extent_cm\": [-3]}", 422, "above 0"),
        ("PATCH", "/api/state", vec![json], "{\"fabirc\": \"denim\"}", 400, "fabirc"),
        ("PATCH", "/api/state", vec![json], "{\"table\": {\"levels\": [[0, 2], [1, 3]]}}", 400, "row 2 starts at 1"),
        ("PATCH", "/api/state", vec![json], "{\"table\": {\"levels\": [[0, 1e999]]}}", 400, "number out of range"),
        ("PATCH", "/api/state", vec![json], "{\"table\": {\"quantile\": 99999999}}", 422, "levels"),
        ("PATCH", "/api/state", vec![json], "{\"measurements\": {\"waist\": 1e300}}", 422, "waist"),
        ("PATCH", "/api/state", vec![json], "{\"garment\": \"kimono\"}", 422, "kimono"),
        ("PATCH", "/api/state", vec![json], "{\"garment\": \"/etc/passwd.obj\"}", 403, "passwd"),
        ("PATCH", "/api/state", vec![json], "{\"table\": \"/etc/shadow.toml\"}", 403, "shadow"),
        ("PATCH", "/api/state", vec![json], "[]", 400, ""),
        ("PATCH", "/api/state", vec![json], "\u{0}\u{ff}", 400, ""),
        ("PATCH", "/api/state", vec![json], &deep, 400, ""),
        ("PATCH", "/api/state", vec![json], &long, 422, "bytes in all"),
        ("PATCH", "/api/state?gesture=-1", vec![json], "{}", 400, "gesture"),
        ("PATCH", "/api/state", vec!["Content-Type: text/plain"], "{}", 415, "application/json"),
        ("PATCH", "/api/state", vec![], "{}", 415, "application/json"),
        ("PATCH", "/api/state", vec!["Content-Type: application/toml"], "levels = [[0, 1]", 400, ""),
        (
            "PATCH",
            "/api/state",
            vec!["Content-Type: application/toml"],
            "name = \"t\"\nunit = \"mm\"\nlevels = [[0, 1]]",
            422,
            "cm",
        ),
        (
            "PATCH",
            "/api/state",
            vec!["Content-Type: application/toml"],
            "[scene]\nbody = \"/elsewhere/x.obj\"",
            403,
            "x.obj",
        ),
        ("PATCH", "/api/state", vec![json, "Content-Length: 10485760"], "", 413, "1048576"),
        ("PATCH", "/api/state", vec![json, "Content-Length: 99999999999"], "", 413, "1048576"),
        ("PATCH", "/api/state", vec![json, "Origin: http://evil.example"], "{}", 403, "evil.example"),
        ("GET", "/api/state", vec!["Origin: null"], "", 403, "null"),
        ("GET", "/api/events", vec!["Sec-Fetch-Site: cross-site"], "", 403, "cross-site"),
        ("GET", "/api/state", vec!["Host: evil.example"], "", 421, "evil.example"),
        ("GET", "/api/state", vec!["Host: 127.0.0.1", "Host: 127.0.0.1"], "", 400, "2 Host headers"),
        ("GET", "http://evil.example/api/state", vec![], "", 421, "evil.example"),
        ("POST", "/api/state", vec![json], "{}", 405, "PATCH"),
        ("DELETE", "/api/undo", vec![], "", 405, ""),
        ("POST", "/api/undo", vec![], "", 422, "undo"),
        ("DELETE", "/api/pins/7", vec![], "", 404, "pin"),
        ("POST", "/api/pins", vec![], "{\"label\": 7}", 400, "label"),
        ("GET", "/api/part?number=100000", vec![], "", 404, "PART"),
        ("GET", "/api/part?number=0", vec![], "", 404, "expected one of 1 to"),
        ("GET", "/api/outline?number=0", vec![], "", 404, "expected one of 1 to"),
        ("GET", "/api/outline?number=x", vec![], "", 400, "number from 1"),
        ("GET", "/api/part?at=0,0,nan", vec![], "", 400, "metres"),
        ("GET", "/api/drape.obj?of=all", vec![], "", 400, "preview"),
        ("GET", "/api/../../etc/passwd", vec![], "", 404, ""),
        ("GET", "/api/sweep.toml", vec![], "", 409, "pinned"),
        ("GET", "/nothing", vec![], "", 404, "nothing"),
        ("PUT", "/", vec![], "", 405, "GET"),
    ];
    for (method, path, headers, body, status, words) in cases {
        let (found, answer) = live.ask(method, path, &headers, body);
        let start: String = body.chars().take(80).collect();
        assert_eq!(found, status, "{method} {path} {headers:?} {start}: {answer}");
        let sentence = answer["error"].as_str().unwrap_or_else(|| panic!("{path}: {answer}"));
        assert!(sentence.contains(words) && sentence.len() < 2100, "{method} {path} {start}: {sentence}");
    }
    // A body that does not say how long it is.
    let mut stream = live.open("PATCH", "/api/state", &[json.to_owned(), "Transfer-Encoding: chunked".to_owned()]);
    for _ in 0..40 {
        let _ = stream.write_all(format!("10000\r\n{}\r\n", " ".repeat(0x10000)).as_bytes());
    }
    assert_eq!(answer(&mut BufReader::new(stream)).0, 413);
    // No request at all.
    let mut stream = std::net::TcpStream::connect(live.address).unwrap();
    stream.write_all(b"\x16\x03\x01\x02\x00 hello\r\n\r\n").unwrap();
    assert_eq!(live.get("/api/state").1["state"], 1);
    assert_eq!(live.patch(r#"{"fabric": "jersey"}"#).1["state"], 2);
}

#[test]
fn pinned_states_become_a_sweep_that_makes_them_again() {
    let live = Live::start(&options());
    let (status, answer) = live.get("/api/sweep.toml");
    assert!(status == 409 && answer["error"].as_str().unwrap().contains("pinned"), "{answer}");
    let mut counts = Vec::new();
    for edit in [r#"{"refine": {"steps": 0}}"#, r#"{"table": {"levels": [[0, 2], [2, "inf", 12]]}, "fabric": "denim"}"#]
    {
        live.patch(edit);
        counts.push(live.idle()["preview"]["count"].as_u64().unwrap().to_string());
        assert_eq!(live.ask("POST", "/api/pins", &[], "").0, 200);
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("pinned.toml");
    std::fs::write(&file, live.text("GET", "/api/sweep.toml", &[], "").1).unwrap();
    let mut sweep = Command::new(env!("CARGO_BIN_EXE_partwise"));
    sweep.args(["sweep", "--no-save", "--accuracy", "none", "--out"]).arg(folder.path().join("rows")).arg(&file);
    let ended = sweep.output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let rows = std::fs::read_to_string(folder.path().join("rows/rows.jsonl")).unwrap();
    let rows: Vec<Value> = rows.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let found: Vec<String> = rows.iter().map(|row| row["part_count"].to_string()).collect();
    assert_eq!(found, counts, "{rows:?}");
    assert_eq!(rows[1]["fabric"], "denim");
}

#[test]
fn elsewhere_a_token_steers_and_another_looks_on() {
    // Characters that mean something in an address are encoded there.
    let (control, read_only) = ("c&#%+ c".repeat(5), "o".repeat(32));
    let encoded = "c%26%23%25%2B%20c".repeat(5);
    let far = LiveOptions { control: Some(control.clone()), read_only: Some(read_only.clone()), ..options() };
    let live = Live::start(&far);
    let bearer = |token: &str| format!("Authorization: Bearer {token}");
    let ask = |method: &str, path: &str, token: Option<&str>| {
        let mut headers = vec!["Content-Type: application/json".to_owned()];
        headers.extend(token.map(bearer));
        live.ask(
            method,
            path,
            &headers.iter().map(String::as_str).collect::<Vec<_>>(),
            if method == "PATCH" { "{}" } else { "" },
        )
    };
    for path in ["/api/state", "/api/events", "/api/stream", "/api/drape.obj", "/api/job.toml"] {
        assert_eq!(ask("GET", path, None).0, 401, "{path}");
        assert_eq!(ask("GET", path, Some("guess")).0, 401, "{path}");
    }
    assert_eq!(ask("GET", "/api/state", Some(&read_only)).1["may_steer"], false);
    for (method, path) in
        [("PATCH", "/api/state"), ("POST", "/api/undo"), ("POST", "/api/pins"), ("DELETE", "/api/pins/1")]
    {
        assert_eq!(ask(method, path, Some(&read_only)).0, 403, "{path}");
    }
    assert_eq!(ask("PATCH", "/api/state", Some(&control)).0, 200);
    assert_eq!(live.get(&format!("/api/state?token={encoded}")).0, 200);
    assert_eq!(live.get(&format!("//api/state?token={encoded}")).0, 200, "the printed address ends in a slash");
    // The page itself tells nothing.
    assert_eq!(live.text("GET", "/", &[], "").0, 200);
    let open = LiveOptions { address: "0.0.0.0:0".parse().unwrap(), ..options() };
    assert!(matches!(LiveServer::start(&live.session, &open), Err(LiveError::Open(_))));
}

#[test]
fn a_port_in_use_is_reported() {
    let live = Live::start(&options());
    let taken = LiveOptions { address: live.address, ..options() };
    let error = LiveServer::start(&Session::new(partwise::Job::default(), true), &taken).err().unwrap();
    assert!(error.to_string().contains("--port"), "{error}");
    let port = live.address.port().to_string();
    let ended = Command::new(env!("CARGO_BIN_EXE_partwise")).args(["live", "--port", &port]).output().unwrap();
    assert_eq!(ended.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&ended.stderr).contains(&port));
}

#[test]
fn events_tell_each_state_and_a_reader_that_never_reads_hinders_nobody() {
    let live = Live::start(&options());
    // These two never read a byte.
    let _idle: Vec<_> = ["/api/events", "/api/stream"].map(|path| live.open("GET", path, &[])).into();
    let mut events = BufReader::new(live.open("GET", "/api/events", &[]));
    assert_eq!(head(&mut events).0, 200);
    let mut next = || -> Value {
        loop {
            let text = String::from_utf8(chunk(&mut events)).unwrap();
            if let Some(data) = text.strip_prefix("event: state\ndata: ") {
                return serde_json::from_str(data).unwrap();
            }
        }
    };
    assert!(next()["histogram"].is_object(), "the first is the whole state");
    // From before the edits: under load, events wait to be read while they are sent.
    let began = Instant::now();
    for i in 0..30 {
        live.patch(&format!(r#"{{"table": {{"levels": [[0, {}], [3, "inf"]]}}}}"#, 1.0 + 0.05 * f64::from(i)));
    }
    let mut seen = Vec::new();
    let last = loop {
        let event = next();
        seen.push(event["state"].as_u64().unwrap());
        if event["idle"] == true && event["state"] == 31 {
            break event;
        }
        assert!(began.elapsed() < Duration::from_secs(60));
    };
    assert!(seen.is_sorted() && last["parts"]["state"] == 31 && last["figures"]["state"] == 31);
    assert!(seen.len() as f64 <= 2.0 + began.elapsed().as_secs_f64() * 126.0, "{} events", seen.len());
}

#[test]
fn a_viewer_gets_triangles_once_and_then_positions() {
    let live = Live::start(&options());
    let mut stream = BufReader::new(live.open("GET", "/api/stream", &[]));
    assert_eq!(head(&mut stream).0, 200);
    let mut bytes = Vec::new();
    let mut next = || -> Vec<u8> {
        loop {
            if let Some(length) = bytes.first_chunk::<4>().map(|b| u32::from_le_bytes(*b) as usize)
                && bytes.len() >= 4 + length
            {
                let piece: Vec<u8> = bytes.drain(..4 + length).skip(4).collect();
                if !piece.is_empty() {
                    return piece;
                }
                continue;
            }
            bytes.extend(chunk(&mut stream));
        }
    };
    let first: Vec<Vec<u8>> = (0..4).map(|_| next()).collect();
    assert!(first.iter().all(|piece| piece.starts_with(b"RRF2")), "whole recordings each");
    live.patch(r#"{"table": {"levels": [[0, 2], [2, "inf"]]}}"#);
    let parts = next();
    assert!(parts.len() * 3 < first[0].len(), "{} bytes after {}", parts.len(), first[0].len());
    // A later client gets the newest data.
    live.idle();
    std::thread::sleep(Duration::from_millis(300));
    let mut late = BufReader::new(live.open("GET", "/api/stream", &[]));
    assert_eq!(head(&mut late).0, 200);
    assert_eq!(u32::from_le_bytes(chunk(&mut late).try_into().unwrap()) as usize, first[0].len());
    assert_eq!(chunk(&mut late), first[0]);
}

#[test]
fn the_lines_of_the_documentation_run() {
    let live = Live::start(&options());
    let text = include_str!("../../assets/live/http.md").replace("\\\n", " ");
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| line.starts_with("curl ")).collect();
    assert!(lines.len() >= 14, "{lines:?}");
    for line in lines {
        live.idle();
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &line.replacen("curl -s", "curl -sS --fail-with-body", 1)])
            .env("BASE", format!("http://{}", live.address));
        let ended = shell.current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
        // curl exits with 28 after `--max-time`.
        let fine = ended.status.success() || line.contains("--max-time") && ended.status.code() == Some(28);
        let answer = String::from_utf8_lossy(&ended.stdout);
        assert!(
            fine && !answer.is_empty(),
            "{line}: {} {answer} {}",
            ended.status,
            String::from_utf8_lossy(&ended.stderr)
        );
    }
    let done = live.idle();
    assert_eq!(done["job"]["measurements"]["waist"], 76.0);
}
