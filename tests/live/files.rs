//! No request opens a file that the command line did not name in the same field.

use std::io::Write as _;
use std::time::{Duration, Instant};

use partwise::live::LiveOptions;
use partwise::scene::FileRole;

use crate::client::{Live, options};

const JSON: &str = "Content-Type: application/json";
const TOML: &str = "Content-Type: application/toml";

/// Fields that can name a file: content type, and the body with `PATH` for the name.
const FIELDS: [(&str, &str); 10] = [
    (JSON, r#"{"body": "PATH"}"#),
    (JSON, r#"{"garment": "PATH"}"#),
    (JSON, r#"{"table": "PATH"}"#),
    (JSON, r#"{"fabric": "PATH"}"#),
    (TOML, "[scene]\nbody = \"PATH\""),
    (TOML, "[scene]\ngarment = \"PATH\""),
    (TOML, "[scene]\nover = [\"PATH\"]"),
    (TOML, "[scene]\nfabrics = [\"PATH\"]"),
    (TOML, "[scene]\nfabrics_file = \"PATH\""),
    (TOML, "[scene]\nrest = \"PATH\""),
];

/// Fields that hold something else, in which a path is refused as any other wrong value, or is the name of nothing.
const OTHERS: [(&str, &str); 27] = [
    (JSON, r#"{"measurements": "PATH"}"#),
    (JSON, r#"{"measurements": {"PATH": 1}}"#),
    (JSON, r#"{"measurements": {"waist": "PATH"}}"#),
    (JSON, r#"{"table": {"levels": "PATH"}}"#),
    (JSON, r#"{"table": {"quantile": "PATH"}}"#),
    (JSON, r#"{"gap": "PATH"}"#),
    (JSON, r#"{"fabric": {"name": "PATH"}}"#),
    (JSON, r#"{"min_part": "PATH"}"#),
    (JSON, r#"{"max_extent_cm": "PATH"}"#),
    (JSON, r#"{"motion": "PATH"}"#),
    (JSON, r#"{"model": "PATH"}"#),
    (JSON, r#"{"refine": "PATH"}"#),
    (JSON, r#"{"self_contact": "PATH"}"#),
    (TOML, "levels = \"PATH\""),
    (TOML, "seed = \"PATH\""),
    (TOML, "accuracy = \"PATH\""),
    (TOML, "spread_starts = \"PATH\""),
    (TOML, "[settings]\ntable = \"PATH\""),
    (TOML, "[settings]\nmodel = \"PATH\""),
    (TOML, "[settings]\nfabric = \"PATH\""),
    (TOML, "[settings]\nrefine = \"PATH\""),
    (TOML, "[scene]\nunit = \"PATH\""),
    (TOML, "[scene]\nup = \"PATH\""),
    (TOML, "[scene]\ndistance_to = \"PATH\""),
    (TOML, "[scene]\nedge_cm = \"PATH\""),
    (TOML, "[scene]\nmeasurements = \"PATH\""),
    (TOML, "[scene]\nhold = [\"PATH\"]"),
];

#[test]
fn no_field_of_any_body_opens_a_path_a_pipe_or_an_endless_device() {
    let folder = tempfile::tempdir().unwrap();
    let secret = "the words that nobody may read";
    let file = folder.path().join("secret.toml");
    std::fs::write(&file, secret).unwrap();
    let pipe = folder.path().join("pipe.obj");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let live = Live::start(&options());
    for path in [file.to_str().unwrap(), pipe.to_str().unwrap(), "/dev/zero", "../Cargo.toml", "/etc/passwd"] {
        for (kind, body) in FIELDS.iter().chain(&OTHERS) {
            let body = body.replace("PATH", path);
            let asked = Instant::now();
            let (status, answer) = live.ask("PATCH", "/api/state", &[kind], &body);
            let names_files = FIELDS.iter().any(|(_, field)| field.replace("PATH", path) == body);
            let fits = if names_files { status == 403 } else { (400..500).contains(&status) };
            assert!(fits, "{body}: {status} {answer}");
            assert!(!answer.to_string().contains("nobody may read"), "{body}: {answer}");
            assert!(!answer.to_string().contains("root:"), "{body}: {answer}");
            assert!(asked.elapsed() < Duration::from_secs(5), "{body}: {:?}", asked.elapsed());
        }
        let label = format!(r#"{{"label": ["{path}"]}}"#);
        assert_eq!(live.ask("POST", "/api/pins", &[JSON], &label).0, 400);
    }
    // A name without a dot is a file where the loader takes it for one.
    assert_eq!(live.ask("PATCH", "/api/state", &[TOML], "[scene]\nrest = \"passwd\"").0, 403);
    assert_eq!(live.ask("PATCH", "/api/state", &[TOML], "[scene]\nfabrics_file = \"passwd\"").0, 403);
    let now = live.get("/api/state").1;
    assert!(now["state"] == 1 && now["idle"] == true, "{now}");
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
