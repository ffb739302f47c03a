//! `partwise run`: one garment through every stage, recorded, summed up, and on request watched.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use glam::DVec3;
use partwise::drape::{Drape, Settings, drape};
use partwise::mechanics::refine::Step;
use partwise::record::{Layout, RecordOptions, Recorder, StepView};

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
    summary: Summary,
}

impl RunArgs {
    /// Runs the command.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        interrupt::listen();
        let mut solved = self.solve()?;
        let mut recorder = Recorder::open(self.record_options(&solved.inputs))?;
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
                self.keep_watching(&mut recorder)?
            } else {
                interrupt::wait()
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

    fn record_options(&self, inputs: &Inputs) -> RecordOptions {
        RecordOptions {
            sinks: self.sinks.sinks(&inputs.garment_name),
            name: inputs.garment_name.clone(),
            layout: Layout { several_tables: self.watch, follow: self.watch, ..Layout::default() },
            replaceable: self.watch,
            ..RecordOptions::default()
        }
    }

    fn solve(&self) -> anyhow::Result<Solved> {
        let start = Instant::now();
        let inputs = self.input.load()?;
        let settings = self.stages.settings()?;
        let load = start.elapsed();
        let drape = refining(&inputs.garment_name, |observer| drape(&inputs.scene, &settings, observer))?;
        let mut summary = Summary::new([&inputs.body_name, &inputs.garment_name], &inputs.scene, &settings, &drape);
        summary.timings_ms.insert("load", ms(load));
        summary.warnings.splice(0..0, inputs.warnings.iter().cloned());
        Ok(Solved { inputs, settings, drape, summary })
    }

    fn record(&self, recorder: &mut Recorder, solved: &mut Solved, index: i64) -> anyhow::Result<()> {
        let start = Instant::now();
        let scene = &solved.inputs.scene;
        recorder.body(index, &scene.body_mesh)?;
        recorder.garment(index, &scene.garment)?;
        let forces: Vec<DVec3> = solved.drape.outcomes.iter().map(|o| o.force_n).collect();
        recorder.step(&StepView {
            index,
            distance_m: &solved.drape.distance,
            part_of_vertex: &solved.drape.parts.part_of_vertex,
            part_force_n: &forces,
            draped: &solved.drape.positions,
            panel: &solved.summary.panel(&solved.settings.fabric),
            scalars: &[],
            overlays: &[],
        })?;
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
    fn keep_watching(&self, recorder: &mut Recorder) -> anyhow::Result<()> {
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
        while watch.changed().is_some() {
            match self.solve() {
                Ok(mut solved) => {
                    index += 1;
                    self.record(recorder, &mut solved, index)?;
                    self.print(&solved)?;
                }
                Err(error) => {
                    console::error(&error);
                }
            }
        }
        Ok(())
    }
}

/// Sets the size of the thread pool.
pub(crate) fn use_threads(threads: Option<usize>) -> anyhow::Result<()> {
    match threads {
        None => Ok(()),
        Some(0) => Err(UserError::new("--threads 0: found 0, expected at least 1; leave it out for one per core")),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build_global()?),
    }
}

/// Runs the stages with the solver's progress shown and Ctrl-C heard.
fn refining<T>(what: &str, work: impl FnOnce(&mut dyn FnMut(&Step<'_>) -> ControlFlow<()>) -> T) -> T {
    let bar = console::progress(None, what);
    let out = work(&mut |step| {
        bar.set_message(format!("{what}: step {}, residual {:.1e}", step.iteration, step.residual_over_weight));
        if interrupt::requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    bar.finish_and_clear();
    out
}
