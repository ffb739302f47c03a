//! Whom it waits for: silent peers, viewers that stop reading, nobody who pressed Ctrl-C.

use std::io::Read as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::Bench;

#[test]
fn a_peer_that_accepts_and_stays_silent_is_no_viewer() {
    let bench = Bench::new();
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("rerun+http://{}/proxy", silent.local_addr().unwrap());
    let refused = bench.drape(&["--no-save", "--connect", &url]);
    refused.with(2, &[&url, "silent"]);
    assert!(refused.took < Duration::from_secs(30), "{:?}", refused.took);
}

/// The address of a viewer that answers as HTTP/2 does, and then never again.
fn unread() -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("rerun+http://{}/proxy", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut open = Vec::new();
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            std::io::Write::write_all(&mut stream, &[0, 0, 0, 4, 0, 0, 0, 0, 0]).unwrap();
            open.push(stream);
        }
    });
    url
}

#[test]
fn a_viewer_that_stops_reading_does_not_keep_the_run() {
    let (bench, url) = (Bench::new(), unread());
    let left = bench.drape(&["--save", "kept.rrd", "--connect", &url]);
    left.with(1, &["a viewer does not take the data"]);
    assert!(left.took < Duration::from_secs(90), "{:?}", left.took);
    assert!(bench.path("kept.rrd").is_file(), "the file is complete all the same");
}

#[test]
fn a_viewer_that_is_closed_ends_no_watch_and_takes_no_recording_with_it() {
    let bench = Bench::new();
    let table =
        |levels: &str| bench.write("mine.toml", &format!("name = \"mine\"\nunit = \"cm\"\nlevels = {levels}\n"));
    table("[[0, inf]]");
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("rerun+http://{}/proxy", listener.local_addr().unwrap());
    // Answers as HTTP/2 does, and closes at the first bytes of the program.
    let (close, closed) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            std::io::Write::write_all(&mut stream, &[0, 0, 0, 4, 0, 0, 0, 0, 0]).unwrap();
            let _ = stream.read(&mut [0; 24]);
            drop(stream);
            let _ = close.send(());
        }
    });
    let parts = |line: String| serde_json::from_str::<serde_json::Value>(&line).unwrap()["part_count"].as_u64();
    // On a busy machine the answer above may come too late; the program then refuses the viewer at once.
    let (mut child, mut results, first) = loop {
        let mut command = bench.command();
        command.args(super::SCENE).args(["--watch", "--table", "mine.toml", "--save", "kept.rrd", "--format", "json"]);
        command.args(["--connect", &url]).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut results = std::io::BufRead::lines(std::io::BufReader::new(child.stdout.take().unwrap()));
        if let Some(first) = results.next() {
            break (child, results, first.unwrap());
        }
        let mut message = String::new();
        child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
        assert!(child.wait().unwrap().code() == Some(2) && message.contains("silent"), "{message}");
    };
    assert_eq!(parts(first), Some(1));
    closed.recv().unwrap();
    table("[[0, 10], [10, inf]]");
    assert!(parts(results.next().unwrap().unwrap()) > Some(1));
    let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{message}");
    assert!(message.contains("a viewer does not take the data"), "{message}");
    bench.run(&["view", "--check", "kept.rrd"]).with(0, &[]);
}

#[test]
fn ctrl_c_ends_a_drape_test_even_where_the_shell_ignores_it() {
    let bench = Bench::new();
    let program = env!("CARGO_BIN_EXE_partwise");
    // A script's background jobs inherit an ignored SIGINT; hours of rows, so that it cannot end by itself.
    let script = format!("trap '' INT; echo ready; exec {program} cusick --rows 100");
    let mut shell = Command::new("sh");
    let mut child = shell.arg("-c").arg(script).current_dir(bench.0.path()).stdout(Stdio::piped()).spawn().unwrap();
    // Before its trap is set the shell itself would be interrupted.
    let mut message = [0; 6];
    child.stdout.take().unwrap().read_exact(&mut message).unwrap();
    assert_eq!(&message, b"ready\n");
    let patience = Instant::now() + Duration::from_secs(60);
    let code = loop {
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        std::thread::sleep(Duration::from_millis(200));
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if Instant::now() > patience {
            child.kill().unwrap();
            panic!("still running");
        }
    };
    assert_eq!(code, Some(130));
}

