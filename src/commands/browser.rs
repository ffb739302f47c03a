//! A page opened in the user's browser, where that was asked for.

use std::ffi::OsString;
use std::process::{Command, Stdio};

use super::console;

/// The program that opens an address, and its arguments: `BROWSER`, or what the system has for it.
fn opener() -> (OsString, &'static [&'static str]) {
    match std::env::var_os("BROWSER").filter(|name| !name.is_empty()) {
        Some(browser) => (browser, &[]),
        None if cfg!(target_os = "macos") => ("open".into(), &[]),
        None if cfg!(target_os = "windows") => ("cmd".into(), &["/c", "start", ""]),
        None => ("xdg-open".into(), &[]),
    }
}

/// Opens `address`; where that cannot be done it is said, and the page is served all the same.
pub(super) fn open(address: &str) {
    let (program, arguments) = opener();
    let mut command = Command::new(&program);
    command.args(arguments).arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Err(error) = command.spawn() {
        console::warning(&format!(
            "--open: found no browser to open ({}: {error}), expected the program that BROWSER names; open the address by hand",
            program.display()
        ));
    }
}
