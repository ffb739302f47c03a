//! `--method`: a garment draped by one of the paper's reference methods, recorded and summed up as our own are.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

use crate::DVec3;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::fit::Fit;
use crate::methods::{self, METHODS, MethodDrape, MethodInput, RestRule};
use crate::record::{Layout, MethodView, Overlay, Panel, RecordOptions, Recorder};
use crate::scene::Loaded;
use crate::study::certificate::{Certificate, certify};
use crate::study::metrics::MethodMetrics;
use anyhow::Context as _;
use serde::Serialize;

use super::{Format, RunArgs, show};
use crate::commands::summary::{command_line, ended, fabric_facts};
use crate::commands::{UserError, certified, console, interrupt};

/// Our own: PARTs and what follows.
pub(super) const TWO_STAGE: &str = "two-stage";

/// The name of a method, or of ours.
pub(super) fn method(name: &str) -> Result<&'static str, String> {
    let known = std::iter::once(TWO_STAGE).chain(METHODS);
    known.clone().find(|known| *known == name).ok_or_else(|| {
        let names: Vec<&str> = known.collect();
        format!("found `{name}`, expected one of {}", names.join(", "))
    })
}

/// The mesh is recorded so often, s of simulated time: enough to see it settle, a few megabytes at most.
const MESH_S: f64 = 0.05;

/// A moment of a run in time: step, RMS speed in m/s, and the mesh every so often.
type Kept = (usize, f64, Option<Vec<DVec3>>);

/// What a run says. Field names are the keys of `--format json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    command_line: String,
    body: &'a str,
    garment: &'a str,
    method: &'static str,
    fabric: &'a str,
    #[serde(flatten)]
    metrics: &'a MethodMetrics,
    /// What the method counted: tests, elements, iterations.
    counts: BTreeMap<&'static str, u64>,
    /// Milliseconds of `load`, of each part of the method, of all `method`, of `measure`, `record` and `total`.
    timings_ms: BTreeMap<&'static str, f64>,
    notes: &'a [String],
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<&'a Certificate>,
    outputs: Vec<String>,
}

impl RunArgs {
    /// Refuses what acts on PARTs or on our own solver alone.
    fn refuse_beside_a_method(&self) -> anyhow::Result<()> {
        let own = [
            ("--accuracy", self.accuracy),
            ("--spread", self.spread > 0),
            ("--cache", self.cache.is_some()),
            ("--watch", self.watch),
            ("--export-colours", self.export_colours.is_some()),
        ];
        let mut given: Vec<&str> = own.into_iter().filter(|(_, given)| *given).map(|(flag, _)| flag).collect();
        given.extend(self.stages.of_two_stages());
        if given.is_empty() {
            return Ok(());
        }
        Err(UserError::new(format!(
            "--method {}: found {}, which only {TWO_STAGE} has; leave it out, or take --method {TWO_STAGE}",
            self.method,
            given.join(", ")
        )))
    }