/// Whether a running program handles SIGINT itself, by the mask of caught signals that Linux reports.
#[cfg(target_os = "linux")]
fn catches_interrupts(id: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & 2 != 0
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_while_a_mesh_is_made_ends_the_run_at_once() {
    let bench = Bench::new();
    let mut command = bench.command();
    command.args(["--no-save", "--garment", "long-sleeved-dress@60000"]).stderr(Stdio::piped()).stdout(Stdio::null());
    let mut child = command.spawn().unwrap();
    while !catches_interrupts(child.id()) {
        std::thread::yield_now();
    }
    let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let status = child.wait().unwrap();
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert_eq!(status.code(), Some(130), "{message}");
    assert!(!message.contains("the results so far are kept"), "{message}");
}

#[test]
fn a_served_recording_is_open_before_the_garment_is_at_rest() {
    let bench = Bench::new();
    let results = bench.path("results");
    let mut command = bench.command();
    command.args(["--no-save", "--serve", "--port", "0", "--garment", "flared-skirt@6000"]).stderr(Stdio::piped());
    let mut child = command.stdout(std::fs::File::create(&results).unwrap()).spawn().unwrap();
    let messages = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    let address = messages.map_while(Result::ok).find(|line| line.contains("view it in a browser"));
    let printed = std::fs::metadata(&results).unwrap().len();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(address.is_some());
    assert_eq!(printed, 0, "the results are printed at rest");
}

#[test]
fn whoever_is_ended_at_once_leaves_nothing_half_written() {
    let bench = Bench::new();
    // Its recording waits for a viewer that does not read, and its file with it.
    let url = unread();
    for signal in ["-INT", "-TERM"] {
        let mut command = bench.command();
        command.args(super::SCENE).args(["--save", "x.rrd", "--connect", &url]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let grows = || bench.names().iter().any(|name| name.ends_with(".part"));
        let pause = || std::thread::sleep(Duration::from_millis(400));
        let began = Instant::now();
        // Twice: whether a file can be there is tried before anything is solved.
        while !(grows() && {
            pause();
            grows()
        }) {
            assert!(began.elapsed() < Duration::from_secs(120), "it writes nothing beside its place");
        }
        for _ in 0..2 {
            let _ = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
            pause();
        }
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(bench.names(), ["body.obj", "garment.obj"]);
    }
}

/// Environment variable with the port of [`serve_as_a_viewer`].
const VIEWER_PORT: &str = "PARTWISE_TEST_VIEWER_PORT";

/// A process that accepts recordings as the viewer does, by Rerun's message proxy, until it is killed.
#[test]
#[ignore = "started by another test"]
fn serve_as_a_viewer() {
    let Ok(port) = std::env::var(VIEWER_PORT) else { return };
    let builder = rerun::RecordingStreamBuilder::new("viewer");
    let _server = builder.serve_grpc_opts("127.0.0.1", port.parse().unwrap(), rerun::ServerOptions::default()).unwrap();
    loop {
        std::thread::park();
    }
}

#[test]
fn a_session_is_shown_to_a_viewer_that_comes_late_and_to_one_that_comes_back() {
    let bench = Bench::new();
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let viewer = || {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "waiting::serve_as_a_viewer", "--ignored"]).env(VIEWER_PORT, port.to_string());
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut command = bench.command();
    command.arg("live").args(super::SCENE).args(["--port", "0", "--record", "kept.rrd"]);
    command.args(["--connect", &format!("rerun+http://127.0.0.1:{port}/proxy")]);
    let mut session = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let lines = std::io::BufRead::lines(std::io::BufReader::new(session.stderr.take().unwrap()));
    let (tell, received) = std::sync::mpsc::channel();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| tell.send(line)));
    let mut all = Vec::new();
    let mut until = |words: &str| {
        while !all.last().is_some_and(|line: &String| line.contains(words)) {
            let Ok(line) = received.recv_timeout(Duration::from_secs(60)) else {
                return Err(format!("{words}: {all:?}"));
            };
            all.push(line);
        }
        Ok(())
    };
    let heard = (|| {
        until("a viewer that connects later shows it")?;
        let mut first = viewer();
        let came = until("a viewer is connected");
        first.kill().unwrap();
        first.wait().unwrap();
        came?;
        // The loss is noticed without an edit.
        until("a viewer that connects later shows it")?;
        let mut second = viewer();
        let came = until("a viewer is connected");
        let _ = Command::new("kill").args(["-INT", &session.id().to_string()]).status().unwrap();
        let kept = until("recording: kept.rrd");
        second.kill().unwrap();
        second.wait().unwrap();
        came.and(kept)
    })();
    let _ = session.kill();
    let _ = session.wait().unwrap();
    assert_eq!(heard, Ok(()));
    assert!(bench.path("kept.rrd").is_file());
}
