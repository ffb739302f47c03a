//! `partwise run`: drapes a garment, records every stage and prints a summary; with `--watch`, again after each change of a file.

mod method;
mod poses;
mod watch;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::Job;
use crate::base::files::has_ending;
use crate::drape::{self, Drape, Refine, Release};
use crate::mechanics::methods::METHODS;
use crate::mechanics::refine::Observer;
use crate::picture::Quantity;
use crate::picture::colour::of_drape;
use crate::record::Recorder;
use crate::scene::Loaded;
use crate::study::certificate::certify;
use crate::study::evaluate::EvaluateError;
use crate::study::job::Against;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser as _};

use super::console::{self, Format};
use super::inputs::InputArgs;
use super::pictures::PictureArgs;
use super::runtime::{interrupted, reference_cache, refuse, use_threads, wait_for_interrupt, with_progress};
use super::sinks::{SinkArgs, mesh_file};
use super::solved::{IterationLog, Solved, begin, folded_preview};
use super::stages::StageArgs;
use super::summary::{Summary, print_certificate, require_pass};

/// The method of this program: PARTs, and refinement at full resolution.
const TWO_STAGE: &str = "two-stage";

fn method_name(name: &str) -> Result<&'static str, String> {
    let methods = std::iter::once(TWO_STAGE).chain(METHODS);
    let expected = || format!("found `{name}`, expected one of {}", methods.clone().collect::<Vec<_>>().join(", "));
    methods.clone().find(|method| *method == name).ok_or_else(expected)
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
    #[command(flatten)]
    picture: PictureArgs,
    /// Body on which the garment is placed and draped first: the same mesh as --body in another pose. The drape is carried along to
    /// --body and settles there; with a folder as --body, from pose to pose in the order of the numbers in the file names
    #[arg(long, value_name = "form|FILE", help_heading = "Body and garment")]
    from_body: Option<String>,
    /// Drape again and stream another step whenever the table, fabric, body or garment file changes
    #[arg(long, help_heading = "Recording")]
    watch: bool,
    /// Omit the iterations of the solver from the recording, for a smaller file
    #[arg(long, help_heading = "Recording")]
    no_iterations: bool,
    /// Drape by one of the paper's reference methods instead, up to its stopping criterion: `zhu2016` [19], `gross2003` [20],
    /// `thomaszewski2006` [21]
    #[arg(long, value_name = "METHOD", default_value = TWO_STAGE, value_parser = method_name, help_heading = "Stages")]
    method: &'static str,
    /// Measure the errors of the drape against its own continuation and the canonical drape; both references are cached
    #[arg(long, help_heading = "Stages")]
    accuracy: bool,
    /// With --accuracy: canonical drapes from this many perturbed starts, for the spread between equilibria
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Stages")]
    spread: u64,
    /// With --accuracy: folder of the reference drapes [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Stages")]
    cache: Option<PathBuf>,
    /// Certify that the drape is a stable equilibrium without intersections, from forces recomputed from its positions; exit code 1 if
    /// a criterion fails
    #[arg(long, help_heading = "Stages", conflicts_with = "watch")]
    certify: bool,
    /// Certify as --certify does, and exit with code 3 unless the verdict is that the garment rests and every criterion passes
    #[arg(long, help_heading = "Stages", conflicts_with = "watch")]
    strict: bool,
    /// Export the draped garment with its groups and texture coordinates (of a sewing pattern: panels and flat positions): as OBJ or PLY
    /// with its original faces, unit and axes, as glTF in metres, y up, or as USD in metres, z up
    #[arg(long, value_name = "FILE.obj|.ply|.glb|.usda", value_parser = PathBufValueParser::new().try_map(mesh_file), help_heading = "Output")]
    export: Option<PathBuf>,
    /// Export the body, too, into a `.glb` or `.usda`
    #[arg(long, requires = "export", help_heading = "Output")]
    export_body: bool,
    /// Colour the vertices of a `.glb`, `.ply` or `.usda` as in the recording, by `parts` (the hue shows the level), largest `strain` (%), `pressure` on
    /// the body (kPa), or `folds` (excess length of the cloth, %)
    #[arg(long, value_parser = ["parts", "strain", "pressure", "folds"], value_name = "WHAT", requires = "export", help_heading = "Output")]
    export_colours: Option<String>,
    /// With --refine 0: export the preview with the folds drawn that its PARTs are too wide for, as in the recording's view of
    /// folds; forces and errors stay those of the PARTs
    #[arg(long, requires = "export", help_heading = "Output")]
    folds: bool,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// The data of a drape from before its measurements.
