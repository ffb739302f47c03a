//! The order of the modules as ARCHITECTURE.md has it, read from the sources: imports run one way, Rerun and clap stay
//! where they belong, and no two public types share a name.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What the crate's root itself holds.
const ROOT: [&str; 1] = ["GRAVITY"];

/// A source file: its top module, its path, and its code without comments and tests.
struct Source {
    module: String,
    path: String,
    code: String,
}

/// Code alone: comments and what comes behind the tests' heading left out.
fn code_of(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let without_comment = |line: &str| line.split("//").next().unwrap().to_owned();
    code.lines().map(without_comment).collect::<Vec<_>>().join("\n")
}

fn sources() -> Vec<Source> {
    fn walk(folder: &Path, found: &mut Vec<Source>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let path = path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().to_str().unwrap().to_owned();
                let module = path.split('/').nth(1).unwrap().trim_end_matches(".rs").to_owned();
                let code = code_of(&fs::read_to_string(&path).unwrap());
                found.push(Source { module, path, code });
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// The modules in their order, from the line of ARCHITECTURE.md that lists them.
fn order() -> Vec<String> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    let (_, list) = text.split_once("each imports only from those before it:\n\n```\n").unwrap();
    let (list, _) = list.split_once("```").unwrap();
    list.split(|c: char| c.is_whitespace() || c == '→').filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The words that follow `prefix` in code, where it is no part of a longer word; of a group in braces each first one.
fn words_after<'a>(code: &'a str, prefix: &str) -> Vec<&'a str> {
    let word = |at: usize| code[at..].split(|c| !is_word(c)).next().unwrap();
    let mut words = Vec::new();
    for (at, _) in code.match_indices(prefix).filter(|(at, _)| !code[..*at].ends_with(is_word)) {
        let at = at + prefix.len();
        if !code[at..].starts_with('{') {
            words.push(word(at));
            continue;
        }
        let (mut depth, mut due) = (0, false);
        for (offset, c) in code[at..].char_indices() {
            match c {
                '{' => (depth, due) = (depth + 1, depth == 0),
                '}' => depth -= 1,
                ',' => due = depth == 1,
                c if due && is_word(c) => {
                    words.push(word(at + offset));
                    due = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    words
}

/// What a source of `module` imports that comes after it, or that nobody listed.
fn offences<'a>(order: &[String], module: &str, code: &'a str) -> Vec<&'a str> {
    let place = |name: &str| order.iter().position(|known| known == name);
    let own = place(module).unwrap_or_else(|| panic!("ARCHITECTURE.md does not list the module {module}"));
    let imported = ["crate::", "partwise::"].into_iter().flat_map(|prefix| words_after(code, prefix));
    let wrong = |name: &&str| *name != module && place(name).is_none_or(|other| other > own);
    imported.filter(|name| !ROOT.contains(name)).filter(wrong).collect()
}

#[test]
fn imports_run_one_way() {
    let order = order();
    for Source { module, path, code } in sources().iter().filter(|source| !["lib", "main"].contains(&&*source.module)) {
        // The command line may take what the root shows to everybody.
        let shown = ["DVec3", "Job", "Scene", "SceneSpec", "Settings", "GRAVITY"];
        let mut wrong = offences(&order, module, code);
        wrong.retain(|name| module != "commands" || !shown.contains(name));
        assert!(wrong.is_empty(), "{path} imports {wrong:?}, expected modules before {module} in ARCHITECTURE.md");
    }
    // A check that finds nothing wrong in what is wrong would be none.
    assert_eq!(offences(&order, "mesh", &code_of("use crate::body::Body; // crate::mesh")), ["body"]);
    assert_eq!(offences(&order, "scene", "use crate::mesh::TriMesh;\nlet x = crate::drape::drape();"), ["drape"]);
    let group = "use crate::{drape, mesh::{Topology, TriMesh}, scene};";
    assert_eq!(offences(&order, "parts", group), ["drape"]);
    assert_eq!(offences(&order, "mesh", group), ["drape", "scene"]);
}

#[test]
fn rerun_is_known_to_the_recording_alone_and_clap_to_the_command_line() {
    for (name, home) in [("rerun", "record"), ("clap", "commands")] {
        let users: Vec<String> = sources()
            .iter()
            .filter(|source| !words_after(&source.code, &format!("{name}::")).is_empty())
            .map(|source| source.module.clone())
            .collect();
        assert!(!users.is_empty() && users.iter().all(|user| user == home), "{name} is used in {users:?}");
    }
}

#[test]
fn no_two_public_types_share_a_name() {
    let mut homes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for Source { path, code, .. } in sources().into_iter().filter(|source| source.module != "commands") {
        for kind in ["pub struct ", "pub enum ", "pub trait ", "pub type "] {
            for name in words_after(&code, kind) {
                homes.entry(name.to_owned()).or_default().push(path.clone());
            }
        }
    }
    homes.retain(|_, paths| paths.len() > 1);
    assert!(homes.is_empty(), "{homes:?}");
}
