//! Mutated requests: every request is answered with a short plain message, and the session continues.
//!
//! `PARTWISE_FUZZ_REQUESTS` sets their number; the state must then be answered within a second after each. The default takes a
//! few seconds and has no such limit, because the machine may be busy.

use std::time::Instant;

use crate::client::{Live, options};
use crate::mutate::mutate;

const JSON: &str = "Content-Type: application/json";
const TOML: &str = "Content-Type: application/toml";

/// Requests to begin from: method, path, type, body.
const SEEDS: [(&str, &str, &str, &str); 14] = [
    ("PATCH", "/api/state", JSON, r#"{"fabric": "denim"}"#),
    ("PATCH", "/api/state", JSON, r#"{"table": {"levels": [[0, 0.5], [0.5, 2], [2, 6, 12], [6, "inf", 8, 24]]}}"#),
    ("PATCH", "/api/state", JSON, r#"{"table": {"quantile": 5}, "gap": "own-level", "motion": "translation"}"#),
    ("PATCH", "/api/state", JSON, r#"{"table": "table-3", "max_extent_cm": [24, 12], "min_part": 2}"#),
    ("PATCH", "/api/state", JSON, r#"{"measurements": {"waist": 76, "bust": 92.5}, "refine": {"steps": 3}}"#),
    ("PATCH", "/api/state", JSON, r#"{"garment": "flared-skirt@400", "body": "form", "self_contact": false}"#),
    ("PATCH", "/api/state", TOML, "name = \"t\"\nunit = \"cm\"\nlevels = [[0, 1], [1, inf]]\n"),
    ("PATCH", "/api/state?gesture=3", JSON, r#"{"table": {"levels": [[0, 1], [1, "inf"]]}}"#),
    ("POST", "/api/undo", JSON, ""),
    ("POST", "/api/redo", JSON, ""),
    ("POST", "/api/pins", JSON, r#"{"label": "as it was"}"#),
    ("DELETE", "/api/pins/1", JSON, ""),
    ("GET", "/api/part?at=0.1,-0.1,1.2&on=rest", JSON, ""),
    ("GET", "/api/part?number=3", JSON, ""),
];

/// The path without characters that HTTP forbids in a request line; the server closes such requests without a message.
fn valid_in_request_line(path: &str) -> String {
    path.chars().filter(|c| c.is_ascii_alphanumeric() || "/?&=,.-_~%+:;@!$'()*".contains(*c)).take(2000).collect()
}

#[test]
#[allow(clippy::print_stderr, reason = "a test that reports what it measured")]
fn every_request_is_answered_and_the_session_continues() {
    let (requests, limit_s) = std::env::var("PARTWISE_FUZZ_REQUESTS")
        .map_or((200, f64::INFINITY), |text| (text.parse::<u32>().unwrap(), 1.0));
    let mut slowest_s = 0.0_f64;
    let live = Live::start(&options());
    let bodies: Vec<String> = SEEDS.iter().map(|(.., body)| (*body).to_owned()).collect();
    let paths: Vec<String> = SEEDS.iter().map(|(_, path, ..)| (*path).to_owned()).collect();
    let (mut taken, mut refused) = (0, 0);
    for i in 0..requests {
        let random = blake3::hash(&i.to_le_bytes());
        let number = |k: usize| u32::from_le_bytes(random.as_bytes()[4 * k..4 * k + 4].try_into().unwrap());
        let (method, path, kind, body) = SEEDS[number(0) as usize % SEEDS.len()];
        let change = |k: usize| ((number(k) % 16) as u8, number(k + 1), number(k + 2));
        // Mutates the body in most requests, the path in some.
        let (path, body) = match number(7) % 4 {
            0 if path.contains('?') || body.is_empty() => {
                (valid_in_request_line(&mutate(path, &paths, change(1))), body.to_owned())
            }
            3 => (path.to_owned(), mutate(&mutate(body, &bodies, change(1)), &bodies, change(4))),
            _ => (path.to_owned(), mutate(body, &bodies, change(1))),
        };
        let path = if path.starts_with('/') { path } else { format!("/{path}") };
        let (status, answer) = live.ask(method, &path, &[kind], &body);
        let what: String = format!("request {i}: {method} {path} {body}").chars().take(600).collect();
        match status {
            200 => taken += 1,
            400..500 => {
                let sentence = answer["error"].as_str().unwrap_or_else(|| panic!("{what}: {answer}"));
                let plain = sentence.chars().all(|c| !c.is_control() || c == '\n' || c == '\t');
                assert!(plain && !sentence.is_empty() && sentence.len() < 2100, "{what}: {sentence:?}");
                refused += 1;
            }
            _ => panic!("{what}: {status} {answer}"),
        }
        let asked = Instant::now();
        assert_eq!(live.get("/api/state").0, 200, "{what}");
        slowest_s = slowest_s.max(asked.elapsed().as_secs_f64());
        assert!(slowest_s < limit_s, "{what}: the state after {slowest_s} s");
    }
    eprintln!("{requests} requests, {taken} taken, {refused} refused, the slowest state after {slowest_s:.3} s");
    assert!(taken > requests / 20 && refused > requests / 20, "{taken} taken, {refused} refused");
    let before = live.get("/api/state").1["state"].as_u64().unwrap();
    let edit = r#"{"garment": "flared-skirt@900", "fabric": "jersey", "table": {"levels": [[0, 1.25], [1.25, "inf"]]}, "model": "coupled"}"#;
    assert_eq!(live.patch(edit).1["state"], before + 1);
    let now = live.idle();
    assert!(now["parts"]["state"] == before + 1 && now["refused"].is_null(), "{now}");
}
