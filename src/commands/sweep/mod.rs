//! `partwise sweep`: every point of a sweep file, a row on disk after each, and a recording of them all.

pub(crate) mod chosen;
pub(crate) mod points;
pub(crate) mod recording;
pub(crate) mod report;
mod single;
pub(crate) mod store;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::Job;
use crate::record::{RecordSummary, Tab};
use crate::study::job::Against;
use crate::study::sweep::{Existing, Outcome, Plan, Point, Row, Run, Shard, Status, SweepProgress, sweep};
use clap::Args;

use self::points::KeepingBench;
use self::report::{Format, Report};
use self::store::PointStore;
use super::failure::UserError;
use super::runtime::{MOST_THREADS, cache, use_threads};
use super::sinks::SinkArgs;
use super::{console, interrupt};

pub(super) const LONG_ABOUT: &str = "\
Runs every point of a sweep file: range tables, and any other setting, over garments, sizes and fabrics.

A row is on disk after every point (rows.jsonl; rows.csv is made of it at the end), so that Ctrl-C, a crash or a full disk lose at \
most the point in hand; --resume goes on from there. A point that fails is a row with its error, and the sweep goes on. At the end \
one recording per garment shows each table as a step, the few best side by side, and speed against error.";

const EXAMPLES: &str = "\
Examples:
  partwise sweep assets/sweeps/table-3-variations.toml                the paper's table and its variations
  partwise sweep mine.toml --resume                                   go on after Ctrl-C, a crash, a full disk
  partwise sweep mine.toml --shard 2/8 --out part-2                   one share of eight, for a job array
  parallel partwise sweep mine.toml --shard {}/3 --out part-{} ::: 1 2 3 && partwise merge part-* --out whole

