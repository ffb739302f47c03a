//! `--method`: a garment draped by one of the paper's reference methods, recorded and summarised like the two-stage drape.

use std::time::{Duration, Instant};

use crate::DVec3;
use crate::garment::fabric::Fabric;
use crate::mechanics::energy::Cloth;
use crate::mechanics::fit::Fit;
use crate::mechanics::methods::{self, MethodDrape, MethodInput, RestRule};
use crate::record::{Layout, MethodView, Overlay, Panel, RecordOptions, Recorder};
use crate::scene::Loaded;
use crate::study::certificate::{Certificate, certify};
use crate::study::metrics::MethodMetrics;
use anyhow::Context as _;
use indexmap::IndexMap;
use serde::Serialize;

use super::{RunArgs, TWO_STAGE, serve};
use crate::commands::console::{self, Format};
use crate::commands::runtime::{UserError, control_flow, keep_results, refuse};
use crate::commands::summary::{command_line, ending, fabric_facts, heading, print_certificate, require_pass};

/// Interval, in s of simulated time, at which the mesh is recorded. A smaller interval gives a smoother animation and a larger file;
/// this one, a heuristic, keeps a recording at a few megabytes.
const MESH_INTERVAL_S: f64 = 0.05;

/// A drape by a reference method, for the recording.
struct Draped<'a> {
    loaded: &'a Loaded,
    drape: &'a MethodDrape,
    fit: &'a Fit,
    fabric: &'a Fabric,
    moments: &'a [Moment],
}

/// The state of the cloth after one time step.
struct Moment {
    step: usize,
    rms_speed_m_per_s: f64,
    /// Positions, m; present in some steps only.
    positions: Option<Vec<DVec3>>,
}

/// The result. Field names are the keys of `--format json`.
#[derive(Serialize)]
struct Report<'a> {
    version: &'static str,
    command_line: String,
    body: &'a str,
    garment: &'a str,
    method: &'static str,
    fabric: &'a str,
    #[serde(flatten)]
    metrics: MethodMetrics,
    /// Tests, elements and iterations, as counted by the method.
    counts: IndexMap<&'static str, u64>,
    /// Milliseconds of `load`, of each part of the method, of the whole `method`, of `measure`, `record` and `total`.
    timings_ms: IndexMap<&'static str, f64>,
    notes: &'a [String],
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<Certificate>,
    outputs: Vec<String>,
}

impl RunArgs {
    /// Refuses flags that act on PARTs or on the two-stage solver.
    fn check_method_flags(&self) -> anyhow::Result<()> {
        let of_run = [
            ("--accuracy", self.accuracy),
            ("--spread", self.spread > 0),
            ("--cache", self.cache.is_some()),
            ("--watch", self.watch),
            ("--export-colours", self.export_colours.is_some()),
        ];
        let mut given: Vec<&str> = of_run.into_iter().filter(|(_, given)| *given).map(|(flag, _)| flag).collect();
        given.extend(self.stages.two_stage_flags());
        if !given.is_empty() {
            let (method, given) = (self.method, given.join(", "));
            refuse!(
                "--method {method}: found {given}, which only {TWO_STAGE} supports; omit it, or use --method {TWO_STAGE}"
            );
        }
        Ok(())
    }

