//! Where it writes: devices, links, full disks, one place for two.

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::process::Command;
use std::time::Duration;

use super::{Bench, SCENE, ended};

#[test]
fn devices_stay_devices_and_a_full_one_is_said() {
    let bench = Bench::new();
    bench.drape(&["--save", "/dev/null", "--export", "/dev/null"]).with(0, &[]);
    bench.drape(&["--save", "/dev/full"]).with(1, &["/dev/full", "No space left"]);
    bench.drape(&["--no-save", "--export", "/dev/full"]).with(2, &["/dev/full", "No space left"]);
    for device in ["/dev/null", "/dev/full"] {
        assert!(fs::metadata(device).unwrap().file_type().is_char_device(), "{device}");
    }
    for format in ["json", "text"] {
        let mut command = bench.command();
        command.args(SCENE).args(["--no-save", "--format", format]);
        command.stdout(fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
        ended(&mut command).with(1, &["standard output", "No space left"]);
    }
}

#[test]
fn a_disk_that_fills_up_leaves_nothing_half_written_and_ends_the_run() {
    let bench = Bench::new();
    bench.write("old.rrd", "what was there");
    // A limit on the size of files stands for the full disk: it needs no rights, and fails in the same places.
    let run = |blocks: usize, arguments: &str| {
        let program = env!("CARGO_BIN_EXE_partwise");
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec {program} {arguments}");
        let mut command = Command::new("sh");
        ended(command.current_dir(bench.0.path()).env("XDG_CACHE_HOME", bench.0.path()).arg("-c").arg(script))
    };
    let recorded = run(8, &format!("{} --save old.rrd", SCENE.join(" ")));
    recorded.with(1, &["old.rrd", "too large"]);
    assert!(recorded.took < Duration::from_secs(60), "{:?}", recorded.took);
    run(0, "cusick silk --rows 4 --csv old.rrd").with(2, &["old.rrd", "too large"]);
    run(0, &format!("{} --no-save --export old.rrd", SCENE.join(" "))).with(2, &["old.rrd", "too large"]);
    assert_eq!(fs::read_to_string(bench.path("old.rrd")).unwrap(), "what was there");
    assert_eq!(bench.names(), ["body.obj", "garment.obj", "old.rrd"]);
}

#[test]
fn one_file_for_two_outputs_is_refused() {
    let bench = Bench::new();
    bench.drape(&["--save", "a", "--export", "./a"]).with(2, &["--save", "--export", "./a"]);
    symlink("a", bench.path("b")).unwrap();
    bench.drape(&["--save", "b", "--export", "a"]).with(2, &["--save", "--export"]);
    assert!(!bench.path("a").exists());
}

#[test]
fn links_are_written_through_and_planted_ones_left_alone() {
    let bench = Bench::new();
    bench.write("victim", "mine");
    for name in ["out.obj.part", "out.rrd.part"] {
        symlink("victim", bench.path(name)).unwrap();
    }
    symlink("kept.obj", bench.path("out.obj")).unwrap();
    bench.drape(&["--export", "out.obj", "--save", "out.rrd"]).with(0, &[]);
    assert_eq!(fs::read_to_string(bench.path("victim")).unwrap(), "mine");
    assert!(bench.path("out.obj").is_symlink());
    assert!(fs::read_to_string(bench.path("kept.obj")).unwrap().contains("f 1 2 5"));
    assert!(bench.path("out.rrd").is_file());
}