A sweep file:
  name = \"extents of a skirt\"
  [base]
  garment = \"flared-skirt@3920\"
  [grid]
  tables = [\"table-3\", { quantile = [10, 20] }, { scale = [0.5, 2] }, \"mine.toml\"]
  extents_cm = [12, 8, 5]";

/// Arguments of `sweep`.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SweepArgs {
    /// The sweep file, TOML
    file: PathBuf,
    /// Folder of the rows [default: recordings/sweeps/FILE, and /shard-I-of-N in it]
    #[arg(long, value_name = "DIR", help_heading = "Rows")]
    out: Option<PathBuf>,
    /// Go on: skip what has a row, try again what failed
    #[arg(long, help_heading = "Rows")]
    resume: bool,
    /// With the sweep file changed since: keep the rows of points it still has
    #[arg(long, requires = "resume", help_heading = "Rows")]
    adopt: bool,
    /// Run one share of the points, e.g. 2/8; `partwise merge` joins them
    #[arg(long, value_name = "I/N", help_heading = "Rows")]
    shard: Option<Shard>,
    /// Points at a time; more than one makes the timings of all of them worse
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Rows")]
    jobs: usize,
    /// What points that do not say it are measured against: `none`, `canonical` (the drape of garment, body and
    /// fabric), or `own` continuation too, a converged drape for every point, seconds each
    #[arg(long, value_name = "none|canonical|own", default_value_t = Against::Own, help_heading = "Rows")]
    accuracy: Against,
    /// Where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Rows")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    sinks: SinkArgs,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

impl SweepArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        if !(1..=MOST_THREADS).contains(&self.jobs) {
            let found = self.jobs;
            return Err(UserError::new(format!(
                "--jobs {found}: found {found}, expected 1 to {MOST_THREADS} points at a time"
            )));
        }
        interrupt::keep();
        self.sinks.check_outputs(&[])?;
        let plan = self.plan()?;
        let folder = self.folder();
        let store = PointStore::in_folder(&folder);
        // Before hours of points, not after them.
        let scenes: BTreeSet<String> = plan.points.iter().map(Point::scene_id).collect();
        one_recording(scenes.len(), &folder, &self.sinks)?;
        let bench = KeepingBench::new(&store, cache(self.cache.as_ref()));
        let existing = match self.resume {
            true => Existing::Resume { retry_failed: true, adopt: self.adopt },
            false => Existing::Refuse,
        };
        let started = Instant::now();
        let bar = console::progress(Some(0), &plan.name);
        let progress = |p: SweepProgress<'_>| {
            bar.set_length(p.total as u64);
            bar.set_position(p.done as u64);
            if p.row.is_none() {
                // The rows found there took no time: what is left is guessed from the others.
                bar.reset_eta();
            }
            if p.failed > 0 {
                bar.set_message(format!("{} ({} failed)", plan.name, p.failed));
            }
        };
        let run = Run { jobs: self.jobs, stop: interrupt::flag(), progress: &progress };
        let row = |point: &Point| bench.row(point, (plan.warm_up, plan.repeats));
        let outcome = sweep(&plan, self.shard, &folder, existing, &run, &row);
        bar.finish_and_clear();
        if let Some(error) = bench.take_broken() {
            let advice = "the rows before are intact: make room and go on with --resume";
            return Err(UserError::new(format!("{}: cannot keep a point: {error}; {advice}", folder.display())));
        }
        let outcome = outcome?;
        self.mend(&plan, &outcome.rows, &store, &bench);
        let seconds = started.elapsed().as_secs_f64();
        console::warnings(&bench.bench.warnings());
        let recordings = record_all(&outcome.rows, &store, &plan.name, &folder, &self.sinks, Tab::Stages)?;
        let report = Report {
            name: &plan.name,
            folder: &folder,
            outcome: &outcome,
            seconds,
            keeping_ms: bench.keeping_ms(),
            recordings: &recordings,
        };
        console::result(&report.text(self.format)?);
        if outcome.failed > 0 && !interrupt::requested() {
            let (Outcome { failed, total, .. }, folder) = (outcome, folder.display());
            anyhow::bail!(
                "{failed} of {total} points failed: the column `error` of {folder}/rows.csv says why; --resume tries them again"
            );
        }
        Ok(())
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        let plan = Plan::read(&self.file, &Job { accuracy: self.accuracy, ..Job::preview() })?;
        console::notes(&plan.notes);
        Ok(plan)
    }

    fn folder(&self) -> PathBuf {
        let stem = self.file.file_stem().map_or_else(|| "sweep".into(), std::ffi::OsStr::to_string_lossy);
        let whole = || Path::new("recordings").join("sweeps").join(stem.as_ref());
        let share = |shard: Shard| whole().join(format!("shard-{}", shard.to_string().replace('/', "-of-")));
        self.out.clone().unwrap_or_else(|| self.shard.map_or_else(whole, share))
    }

    /// Computes again what is kept of points whose file is gone or damaged.
    fn mend(&self, plan: &Plan, rows: &[Row], store: &PointStore, bench: &KeepingBench<'_>) {
        for row in rows.iter().filter(|row| row.status == Status::Ok) {
            if interrupt::requested() {
                return;
            }
            if store.point(&row.point).is_some_and(|point| store.scene(&point.scene).is_some()) {
                continue;
            }
            let again = bench.row(&plan.points[row.index], (0, 1));
            if again.is_none_or(|again| again.status == Status::Error) {
                console::warning(&format!("point {} is missing from the recording", row.index));
            }
        }
    }
}

/// Refuses a sink that takes one recording where there are several.
fn one_recording(recordings: usize, folder: &Path, sinks: &SinkArgs) -> anyhow::Result<()> {
    if recordings > 1 && (sinks.save.is_some() || sinks.serve) {
        return Err(UserError::new(format!(
            "--save and --serve take one recording, and this sweep makes {recordings}, one a garment; leave them out, and look at \
             one of {}/*.rrd with `partwise view`",
            folder.display()
        )));
    }
    Ok(())
}

/// Makes the recordings of a sweep, in its folder unless a file was given.
pub(crate) fn record_all(
    rows: &[Row],
    store: &PointStore,
    name: &str,
    folder: &Path,
    sinks: &SinkArgs,
    opens_on: Tab,
) -> anyhow::Result<Vec<RecordSummary>> {
    let (groups, missing) = recording::groups(rows, store);
    if missing > 0 {
        console::warning(&format!(
            "{missing} points have a row but no drape on disk and are missing from the recording"
        ));
    }
    one_recording(groups.len(), folder, sinks)?;
    let mut done = Vec::new();
    for group in &groups {
        let sinks = sinks.sinks_in(folder, &group.name);
        if !sinks.is_empty() {
            done.push(recording::record(group, store, name, sinks, opens_on)?);
        }
    }
    Ok(done)
}
