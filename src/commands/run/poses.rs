//! `--from-body`, or a folder as `--body`: a garment draped on one pose of a body and carried to the others, one step of the recording for
//! each.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::{Origin, RunArgs, TWO_STAGE, print_address, serve};
use crate::base::files::stem;
use crate::commands::console::{self, Format};
use crate::commands::runtime::{interrupted, refuse, with_progress};
use crate::commands::solved::IterationLog;
use crate::commands::summary::{Summary, print_certificate, require_pass};
use crate::drape::{Model, next_pose};
use crate::scene::{PoseReader, pose_files};
use crate::study::accuracy::rms_mm;

/// Most figures of a picture of poses.
const MAX_PICTURED: usize = 24;

/// One pose in the result. Field names are the keys of `--format json`.
#[derive(Serialize)]
struct Pose {
    /// Time until the garment was carried to the pose and out of the body, ms; 0 for the first.
    preview_ms: f64,
    /// RMS distance of the carried garment from its rest, mm; 0 for the first.
    preview_rms_mm: f64,
    /// Time until it rested, ms.
    rest_ms: f64,
    #[serde(flatten)]
    summary: Summary,
}

/// The result of all poses.
#[derive(Serialize)]
struct Poses<'a> {
    poses: &'a [Pose],
}

impl RunArgs {
    /// Whether several poses were requested.
    pub(super) fn has_poses(&self) -> bool {
        self.from_body.is_some() || Path::new(self.input.body()).is_dir()
    }

    /// Drapes the garment on the first pose, and carries it to the others.
    pub(super) fn run_poses(&self) -> anyhow::Result<()> {
        let start = Instant::now();
        let mut files = pose_files(self.input.body())?;
        let mut job = self.job()?;
        job.scene.body = match &self.from_body {
            Some(first) => first.clone(),
            None => files.remove(0).display().to_string(),
        };
        if files.is_empty() {
            refuse!("{}: found a single pose, expected two or more", self.input.body());
        }
        let given = [
            ("--method", self.method != TWO_STAGE),
            ("--watch", self.watch),
            ("--accuracy", self.accuracy),
            ("--folds", self.folds),
            ("--model paper", matches!(job.settings.model, Model::Paper(_))),
        ];
        if let Some((flag, _)) = given.iter().find(|(_, given)| *given) {
            refuse!("{flag}: found several poses of the body, expected one; leave out --from-body, or {flag}");
        }
        let name = job.scene.garment_name();
        self.sinks.refuse_unwritable(&name)?;
        let meshes = self.input.meshes();
        let reader = PoseReader::new(&job.scene, &meshes)?;
        // All files are read once before the first drape, so that a wrong one is refused at once.
        for file in &files {
            reader.read(file)?;
        }
        let loaded = self.load(&job)?;
        let solved = self.solve(job.clone(), loaded, start.elapsed(), IterationLog::new(None))?;
        let mut recorder = solved.open(&self.sinks)?;
        print_address(&recorder);
        let rest_ms = 1e3 * solved.drape.times.total.as_secs_f64();
        let mut poses = vec![Pose { preview_ms: 0.0, preview_rms_mm: 0.0, rest_ms, summary: solved.summary.clone() }];
        let mut all = vec![solved];
        all[0].record(&mut recorder, 0)?;
        for (index, file) in (1..).zip(&files) {
            if interrupted() {
                break;
            }
            let Some(before) = all.last() else { break };
            let body = reader.read(file)?;
            let began = Instant::now();
            let mut loaded = before.loaded.clone();
            loaded.scene = before.loaded.scene.in_pose(body, &before.drape.positions);
            loaded.body_name = stem(&file.to_string_lossy());
            let preview = began.elapsed();
            let title = format!("{name} on {}", loaded.body_name);
            let last = (&before.loaded.scene, &before.drape);
            let drape = with_progress(&title, |progress| next_pose(last, &loaded.scene, &job.settings, progress))?;
            let rest = drape.times.total;
            let preview_rms_mm = rms_mm(&drape.preview, &drape.positions);
            let origin = Origin { load: Duration::ZERO, iterations: 0 };
            let mut solved = self.measured(&mut job, loaded, drape, origin)?;
            solved.summary.add_time("carry", preview);
            solved.record(&mut recorder, index)?;
            let [preview_ms, rest_ms] = [preview, rest].map(|time| 1e3 * time.as_secs_f64());
            poses.push(Pose { preview_ms, preview_rms_mm, rest_ms, summary: solved.summary.clone() });
            // Without a picture only the last pose is needed.
            if self.picture.picture.is_none() || all.len() >= MAX_PICTURED {
                all.pop();
            }
            all.push(solved);
        }
        let Some(last) = all.last_mut() else { return Ok(()) };
        self.export(last)?;
        let mut outputs = std::mem::take(&mut last.summary.outputs);
        outputs.extend(self.picture.draw_runs(&all)?);
        if self.sinks.serve {
            self.print_poses(&poses, &outputs)?;
            serve(recorder)?;
        } else {
            outputs.extend(recorder.finish()?.file_line());
            self.print_poses(&poses, &outputs)?;
        }
        for pose in &poses {
            if self.strict {
                pose.summary.require_good()?;
            } else {
                require_pass(pose.summary.certificate.as_ref())?;
            }
        }
        Ok(())
    }

    fn print_poses(&self, poses: &[Pose], outputs: &[String]) -> anyhow::Result<()> {
        match self.format {
            Format::Json => console::json(&Poses { poses })?,
            Format::Text => {
                let header = ["pose", "preview ms", "from rest mm", "at rest ms", "steps", "strain %", "verdict"];
                let rows = poses.iter().map(|pose| {
                    let metrics = &pose.summary.metrics;
                    let share = metrics.strain_max.unwrap_or_default();
                    [
                        pose.summary.body().to_owned(),
                        format!("{:.1}", pose.preview_ms),
                        format!("{:.1}", pose.preview_rms_mm),
                        format!("{:.0}", pose.rest_ms),
                        metrics.refine_steps.unwrap_or_default().to_string(),
                        format!("{:.0}", 100.0 * share),
                        metrics.verdict.clone(),
                    ]
                });
                console::prose(&console::table(console::OPEN, header, 1..6, rows));
                for pose in poses.iter().filter(|pose| pose.summary.certificate.is_some()) {
                    console::prose(&format!("\n{}", pose.summary.body()));
                    print_certificate(pose.summary.certificate.as_ref());
                }
            }
        }
        console::notes(outputs);
        for pose in poses {
            let warnings = pose.summary.warnings.iter().map(|warning| format!("{}: {warning}", pose.summary.body()));
            console::warnings(&warnings.collect::<Vec<_>>());
        }
        Ok(())
    }
}