    /// Drapes by the reference method.
    pub(super) fn run_method(&self) -> anyhow::Result<()> {
        self.check_method_flags()?;
        let began = Instant::now();
        let fabric_args = &self.stages.model.fabric;
        let (spec, fabric) = (fabric_args.assign(self.input.spec()?)?, fabric_args.first()?);
        if !spec.over.is_empty() {
            let (method, garments) = (self.method, 1 + spec.over.len());
            refuse!(
                "--method {method}: found {garments} garments in layers, expected one: it has no contact of cloth with cloth"
            );
        }
        self.sinks.refuse_unwritable(&spec.garment_name())?;
        let loaded = self.input.load(&spec)?;
        fabric_args.check_used(&loaded)?;
        let mut timings_ms = IndexMap::new();
        let mut add_time = |name, time: Duration| {
            timings_ms.insert(name, 1e3 * time.as_secs_f64());
        };
        add_time("load", began.elapsed());
        let sewn = loaded.tailored.as_ref().map(|tailored| &tailored.put_on.garment);
        let method = methods::by_name(self.method, !self.sinks.sinks("").is_empty(), sewn);
        let method = method.with_context(|| format!("there is no method {}", self.method))?;
        let scene = &loaded.scene;
        let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &scene.fabrics(&fabric), &scene.held)?;
        let fabric = &cloth.fabrics[0];
        let input = MethodInput { scene, fabric, cloth: &cloth };
        let bar = console::progress(None, self.method);
        let (mut moments, mut meshes): (Vec<Moment>, f64) = (Vec::new(), 0.0);
        keep_results();
        let drape = method.drape(&input, &RestRule::default(), &mut |moment| {
            let due = moment.time_s > MESH_INTERVAL_S * (meshes - 1e-6);
            meshes += f64::from(u8::from(due));
            let positions = due.then(|| moment.positions.to_vec());
            let (step, rms_speed_m_per_s) = (moment.step, moment.rms_speed_m_per_s);
            moments.push(Moment { step, rms_speed_m_per_s, positions });
            let speed = 100.0 * rms_speed_m_per_s;
            bar.set_message(format!("{}: {}, {:.2} s, {speed:.1} cm/s", self.method, moment.stage, moment.time_s));
            control_flow()
        });
        bar.finish_and_clear();
        let drape = drape.map_err(|e| UserError(e.to_string()))?;
        let measuring = Instant::now();
        let (metrics, fit) = MethodMetrics::of(&input, &drape);
        let certificate = self.certify.then(|| certify(scene, fabric, &drape.positions)).transpose()?;
        drape.times.iter().for_each(|(name, time)| add_time(name, *time));
        add_time("method", drape.total);
        add_time("measure", measuring.elapsed());
        let mut warnings = [loaded.warnings(), metrics.warnings(&input), fabric.warnings()].concat();
        if scene.releases_held && !scene.held.is_empty() {
            warnings.push(format!("{} does not release held edges: they stay held", self.method));
        }
        let mut report = Report {
            version: env!("CARGO_PKG_VERSION"),
            command_line: command_line(),
            body: &loaded.body_name,
            garment: &loaded.garment_name,
            method: self.method,
            fabric: &fabric.name,
            metrics,
            counts: drape.counts.iter().copied().collect(),
            timings_ms,
            notes: &drape.notes,
            warnings,
            certificate,
            outputs: Vec::new(),
        };
        let recording = Instant::now();
        let draped = Draped { loaded: &loaded, drape: &drape, fit: &fit, fabric, moments: &moments };
        let mut served = Some(self.record_method(&draped, &report)?);
        report.timings_ms.insert("record", 1e3 * recording.elapsed().as_secs_f64());
        if let Some(path) = &self.export {
            loaded.write_with(path, &drape.positions, None, self.export_body)?;
            report.outputs.push(format!("draped garment: {}", path.display()));
        }
        if let Some(recorder) = served.take_if(|recorder| recorder.web_url().is_none()) {
            report.outputs.extend(recorder.finish()?.file_line());
        }
        report.timings_ms.insert("total", 1e3 * began.elapsed().as_secs_f64());
        match self.format {
            Format::Json => console::json(&report)?,
            Format::Text => {
                console::prose(&report.text());
                print_certificate(report.certificate.as_ref());
            }
        }
        console::notes(&[loaded.notes(), drape.notes.clone()].concat());
        console::warnings(&report.warnings);
        served.map_or(Ok(()), serve)?;
        require_pass(report.certificate.as_ref())
    }

    fn record_method(&self, draped: &Draped<'_>, report: &Report<'_>) -> anyhow::Result<Recorder> {
        let Draped { loaded, drape, fit, fabric, moments } = draped;
        let overlays = [
            Overlay { name: "strain", unit: "%", values: &fit.strain_percent, positions: None },
            Overlay { name: "pressure", unit: "kPa", values: &fit.pressure_kpa, positions: None },
        ];
        let mut recorder = Recorder::open(RecordOptions {
            sinks: self.sinks.sinks(&loaded.garment_name),
            name: format!("{} by {}", loaded.garment_name, self.method),
            layout: Layout {
                iterations: true,
                method: Some(drape.exhibits.iter().map(|(name, _)| (*name).to_owned()).collect()),
                fit: overlays.iter().map(|o| o.name.to_owned()).collect(),
                ..Layout::default()
            },
            replaceable: false,
            front: self.sinks.seen_from.direction(),
        })?;
        recorder.body(0, loaded.scene.body.mesh())?;
        recorder.garment(0, &loaded.scene.garment)?;
        for moment in moments.iter().filter(|_| !self.no_iterations) {
            let step = i64::try_from(moment.step).unwrap_or(i64::MAX);
            recorder.time_step(step, moment.rms_speed_m_per_s, moment.positions.as_deref())?;
        }
        let method = std::iter::once(("method", self.method.to_owned()));
        let counts = report.counts.iter().map(|(name, count)| (*name, count.to_string()));
        let notes = drape.notes.iter().map(|note| ("note", note.clone()));
        let facts = method.chain(counts).chain(report.metrics.findings()).chain(notes);
        let panel = Panel {
            title: format!("{} on {}, by {}", loaded.garment_name, loaded.body_name, self.method),
            facts: facts.map(|(name, value)| (name.to_owned(), value)).collect(),
            fabric: fabric_facts(fabric),
            timings_ms: report.timings_ms.iter().map(|(name, ms)| ((*name).to_owned(), *ms)).collect(),
            warnings: report.warnings.clone(),
            command_line: command_line(),
            ..Panel::default()
        };
        recorder.method(&MethodView {
            exhibits: &drape.exhibits,
            draped: &drape.positions,
            steps: drape.steps,
            panel: &panel,
            overlays: &overlays,
        })?;
        Ok(recorder)
    }
}

impl Report<'_> {
    /// Text for the terminal.
    fn text(&self) -> String {
        let method = std::iter::once(("method", format!("{} in {}", self.method, self.fabric)));
        let counts = self.counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ");
        let lines = method.chain(self.metrics.findings()).chain([("counts", counts)]);
        heading(self.garment, self.body, (self.metrics.vertices, self.metrics.triangles), lines)
            + &ending(self.timings_ms.iter().map(|(name, ms)| (*name, *ms)), &self.outputs)
    }
}
