//! No request opens a file that the command line did not name in the same field.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::time::{Duration, Instant};

use partwise::garment::fabric::Fabric;
use partwise::live::LiveOptions;
use partwise::scene::FileRole;
use serde_json::{Value, json};

use crate::client::{Live, options};

const JSON: &str = "Content-Type: application/json";
const TOML: &str = "Content-Type: application/toml";

/// The tables of the documentation: every field of every body, and every parameter of an address.
const TABLES: &str = include_str!("../../docs/guide/http.md");

/// The effect of a path in a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    File,
    Text,
    Refused,
}

/// A row of a table: the object or the address, its fields, the effect of a path.
fn rows(of_addresses: bool) -> Vec<(String, Vec<String>, Effect)> {
    let names = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let row = |line: &str| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [object, fields, _, effect] = cells[..] else { return None };
        let effect = match effect {
            "a file" => Effect::File,
            "a text" => Effect::Text,
            "refused" => Effect::Refused,
            _ => return None,
        };
        Some((names(object).pop()?, names(fields), effect))
    };
    TABLES.lines().filter_map(row).filter(|(object, ..)| object.contains('/') == of_addresses).collect()
}

/// A body with `value` in `field` of `object`, the other fields of a fabric or of rows being valid.
fn body(object: &str, field: &str, value: Value) -> Value {
    let mut body = match object {
        "edit.fabric" | "job.settings.fabric" => serde_json::to_value(Fabric::default()).unwrap(),
        "edit.table" | "job.settings.table.rows" => json!({"name": "x", "levels": [[0, 1], [1, 100]]}),
        "job.settings.table.quantile" => json!({"name": "x", "levels": 4}),
        "table" => json!({"name": "x", "unit": "cm", "levels": [[0, 1], [1, 100]]}),
        _ => json!({}),
    };
    body[field] = value;
    object.split('.').skip(1).collect::<Vec<_>>().into_iter().rev().fold(body, |inner, name| json!({ name: inner }))
}

/// Sends a body for `object`; returns the status and the answer.
fn send(live: &Live, object: &str, body: &Value) -> (u16, String) {
    let asked = Instant::now();
    let (status, answer) = match object.split('.').next() {
        Some("pin") => live.ask("POST", "/api/pins", &[JSON], &body.to_string()),
        Some("edit") => live.ask("PATCH", "/api/state", &[JSON], &body.to_string()),
        _ => live.ask("PATCH", "/api/state", &[TOML], &toml::to_string(body).unwrap()),
    };
    assert!(asked.elapsed() < Duration::from_secs(30), "{body}: {:?}", asked.elapsed());
    (status, answer.to_string())
}

#[test]
fn the_documentation_lists_every_field_that_the_server_takes() {
    let live = Live::start(&options());
    let mut documented: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (object, fields, _) in rows(false) {
        documented.entry(object).or_default().extend(fields);
    }
    for (object, fields) in documented {
        let (status, answer) = send(&live, &object, &body(&object, "no_such_field", json!(1)));
        assert!((400..500).contains(&status), "{object}: {answer}");
        // `expected one of `a`, `b``, and of a variant with fields `available keys: a, b`.
        let quoted = |text: &str| text.split('`').skip(1).step_by(2).map(str::to_owned).collect();
        let listed: BTreeSet<String> = match answer.split_once("available keys: ") {
            Some((_, keys)) => keys.trim_end_matches(['"', '}']).split(", ").map(str::to_owned).collect(),
            None => quoted(answer.split_once("expected").map_or("", |(_, names)| names.split(';').next().unwrap())),
        };
        assert_eq!(listed, fields, "{object}");
    }
}

#[test]
fn no_field_of_any_body_opens_a_path_a_pipe_or_an_endless_device() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("secret.toml");
    std::fs::write(&file, "the words that nobody may read").unwrap();
    let pipe = folder.path().join("pipe.obj");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let live = Live::start(&options());
    let paths = [file.to_str().unwrap(), pipe.to_str().unwrap(), "/dev/zero", "../Cargo.toml", "/etc/passwd"];
    // Texts last: they may be taken, and change the state.
    let mut all = rows(false);
    all.sort_by_key(|(.., effect)| *effect == Effect::Text);
    let mut sent = 0;
    for (object, fields, effect) in &all {
        for (field, path) in fields.iter().flat_map(|field| paths.map(|path| (field, path))) {
            let mut statuses = Vec::new();
            for value in [json!(path), json!([path]), json!({ path: 1 })] {
                let body = body(object, field, value);
                let (status, answer) = send(&live, object, &body);
                sent += 1;
                assert!(status < 500 && (status >= 400 || *effect == Effect::Text), "{body}: {status} {answer}");
                for secret in ["nobody may read", "root:", "[package]"] {
                    assert!(!answer.contains(secret), "{body}: {answer}");
                }
                statuses.push(status);
            }
            assert!(statuses.contains(&403) || *effect != Effect::File, "{object} {field}: {statuses:?}");
        }
        if *effect != Effect::Text {
            assert_eq!(live.get("/api/state").1["state"], 1, "{object}");
        }
    }
    for (address, parameters, _) in rows(true) {
        let (method, address) = address.split_once(' ').unwrap();
        for (parameter, path) in parameters.iter().flat_map(|parameter| paths.map(|path| (parameter, path))) {
            let (status, answer) = live.ask(method, &format!("{address}?{parameter}={path}"), &[JSON], "{}");
            assert!((400..500).contains(&status), "{address}?{parameter}={path}: {status} {answer}");
        }
    }
    // A name without a dot is a file where the loader takes it for one.
    for field in ["rest", "fabrics_file"] {
        assert_eq!(send(&live, "job.scene", &body("job.scene", field, json!("passwd"))).0, 403);
    }
    assert!(sent > 1000, "{sent}");
    assert_eq!(live.patch(r#"{"garment": "flared-skirt@400", "fabric": "denim"}"#).0, 200);
    let now = live.idle();
    assert!(now["refused"].is_null(), "{now}");
}

#[test]
fn a_file_of_the_command_line_is_taken_in_its_field_alone_and_never_quoted() {
    let mut table = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    table.write_all(b"name = \"mine\"\nunit = \"cm\"\nlevels = [[0, 2], [2, inf]]\n").unwrap();
    let name = table.path().to_str().unwrap().to_owned();
    let live = Live::start(&LiveOptions { files: vec![(FileRole::Table, name.clone())], ..options() });
    let as_table = format!(r#"{{"table": "{name}"}}"#);
    assert_eq!(live.patch(&as_table).0, 200);
    assert_eq!(live.patch(&format!(r#"{{"fabric": "{name}"}}"#)).0, 403);
    assert_eq!(live.ask("PATCH", "/api/state", &[TOML], &format!("[scene]\nfabrics_file = \"{name}\"")).0, 403);
    std::fs::write(table.path(), "a secret that does not parse").unwrap();
    let (status, answer) = live.patch(&as_table);
    let sentence = answer["error"].as_str().unwrap();
    assert!(status == 422 && sentence.contains(&name) && !sentence.contains("secret"), "{answer}");
}
