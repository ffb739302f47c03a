//! Mutated input through every reader of the library: each input is accepted, or refused with a clear message, in bounded time.
//!
//! `PARTWISE_FUZZ_CASES` sets the number of inputs for each reader (the default takes a few seconds), `PARTWISE_FUZZ_SEED` (0 to 255)
//! the random seed. A failing input is shrunk and stored in `tests/fuzz/corpus/`. Later runs try these files first and mutate them.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking, and prints counts"
)]

mod meshes;
mod mutate;
mod readers;

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};

use readers::Outcome;

/// Time limit for one input; far above the usual milliseconds, so that a busy machine does not exceed it.
const TIME_LIMIT: Duration = Duration::from_secs(20);

/// Number of kinds of changes to texts, and to binary files, whose bytes are the characters.
const OF_TEXT: u8 = 16;
const OF_BYTES: u8 = 24;

/// A seed and up to three changes.
fn mutated(kinds: u8) -> impl Strategy<Value = (u32, Vec<mutate::Mutation>)> {
    (any::<u32>(), prop::collection::vec((0..kinds, any::<u32>(), any::<u32>()), 0..4))
}

/// Reads an input and returns its outcome, or the description of a fault in the reader.
type Reader = dyn Fn(&str) -> Result<Outcome, String> + Send + Sync;

/// Runs one input and checks time, panics and the message.
fn judge(reader: &Reader, text: &str) -> Result<Outcome, String> {
    let began = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| reader(text))).map_err(|_| "it panicked".to_owned())??;
    if began.elapsed() > TIME_LIMIT {
        return Err(format!("it took {:?}", began.elapsed()));
    }
    if let Outcome::Refused(message) = &outcome {
        if message.chars().any(|c| c.is_control() && c != '\n' && c != '\t') {
            return Err(format!("control characters in the message: {message:?}"));
        }
        if message.len() > 5_000 {
            return Err(format!("a message of {} bytes", message.len()));
        }
        if !readers::INFORMATIVE.iter().any(|word| message.contains(word)) {
            return Err(format!("a message without found, expected or remedy: {message:?}"));
        }
    }
    Ok(outcome)
}

/// [`fuzz`] for binary files. Seeds and corpus have a character for each byte.
fn fuzz_bytes(
    class: &'static str,
    share: f64,
    seeds: &[Vec<u8>],
    reader: impl Fn(&[u8]) -> Result<Outcome, String> + Send + Sync + 'static,
) {
    let text = |bytes: &Vec<u8>| bytes.iter().copied().map(char::from).collect();
    let bytes = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    fuzz_kinds(class, share, (seeds.iter().map(text).collect(), OF_BYTES), move |text| reader(&bytes(text)));
}

/// Runs `reader` on the seeds, on the stored corpus, and on mutations of both; `share` scales the number of mutations.
fn fuzz(
    class: &'static str,
    share: f64,
    seeds: Vec<String>,
    reader: impl Fn(&str) -> Result<Outcome, String> + Send + Sync + 'static,
) {
    fuzz_kinds(class, share, (seeds, OF_TEXT), reader);
}

fn fuzz_kinds(
    class: &'static str,
    share: f64,
    (seeds, kinds): (Vec<String>, u8),
    reader: impl Fn(&str) -> Result<Outcome, String> + Send + Sync + 'static,
) {
    let cases = std::env::var("PARTWISE_FUZZ_CASES").ok().map_or(300, |text| text.parse::<u32>().unwrap());
    let cases = ((f64::from(cases) * share) as u32).max(20);
    let corpus = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(class);
    let mut found: Vec<PathBuf> =
        fs::read_dir(&corpus).map_or_else(|_| Vec::new(), |f| f.map(|e| e.unwrap().path()).collect());
    found.sort();
    let mut seeds = seeds;
    seeds.extend(found.iter().map(|path| fs::read_to_string(path).unwrap()));
    for seed in &seeds {
        if let Err(wrong) = judge(&reader, seed) {
            panic!("{class}: {wrong}, of a seed:\n{seed}");
        }
    }
    // The current input, so that an endless loop can be reported with it.
    let current = Arc::new(Mutex::new((Instant::now(), String::new())));
    let (reading, of_thread) = (current.clone(), seeds.clone());
    let worker = std::thread::spawn(move || {
        let (seeds, mut counts) = (of_thread, BTreeMap::<&str, usize>::new());
        let input = |(seed, changes): &(u32, Vec<mutate::Mutation>)| {
            let start = seeds[*seed as usize % seeds.len()].clone();
            changes.iter().fold(start, |text, &change| mutate::mutate(&text, &seeds, change))
        };
        let config = Config { cases, failure_persistence: None, max_shrink_iters: 2_000, ..Config::default() };
        let mut seed = [7; 32];
        seed[..class.len()].copy_from_slice(class.as_bytes());
        seed[31] = std::env::var("PARTWISE_FUZZ_SEED").map_or(7, |text| text.parse().unwrap());
        let mut runner = TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &seed));
        let counted = Mutex::new(&mut counts);
        let outcome = runner.run(&mutated(kinds), |case| {
            let text = input(&case);
            *reading.lock().unwrap() = (Instant::now(), text.clone());
            let outcome = judge(&reader, &text).map_err(TestCaseError::fail)?;
            *counted.lock().unwrap().entry(outcome.name()).or_default() += 1;
            Ok(())
        });
        (
            outcome.map_err(|error| match error {
                TestError::Fail(reason, case) => (reason.to_string(), input(&case)),
                TestError::Abort(reason) => (reason.to_string(), String::new()),
            }),
            counts,
        )
    });
    while !worker.is_finished() {
        std::thread::sleep(Duration::from_millis(20));
        let (since, text) = current.lock().unwrap().clone();
        assert!(
            since.elapsed() < 3 * TIME_LIMIT || text.is_empty(),
            "{class}: still at work after {:?} on:\n{text}",
            since.elapsed()
        );
    }
    let (outcome, counts) = worker.join().unwrap();
    eprintln!("{class}: {counts:?}");
    if let Err((reason, text)) = outcome {
        let name = blake3::hash(text.as_bytes()).to_hex();
        fs::create_dir_all(&corpus).unwrap();
        fs::write(corpus.join(&name[..12]), &text).unwrap();
        panic!("{class}: {reason}, kept as tests/fuzz/corpus/{class}/{}:\n{text}", &name[..12]);
    }
}
