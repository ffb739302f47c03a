//! `partwise run`: one garment through every stage, recorded, summed up, and on request watched.

mod recording;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use glam::DVec3;
use partwise::Job;
use partwise::drape::Drape;
use partwise::job::{Against, Measured};
use partwise::record::{Layout, RecordOptions, Recorder};
use partwise::scene::Loaded;

use super::inputs::InputArgs;
use super::sinks::SinkArgs;
use super::stages::StageArgs;
use super::summary::{Summary, ms};
use super::watch::FileWatch;
use super::work::{cache, refining, use_threads};
use super::{console, failure::UserError, interrupt};

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
    /// Measure the drape against its own continuation and the canonical drape; references are cached between runs
    #[arg(long, help_heading = "Stages")]
    accuracy: bool,
    /// Under --accuracy: canonical drapes from this many perturbed starts, for the spread between equilibria
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Stages")]
    spread: u64,
    /// Under --accuracy: where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Stages")]
    cache: Option<PathBuf>,
    /// Write the displaced garment: as OBJ with its original faces, groups and texture coordinates (of a pattern the panels and
    /// where they lay flat), or as glTF in metres, y up
    #[arg(long, value_name = "FILE.obj|FILE.glb", help_heading = "Output")]
    export: Option<PathBuf>,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// A garment through every stage.
struct Solved {
    job: Job,
    loaded: Loaded,
    drape: Drape,
    measured: Measured,
    snapshots: Vec<Snapshot>,
    summary: Summary,
}

/// The cloth at one of the solver's steps; the mesh every so often.
struct Snapshot {
    iteration: usize,
    energy: f64,
    residual_over_weight: f64,
    positions: Option<Vec<DVec3>>,
}

/// The recording gets the mesh at every so many steps: enough to see it settle, a few megabytes at most.
const MESH_EVERY: usize = 8;

