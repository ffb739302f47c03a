//! `partwise run`: one garment through every stage, recorded, summed up, and on request watched.

mod by_method;
mod coloured_export;
mod watching;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use crate::Job;
use crate::drape::{self, LetGo};
use crate::record::Recorder;
use crate::study::certificate::certify;
use crate::study::evaluate::EvaluateError;
use crate::study::job::Against;
use clap::builder::{PathBufValueParser, TypedValueParser as _};
use clap::{Args, ValueEnum};

use super::runtime::{cache, refining, use_threads};
use super::sinks::mesh_file;
use super::solved::{Snapshot, Solved};
use super::summary::Summary;
use super::{InputArgs, SinkArgs, StageArgs, certified, console, interrupt};
use coloured_export::ExportColours;

/// What stdout is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Tables for people
    Text,
    /// One JSON object
    Json,
}

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    input: InputArgs,
    #[command(flatten)]
    stages: StageArgs,
    #[command(flatten)]
    sinks: SinkArgs,
    /// Solve again and stream the next step whenever the table, fabric, body or garment file changes
    #[arg(long, help_heading = "Recording")]
    watch: bool,
    /// Leave the solver's steps out of the recording, for a small file
    #[arg(long, help_heading = "Recording")]
    no_iterations: bool,
    /// Drape by one of the paper's reference methods instead, to its stopping rule: `zhu2016` [19], `gross2003` [20],
    /// `thomaszewski2006` [21]
    #[arg(long, value_name = "METHOD", default_value = by_method::TWO_STAGE, value_parser = by_method::method, help_heading = "Stages")]
    method: &'static str,
    /// Measure the drape against its own continuation and the canonical drape; references are cached between runs
    #[arg(long, help_heading = "Stages")]
    accuracy: bool,
    /// Under --accuracy: canonical drapes from this many perturbed starts, for the spread between equilibria
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Stages")]
    spread: u64,
    /// Under --accuracy: where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Stages")]
    cache: Option<PathBuf>,
    /// Certify the drape: whether it is at rest, would stay so, and nothing goes through anything, by forces taken anew from its
    /// positions; exit code 1 where a line fails
    #[arg(long, help_heading = "Stages", conflicts_with = "watch")]
    certify: bool,
    /// Write the displaced garment: as OBJ with its original faces, groups and texture coordinates (of a pattern the panels and
    /// where they lay flat), or as glTF in metres, y up
    #[arg(long, value_name = "FILE.obj|FILE.glb", value_parser = PathBufValueParser::new().try_map(mesh_file), help_heading = "Output")]
    export: Option<PathBuf>,
    /// Colour the vertices of a `.glb` as the views of the recording do
    #[arg(long, value_enum, value_name = "WHAT", requires = "export", help_heading = "Output")]
    export_colours: Option<ExportColours>,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// Says where a recording is served, and ends it once the user has seen enough.
fn show(recorder: Recorder) -> anyhow::Result<()> {
    if let Some(url) = recorder.web_url() {
        console::note(&format!("look at it: {url}"));
    }
    interrupt::wait();
    console::notes(recorder.finish()?.file_line().as_slice());
    Ok(())
}

/// The recording gets the mesh at every so many steps: enough to see it settle, a few megabytes at most.
const MESH_EVERY: usize = 8;

