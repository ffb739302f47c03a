//! The structure of the sources: imports follow the order of the modules in ARCHITECTURE.md, no files import each other in a circle,
//! only `record` uses Rerun and only `commands` uses clap, and no two public types share a name.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Items that the crate root defines.
const ROOT: [&str; 1] = ["GRAVITY"];

/// A source file: its top module, its path, and its code without comments and tests.
struct Source {
    module: String,
    path: String,
    code: String,
}

/// Code without comments and without the unit tests at its end.
fn code_of(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let without_comment = |line: &str| line.split("//").next().unwrap().to_owned();
    code.lines().map(without_comment).collect::<Vec<_>>().join("\n")
}

fn sources() -> Vec<Source> {
    fn walk(folder: &Path, found: &mut Vec<Source>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.file_stem().is_some_and(|stem| stem == "tests") {
                continue;
            }
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

/// The words that follow `prefix` in code, if `prefix` starts a word; for a group in braces, the first word of each member.
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

/// The imports in a source of `module` of later modules, or of unlisted ones.
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
        // The command line may import what the root re-exports.
        let exported = ["DVec3", "Job", "Scene", "SceneSpec", "Settings", "GRAVITY"];
        let mut wrong = offences(&order, module, code);
        wrong.retain(|name| module != "commands" || !exported.contains(name));
        assert!(wrong.is_empty(), "{path} imports {wrong:?}, expected modules before {module} in ARCHITECTURE.md");
    }
    // The check itself finds violations.
    assert_eq!(offences(&order, "mesh", &code_of("use crate::body::Body; // crate::mesh")), ["body"]);
    assert_eq!(offences(&order, "scene", "use crate::mesh::TriMesh;\nlet x = crate::drape::drape();"), ["drape"]);
    let group = "use crate::{drape, mesh::{Topology, TriMesh}, scene};";
    assert_eq!(offences(&order, "parts", group), ["drape"]);
    assert_eq!(offences(&order, "mesh", group), ["drape", "scene"]);
}

#[test]
fn only_record_uses_rerun_and_only_commands_use_clap() {
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

/// A module of the crate: its file, code outside imports, and the paths that its imports give names to.
struct Module {
    file: String,
    code: String,
    imports: Vec<Import>,
}

/// One name of a `use` statement: its path, the name in this module (`*` for all), and whether it is exported again.
struct Import {
    path: Vec<String>,
    name: String,
    exported: bool,
}

/// The paths of a `use` tree, each with the name that it introduces.
fn expand(tree: &str, prefix: &[String], found: &mut Vec<(Vec<String>, String)>) {
    let tree = tree.trim();
    if let Some((head, group)) = tree.split_once('{') {
        let mut inner = prefix.to_vec();
        inner.extend(head.split("::").map(|s| s.trim().to_owned()).filter(|s| !s.is_empty()));
        let (mut depth, mut start) = (0, 0);
        let group = group.strip_suffix('}').unwrap_or(group);
        for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    expand(&group[start..at], &inner, found);
                    start = at + 1;
                }
                _ => {}
            }
        }
    } else if !tree.is_empty() {
        let (path, name) = tree.split_once(" as ").map_or((tree, None), |(path, name)| (path, Some(name.trim())));
        let mut segments = prefix.to_vec();
        segments.extend(path.split("::").map(|s| s.trim().to_owned()).filter(|s| !s.is_empty()));
        if segments.len() > 1 && segments.last().is_some_and(|s| s == "self") {
            segments.pop();
        }
        let name = name.map_or_else(|| segments.last().cloned().unwrap_or_default(), str::to_owned);
        found.push((segments, name));
    }
}

/// All modules by their path in the crate.
fn modules() -> BTreeMap<Vec<String>, Module> {
    let mut all = BTreeMap::new();
    for Source { path, code, .. } in sources() {
        let mut name: Vec<String> = path.trim_end_matches(".rs").split('/').skip(1).map(str::to_owned).collect();
        match name.last().map(String::as_str) {
            Some("main") => continue,
            Some("mod" | "lib") => drop(name.pop()),
            _ => {}
        }
        let (mut imports, mut rest, mut statement) = (Vec::new(), String::new(), String::new());
        for line in code.lines() {
            let starts =
                ["use ", "pub use ", "pub(crate) use ", "pub(super) use "].iter().any(|s| line.trim().starts_with(s));
            if !starts && statement.is_empty() {
                rest += line;
                rest.push('\n');
                continue;
            }
            statement += line.trim();
            statement.push(' ');
            if let Some((head, tree)) = statement.trim().strip_suffix(';').and_then(|s| s.split_once("use ")) {
                let mut found = Vec::new();
                expand(tree, &[], &mut found);
                let exported = head.contains("pub");
                imports.extend(found.into_iter().map(|(path, name)| Import { path, name, exported }));
                statement.clear();
            }
        }
        all.insert(name, Module { file: path, code: rest, imports });
    }
    all
}