impl RunArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        self.sinks.refuse_twice(&[("--export", self.export.as_deref())])?;
        interrupt::listen_at_once();
        let start = Instant::now();
        let mut solved = self.solve(self.job()?, start, None)?;
        let mut recorder = Recorder::open(self.record_options(&solved))?;
        solved.record(&mut recorder, 0, self.records_iterations())?;
        if let Some(path) = &self.export {
            solved.loaded.write(path, &solved.drape.positions)?;
            solved.summary.outputs.push(format!("displaced garment: {}", path.display()));
        }
        if self.watch || self.sinks.serve {
            self.print(&solved)?;
            if let Some(url) = recorder.web_url() {
                console::note(&format!("look at it: {url}"));
            }
            if self.watch {
                self.keep_watching(&mut recorder, solved)?;
            } else {
                interrupt::wait();
            }
            if let Some(path) = recorder.finish()?.path {
                console::note(&format!("recording: {}", path.display()));
            }
        } else {
            let finished = Instant::now();
            if let Some(path) = recorder.finish()?.path {
                solved.summary.outputs.push(format!("recording: {}", path.display()));
            }
            *solved.summary.timings_ms.entry("record").or_default() += ms(finished.elapsed());
            self.print(&solved)?;
        }
        Ok(())
    }

    fn record_options(&self, solved: &Solved) -> RecordOptions {
        let overlays = solved.overlays();
        let of_cloth = overlays.iter().map(|overlay| overlay.name).filter(|name| *name != "error");
        RecordOptions {
            sinks: self.sinks.sinks(&solved.loaded.garment_name),
            name: solved.loaded.garment_name.clone(),
            layout: Layout {
                several_tables: self.watch,
                follow: self.watch,
                iterations: self.records_iterations() && solved.snapshots.len() > 1,
                error: solved.measured.assessment.is_some(),
                pattern: solved.loaded.tailored.is_some(),
                wrinkles: solved.measured.assessment.is_some(),
                fit: of_cloth.map(str::to_owned).collect(),
                ..Layout::default()
            },
            replaceable: self.watch,
            front: self.sinks.seen_from.direction(),
        }
    }

    /// The job that the flags ask for, its small files read.
    fn job(&self) -> anyhow::Result<Job> {
        let settings = self.stages.settings()?;
        let accuracy = if self.accuracy { Against::Own } else { Against::None };
        Ok(Job { scene: self.input.spec()?, settings, seed: 0, accuracy, spread_starts: self.spread })
    }

    /// Runs every stage of a job; `kept` saves reading body and garment again.
    fn solve(&self, mut job: Job, start: Instant, kept: Option<Loaded>) -> anyhow::Result<Solved> {
        let loaded = kept.map_or_else(|| self.input.load(&job.scene), Ok)?;
        let load = start.elapsed();
        let name = &loaded.garment_name;
        let mut snapshots = Vec::new();
        let drape = refining(name, |progress| {
            job.drape(&loaded.scene, &mut |step| {
                let positions = (step.iteration.is_multiple_of(MESH_EVERY)).then(|| step.positions.to_vec());
                snapshots.push(Snapshot {
                    iteration: step.iteration,
                    energy: step.energy,
                    residual_over_weight: step.residual_over_weight,
                    positions,
                });
                progress(step)
            })
        })?;
        let cache = cache(self.cache.as_ref());
        if interrupt::requested() {
            job.accuracy = Against::None;
        }
        let what = format!("{name}: references");
        let measured = refining(&what, |progress| job.measure(&loaded.scene, &drape, cache.as_ref(), progress))?;
        let mut summary = Summary::new(&loaded, &job.settings, &drape, &measured)?;
        let sew = loaded.tailored.as_ref().map(|tailored| tailored.put_on.time).unwrap_or_default();
        summary.timings_ms.insert("load", ms(load.saturating_sub(sew)));
        if loaded.tailored.is_some() {
            summary.timings_ms.insert("sew", ms(sew));
        }
        Ok(Solved { job, loaded, drape, measured, snapshots, summary })
    }

    fn records_iterations(&self) -> bool {
        !self.watch && !self.no_iterations
    }

    fn print(&self, solved: &Solved) -> anyhow::Result<()> {
        for warning in &solved.summary.warnings {
            console::warning(warning);
        }
        for note in solved.loaded.notes() {
            console::note(&note);
        }
        match self.format {
            Format::Text => console::result(&solved.summary.text()),
            Format::Json => console::result(&solved.summary.json()?),
        }
        Ok(())
    }

    /// Streams a new step after each edit; an edit that does not read leaves the last good state on the page.
    fn keep_watching(&self, recorder: &mut Recorder, solved: Solved) -> anyhow::Result<()> {
        let of_meshes: Vec<PathBuf> =
            solved.job.scene.files().into_iter().chain(self.input.measurements()).map(Path::to_path_buf).collect();
        let files: Vec<PathBuf> =
            of_meshes.iter().cloned().chain(self.stages.files().into_iter().map(Path::to_path_buf)).collect();
        if files.is_empty() {
            return Err(UserError::new(
                "--watch has no file to watch: everything is built in. Give --table, --fabric, --body or --garment a file",
            ));
        }
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        let mut watch = FileWatch::new(files)?;
        console::note(&format!("watching {}; Ctrl-C ends", names.join(", ")));
        let mut index = 0;
        let mut last = Some(solved.loaded);
        while let Some(changed) = watch.changed() {
            // Body and garment take a second to make; a new table need not wait for them.
            let meshes_stand = changed.iter().all(|file| !of_meshes.contains(file));
            let kept = last.take_if(|_| meshes_stand);
            // A file that does not read is found before what is kept is used up.
            let start = Instant::now();
            let solved = match self.job() {
                Ok(job) => self.solve(job, start, kept),
                Err(error) => {
                    last = kept;
                    Err(error)
                }
            };
            match solved {
                Ok(mut solved) => {
                    index += 1;
                    solved.record(recorder, index, self.records_iterations())?;
                    self.print(&solved)?;
                    last = Some(solved.loaded);
                }
                Err(error) => {
                    console::error(&error);
                    recorder.notice(index, &format!("{error:#}"))?;
                }
            }
        }
        Ok(())
    }
}