impl RunArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        self.sinks.check_outputs(&[("--export", self.export.as_deref())])?;
        coloured_export::refuse(self.export.as_deref(), self.export_colours)?;
        if self.method != by_method::TWO_STAGE {
            return self.run_by_method();
        }
        if self.watch {
            return self.keep_watching();
        }
        let start = Instant::now();
        let job = self.job()?;
        self.sinks.refuse_unwritable(&job.scene.garment_name())?;
        let mut solved = self.solve(job, start)?;
        let mut recorder = Recorder::open(solved.record_options(&self.sinks, !self.no_iterations, false))?;
        solved.record(&mut recorder, 0, !self.no_iterations)?;
        self.export(&mut solved)?;
        if self.sinks.serve {
            self.print(&solved)?;
            show(recorder)?;
        } else {
            let finished = Instant::now();
            solved.summary.outputs.extend(recorder.finish()?.file_line());
            solved.summary.add_time("record", finished.elapsed());
            self.print(&solved)?;
        }
        certified::verified(solved.summary.certificate.as_ref())
    }

    fn export(&self, solved: &mut Solved) -> anyhow::Result<()> {
        if let Some(path) = &self.export {
            coloured_export::write(solved, path, self.export_colours)?;
            solved.summary.outputs.push(format!("displaced garment: {}", path.display()));
        }
        Ok(())
    }

    /// The job that the flags ask for, its small files read.
    fn job(&self) -> anyhow::Result<Job> {
        let settings = self.stages.settings()?;
        let scene = self.stages.dials.cloth.give(self.input.spec()?)?;
        let accuracy = if self.accuracy { Against::Own } else { Against::None };
        Ok(Job { scene, settings, seed: 0, accuracy, spread_starts: self.spread })
    }

    /// Runs every stage of a job.
    fn solve(&self, mut job: Job, start: Instant) -> anyhow::Result<Solved> {
        let loaded = self.input.load(&job.scene)?;
        self.stages.dials.cloth.check_used(&loaded)?;
        let load = start.elapsed();
        let name = &loaded.garment_name;
        let mut snapshots = BTreeMap::new();
        let drape = refining(name, |progress| {
            job.drape(&loaded.scene, &mut |step| {
                if step.at_rest {
                    // Told before, as the step that it is.
                    return progress(step);
                }
                let positions = (step.iteration.is_multiple_of(MESH_EVERY)).then(|| step.positions.to_vec());
                let snapshot =
                    Snapshot { energy: step.energy, residual_over_weight: step.residual_over_weight, positions };
                // Coarser garments that it rests on first, and trials that were taken back, count as the step that follows.
                snapshots.insert(step.iteration, snapshot);
                progress(step)
            })
        })?;
        let cache = cache(self.cache.as_ref());
        if interrupt::requested() {
            job.accuracy = Against::None;
        }
        let what = format!("{name}: references");
        let draped = Instant::now();
        let measured = match refining(&what, |progress| job.measure(&loaded.scene, &drape, cache.as_ref(), progress)) {
            // The drape is there all the same, and is not lost for what it was to be compared with.
            Err(error @ (EvaluateError::Fallen | EvaluateError::Interrupted)) => {
                console::warning(&format!("{error}; the drape is kept without its error"));
                job.accuracy = Against::None;
                job.measure(&loaded.scene, &drape, None, &mut drape::unobserved)?
            }
            other => other?,
        };
        let mut summary = Summary::new(&loaded, &job.settings, &drape, &measured)?;
        let sew = loaded.tailored.as_ref().map(|tailored| tailored.put_on.time);
        summary.add_time("load", load.saturating_sub(sew.unwrap_or_default()));
        if let Some(sew) = sew {
            summary.add_time("sew", sew);
        }
        summary.add_time("measure", draped.elapsed());
        if self.certify {
            let began = Instant::now();
            let mut scene = loaded.scene.clone();
            if matches!(drape.let_go, Some(LetGo::Stays { .. })) {
                scene.held.clear();
            }
            summary.certificate = Some(certify(&scene, &job.settings.fabric, &drape.positions)?);
            summary.add_time("certify", began.elapsed());
        }
        Ok(Solved { loaded, drape, measured, snapshots, summary })
    }

    fn print(&self, solved: &Solved) -> anyhow::Result<()> {
        console::warnings(&solved.summary.warnings);
        console::notes(&solved.loaded.notes());
        match self.format {
            Format::Text => {
                console::result(&solved.summary.text());
                certified::print(solved.summary.certificate.as_ref());
            }
            Format::Json => console::result(&solved.summary.json()?),
        }
        Ok(())
    }
}