struct Origin {
    /// Time spent loading.
    load: Duration,
    /// Recorded iterations of the solver.
    iterations: i64,
}

/// Serves a recording until Ctrl-C, and ends it.
fn serve(recorder: Recorder) -> anyhow::Result<()> {
    wait_for_interrupt();
    console::notes(recorder.finish()?.file_line().as_slice());
    Ok(())
}

/// Prints the address of a recording, if it is served.
fn print_address(recorder: &Recorder) {
    if let Some(url) = recorder.web_url() {
        console::note(&format!("view it in a browser: {url}"));
    }
}

impl RunArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        self.sinks.check_outputs(&[("--export", self.export.as_deref()), self.picture.output()])?;
        self.check_export()?;
        let without: &[_] = if self.accuracy { &[] } else { &[(Quantity::Error, "no --accuracy")] };
        self.picture.check_before(self.input.is_a_pattern(), without)?;
        if self.picture.picture.is_some() && (self.watch || self.method != TWO_STAGE) {
            let found = if self.watch { "--watch" } else { "--method" };
            refuse!("--picture: found {found}, expected a run of the two stages that ends; leave one of the two out");
        }
        if self.has_poses() {
            return self.run_poses();
        }
        if self.method != TWO_STAGE {
            if self.strict {
                refuse!("--strict: found --method {}, expected {TWO_STAGE}, the method that is certified", self.method);
            }
            return self.run_method();
        }
        if self.watch {
            return self.keep_watching();
        }
        let start = Instant::now();
        let job = self.job()?;
        if self.folds && job.settings.refine != Refine::Steps(0) {
            refuse!(
                "--folds: found a drape with steps at full resolution, which has its own folds, expected --refine 0"
            );
        }
        self.sinks.refuse_unwritable(&job.scene.garment_name())?;
        let loaded = self.load(&job)?;
        let load = start.elapsed();
        let iterations = !self.no_iterations && job.settings.refine != Refine::Steps(0);
        let (mut recorder, recorded) = begin(&self.sinks, &job, &loaded, iterations)?;
        print_address(&recorder);
        let log = IterationLog::new(Some(&mut recorder).filter(|_| iterations));
        let mut solved = self.solve(job, loaded, load, log)?;
        solved.summary.add_time("record", recorded);
        recorder.set_layout(solved.layout())?;
        solved.record(&mut recorder, 0)?;
        self.export(&mut solved)?;
        self.draw(&mut solved)?;
        if self.sinks.serve {
            self.print(&solved)?;
            serve(recorder)?;
        } else {
            let finished = Instant::now();
            solved.summary.outputs.extend(recorder.finish()?.file_line());
            solved.summary.add_time("record", finished.elapsed());
            self.print(&solved)?;
        }
        if self.strict {
            return solved.summary.require_good();
        }
        require_pass(solved.summary.certificate.as_ref())
    }

    /// Refuses options that the format of the export cannot hold.
    fn check_export(&self) -> anyhow::Result<()> {
        let Some(path) = &self.export else { return Ok(()) };
        let is = |endings: &[&str]| endings.iter().any(|ending| has_ending(path, ending));
        let name = path.display();
        if self.export_colours.is_some() && !is(&["glb", "ply", "usda"]) {
            refuse!(
                "{name}: found --export-colours for an OBJ, which has no colours, expected a name that ends in `.glb`, `.ply` or `.usda`"
            );
        }
        if self.export_body && !is(&["glb", "usda"]) {
            refuse!(
                "{name}: found --export-body for a file of one mesh, expected a name that ends in `.glb` or `.usda`"
            );
        }
        Ok(())
    }

    fn draw(&self, solved: &mut Solved) -> anyhow::Result<()> {
        let began = Instant::now();
        if let Some(line) = self.picture.draw_run(solved)? {
            solved.summary.outputs.push(line);
            solved.summary.add_time("picture", began.elapsed());
        }
        Ok(())
    }

    fn export(&self, solved: &mut Solved) -> anyhow::Result<()> {
        if let Some(path) = &self.export {
            self.write_export(solved, path)?;
            let mut line = format!("draped garment: {}", path.display());
            match &solved.folded {
                Some(folded) if self.folds => {
                    let counts: Vec<String> = folded.counts.iter().map(ToString::to_string).collect();
                    line += &format!(", with {} folds drawn", counts.join(" and "));
                }
                None if self.folds => console::warning(
                    "--folds: found no region to fold, expected one that closes around a vertical axis and is compressed, as a flared \
                     skirt is; the preview is exported without folds",
                ),
                _ => (),
            }
            solved.summary.outputs.push(line);
        }
        Ok(())
    }

    fn write_export(&self, solved: &Solved, path: &Path) -> anyhow::Result<()> {
        let (scene, drape) = (&solved.loaded.scene, &solved.drape);
        let positions = match &solved.folded {
            Some(folded) if self.folds => &folded.positions,
            _ => &drape.positions,
        };
        let mut colours = None;
        if let Some(quantity) = &self.export_colours {
            colours = of_drape(&scene.garment, drape, quantity);
            if colours.is_none() {
                refuse!(
                    "{}: found no {quantity} to colour it by, because this model does not compute it; expected --export-colours \
                     parts, or --model coupled",
                    path.display()
                )
            }
        }
        Ok(solved.loaded.write_with(path, positions, colours.as_deref(), self.export_body)?)
    }

    /// The job that the arguments specify, its tables and fabrics read.
    fn job(&self) -> anyhow::Result<Job> {
        let settings = self.stages.settings()?;
        let scene = self.stages.model.fabric.assign(self.input.spec()?)?;
        let accuracy = if self.accuracy { Against::Own } else { Against::None };
        Ok(Job { scene, settings, seed: 0, accuracy, spread_starts: self.spread })
    }

    /// Body and garment of a job.
    fn load(&self, job: &Job) -> anyhow::Result<Loaded> {
        let loaded = self.input.load(&job.scene)?;
        self.stages.model.fabric.check_used(&loaded)?;
        Ok(loaded)
    }

    /// Runs every stage of a job.
    fn solve(&self, mut job: Job, loaded: Loaded, load: Duration, mut log: IterationLog<'_>) -> anyhow::Result<Solved> {
        let mut logged = Ok(());
        let drape = with_progress(&loaded.garment_name, |progress| {
            job.drape(&loaded.scene, &mut |step| {
                // The solver may report states after a break, and the first error counts.
                if logged.is_ok() {
                    logged = log.add(step);
                }
                if logged.is_err() { ControlFlow::Break(()) } else { progress(step) }
            })
        })?;
        logged?;
        let iterations = log.finish()?;
        self.measured(&mut job, loaded, drape, Origin { load, iterations })
    }

    /// A drape with its measurements and its summary.
    fn measured(&self, job: &mut Job, loaded: Loaded, drape: Drape, origin: Origin) -> anyhow::Result<Solved> {
        let Origin { load, iterations } = origin;
        let cache = reference_cache(self.cache.as_ref());
        if interrupted() {
            job.accuracy = Against::None;
        }
        let what = if matches!(job.accuracy, Against::None) { "measurements" } else { "references" };
        let title = format!("{}: {what}", loaded.garment_name);
        let draped = Instant::now();
        let measure = |progress: Observer<'_>| job.measure(&loaded.scene, &drape, cache.as_ref(), progress);
        let measured = match with_progress(&title, measure) {
            // A drape without its references is still a result.
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
        if self.certify || self.strict {
            let began = Instant::now();
            let mut scene = loaded.scene.clone();
            if matches!(drape.release, Some(Release::Stays { .. })) {
                scene.held.clear();
            }
            summary.certificate = Some(certify(&scene, &job.settings.fabric, &drape.positions)?);
            summary.add_time("certify", began.elapsed());
        }
        let folded = folded_preview(&loaded, job, &drape);
        Ok(Solved { loaded, drape, measured, folded, iterations, summary })
    }

    fn print(&self, solved: &Solved) -> anyhow::Result<()> {
        let summary = &solved.summary;
        match self.format {
            Format::Text => {
                console::prose(&summary.text());
                print_certificate(summary.certificate.as_ref());
            }
            Format::Json => console::json(summary)?,
        }
        console::notes(&solved.loaded.notes());
        console::warnings(&summary.warnings);
        if matches!(self.format, Format::Text) {
            console::prose(&summary.verdict());
        }
        Ok(())
    }
}
