//! The bits of a drape do not depend on the processor: with the portable lanes of the program and the plain functions of the C library, each
//! drape is the same number by number.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "the lines are read by the parent process")]

use std::process::Command;

use partwise::SceneSpec;
use partwise::drape::{self, Settings};
use partwise::garment::fabric::Fabric;

/// Set in the process that drapes with the portable lanes: `base::simd`.
const PORTABLE: &str = "PARTWISE_PORTABLE";

/// Functions of the C library without AVX2 and FMA.
const PLAIN: (&str, &str) =
    ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-AVX,-FMA,-FMA4,-AVX512F,-AVX2_Usable,-FMA_Usable");

/// One line for each drape: its name and a sum of all bits.
fn drapes() -> String {
    let pattern = format!("{}/assets/patterns/skirt.json", env!("CARGO_MANIFEST_DIR"));
    let all = [
        ("pullover-1@700", "jersey"),
        ("flared-skirt@700", "cotton"),
        ("low-cut-dress@700", "denim"),
        (&*pattern, "interlock"),
    ];
    let of = |(garment, fabric): (&str, &str)| {
        let loaded = SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", garment) }.load().unwrap();
        let settings = Settings { fabric: Fabric::by_name(fabric).unwrap(), ..Settings::default() };
        let drape = drape::drape(&loaded.scene, &settings, &mut drape::unobserved).unwrap();
        let numbers = drape.preview.iter().chain(&drape.positions).flat_map(partwise::DVec3::to_array);
        let bits = numbers.fold(0u64, |sum, x| sum.rotate_left(5).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ x.to_bits());
        let steps = drape.state.map(|state| state.steps);
        format!("bits: {garment} in {fabric}, {steps:?} steps: {bits:016x}\n")
    };
    all.into_iter().map(of).collect()
}

#[test]
fn drapes_have_the_same_bits_without_avx2_and_fma() {
    let lines = drapes();
    print!("{lines}");
    if std::env::var_os(PORTABLE).is_some() {
        return;
    }
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "drapes_have_the_same_bits_without_avx2_and_fma", "--nocapture"])
        .env(PORTABLE, "1")
        .env(PLAIN.0, PLAIN.1)
        .output()
        .unwrap();
    let stdout = String::from_utf8(child.stdout).unwrap();
    assert!(child.status.success(), "{stdout}");
    let portable: String =
        stdout.lines().filter(|line| line.contains("bits: ")).map(|line| format!("{line}\n")).collect();
    let from = portable.find("bits: ").unwrap();
    assert_eq!(portable[from..], lines);
}

/// The C library chooses its functions by the processor, and so does a library of dense kernels: `base::math` and `newton::dense` have their
/// own.
#[test]
fn nothing_that_a_drape_computes_depends_on_functions_of_the_platform() {
    let functions = "sin cos tan sin_cos asin acos atan atan2 sinh cosh tanh exp exp2 exp_m1 ln ln_1p log2 log10 powf cbrt hypot to_angle angle_to \
                     angle_between mul_add";
    let calls: Vec<String> = functions.split_whitespace().map(|function| format!(".{function}(")).collect();
    let others = ["DVec2::from_angle(", "::from_rotation_", "::from_axis_angle(", "faer::linalg", "matmul"];
    let mut found = Vec::new();
    let rooms = ["mesh", "body", "garment", "scene", "parts", "mechanics", "drape", "session"];
    for room in rooms {
        let mut folders = vec![std::path::PathBuf::from(format!("{}/src/{room}", env!("CARGO_MANIFEST_DIR")))];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let text = std::fs::read_to_string(&path).unwrap();
                let of_tests = path.components().any(|part| part.as_os_str() == "tests");
                let code = text.split("#[cfg(test)]\nmod tests").next().filter(|_| !of_tests).unwrap_or_default();
                let names = |line: &&str| {
                    !line.trim_start().starts_with("//")
                        && (calls.iter().any(|call| line.contains(call)) || others.iter().any(|other| line.contains(other)))
                        // Its axis-angle form is for opposite vectors alone.
                        && !line.contains("from_rotation_arc")
                        && !line.contains("math::")
                };
                found.extend(code.lines().filter(names).map(|line| format!("{}: {}", path.display(), line.trim())));
            }
        }
    }
    assert!(found.is_empty(), "call base::math instead: {found:#?}");
}
