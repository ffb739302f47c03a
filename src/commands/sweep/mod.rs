//! `partwise sweep`: computes every point of a sweep file, writes a row after each, and records all. `partwise merge`: joins the shards
//! of a sweep.

pub(crate) mod recording;
pub(crate) mod report;
pub(crate) mod store;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::Job;
use crate::picture::Quantity;
use crate::record::{RecordSummary, Tab};
use crate::study::job::Against;
use crate::study::sweep::{self, Existing, Outcome, Plan, Point, Row, Run, Shard, Status, SweepProgress};
use clap::Args;

use self::report::Report;
use self::store::{PointStore, StoringBench};
use super::console::{self, RowFormat};
use super::pictures::PictureArgs;
use super::runtime::{
    MAX_THREADS, interrupt_flag, interrupted, keep_results, reference_cache, refuse, unwritable, use_threads,
};
use super::sinks::SinkArgs;

/// Arguments of `sweep`.
#[derive(Debug, Clone, Args)]
#[command(after_help = include_str!("../../../assets/help/sweep.txt"))]
pub(crate) struct SweepArgs {
    /// Sweep file, TOML
    file: PathBuf,
    /// Folder of the rows [default: recordings/sweeps/FILE, for shards /shard-I-of-N in it]
    #[arg(long, value_name = "DIR", help_heading = "Rows")]
    out: Option<PathBuf>,
    /// Continue: skip points that have a row, and repeat those that failed
    #[arg(long, help_heading = "Rows")]
    resume: bool,
    /// With a sweep file changed since: keep the rows of points that it still contains
    #[arg(long, requires = "resume", help_heading = "Rows")]
    adopt: bool,
    /// Run one shard of the points, e.g. 2/8; `partwise merge` joins the shards
    #[arg(long, value_name = "I/N", help_heading = "Rows")]
    shard: Option<Shard>,
    /// Points computed in parallel; more than one distorts the measured times
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Rows")]
    jobs: usize,
    /// Reference of points that specify none: `none`, `canonical` (the canonical drape of garment, body and fabric), or `own` (also the
    /// point's own continuation to convergence, seconds per point)
    #[arg(long, value_name = "none|canonical|own", default_value_t = Against::Own, help_heading = "Rows")]
    accuracy: Against,
    /// Folder of the reference drapes [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Rows")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    sinks: SinkArgs,
    #[command(flatten)]
    picture: PictureArgs,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// Colours that points have no values for.
pub(crate) const NOT_STORED: [(Quantity, &str); 1] = [(Quantity::Folds, "points without excess length")];

impl SweepArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        if !(1..=MAX_THREADS).contains(&self.jobs) {
            let found = self.jobs;
            refuse!("--jobs {found}: found {found}, expected 1 to {MAX_THREADS} points in parallel");
        }
        keep_results();
        self.picture.check_before(false, &NOT_STORED)?;
        self.sinks.check_outputs(&[self.picture.output()])?;
        let plan = self.plan()?;
        let folder = self.folder();
        let store = PointStore::in_folder(&folder);
        // Checked before the points are computed, which may take hours.
        let scenes: BTreeSet<String> = plan.points.iter().map(Point::scene_id).collect();
        check_single_recording(scenes.len(), &folder, &self.sinks)?;
        let bench = StoringBench::new(&store, reference_cache(self.cache.as_ref()));
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
                // Rows of an earlier run took no time and would distort the estimate.
                bar.reset_eta();
            }
            if p.failed > 0 {
                bar.set_message(format!("{} ({} failed)", plan.name, p.failed));
            }
        };
        let run = Run { jobs: self.jobs, stop: interrupt_flag(), progress: &progress };
        let row = |point: &Point| bench.row(point, (plan.warm_up, plan.repeats));
        let outcome = sweep::sweep(&plan, self.shard, &folder, existing, &run, &row);
        bar.finish_and_clear();
        if let Some(error) = bench.take_error() {
            let remedy = "the earlier rows are intact: free disk space and continue with --resume";
            refuse!("{}: cannot store a point: {error}; {remedy}", folder.display());
        }
        let outcome = outcome?;
        self.restore(&plan, &outcome.rows, &store, &bench);
        let seconds = started.elapsed().as_secs_f64();
        let recordings = record_all(&outcome.rows, &store, &plan.name, &folder, &self.sinks, Tab::Stages)?;
        console::notes(self.picture.draw_sweep(&plan.name, &outcome.rows, &store)?.as_slice());
        let report = Report {
            name: &plan.name,
            folder: &folder,
            outcome: &outcome,
            seconds,
            storing_ms: bench.storing_ms(),
            recordings: &recordings,
        };
        report.print(self.format)?;
        console::warnings(&bench.bench.warnings());
        if outcome.failed > 0 && !interrupted() {
            let (Outcome { failed, total, .. }, folder) = (outcome, folder.display());
            anyhow::bail!(
                "{failed} of {total} points failed: the column `error` of {folder}/rows.csv contains the reasons; --resume repeats them"
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
        let of_shard = |shard: Shard| whole().join(format!("shard-{}", shard.to_string().replace('/', "-of-")));
        self.out.clone().unwrap_or_else(|| self.shard.map_or_else(whole, of_shard))
    }

    /// Computes points again whose stored file is missing or damaged.
    fn restore(&self, plan: &Plan, rows: &[Row], store: &PointStore, bench: &StoringBench<'_>) {
        for row in rows.iter().filter(|row| row.status == Status::Ok) {
            if interrupted() {
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

/// Refuses sinks for a single recording if there are several.
fn check_single_recording(recordings: usize, folder: &Path, sinks: &SinkArgs) -> anyhow::Result<()> {
    if recordings > 1 && (sinks.save.is_some() || sinks.serve) {
        refuse!(
            "--save and --serve accept one recording, but this sweep has {recordings}, one per garment; omit them, and open one \
             of {}/*.rrd with `partwise view`",
            folder.display()
        );
    }
    Ok(())
}

/// Writes the recordings of a sweep, to its folder unless a file was given.
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
            "{missing} points have a row but no stored drape and are missing from the recording"
        ));
    }
    check_single_recording(groups.len(), folder, sinks)?;
    let mut done = Vec::new();
    for group in &groups {
        let sinks = sinks.sinks_in(folder, &group.name);
        if !sinks.is_empty() {
            done.push(recording::record(group, store, name, sinks, opens_on)?);
        }
    }
    Ok(done)
}

