//! Shared by the commands: exit codes, Ctrl-C, threads, output files, progress of the solver.

use std::error::Error;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::base::atomic_file::{self, AtomicFile};
use crate::base::files::read_text;
use crate::drape::DrapeError;
use crate::live::LiveError;
use crate::mechanics::refine::Observer;
use crate::mechanics::solver_options::NewtonOptions;
use crate::record::RecordError;
use crate::study::accuracy::ReferenceCache;
use crate::study::drape_test::DrapeTestError;
use crate::study::evaluate::EvaluateError;

use super::console;

/// A mistake in the user's input that no library error describes.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UserError(pub(crate) String);

/// A drape that `--strict` does not accept.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadVerdict(pub(crate) String);

/// Returns a [`UserError`] with a formatted message from the enclosing function.
macro_rules! refuse {
    ($($message:tt)*) => {
        return Err($crate::commands::runtime::UserError(format!($($message)*)).into())
    };
}
pub(crate) use refuse;

/// The exit code of an error: 2 where the user can remedy it, by another input or more disk space, 3 for a drape that `--strict` does
/// not accept, and 1 otherwise.
pub(crate) fn exit_code(error: &anyhow::Error) -> ExitCode {
    if error.is::<BadVerdict>() {
        return ExitCode::from(3);
    }
    if error.chain().any(is_users) { ExitCode::from(2) } else { ExitCode::FAILURE }
}

fn is_users(cause: &(dyn Error + 'static)) -> bool {
    cause.downcast_ref().is_some_and(RecordError::is_users)
        // A garment without a free vertex is the user's; a failure of the solver is not.
        || cause.downcast_ref().is_some_and(|error| !matches!(error, DrapeError::Solve(_)))
        || cause.downcast_ref().is_some_and(|error| !matches!(error, LiveError::Server(_)))
        || matches!(cause.downcast_ref(), Some(EvaluateError::Fallen | EvaluateError::Layers { .. }))
        || cause.is::<UserError>()
        || cause.is::<crate::base::files::Unreadable>()
        || cause.is::<crate::body::ShapeError>()
        || cause.is::<crate::garment::fabric::FabricError>()
        || cause.is::<crate::garment::lab_sheet::LabSheetError>()
        || cause.is::<crate::garment::pattern::PatternError>()
        || cause.is::<crate::mechanics::energy::EnergyError>()
        || cause.is::<crate::mechanics::paper::PaperError>()
        || cause.is::<crate::mesh::MeshError>()
        || cause.is::<crate::parts::range_table::TableError>()
        || cause.is::<crate::scene::SceneError>()
        || cause.is::<crate::session::EditError>()
        || matches!(cause.downcast_ref(), Some(DrapeTestError::Radii { .. } | DrapeTestError::TooCoarse { .. }))
        || cause.is::<crate::study::sweep::MergeError>()
        || cause.is::<crate::study::sweep::PlanError>()
        || cause.is::<crate::study::sweep::StoreError>()
}

/// Signals within this time count as one: `timeout` and similar programs signal the process and then its group.
const SAME_INTERRUPT: Duration = Duration::from_millis(300);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static HAS_RESULTS: AtomicBool = AtomicBool::new(false);
static FIRST_INTERRUPT: OnceLock<Instant> = OnceLock::new();

/// Handles Ctrl-C from now on. Before [`keep_results`] is called, and at the second interrupt, the program exits at once and removes
/// its incomplete files. Where no handler can be installed, the default action remains.
pub(crate) fn handle_interrupts() {
    let _ = ctrlc::set_handler(|| {
        let since = FIRST_INTERRUPT.get_or_init(Instant::now).elapsed();
        let again = INTERRUPTED.swap(true, Ordering::SeqCst);
        if !HAS_RESULTS.load(Ordering::SeqCst) || (again && since > SAME_INTERRUPT) {
            atomic_file::abandon_all();
            std::process::exit(130);
        }
        if !again {
            console::note("interrupted: the results so far are kept; press Ctrl-C again to quit at once");
        }
    });
}

/// Makes a write beyond `ulimit -f` an error, as on a full disk. By default its signal ends the program and leaves incomplete files.
pub(crate) fn ignore_file_size_signal() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        /// The number of the signal on Linux (except MIPS), macOS and the BSDs.
        const SIGXFSZ: i32 = 25;
        // Tokio's handler remains installed after its listener is dropped.
        if let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() {
            let _ = runtime.block_on(async { signal(SignalKind::from_raw(SIGXFSZ)) });
        }
    }
}

