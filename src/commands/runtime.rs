//! Shared by the commands: exit codes, Ctrl-C, threads, output files, progress of the solver.

use std::collections::VecDeque;
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
    let (began, mut decay) = (Instant::now(), Decay::default());
    let out = work(&mut |step| {
        let (number, residual) = (step.iteration, step.residual_over_weight);
        // Steps on a coarser mesh have no number.
        let on = if number == 0 { "coarser mesh".to_owned() } else { format!("step {number}") };
        let left = decay.seconds_left(began.elapsed().as_secs_f64(), residual, rests_below).filter(|_| number > 0);
        let left = left.map_or_else(String::new, |seconds| format!(", about {seconds:.0} s left"));
        bar.set_message(format!("{title}: {on}, residual {residual:.1e}, rests below {rests_below:.0e}{left}"));
        control_flow()
    });
    bar.finish_and_clear();
    out
}

/// The decay of a residual over the last steps, by which the remaining time is estimated.
#[derive(Debug, Default)]
struct Decay {
    /// Seconds and the logarithm of the residual.
    steps: VecDeque<(f64, f64)>,
}

impl Decay {
    /// Steps that count. A heuristic: fewer follow single steps, more follow an earlier phase of the solver.
    const STEPS: usize = 12;
    /// Steps before the first estimate.
    const LEAST: usize = 4;
    /// Longest estimate, s; a slower decay says nothing.
    const LONGEST: f64 = 1800.0;

    /// Adds a step, and returns the seconds until the residual falls below `target` if its logarithm keeps falling at the rate of the last steps.
    fn seconds_left(&mut self, seconds: f64, residual: f64, target: f64) -> Option<f64> {
        if residual.is_nan() || residual <= 0.0 {
            return None;
        }
        self.steps.push_back((seconds, residual.ln()));
        if self.steps.len() > Self::STEPS {
            self.steps.pop_front();
        }
        if self.steps.len() < Self::LEAST {
            return None;
        }
        let count = self.steps.len() as f64;
        let (t, r) = self.steps.iter().fold((0.0, 0.0), |(t, r), step| (t + step.0 / count, r + step.1 / count));
        let (covariance, variance) = self.steps.iter().fold((0.0, 0.0), |(covariance, variance), step| {
            (covariance + (step.0 - t) * (step.1 - r), variance + (step.0 - t).powi(2))
        });
        let slope = covariance / variance;
        let left = (r + slope * (seconds - t) - target.ln()) / -slope;
        (slope < 0.0 && (0.5..Self::LONGEST).contains(&left)).then_some(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_the_decay_of_the_residual() {
        let mut decay = Decay::default();
        // A tenth every two seconds, from 1: a thousandth is reached at six.
        let estimates: Vec<Option<f64>> =
            (0..8).map(|i| f64::from(i) * 0.5).map(|t| decay.seconds_left(t, 10f64.powf(-0.5 * t), 1e-3)).collect();
        assert!(estimates[..3].iter().all(Option::is_none), "{estimates:?}");
        assert!(
            estimates[3..].iter().enumerate().all(|(i, left)| (left.unwrap() - (4.5 - 0.5 * i as f64)).abs() < 1e-9)
        );
        // A residual that grows has no estimate.
        let mut grows = Decay::default();
        assert!((0..9).all(|i| grows.seconds_left(f64::from(i), f64::from(i + 1), 1e-3).is_none()));
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