/// Arguments of `merge`.
#[derive(Debug, Clone, Args)]
pub(crate) struct MergeArgs {
    /// Folders written by `partwise sweep --shard I/N`; overlapping shards must agree
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,
    /// Folder of the joined sweep
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    sinks: SinkArgs,
    #[command(flatten)]
    picture: PictureArgs,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
}

impl MergeArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        let started = Instant::now();
        self.picture.check_before(false, &NOT_STORED)?;
        self.sinks.check_outputs(&[self.picture.output()])?;
        let rows = sweep::merge(&self.shards, &self.out)?;
        let (manifest, _) = sweep::store::read(&self.out)?;
        let store = PointStore::in_folder(&self.out);
        let sources: Vec<PointStore> = self.shards.iter().map(|folder| PointStore::in_folder(folder)).collect();
        for row in rows.iter().filter(|row| row.status == Status::Ok) {
            for source in &sources {
                if store.adopt(source, &row.point).map_err(unwritable(&self.out, "--out"))? {
                    break;
                }
            }
        }
        let recordings = record_all(&rows, &store, &manifest.name, &self.out, &self.sinks, Tab::Stages)?;
        console::notes(self.picture.draw_sweep(&manifest.name, &rows, &store)?.as_slice());
        let report = Report {
            name: &manifest.name,
            folder: &self.out,
            outcome: &Outcome::found(rows),
            seconds: started.elapsed().as_secs_f64(),
            storing_ms: 0.0,
            recordings: &recordings,
        };
        report.print(self.format)
    }
}
