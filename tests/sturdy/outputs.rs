//! Outputs: devices, links, full disks, two outputs in one file.

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::process::Command;
use std::time::Duration;

use super::{Bench, SCENE, ended};

#[test]
fn devices_are_kept_and_a_full_device_is_reported() {
    let bench = Bench::new();
    bench.drape(&["--save", "/dev/null", "--export", "/dev/null"]).with(0, &[]);
    bench.drape(&["--save", "/dev/full"]).with(2, &["/dev/full", "No space left"]);
    bench.drape(&["--no-save", "--export", "/dev/full"]).with(2, &["/dev/full", "No space left"]);
    let pattern = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/patterns/skirt.json");
    bench.run(&["pattern", pattern, "--svg", "/dev/full"]).with(2, &["/dev/full", "No space left"]);
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
fn an_output_that_cannot_be_is_refused_before_anything_is_read_or_solved() {
    let bench = Bench::new();
    let [rrd, obj] = ["missing/x.rrd", "missing/x.obj"].map(|name| bench.path(name).to_str().unwrap().to_owned());
    // If the inputs were read first, the missing garment would be reported.
    for output in [["--save", &rrd], ["--export", &obj]] {
        let mut arguments = vec!["--body", "body.obj", "--garment", "nowhere.obj"];
        arguments.extend(output);
        let ended = bench.run(&arguments);
        ended.with(2, &[output[1], "cannot"]);
        assert!(!ended.stderr.contains("nowhere.obj"), "{}", ended.stderr);
    }
    assert_eq!(bench.names(), ["body.obj", "garment.obj"]);
}

#[test]
fn a_disk_that_fills_up_leaves_nothing_half_written_and_ends_the_run() {
    let bench = Bench::new();
    bench.write("old.rrd", "what was there");
    // A limit on the size of files stands for the full disk: it needs no rights, and fails in the same places.
    let run = |blocks: usize, arguments: &str| {
        let program = env!("CARGO_BIN_EXE_partwise");
        let script = format!("ulimit -f {blocks}; exec {program} {arguments}");
        let mut command = Command::new("sh");
        ended(command.current_dir(bench.0.path()).env("XDG_CACHE_HOME", bench.0.path()).arg("-c").arg(script))
    };
    let recorded = run(8, &format!("{} --save old.rrd", SCENE.join(" ")));
    recorded.with(2, &["old.rrd", "too large"]);
    assert!(recorded.took < Duration::from_secs(60), "{:?}", recorded.took);
    run(0, "cusick silk --rows 4 --csv old.rrd").with(2, &["old.rrd", "too large"]);
    run(0, "assets --vertices 400 --out a").with(2, &["a/bodies/form.obj", "too large"]);
    fs::remove_dir_all(bench.path("a")).unwrap();
    bench.write("old.obj", "and there");
    run(0, &format!("{} --no-save --export old.obj", SCENE.join(" "))).with(2, &["old.obj", "too large"]);
    assert_eq!(fs::read_to_string(bench.path("old.rrd")).unwrap(), "what was there");
    assert_eq!(fs::read_to_string(bench.path("old.obj")).unwrap(), "and there");
    assert_eq!(bench.names(), ["body.obj", "garment.obj", "old.obj", "old.rrd"]);
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
fn an_input_is_not_overwritten_by_any_command_unless_forced() {
    let bench = Bench::new();
    let read =
        |file: &str| fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/").to_owned() + file).unwrap();
    bench.write("p.json", &read("patterns/skirt.json"));
    bench.write("f.toml", &read("fabrics/denim.toml"));
    bench.write("t.toml", "name = \"t\"\nunit = \"cm\"\nlevels = [[0, inf]]\n");
    bench.write("s.toml", "name = \"s\"\n[base]\ngarment = \"garment.obj\"\n[grid]\ntables = [\"table-3\"]\n");
    fs::create_dir(bench.path("tuned")).unwrap();
    fs::hard_link(bench.path("f.toml"), bench.path("tuned/flared-skirt@400-levels.toml")).unwrap();
    fs::hard_link(bench.path("garment.obj"), bench.path("hard.obj")).unwrap();
    for name in ["garment.obj", "t.toml", "s.toml"] {
        symlink(name, bench.path(name.to_owned() + ".rrd")).unwrap();
    }
    let all = |bench: &Bench| {
        let files = bench.names().into_iter().filter_map(|name| Some((fs::read(bench.path(&name)).ok()?, name)));
        files.collect::<Vec<_>>()
    };
    let before = all(&bench);
    let scene = SCENE.join(" ");
    for line in [
        format!("{scene} --no-save --export garment.obj"),
        format!("{scene} --no-save --export ./body.obj"),
        format!("{scene} --no-save --export hard.obj"),
        format!("{scene} --save garment.obj.rrd"),
        format!("{scene} --save t.toml.rrd --table t.toml"),
        format!("{scene} --no-save --export hard.obj --method zhu2016"),
        format!("{scene} --no-save --export hard.obj --watch"),
        "pattern p.json --svg ../../../../../../../../../{here}/p.json"
            .replace("{here}", bench.path("").to_str().unwrap()),
        "compare table-3 t.toml --garment flared-skirt@400 --no-save --csv t.toml".to_owned(),
        "cusick f.toml --rows 4 --csv f.toml".to_owned(),
        "bench table-4 --quick --fabric f.toml --csv f.toml".to_owned(),
        "sweep s.toml --out swept --save s.toml.rrd".to_owned(),
        "sweep s.toml --out swept --save garment.obj.rrd".to_owned(),
        "tune --garment flared-skirt@400 --levels-only --max-parts 2 --fabric f.toml --out tuned".to_owned(),
    ] {
        bench.run(&line.split(' ').collect::<Vec<_>>()).with(2, &["the run reads and writes this file", "--force"]);
        let _ = fs::remove_dir_all(bench.path("swept"));
        assert!(all(&bench) == before, "{line}: {:?}", bench.names());
    }
    bench.drape(&["--no-save", "--export", "garment.obj", "--force"]).with(0, &[]);
    assert_ne!(fs::read_to_string(bench.path("garment.obj")).unwrap(), super::GARMENT);
    bench.run(&["pattern", "p.json", "--svg", "p.json", "--force"]).with(0, &[]);
    assert!(fs::read_to_string(bench.path("p.json")).unwrap().starts_with("<svg"));
    // A file of another program is not a recording.
    bench.write("notes.txt", "mine");
    bench.drape(&["--save", "notes.txt"]).with(2, &["notes.txt", ".rrd"]);
    bench.drape(&["--save", "notes.txt", "--force"]).with(2, &["notes.txt", ".rrd"]);
}

#[test]
fn assets_that_were_edited_are_kept_unless_forced() {
    let bench = Bench::new();
    let assets = |more: &[&str]| bench.run(&[&["assets", "--vertices", "400", "--out", "a"], more].concat());
    assets(&[]).with(0, &[]);
    assets(&[]).with(0, &[]);
    bench.write("a/fabrics/silk.toml", "mine");
    bench.write("a/garments/pullover-1.obj", "");
    fs::remove_file(bench.path("a/bodies/form.toml")).unwrap();
    let refused = assets(&[]);
    refused.with(2, &["garments/pullover-1.obj, fabrics/silk.toml;", "nothing is written", "--force"]);
    assert_eq!(fs::read_to_string(bench.path("a/fabrics/silk.toml")).unwrap(), "mine");
    assert!(!bench.path("a/bodies/form.toml").exists());
    assets(&["--force"]).with(0, &[]);
    assert!(fs::read_to_string(bench.path("a/fabrics/silk.toml")).unwrap().contains("bending_nm"));
    assert!(bench.path("a/bodies/form.toml").exists());
}

#[test]
fn a_garment_of_assets_with_its_shape_as_cut_drapes_as_the_built_in_one() {
    let bench = Bench::new();
    bench.run(&["assets", "--vertices", "400", "--out", "a"]).with(0, &["--rest texture"]);
    let drape = |garment: &[&str], export: &str| {
        bench.run(&[garment, &["--refine", "3", "--no-save", "--export", export]].concat()).with(0, &[]);
        let text = fs::read_to_string(bench.path(export)).unwrap();
        text.lines().filter(|line| line.starts_with("v ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let built_in = drape(&["--garment", "low-cut-dress@400"], "built-in.obj");
    let from_file = drape(&["--garment", "a/garments/low-cut-dress.obj", "--rest", "texture"], "file.obj");
    assert_eq!(built_in.len(), 400);
    assert_eq!(built_in, from_file);
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

#[test]
fn the_ending_of_a_name_chooses_the_format_relative_to_the_working_folder() {
    let bench = Bench::new();
    bench.drape(&["--no-save", "--export", "garment.fbx"]).with(2, &["--export", ".fbx", ".obj"]);
    assert!(!bench.path("garment.fbx").exists());
    let far = bench.path("not/there/x.rrd");
    bench.drape(&["--save", far.to_str().unwrap()]).with(2, &["not/there/x.rrd", "No such file or directory"]);
    assert!(!bench.path("not").exists(), "folders of an absolute path are not made");
    bench.drape(&["--save", "new/folder/x.rrd"]).with(0, &[]);
    assert!(bench.path("new/folder/x.rrd").is_file());
}

#[test]
fn two_runs_at_once_on_one_output_and_one_cache_leave_one_whole_file_each() {
    let bench = Bench::new();
    let arguments =
        ["--garment", "flared-skirt@600", "--save", "one.rrd", "--export", "one.obj", "--accuracy", "--cache", "kept"];
    for _ in 0..2 {
        let mut running: Vec<_> = (0..3)
            .map(|_| {
                bench
                    .command()
                    .args(arguments)
                    .stderr(std::process::Stdio::null())
                    .stdout(std::process::Stdio::null())
                    .spawn()
                    .unwrap()
            })
            .collect();
        for child in &mut running {
            assert!(child.wait().unwrap().success());
        }
        bench.run(&["view", "--check", "one.rrd"]).with(0, &[]);
        let export = fs::read_to_string(bench.path("one.obj")).unwrap();
        assert!(export.matches("\nv ").count() > 500 && export.ends_with('\n'), "{}", export.len());
        let names = bench.names();
        assert!(!names.iter().any(|name| name.ends_with(".part")), "{names:?}");
    }
}

#[test]
fn a_damaged_reference_is_recomputed_with_a_note() {
    let bench = Bench::new();
    let run = || bench.run(&["--garment", "flared-skirt@400", "--no-save", "--accuracy", "--cache", "kept"]);
    run().with(0, &[]);
    let entries: Vec<_> = fs::read_dir(bench.path("kept")).unwrap().map(|e| e.unwrap().path()).collect();
    assert!(!entries.is_empty());
    for poison in [&b"nothing of ours"[..], b"", &[0xff; 4000]] {
        for entry in &entries {
            fs::write(entry, poison).unwrap();
        }
        run().with(0, &["kept"]);
        run().with(0, &[]);
    }
    // One that is truncated, and one that belongs to another reference.
    let whole = fs::read(&entries[0]).unwrap();
    fs::write(&entries[0], &whole[..whole.len() / 2]).unwrap();
    run().with(0, &["kept"]);
    if let [first, second, ..] = &entries[..] {
        fs::copy(first, second).unwrap();
        run().with(0, &["kept"]);
    }
}

#[test]
fn a_full_disk_under_a_sweep_a_comparison_and_a_search_ends_them_with_words() {
    let bench = Bench::new();
    bench.write("sweep.toml", "name = \"s\"\n[base]\nbody = \"body.obj\"\ngarment = \"garment.obj\"\noptions = { unit = \"m\", up = \"z\" }\n[grid]\ntables = [\"table-3\", { quantile = 2 }]\n");
    let program = env!("CARGO_BIN_EXE_partwise");
    let scene = "--body body.obj --garment garment.obj";
    for (blocks, arguments) in [
        (0, "sweep sweep.toml --out full --no-save".to_owned()),
        (16, "sweep sweep.toml --out part --accuracy none".to_owned()),
        (8, format!("compare table-3 table-3 {scene} --accuracy none --repeats 1 --save full.rrd")),
        (0, "tune --garment flared-skirt@400 --levels-only --tables 16 --out tuned".to_owned()),
        (1, "assets --vertices 400 --out assets".to_owned()),
    ] {
        let script = format!("ulimit -f {blocks}; exec {program} {arguments}");
        let mut command = Command::new("sh");
        let run =
            ended(command.current_dir(bench.0.path()).env("XDG_CACHE_HOME", bench.0.path()).arg("-c").arg(&script));
        // A sweep whose points cannot be kept has failed points, which is no mistake of the user's.
        let failed = run.stderr.contains("points failed");
        assert_eq!(run.code, Some(if failed { 1 } else { 2 }), "{arguments}: {}", run.stderr);
        // A point that could not be kept is a row, which says so.
        let rows = fs::read_to_string(bench.path("part/rows.jsonl")).unwrap_or_default();
        assert!(run.stderr.contains("too large") || rows.contains("too large"), "{arguments}: {}", run.stderr);
        assert!(!run.stderr.contains("panicked"), "{arguments}: {}", run.stderr);
        assert!(run.took < Duration::from_secs(90), "{arguments}: {:?}", run.took);
        let left = Command::new("find").arg(bench.0.path()).args(["-name", "*.part"]).output().unwrap().stdout;
        assert!(left.is_empty(), "{arguments}: {}", String::from_utf8_lossy(&left));
    }
}

#[test]
fn a_garment_without_a_rest_is_draped_and_kept_all_the_same() {
    let bench = Bench::new();
    bench
        .drape(&["--accuracy", "--save", "kept.rrd"])
        .with(0, &["falls off the body", "kept without its error", "--hold"]);
    assert!(bench.path("kept.rrd").is_file());
}
