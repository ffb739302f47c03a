//! `--watch`: the same session with a file as its only source of edits, from outside.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::client::GARMENT;

fn watching(table: &Path, more: &[&str]) -> (Child, Receiver<Value>) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_partwise"))
        .args(["--garment", GARMENT, "--watch", "--no-save", "--format", "json", "--table"])
        .arg(table)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let stdout = BufReader::new(child.stdout.take().unwrap());
    let (sender, results) = channel();
    std::thread::spawn(move || {
        for line in stdout.lines().map_while(Result::ok) {
            let _ = sender.send(serde_json::from_str(&line).unwrap());
        }
    });
    (child, results)
}

fn save(table: &Path, levels: &str) {
    std::fs::write(table, format!("name = \"mine\"\nunit = \"cm\"\nlevels = {levels}\n")).unwrap();
}

#[test]
fn saves_make_states_despite_other_changes_in_the_folder_until_an_interrupt() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("mine.toml");
    save(&table, "[[0, inf]]");
    let (mut child, results) = watching(&table, &[]);
    // Another file, touched all the time.
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for i in 0.. {
                std::fs::write(folder.path().join("other"), i.to_string()).unwrap();
                std::thread::sleep(Duration::from_millis(30));
                if over.load(Ordering::SeqCst) {
                    break;
                }
            }
        });
        let next = || {
            let result = results.recv_timeout(Duration::from_secs(120)).unwrap();
            (result["part_count"].as_u64().unwrap(), result["since_last"].as_str().map(str::to_owned))
        };
        let (first, since) = next();
        assert_eq!(since, None);
        save(&table, "[[0, 2], [2, inf]]");
        let (second, since) = next();
        assert!(second > first, "{second} PARTs after {first}");
        let since = since.unwrap();
        assert!(since.starts_with(&format!("{second} PARTs after {first}; the drape moved by ")), "{since}");
        // An invalid table is reported, and the next save is drawn.
        save(&table, "[[0, 2], [1, inf]]");
        std::thread::sleep(Duration::from_millis(500));
        save(&table, "[[0, inf]]");
        assert_eq!(next().0, first);
        over.store(true, Ordering::SeqCst);
    });
    let asked = Instant::now();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(asked.elapsed() < Duration::from_secs(10), "{:?}", asked.elapsed());
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert!(message.contains("row 2 starts at 1"), "{message}");
}

/// Resident memory of a process, MB.
#[cfg(target_os = "linux")]
fn resident_mb(child: &Child) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

/// `PARTWISE_WATCH_EDITS=500` for longer.
#[test]
#[cfg(target_os = "linux")]
#[allow(clippy::print_stderr, reason = "a test that tells what it measured")]
fn memory_does_not_grow_with_the_number_of_edits() {
    let edits = std::env::var("PARTWISE_WATCH_EDITS").map_or(60, |text| text.parse::<usize>().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("mine.toml");
    save(&table, "[[0, inf]]");
    let (mut child, results) = watching(&table, &["--serve", "--history", "4"]);
    let mut memory = Vec::new();
    for i in 0..edits {
        results.recv_timeout(Duration::from_secs(120)).unwrap();
        memory.push(resident_mb(&child));
        let bound = 1.0 + 0.01 * i as f64;
        save(&table, &format!("[[0, {bound}], [{bound}, inf]]"));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    child.wait().unwrap();
    let samples: Vec<String> = memory.iter().step_by((edits / 12).max(1)).map(|mb| format!("{mb:.0}")).collect();
    eprintln!("{edits} edits, resident, MB: {}, at the end {:.0}", samples.join(" "), memory[edits - 1]);
    // Without the bound each edit of this garment stays, 0.3 MB at the least; allocators breathe.
    let (half, end) = (memory[edits / 2], memory[edits - 1]);
    assert!(
        end - half < 0.1 * (edits / 2) as f64 + 8.0,
        "{half:.0} MB after {} edits, {end:.0} after {edits}",
        edits / 2
    );
}
