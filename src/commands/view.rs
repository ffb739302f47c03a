//! `partwise view`: a recording in the bundled web viewer; and `--open`, which opens a page in the user's browser.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use crate::record::web;
use clap::Args;

use super::console;
use super::runtime::{interrupted, keep_results, refuse, wait_for_interrupt};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Recording
    #[arg(value_name = "FILE.rrd")]
    file: PathBuf,
    /// Port of the page; 0 picks a free one [default: 7278, or a free one if it is in use]
    #[arg(long, visible_alias = "port", value_name = "PORT")]
    web_port: Option<u16>,
    /// Additional port on which viewers can read the recording
    #[arg(long, value_name = "PORT")]
    grpc_port: Option<u16>,
    /// Open the page in your browser
    #[arg(long)]
    open: bool,
    /// Read the recording and exit; `view` runs this in a separate process first
    #[arg(long, hide = true)]
    check: bool,
}

impl ViewArgs {
    /// Serves until Ctrl-C.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if self.check {
            console::warnings(web::check_file(&self.file)?.as_slice());
            return Ok(());
        }
        keep_results();
        self.check_in_child()?;
        // The decoder's panics are returned as errors, so their output is suppressed.
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let served = web::serve_file(&self.file, self.web_port, self.grpc_port);
        std::panic::set_hook(hook);
        let served = served?;
        console::result(served.url());
        console::note("open this address in a browser; Ctrl-C ends");
        if let Some(warning) = served.warning() {
            console::warning(warning);
        }
        if self.open {
            open_browser(served.url());
        }
        wait_for_interrupt();
        Ok(())
    }

    /// Reads the file in a child process. Rerun's decoder trusts the sizes in a file, and a damaged recording can end the process by
    /// an allocation that no error handling catches.
    fn check_in_child(&self) -> anyhow::Result<()> {
        let mut reader = Command::new(std::env::current_exe()?);
        reader.arg("view").arg("--check").arg(&self.file);
        let ended = reader.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status()?;
        // This process reports the errors that the reader returned.
        if matches!(ended.code(), Some(0 | 2)) || interrupted() {
            return Ok(());
        }
        refuse!(
            "{}: found a damaged recording (its decoder failed: {ended}), expected an .rrd file as written by `partwise run --save \
             FILE.rrd`; create or copy it again",
            self.file.display()
        )
    }
}

/// The commands that open an address, in the order in which they are tried: the list in BROWSER (separated by colons, with `%s` for
/// the address or without), or else the command of the operating system.
fn browser_commands(address: &str) -> Vec<Vec<OsString>> {
    let system: &[&str] = if cfg!(target_os = "macos") {
        &["open"]
    } else if cfg!(target_os = "windows") {
        &["cmd", "/c", "start", ""]
    } else {
        &["xdg-open"]
    };
    let command = |words: Vec<&str>| {
        let has_place = words.iter().any(|word| word.contains("%s"));
        let mut words: Vec<OsString> = words.iter().map(|word| word.replace("%s", address).into()).collect();
        words.extend((!has_place).then(|| address.into()));
        words
    };
    match std::env::var_os("BROWSER").filter(|list| !list.is_empty()).map(OsString::into_string) {
        None => vec![command(system.to_vec())],
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

fn start(words: &[OsString]) -> std::io::Result<Child> {
    let null = Stdio::null;
    Command::new(&words[0]).args(&words[1..]).stdin(null()).stdout(null()).stderr(null()).spawn()
}

/// Opens `address` in a browser. A failure is a warning, because the page is served anyway. The crate `webbrowser` reports neither the
/// program that failed nor its exit status, so the browser is started here.
pub(super) fn open_browser(address: &str) {
    let warn = |reason: &str| {
        console::warning(&format!(
            "--open: found no browser to open ({reason}), expected the program that BROWSER names; open the address by hand"
        ));
    };
    let mut failures = Vec::new();
    for words in browser_commands(address) {
        let name = words[0].display().to_string();
        match start(&words) {
            Ok(mut child) => {
                // The command may run until the browser is closed.
                std::thread::spawn(move || match child.wait() {
                    Ok(status) if !status.success() => warn(&format!("{name} ended with {status}")),
                    _ => {}
                });
                return;
            }
            Err(error) => failures.push(format!("{name}: {error}")),
        }
    }
    warn(&failures.join("; "));
}
