//! `partwise run`: one garment through every stage, recorded, summed up, and on request watched.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use glam::DVec3;
use partwise::accuracy::reference::ReferenceCache;
use partwise::assess::{AssessOptions, Assessment, assess};
use partwise::drape::{Drape, Settings, drape};
use partwise::mechanics::refine::Observer;
use partwise::record::{Layout, Overlay, RecordOptions, Recorder, StepView, WrinkleView};

use super::inputs::{InputArgs, Inputs};
use super::sinks::SinkArgs;
use super::stages::StageArgs;
use super::summary::{Summary, ms};
use super::watch::FileWatch;
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
    /// Write the displaced garment as OBJ, with its original faces, groups and texture coordinates
    #[arg(long, value_name = "FILE.obj", help_heading = "Output")]
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
    inputs: Inputs,
    settings: Settings,
    drape: Drape,
    assessment: Option<Assessment>,
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
    /// Runs the command.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        self.sinks.refuse_twice(&[("--export", self.export.as_deref())])?;
        interrupt::listen_at_once();
        let mut solved = self.solve(None)?;
        let mut recorder = Recorder::open(self.record_options(&solved))?;
        self.record(&mut recorder, &mut solved, 0)?;
        if let Some(path) = &self.export {
            solved.inputs.export(path, &solved.drape.positions)?;
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
        RecordOptions {
            sinks: self.sinks.sinks(&solved.inputs.garment_name),
            name: solved.inputs.garment_name.clone(),
            layout: Layout {
                several_tables: self.watch,
                follow: self.watch,
                iterations: self.records_iterations() && solved.snapshots.len() > 1,
                error: solved.assessment.is_some(),
                wrinkles: solved.assessment.is_some(),
                fit: if solved.drape.state.is_some() { vec!["strain".into(), "pressure".into()] } else { Vec::new() },
                ..Layout::default()
            },
            replaceable: self.watch,
            front: self.sinks.seen_from.direction(),
        }
    }

    /// Reads what is to be read, the quick files first, and runs every stage; `kept` saves reading body and garment again.
    fn solve(&self, kept: Option<Inputs>) -> anyhow::Result<Solved> {
        let start = Instant::now();
        let settings = self.stages.settings()?;
        let inputs = kept.map_or_else(|| self.input.load(), Ok)?;
        let load = start.elapsed();
        let name = &inputs.garment_name;
        let mut snapshots = Vec::new();
        let drape = refining(name, |progress| {
            drape(&inputs.scene, &settings, &mut |step| {
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
        let options = AssessOptions { cache: self.cache(), spread_starts: self.spread };
        let assessment = if self.accuracy && !interrupt::requested() {
            let what = format!("{name}: references");
            Some(refining(&what, |progress| assess(&inputs.scene, &settings, &drape, &options, progress))?)
        } else {
            None
        };
        let mut summary = Summary::new([&inputs.body_name, &inputs.garment_name], &inputs.scene, &settings, &drape);
        summary.timings_ms.insert("load", ms(load));
        summary.warnings.splice(0..0, inputs.warnings.iter().cloned());
        if let Some(assessment) = &assessment {
            summary.assessed(assessment);
        }
        Ok(Solved { inputs, settings, drape, assessment, snapshots, summary })
    }

    fn records_iterations(&self) -> bool {
        !self.watch && !self.no_iterations
    }

    fn cache(&self) -> Option<ReferenceCache> {
        self.cache.clone().map(ReferenceCache::new).or_else(ReferenceCache::in_user_cache)
    }

    fn record(&self, recorder: &mut Recorder, solved: &mut Solved, index: i64) -> anyhow::Result<()> {
        let start = Instant::now();
        let scene = &solved.inputs.scene;
        recorder.body(index, &scene.body_mesh)?;
        recorder.garment(index, &scene.garment)?;
        let forces: Vec<DVec3> = solved.drape.outcomes.iter().map(|o| o.force_n).collect();
        let mut overlays = Vec::new();
        if let Some(state) = &solved.drape.state {
            overlays.push(Overlay { name: "strain", unit: "%", values: &state.fit.strain_percent });
            overlays.push(Overlay { name: "pressure", unit: "kPa", values: &state.fit.pressure_kpa });
        }
        let mut scalars = Vec::new();
        if let Some(assessment) = &solved.assessment {
            overlays.push(Overlay { name: "error", unit: "mm", values: &assessment.error_mm });
            scalars.push(("error/rms_mm", assessment.accuracy.vertices.rms_mm));
        }
        recorder.step(&StepView {
            index,
            distance_m: &solved.drape.distance,
            part_of_vertex: &solved.drape.parts.part_of_vertex,
            part_force_n: &forces,
            draped: &solved.drape.positions,
            panel: &solved.summary.panel(&solved.settings.fabric),
            scalars: &scalars,
            overlays: &overlays,
        })?;
        if let Some(assessment) = &solved.assessment {
            let joining = scene.topology.edges.as_slice();
            let seams = solved.drape.parts.seams.iter().zip(&assessment.wrinkles.seams);
            let jumps_mm: Vec<([u32; 2], f64)> = seams
                .flat_map(|(seam, measured)| {
                    seam.edges.iter().map(|&e| (joining[e as usize], measured.displacement_difference_mm))
                })
                .collect();
            recorder.wrinkles(&WrinkleView {
                index,
                draped: &solved.drape.positions,
                jumps_mm: &jumps_mm,
                curvature_per_m: &assessment.wrinkles.vertex_curvature_per_m,
            })?;
        }
        if self.records_iterations() {
            for s in &solved.snapshots {
                let iteration = i64::try_from(s.iteration).unwrap_or(i64::MAX);
                recorder.iteration(iteration, s.energy, s.residual_over_weight, s.positions.as_deref())?;
            }
        }
        solved.summary.timings_ms.insert("record", ms(start.elapsed()));
        Ok(())
    }

    fn print(&self, solved: &Solved) -> anyhow::Result<()> {
        for warning in &solved.summary.warnings {
            console::warning(warning);
        }
        for note in &solved.inputs.notes {
            console::note(note);
        }
        match self.format {
            Format::Text => console::result(&solved.summary.text()),
            Format::Json => console::result(&solved.summary.json()?),
        }
        Ok(())
    }

    /// Streams a new step after each edit; an edit that does not read leaves the last good state on the page.
    fn keep_watching(&self, recorder: &mut Recorder, solved: Solved) -> anyhow::Result<()> {
        let files: Vec<PathBuf> =
            self.input.files().into_iter().chain(self.stages.files()).map(Path::to_path_buf).collect();
        if files.is_empty() {
            return Err(UserError::new(
                "--watch has no file to watch: everything is built in. Give --table, --fabric, --body or --garment a file",
            ));
        }
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        let mut watch = FileWatch::new(files)?;
        console::note(&format!("watching {}; Ctrl-C ends", names.join(", ")));
        let mut index = 0;
        let mut last = Some(solved.inputs);
        while let Some(changed) = watch.changed() {
            // Body and garment take a second to make; a new table need not wait for them.
            let meshes_stand = changed.iter().all(|file| !self.input.files().contains(&file.as_path()));
            let kept = last.take_if(|_| meshes_stand);
            // A file that does not read is found before what is kept is used up.
            let solved = match self.stages.settings() {
                Ok(_) => self.solve(kept),
                Err(error) => {
                    last = kept;
                    Err(error)
                }
            };
            match solved {
                Ok(mut solved) => {
                    index += 1;
                    self.record(recorder, &mut solved, index)?;
                    self.print(&solved)?;
                    last = Some(solved.inputs);
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

/// More threads than any machine has cores: the system runs out of them before they do any good.
pub(crate) const MOST_THREADS: usize = 1024;

/// Sets the size of the thread pool.
pub(crate) fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    match threads {
        None => Ok(()),
        Some(0) => Err(UserError::new("--threads 0: found 0, expected at least 1; leave it out for one per core")),
        Some(n) if n > MOST_THREADS => Err(UserError::new(format!(
            "--threads {n}: found {n}, expected 1 to {MOST_THREADS}; leave it out for one per core"
        ))),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}

/// Runs `work` with the solver's progress shown and Ctrl-C heard.
pub(crate) fn refining<T>(what: &str, work: impl FnOnce(Observer<'_>) -> T) -> T {
    interrupt::keep();
    let bar = console::progress(None, what);
    let out = work(&mut |step| {
        bar.set_message(format!("{what}: step {}, residual {:.1e}", step.iteration, step.residual_over_weight));
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    out
}