/// Address space that the program and its threads take without a garment, and for each vertex of one, bytes. Drapes of 400 to 60,000
/// vertices reached 0.43 to 1.4 GB.
const BASE_MEMORY: u64 = 448 << 20;
const MEMORY_PER_VERTEX: u64 = 16 << 10;

/// Refuses a limit of the address space (`ulimit -v`) under which a garment of this many vertices cannot be draped. An allocation that
/// fails ends a Rust program by a signal, which no code can turn into an error.
pub(crate) fn check_memory(vertices: usize) -> anyhow::Result<()> {
    // Only Linux has this file.
    let limits = read_text("/proc/self/limits".as_ref()).unwrap_or_default();
    check_address_space(address_space(&limits), vertices)
}

/// The soft limit of the address space in a file such as `/proc/self/limits`, bytes; `None` if there is no limit.
fn address_space(limits: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse().ok()
}

fn check_address_space(limit: Option<u64>, vertices: usize) -> anyhow::Result<()> {
    let needed = BASE_MEMORY + MEMORY_PER_VERTEX * vertices as u64;
    if let Some(limit) = limit.filter(|limit| *limit < needed) {
        let garment = if vertices == 0 { String::new() } else { format!(" for a garment of {vertices} vertices") };
        refuse!(
            "found a limit of {} MB for the memory of the program (ulimit -v), expected at least {} MB{garment}; raise it, or take \
             fewer vertices",
            limit >> 20,
            needed >> 20
        );
    }
    Ok(())
}