    /// Drapes by the reference method that was asked for.
    pub(super) fn run_by_method(&self) -> anyhow::Result<()> {
        self.refuse_beside_a_method()?;
        let began = Instant::now();
        let (spec, fabric) = (self.stages.dials.cloth.give(self.input.spec()?)?, self.stages.dials.cloth.first()?);
        if !spec.over.is_empty() {
            return Err(UserError::new(format!(
                "--method {}: found {} garments over each other, expected one: it keeps no cloth off cloth",
                self.method,
                1 + spec.over.len()
            )));
        }
        self.sinks.refuse_unwritable(&spec.garment_name())?;
        let loaded = self.input.load(&spec)?;
        self.stages.dials.cloth.check_used(&loaded)?;
        let load = began.elapsed();
        let sewn = loaded.tailored.as_ref().map(|tailored| &tailored.put_on.garment);
        let method = methods::by_name(self.method, !self.sinks.sinks("").is_empty(), sewn);
        let method = method.with_context(|| format!("there is no method {}", self.method))?;
        let scene = loaded.scene.clone();
        let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(&fabric), &scene.held)?;
        let fabric = &cloth.fabrics[0];
        let dressing = MethodInput { scene: &scene, fabric, cloth: &cloth };
        let bar = console::progress(None, self.method);
        let (mut kept, mut meshes): (Vec<Kept>, f64) = (Vec::new(), 0.0);
        interrupt::keep();
        let drape = method.drape(&dressing, &RestRule::default(), &mut |moment| {
            let due = moment.time_s > MESH_S * (meshes - 1e-6);
            meshes += f64::from(u8::from(due));
            let mesh = due.then(|| moment.positions.to_vec());
            kept.push((moment.step, moment.rms_speed_m_per_s, mesh));
            let speed = 100.0 * moment.rms_speed_m_per_s;
            bar.set_message(format!("{}: {}, {:.2} s, {speed:.1} cm/s", self.method, moment.stage, moment.time_s));
            interrupt::go_on()
        });
        bar.finish_and_clear();
        let drape = drape.map_err(|e| UserError::new(e.to_string()))?;
        let measured = Instant::now();
        let (metrics, fit) = MethodMetrics::of(&dressing, &drape);
        let certificate = self.certify.then(|| certify(&scene, fabric, &drape.positions)).transpose()?;
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        let mut timings = vec![("load", ms(load))];
        timings.extend(drape.times.iter().map(|(name, time)| (*name, ms(*time))));
        timings.extend([("method", ms(drape.total)), ("measure", ms(measured.elapsed()))]);
        let mut warnings = [loaded.warnings(), metrics.warnings(&dressing), fabric.warnings()].concat();
        if scene.let_go && !scene.held.is_empty() {
            warnings.push(format!("{} does not let go: what is held stays held", self.method));
        }
        let recorded = Instant::now();
        let (loaded, drape, metrics) = (&loaded, &drape, &metrics);
        let made =
            Made { loaded, drape, metrics, fit: &fit, fabric, kept: &kept, timings_ms: &timings, warnings: &warnings };
        let recorder = self.record_method(&made)?;
        timings.push(("record", ms(recorded.elapsed())));
        let mut outputs = Vec::new();
        if let Some(path) = &self.export {
            loaded.write(path, &drape.positions)?;
            outputs.push(format!("displaced garment: {}", path.display()));
        }
        let mut served = Some(recorder);
        if let Some(recorder) = served.take_if(|recorder| recorder.web_url().is_none()) {
            outputs.extend(recorder.finish()?.file_line());
        }
        timings.push(("total", ms(began.elapsed())));
        console::notes(&[loaded.notes(), drape.notes.clone()].concat());
        console::warnings(&warnings);
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            command_line: command_line(),
            body: &loaded.body_name,
            garment: &loaded.garment_name,
            method: self.method,
            fabric: &fabric.name,
            metrics,
            counts: drape.counts.iter().copied().collect(),
            timings_ms: timings.iter().copied().collect(),
            notes: &drape.notes,
            warnings,
            certificate: certificate.as_ref(),
            outputs,
        };
        match self.format {
            Format::Json => console::result(&crate::base::error_text::json(&report)?),
            Format::Text => {
                console::result(&report.text(drape, &timings));
                certified::print(certificate.as_ref());
            }
        }
        served.map_or(Ok(()), show)?;
        certified::verified(certificate.as_ref())
    }

    fn record_method(&self, made: &Made<'_>) -> anyhow::Result<Recorder> {
        let loaded = made.loaded;
        let overlays = [
            Overlay { name: "strain", unit: "%", values: &made.fit.strain_percent },
            Overlay { name: "pressure", unit: "kPa", values: &made.fit.pressure_kpa },
        ];
        let exhibits: Vec<String> = made.drape.exhibits.iter().map(|(name, _)| (*name).to_owned()).collect();
        let mut recorder = Recorder::open(RecordOptions {
            sinks: self.sinks.sinks(&loaded.garment_name),
            name: format!("{} by {}", loaded.garment_name, self.method),
            layout: Layout {
                iterations: true,
                method: Some(exhibits),
                fit: overlays.iter().map(|o| o.name.to_owned()).collect(),
                ..Layout::default()
            },
            replaceable: false,
            front: self.sinks.seen_from.direction(),
        })?;
        recorder.body(0, loaded.scene.body.mesh())?;
        recorder.garment(0, &loaded.scene.garment)?;
        for (step, speed, mesh) in made.kept {
            // The mesh every so often; speed at every step.
            let step = i64::try_from(*step).unwrap_or(i64::MAX);
            if !self.no_iterations {
                recorder.time_step(step, *speed, mesh.as_deref())?;
            }
        }
        let facts = [("method".to_owned(), self.method.to_owned())];
        let counts = made.drape.counts.iter().map(|(name, count)| ((*name).to_owned(), count.to_string()));
        let found = made.metrics.findings().into_iter().map(|(name, value)| (name.to_owned(), value));
        let notes = made.drape.notes.iter().map(|note| ("note".to_owned(), note.clone()));
        let panel = Panel {
            title: format!("{} on {}, by {}", loaded.garment_name, loaded.body_name, self.method),
            facts: facts.into_iter().chain(counts).chain(found).chain(notes).collect(),
            fabric: fabric_facts(made.fabric),
            timings_ms: made.timings_ms.iter().map(|(name, ms)| ((*name).to_owned(), *ms)).collect(),
            warnings: made.warnings.to_vec(),
            command_line: command_line(),
            ..Panel::default()
        };
        recorder.method(&MethodView {
            exhibits: &made.drape.exhibits,
            draped: &made.drape.positions,
            steps: made.drape.steps,
            panel: &panel,
            overlays: &overlays,
        })?;
        Ok(recorder)
    }
}

/// What there is to record.
struct Made<'a> {
    loaded: &'a Loaded,
    drape: &'a MethodDrape,
    metrics: &'a MethodMetrics,
    fit: &'a Fit,
    fabric: &'a Fabric,
    kept: &'a [Kept],
    timings_ms: &'a [(&'static str, f64)],
    warnings: &'a [String],
}

impl Report<'_> {
    /// For the terminal.
    fn text(&self, drape: &MethodDrape, timings_ms: &[(&'static str, f64)]) -> String {
        let MethodMetrics { vertices, triangles, .. } = self.metrics;
        let mut out = format!("{} on {}: {vertices} vertices, {triangles} triangles\n", self.garment, self.body);
        let _ = writeln!(out, "{:<20}{} in {}", "method", self.method, self.fabric);
        for (name, value) in self.metrics.findings() {
            let _ = writeln!(out, "{name:<20}{value}");
        }
        let counts: Vec<String> = drape.counts.iter().map(|(name, count)| format!("{name} {count}")).collect();
        let _ = writeln!(out, "{:<20}{}", "counted", counts.join(", "));
        out + &ended(timings_ms.iter().copied(), &self.outputs)
    }
}
