//! The recording of a run of the program.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod inspect;

#[test]
fn a_garment_that_starts_on_coarser_ones_has_one_point_per_iteration() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.rrd");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_partwise"));
    command.args(["--garment", "flared-skirt@6000", "--format", "json", "--save"]).arg(&path);
    let done = command.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let printed: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    let steps = printed["refine_steps"].as_u64().unwrap();
    let contents = inspect::read(&path);
    for plot in ["/solver/energy", "/solver/residual_log10"] {
        assert_eq!(contents.entities[plot].rows as u64, steps + 1, "{plot}");
    }
}