/// From now on, the first Ctrl-C sets [`interrupted`] instead of ending the program.
pub(crate) fn keep_results() {
    HAS_RESULTS.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// [`interrupted`] for iterative work.
pub(crate) fn control_flow() -> ControlFlow<()> {
    if interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// [`interrupted`] for worker threads.
pub(crate) fn interrupt_flag() -> &'static AtomicBool {
    &INTERRUPTED
}

/// Blocks until Ctrl-C.
pub(crate) fn wait_for_interrupt() {
    while !interrupted() {
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// The cache of reference drapes: `folder`, or else the user's cache folder.
pub(crate) fn reference_cache(folder: Option<&PathBuf>) -> Option<ReferenceCache> {
    folder.cloned().map(ReferenceCache::new).or_else(ReferenceCache::in_user_cache)
}

/// Bound on the number of threads; a heuristic, above the core count of any machine and below the limits of operating systems.
pub(crate) const MAX_THREADS: usize = 1024;

/// Sets the size of the thread pool.
pub(crate) fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    match threads {
        None => Ok(()),
        Some(0) => refuse!("--threads 0: found 0, expected at least 1; leave it out for one per core"),
        Some(n) if n > MAX_THREADS => {
            refuse!("--threads {n}: found {n}, expected 1 to {MAX_THREADS}; leave it out for one per core")
        }
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}

/// Refuses an output that cannot be written or is an input, before anything is computed.
pub(crate) fn check(path: &Path, flag: &str) -> anyhow::Result<()> {
    AtomicFile::check(path).map_err(unwritable(path, flag))
}

/// Writes the output of `flag`.
pub(crate) fn write(path: &Path, text: impl AsRef<[u8]>, flag: &str) -> anyhow::Result<()> {
    AtomicFile::write(path, text).map_err(unwritable(path, flag))
}

/// The error of an output that cannot be written; `flag` selects another place.
pub(crate) fn unwritable<'a>(path: &'a Path, flag: &'a str) -> impl FnOnce(io::Error) -> anyhow::Error + 'a {
    move |e| UserError(format!("{}: cannot be written: {e}; choose another place with {flag}", path.display())).into()
}

/// Creates a folder for outputs.
pub(crate) fn create_folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).map_err(|e| UserError(format!("{}: cannot be created: {e}", path.display())).into())
}

/// Runs `work` with a progress display of the solver's steps; Ctrl-C interrupts it.
pub(crate) fn with_progress<T>(title: &str, work: impl FnOnce(Observer<'_>) -> T) -> T {
    keep_results();
    let bar = console::progress(None, title);
    let rests_below = NewtonOptions::default().tolerance;
    let (began, mut pace) = (Instant::now(), Pace::default());
    let out = work(&mut |step| {
        let (number, residual) = (step.iteration, step.residual_over_weight);
        // Steps on a coarser mesh have no number.
        let on = if number == 0 { "coarser mesh".to_owned() } else { format!("step {number}") };
        let left = pace.seconds_left(number, began.elapsed().as_secs_f64(), residual / rests_below);
        let left = left.map_or_else(String::new, |[low, high]| format!(", {low:.0} to {high:.0} s left"));
        bar.set_message(format!("{title}: {on}, residual {residual:.1e} (rest: {rests_below:.0e}){left}"));
        control_flow()
    });
    bar.finish_and_clear();
    out
}

/// The pace of a solve, by which the time left is estimated: the geometric mean of the time so far and of the time in which the residual
/// reaches its tolerance if its logarithm falls on along a line through all steps at full resolution.
///
/// Limits: residuals rise and fall by a factor of ten from step to step. Over 202 steps of ten drapes (26 November 2026) the time left
/// was within a factor of three of that mean at 77 % of the steps, so that the estimate is that interval. A line through the last twelve
/// steps gave an estimate at 54 % of the steps, of which 62 % were within that factor.
#[derive(Debug, Default)]
struct Pace {
    /// Seconds at the start of this solve.
    began: f64,
    /// Number of the last step.
    last: usize,
    /// Count and sums over the steps: of the time t in s, of r = ln(residual / tolerance), of t² and of t r.
    sums: [f64; 5],
}

impl Pace {
    /// Steps before the first estimate.
    const LEAST: f64 = 4.0;
    /// Ends of the estimate over its middle. Wider ends are more often right and say less.
    const SPREAD: f64 = 3.0;
    /// Shortest and longest extrapolation that counts, s.
    const COUNTS: std::ops::Range<f64> = 0.5..1800.0;

    /// Adds a step and its residual over the tolerance; returns an interval for the seconds left, of one significant digit each.
    fn seconds_left(&mut self, number: usize, seconds: f64, residual: f64) -> Option<[f64; 2]> {
        if number < self.last {
            // Another solve, as of a reference.
            *self = Self { began: seconds, ..Self::default() };
        }
        self.last = number;
        if number == 0 || residual.is_nan() || residual <= 1.0 {
            return None;
        }
        let (t, r) = (seconds - self.began, residual.ln());
        for (sum, value) in self.sums.iter_mut().zip([1.0, t, r, t * t, t * r]) {
            *sum += value;
        }
        let [count, sum_t, sum_r, sum_tt, sum_tr] = self.sums;
        if count < Self::LEAST {
            return None;
        }
        let slope = (count * sum_tr - sum_t * sum_r) / (count * sum_tt - sum_t * sum_t);
        let line = (sum_r + slope * (count * t - sum_t)) / (-slope * count);
        let middle = if slope < 0.0 && Self::COUNTS.contains(&line) { (line * t).sqrt() } else { t };
        Some([middle / Self::SPREAD, middle * Self::SPREAD].map(|end| one_digit(end).max(1.0)))
    }
}

/// A positive number, rounded to one significant digit.
fn one_digit(value: f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor());
    (value / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_between_the_decay_of_the_residual_and_the_time_so_far() {
        let mut pace = Pace::default();
        // A tenth every ten seconds, from a thousand: rest is reached at 30 s.
        let mut at = |number: usize, t: f64| pace.seconds_left(number, t, 10f64.powf(3.0 - 0.1 * t));
        assert!((1..4).all(|number| at(number, number as f64).is_none()), "three steps tell nothing");
        // The middle is the root of 24 times 6, and of 10 times 20.
        assert_eq!(at(4, 6.0), Some([4.0, 40.0]));
        assert_eq!(at(5, 20.0), Some([5.0, 40.0]));
        assert_eq!(at(6, 30.5), None, "the residual is below its tolerance");
        assert_eq!(at(0, 31.0), None, "the coarser mesh of another solve");
        assert!((1..4).all(|number| at(number, 31.5).is_none()), "which begins anew");
        // A residual that grows: as long again as so far.
        let mut grows = Pace::default();
        let last = (1..9).map(|i| grows.seconds_left(i, i as f64, 2.0 * i as f64)).last().flatten();
        assert_eq!(last, Some([3.0, 20.0]));
    }

    #[test]
    fn a_limit_of_memory_that_a_garment_exceeds_is_refused() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max file locks            unlimited            unlimited            locks     \n";
        assert_eq!(address_space(limits), None);
        assert_eq!(address_space(&format!("{limits}Max address space         unlimited   unlimited   bytes\n")), None);
        let limit = address_space(&format!("{limits}Max address space         614400000   unlimited   bytes\n"));
        assert_eq!(limit, Some(614_400_000));
        check_address_space(limit, 4_000).unwrap();
        let error = check_address_space(limit, 60_000).unwrap_err().to_string();
        assert!(error.contains("585 MB") && error.contains("1385 MB") && error.contains("ulimit -v"), "{error}");
    }
}
