//! The verdict of a run, names that are mistyped, recordings that are replaced, and the frames of both files.

use super::{Bench, json};

fn stderr(output: &std::process::Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_run_ends_with_its_verdict_and_strict_makes_it_an_exit_code() {
    let bench = Bench::new();
    let last = |output: &std::process::Output| {
        String::from_utf8_lossy(&output.stdout).trim_end().lines().last().unwrap_or_default().to_owned()
    };
    let rests = bench.drape(&["--no-save"]);
    assert_eq!(rests.status.code(), Some(0), "{}", stderr(&rests));
    assert!(last(&rests).starts_with("verdict: rests, nothing inside the body, no crossing"), "{}", last(&rests));
    assert_eq!(json(&bench.drape(&["--no-save", "--format", "json"]))["verdict"], "rests");
    let preview = ["--no-save", "--refine", "0"];
    let plain = bench.drape(&preview);
    assert_eq!(plain.status.code(), Some(0));
    assert!(last(&plain).contains("does not rest: residual"), "{}", last(&plain));
    let strict = bench.drape(&[&preview[..], &["--strict"]].concat());
    assert_eq!(strict.status.code(), Some(3), "{}", stderr(&strict));
    let message = stderr(&strict);
    for part in ["--strict: found \"does not rest", "not certified: residual", "expected a garment that rests"] {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
    bench.refuses(&["--strict", "--method", "zhu2016", "--no-save"], &["--strict", "zhu2016", "two-stage"]);
}

/// The output of a drape as a terminal shows it: both streams in their order.
fn shown(bench: &Bench, more: &[&str]) -> String {
    let path = bench.path("shown.txt");
    let file = std::fs::File::create(&path).unwrap();
    let inputs = ["--body", "body.obj", "--garment", "garment.obj", "--unit", "m", "--up", "z", "--no-save"];
    std::process::Command::new(env!("CARGO_BIN_EXE_partwise"))
        .current_dir(bench.folder.path())
        .args(inputs.iter().chain(more))
        .stdout(file.try_clone().unwrap())
        .stderr(file)
        .status()
        .unwrap();
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn the_verdict_stands_below_all_notes_and_warnings() {
    let bench = Bench::new();
    for more in [&["--certify"][..], &["--refine", "0"]] {
        let shown = shown(&bench, more);
        let last = shown.trim_end().lines().last().unwrap();
        assert!(shown.contains("garment.obj: 169 vertices") && last.starts_with("verdict: "), "{shown}");
    }
}

#[test]
fn a_mistyped_name_is_answered_by_the_one_that_is_like_it() {
    let bench = Bench::new();
    for (arguments, meant) in [
        (["--table", "table3"], "did you mean `table-3`?"),
        (["--garment", "pulover-1"], "did you mean `pullover-1`?"),
        (["--fabric", "interlok"], "did you mean `interlock`?"),
        (["--measure", "crotch_heigth=80"], "did you mean `crotch_height_cm`?"),
    ] {
        bench.refuses(&arguments, &[meant]);
    }
}

#[test]
fn options_of_the_solver_are_set_by_name_and_unknown_ones_refused() {
    let bench = Bench::new();
    let one = bench.drape(&["--no-save", "--format", "json", "--solver", "newton.max-steps=1"]);
    assert_eq!(json(&one)["refine_steps"], 1, "{}", stderr(&one));
    bench.refuses(&["--solver", "newton.dampin=3"], &["newton.dampin", "newton.damping,"]);
    bench.refuses(&["--solver", "newton.damping=-1"], &["newton.damping", "0 to 1e9"]);
    bench.refuses(&["--method", "zhu2016", "--no-save", "--solver", "newton.damping=1"], &["--solver", "two-stage"]);
}

#[test]
fn the_recording_of_an_earlier_run_is_replaced_with_a_word() {
    let bench = Bench::new();
    let preview = ["--refine", "0"];
    assert!(!stderr(&bench.drape(&preview)).contains("replaces"));
    let again = stderr(&bench.drape(&preview));
    assert!(again.contains("garment.rrd: replaces the recording of an earlier run; --save FILE.rrd"), "{again}");
    assert!(!stderr(&bench.drape(&["--refine", "0", "--save", "own.rrd"])).contains("replaces"));
}

#[test]
fn body_and_garment_have_frames_of_their_own() {
    let bench = Bench::new();
    // The cube of half a metre in millimetres, y up; the sheet in metres, z up.
    let cube = super::cube(1.0);
    let vertex = |line: &str| {
        let p: Vec<f64> = line.split_whitespace().skip(1).map(|x| 1e3 * x.parse::<f64>().unwrap()).collect();
        format!("v {} {} {}\n", p[0], p[2], -p[1])
    };
    let line = |line: &str| if line.starts_with('v') { vertex(line) } else { format!("{line}\n") };
    bench.write("body.obj", &cube.lines().map(line).collect::<String>());
    let files = ["--body", "body.obj", "--garment", "garment.obj", "--no-save", "--format", "json"];
    let run = |more: &[&str]| json(&bench.run(&[&files[..], more].concat()));
    let guessed = run(&[]);
    assert_eq!(guessed["verdict"], "rests", "{guessed}");
    let given = run(&["--body-unit", "mm", "--body-up", "y", "--garment-unit", "m", "--garment-up", "z"]);
    assert_eq!(given["energy_j"], guessed["energy_j"]);
    assert_eq!(
        run(&["--unit", "m", "--up", "z", "--body-unit", "mm", "--body-up", "y"])["energy_j"],
        given["energy_j"]
    );
    bench.refuses(&["--front", "up", "--no-save"], &["--front", "x, -x, y, -y, z or -z"]);
    // A garment that fits about the body in no frame.
    bench.write("garment.obj", &super::sheet(12, 1.51).replace(" 1.51\n", " 1e6\n"));
    bench.refuses(&["--body", "body.obj", "--garment", "garment.obj"], &["--garment-unit"]);
}
