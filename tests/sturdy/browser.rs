//! `--open`: a stand-in for the browser writes its arguments to a file.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{Bench, SCENE};

impl Bench {
    /// A program that writes its arguments to `opened`, a line each.
    fn browser(&self, name: &str, then: &str) -> String {
        let path = self.path(name);
        let opened = self.path("opened");
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, format!("#!/bin/sh\nprintf '%s\\n' \"$@\" > {}\n{then}\n", opened.display())).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path.display().to_string()
    }
}

/// A program that serves: its address, and itself.
fn serving(mut command: Command) -> (String, Child) {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut address = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut address).unwrap();
    assert!(address.starts_with("http://127.0.0.1:"), "{address}");
    (address.trim().to_owned(), child)
}

/// The stderr of a child, which is killed first.
fn stderr_of(mut child: Child) -> String {
    child.kill().unwrap();
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    child.wait().unwrap();
    message
}

fn soon(what: impl Fn() -> bool) -> bool {
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(30) {
        if what() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    false
}

#[test]
fn the_page_is_opened_in_the_browser_that_is_named_or_that_the_system_has() {
    let bench = Bench::new();
    bench.drape(&["--refine", "0", "--save", "x.rrd"]).with(0, &[]);
    let named = bench.browser("browser", "");
    // Where nothing is named, the first of this name on the path.
    bench.browser("bin/xdg-open", "");
    let path = format!("{}:{}", bench.path("bin").display(), std::env::var("PATH").unwrap());
    let cases = [
        (Some(named.clone()), vec![]),
        (Some(format!("{named} --new-window")), vec!["--new-window"]),
        (Some(format!("no-such-browser:{named} --at=%s --quiet")), vec!["--at=%s", "--quiet"]),
        (None, vec![]),
    ];
    for (browser, before) in cases {
        for line in [vec!["view", "x.rrd"], vec!["live", "--garment", "flared-skirt@900"]] {
            let _ = fs::remove_file(bench.path("opened"));
            let mut command = bench.command();
            command.args(&line).arg("--open").env("PATH", &path).env_remove("BROWSER");
            command.envs(browser.as_ref().map(|name| ("BROWSER", name)));
            let (address, child) = serving(command);
            let mut expected: Vec<String> = before.iter().map(|word| word.replace("%s", &address)).collect();
            if !before.iter().any(|word| word.contains("%s")) {
                expected.push(address);
            }
            let opened = || fs::read_to_string(bench.path("opened")).unwrap_or_default();
            let as_asked = soon(|| opened().lines().eq(&expected));
            let message = stderr_of(child);
            assert!(as_asked, "{line:?} with {browser:?}: found {:?}, expected {expected:?}: {message}", opened());
            assert!(!message.contains("--open"), "{message}");
        }
    }
}

#[test]
fn without_a_browser_the_page_is_served_all_the_same() {
    let bench = Bench::new();
    bench.run(&[&SCENE[..], &["--refine", "0", "--save", "x.rrd"]].concat()).with(0, &[]);
    let broken = bench.browser("broken", "exit 3");
    for (browser, why) in [("no-such-browser", "no-such-browser: No such file"), (&broken, "exit status: 3")] {
        let mut command = bench.command();
        command.args(["view", "x.rrd", "--open"]).env("BROWSER", browser);
        let (address, mut child) = serving(command);
        let host = address.strip_prefix("http://").unwrap().trim_end_matches('/');
        assert!(std::net::TcpStream::connect(host).is_ok() && child.try_wait().unwrap().is_none());
        let _ = soon(|| browser != broken || bench.path("opened").exists());
        std::thread::sleep(Duration::from_millis(300));
        let message = stderr_of(child);
        assert!(message.contains(why) && message.contains("open the address by hand"), "{message}");
    }
}
