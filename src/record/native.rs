//! Starting the native viewer.
//!
//! Rerun's own `spawn` inherits the standard streams: in `partwise run --spawn | less` the pipe then stays open as long as the
//! viewer does. Here the viewer inherits none, and has its own process group, so that Ctrl-C does not end it.

use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::error::{RERUN_VERSION, RecordError};

/// Longest wait for the viewer's port: a cold start from a slow disk takes seconds.
const START_TIMEOUT: Duration = Duration::from_secs(15);
/// Interval of the attempts to connect.
const POLL: Duration = Duration::from_millis(100);

/// Starts the native viewer, `program`, on `port` of 127.0.0.1 and waits until it listens. A listener that is there already is assumed to be a
/// viewer.
///
/// # Errors
/// No such program in PATH, one of another version, one that ends or does not listen in time.
pub(super) fn start(program: &str, port: u16) -> Result<(), RecordError> {
    if listens(port) {
        return Ok(());
    }
    let failed = |reason: String| RecordError::NoViewer { reason };
    let not_run = |error: std::io::Error| {
        failed(match error.kind() {
            std::io::ErrorKind::NotFound => format!("there is no `{program}` in PATH"),
            _ => format!("`{program}`: {error}"),
        })
    };
    let version = Command::new(program).arg("--version").stdin(Stdio::null()).output().map_err(not_run)?;
    let answer = String::from_utf8_lossy(&version.stdout).into_owned();
    // Rerun promises compatibility within a minor version only.
    if minor(&answer).is_some_and(|found| Some(found) != minor(RERUN_VERSION)) {
        let first = answer.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
        return Err(failed(format!("the one in PATH is {first}")));
    }
    let mut command = Command::new(program);
    command
        .args([format!("--port={port}"), "--bind=127.0.0.1".to_owned()])
        .args(["--expect-data-soon", "--hide-welcome-screen"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut viewer = command.spawn().map_err(not_run)?;
    let started = Instant::now();
    while started.elapsed() < START_TIMEOUT {
        if listens(port) {
            return Ok(());
        }
        // A launcher may start the viewer and end with success.
        if let Ok(Some(status)) = viewer.try_wait()
            && !status.success()
        {
            return Err(failed(format!("`{program}` ended with {status}; run it alone to see why")));
        }
        std::thread::sleep(POLL);
    }
    Err(failed(format!(
        "`{program}` was started, but does not listen on port {port} after {} s",
        START_TIMEOUT.as_secs()
    )))
}

fn listens(port: u16) -> bool {
    TcpStream::connect_timeout(&SocketAddr::from((Ipv4Addr::LOCALHOST, port)), Duration::from_secs(1)).is_ok()
}

/// Major and minor version of the first version in a text.
fn minor(text: &str) -> Option<(u32, u32)> {
    text.split_whitespace().find_map(|word| {
        let mut numbers = word.split('.').map(str::parse);
        Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    /// A viewer that runs `script`.
    #[cfg(unix)]
    fn program(folder: &tempfile::TempDir, script: &str) -> String {
        use std::os::unix::fs::PermissionsExt as _;
        let path = folder.path().join("viewer");
        std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        path.to_str().unwrap().to_owned()
    }

    #[cfg(unix)]
    fn free_port() -> u16 {
        TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
    }

    #[test]
    #[cfg(unix)]
    fn a_viewer_that_does_not_start_is_reported_with_its_cause() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("none").to_str().unwrap().to_owned();
        assert!(start(&missing, free_port()).unwrap_err().to_string().contains("in PATH"));
        let old = program(&folder, "echo rerun-cli 0.21.0");
        assert!(start(&old, free_port()).unwrap_err().to_string().contains("is rerun-cli 0.21.0"));
        let broken = program(&folder, "case $1 in --version) echo rerun-cli 0.36.1;; *) exit 3;; esac");
        assert!(start(&broken, free_port()).unwrap_err().to_string().contains("exit status: 3"));
    }

    #[test]
    fn a_viewer_that_listens_already_is_used() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        start("no such program", listener.local_addr().unwrap().port()).unwrap();
    }

    #[test]
    fn the_version_is_parsed_from_the_viewers_output() {
        assert_eq!(minor("rerun-cli 0.36.3 (base lance) [rustc 1.95.0]"), Some((0, 36)));
        assert_eq!(minor(RERUN_VERSION), Some((0, 36)));
        assert_eq!(minor("no version here"), None);
    }
}
