//! A page opened in the user's browser, where that was asked for.

use std::ffi::OsString;
use std::process::{Child, Command, Stdio};

use super::console;

/// What opens an address, in the order in which it is tried: the commands that BROWSER lists (colons between them, `%s` for the
/// address or none, as elsewhere), or what the system has for it.
fn openers(address: &str) -> Vec<Vec<OsString>> {
    let of_system: &[&str] = if cfg!(target_os = "macos") {
        &["open"]
    } else if cfg!(target_os = "windows") {
        &["cmd", "/c", "start", ""]
    } else {
        &["xdg-open"]
    };
    let command = |words: Vec<&str>| {
        let named = words.iter().any(|word| word.contains("%s"));
        let mut words: Vec<OsString> = words.iter().map(|word| word.replace("%s", address).into()).collect();
        words.extend((!named).then(|| address.into()));
        words
    };
    let set = std::env::var_os("BROWSER").filter(|list| !list.is_empty());
    match set.map(OsString::into_string) {
        None => vec![command(of_system.to_vec())],
        Some(Ok(list)) if cfg!(unix) => list
            .split(':')
            .map(|entry| entry.split_whitespace().collect::<Vec<_>>())
            .filter(|words| !words.is_empty())
            .map(command)
            .collect(),
        Some(Ok(program)) => vec![vec![program.into(), address.into()]],
        Some(Err(program)) => vec![vec![program, address.into()]],
    }
}

fn started(words: &[OsString]) -> std::io::Result<Child> {
    let quiet = || Stdio::null();
    Command::new(&words[0]).args(&words[1..]).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn()
}

/// Opens `address`; where that cannot be done it is said, and the page is served all the same.
pub(super) fn open(address: &str) {
    let mut tried = Vec::new();
    for words in openers(address) {
        let name = words[0].display().to_string();
        match started(&words) {
            Ok(mut child) => {
                // It may stay for as long as the browser does.
                std::thread::spawn(move || match child.wait() {
                    Ok(status) if !status.success() => none(&format!("{name} ended with {status}")),
                    _ => {}
                });
                return;
            }
            Err(error) => tried.push(format!("{name}: {error}")),
        }
    }
    none(&tried.join("; "));
}

fn none(why: &str) {
    console::warning(&format!(
        "--open: found no browser to open ({why}), expected the program that BROWSER names; open the address by hand"
    ));
}