/// The file that defines the item of a path as seen from module `at`, through re-exports; `None` outside the crate.
fn resolve(all: &BTreeMap<Vec<String>, Module>, at: &[String], path: &[String], depth: usize) -> Option<String> {
    let (mut current, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "self" => (at.to_vec(), &path[1..]),
        "super" => (at[..at.len().checked_sub(1)?].to_vec(), &path[1..]),
        first => {
            let child = [at, &[first.to_owned()]].concat();
            all.contains_key(&child).then_some((child, &path[1..]))?
        }
    };
    while let Some((next, after)) = rest.split_first() {
        let child = if next == "super" {
            current[..current.len().checked_sub(1)?].to_vec()
        } else {
            [&current[..], std::slice::from_ref(next)].concat()
        };
        if !all.contains_key(&child) {
            break;
        }
        (current, rest) = (child, after);
    }
    let module = all.get(&current)?;
    let Some(item) = rest.first().filter(|_| depth < 8) else { return Some(module.file.clone()) };
    if let Some(import) = module.imports.iter().find(|import| import.name == *item) {
        return resolve(all, &current, &import.path, depth + 1);
    }
    let defined = |code: &str| {
        let kinds = ["fn ", "struct ", "enum ", "trait ", "type ", "const ", "static ", "union "];
        kinds.iter().any(|kind| words_after(code, kind).contains(&item.as_str()))
    };
    if !defined(&module.code) {
        for import in module.imports.iter().filter(|import| import.name == "*") {
            let of = [&import.path[..import.path.len() - 1], std::slice::from_ref(item)].concat();
            if let Some(file) = resolve(all, &current, &of, depth + 1) {
                return Some(file);
            }
        }
    }
    Some(module.file.clone())
}

/// The files that each file takes items from, re-exports left out.
fn imported_files(all: &BTreeMap<Vec<String>, Module>) -> BTreeMap<&str, BTreeSet<String>> {
    let mut edges = BTreeMap::new();
    for (name, module) in all {
        let mut paths: Vec<Vec<String>> =
            module.imports.iter().filter(|import| !import.exported).map(|import| import.path.clone()).collect();
        for path in paths.iter_mut().filter(|path| path.last().is_some_and(|last| last == "*")) {
            path.pop();
        }
        let children = all.keys().filter(|child| child.len() == name.len() + 1 && child.starts_with(name));
        let first_segments =
            ["crate", "super", "self"].into_iter().chain(children.map(|child| child[name.len()].as_str()));
        for first in first_segments {
            for (start, _) in module.code.match_indices(&format!("{first}::")) {
                if !module.code[..start].ends_with(|c| is_word(c) || c == ':') {
                    let end =
                        module.code[start..].find(|c| !is_word(c) && c != ':').map_or(module.code.len(), |n| start + n);
                    paths.push(
                        module.code[start..end].split("::").filter(|s| !s.is_empty()).map(str::to_owned).collect(),
                    );
                }
            }
        }
        let mut files: BTreeSet<String> = paths.iter().filter_map(|path| resolve(all, name, path, 0)).collect();
        files.remove(&module.file);
        edges.insert(module.file.as_str(), files);
    }
    edges
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let all = modules();
    let edges = imported_files(&all);
    let reached = |from: &str| {
        let (mut found, mut next) = (BTreeSet::new(), vec![from.to_owned()]);
        while let Some(file) = next.pop() {
            next.extend(
                edges.get(file.as_str()).into_iter().flatten().filter(|to| found.insert((*to).clone())).cloned(),
            );
        }
        found
    };
    let reach: BTreeMap<&str, BTreeSet<String>> = edges.keys().map(|file| (*file, reached(file))).collect();
    let mut circles: BTreeSet<Vec<&str>> = BTreeSet::new();
    for (file, to) in &reach {
        if to.contains(*file) {
            circles.insert(
                reach
                    .iter()
                    .filter(|(other, back)| to.contains(**other) && back.contains(*file))
                    .map(|(other, _)| *other)
                    .collect(),
            );
        }
    }
    assert!(circles.is_empty(), "files that import each other: {circles:#?}");
    // Imports are found through re-exports: the study reaches the mesh.
    assert!(reach.iter().any(|(file, to)| file.starts_with("src/study/") && to.contains("src/mesh/topology.rs")));
}
