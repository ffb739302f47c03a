//! The summary of a run, in three forms: text for the terminal, JSON for scripts, the text panel of the recording; and the
//! certificate of a drape.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use crate::Settings;
use crate::base::files::listed;
use crate::drape::Drape;
use crate::garment::fabric::Fabric;
use crate::record::Panel;
use crate::scene::{Loaded, Swatch};
use crate::study::accuracy::Accuracy;
use crate::study::certificate::Certificate;
use crate::study::job::Measured;
use crate::study::metrics::{GirthEase, LevelCount, Metrics, RESTS};
use serde::Serialize;
use serde_json::{Map, Value};

use super::console;
use super::runtime::BadVerdict;

/// The summary of one draped garment. Field names are the keys of `--format json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Summary {
    version: &'static str,
    command_line: String,
    body: String,
    garment: String,
    model: &'static str,
    motion: &'static str,
    fabric: String,
    /// The panels of each fabric, if fabrics were assigned.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cut: Vec<Swatch>,
    /// The constants of all fabrics, for the panel.
    #[serde(skip)]
    fabrics: Vec<Fabric>,
    table: String,
    #[serde(flatten)]
    pub(crate) metrics: Metrics,
    /// Repairs of the garment's mesh, after which its PARTs are counted.
    repairs: Vec<String>,
    parts_per_level: Vec<usize>,
    level_bounds_cm: Vec<[Option<f64>; 2]>,
    vertices_per_level: Vec<usize>,
    #[serde(skip)]
    levels: Vec<LevelCount>,
    /// Garment and body at bust, waist, hip and hem.
    ease: Vec<GirthEase>,
    /// The change since the previous save, under `--watch`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) since_last: Option<String>,
    /// The result of releasing held edges.
    release: Option<String>,
    /// The errors against the drape's own continuation, under `--accuracy`.
    accuracy: Option<Value>,
    /// Milliseconds of `load`, `sew`, `carry`, `distance`, `segment`, `mechanics`, `refine`, `other`, `measure`, `certify`, `record`, `picture`, and `total`.
    timings_ms: BTreeMap<&'static str, f64>,
    pub(crate) warnings: Vec<String>,
    /// The certificate, under `--certify`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) certificate: Option<Certificate>,
    /// The files written.
    pub(crate) outputs: Vec<String>,
}

impl Summary {
    /// The summary of a result.
    pub(crate) fn new(
        loaded: &Loaded,
        settings: &Settings,
        drape: &Drape,
        measured: &Measured,
    ) -> anyhow::Result<Self> {
        let levels = LevelCount::all(&drape.table, &drape.parts);
        let finite = |x: f64| x.is_finite().then_some(x);
        let accuracy = measured.evaluation.as_ref().map(|a| without_state(&a.accuracy)).transpose()?;
        let ease = measured.ease.clone();
        let mut warnings = [loaded.warnings(), drape.warnings.clone(), measured.warnings.clone()].concat();
        if measured.metrics.is_torn() {
            let small = ease.iter().filter(|e| e.ease_cm.is_some_and(|cm| cm < 0.0));
            let small: Vec<String> =
                small.map(|e| format!("at the {} by {:.0} cm", e.at, -e.ease_cm.unwrap_or_default())).collect();
            if !small.is_empty() {
                warnings.push(format!("the garment is too small {}", listed(&small)));
            }
        }
        let mut summary = Self {
            version: env!("CARGO_PKG_VERSION"),
            command_line: command_line(),
            body: loaded.body_name.clone(),
            garment: loaded.garment_name.clone(),
            model: settings.model.name(),
            motion: settings.model.motion().name(),
            fabric: loaded.scene.fabric_names(&settings.fabric),
            cut: loaded.swatches.iter().map(|swatch| swatch.cut_from(&settings.fabric)).collect(),
            fabrics: loaded.scene.fabrics(&settings.fabric),
            table: drape.table.name.clone(),
            metrics: measured.metrics.clone(),
            repairs: loaded.repairs().iter().map(ToString::to_string).collect(),
            parts_per_level: levels.iter().map(|l| l.parts).collect(),
            level_bounds_cm: levels.iter().map(|l| [finite(l.lower_cm), finite(l.upper_cm)]).collect(),
            vertices_per_level: levels.iter().map(|l| l.vertices).collect(),
            levels,
            ease,
            since_last: None,
            release: drape.release.map(|release| release.to_string()),
            accuracy,
            timings_ms: BTreeMap::new(),
            warnings,
            certificate: None,
            outputs: Vec::new(),
        };
        let times = drape.times;
        let stages = [
            ("distance", times.distance),
            ("segment", times.segment),
            ("cloth", times.cloth),
            ("mechanics", times.mechanics),
            ("refine", times.refine),
            ("other", times.other()),
        ];
        stages.into_iter().for_each(|(stage, time)| summary.add_time(stage, time));
        Ok(summary)
    }

    /// The name of the body.
    pub(crate) fn body(&self) -> &str {
        &self.body
    }

    /// Fails, for exit code 3, unless the verdict and every criterion of the certificate are good.
    pub(crate) fn require_good(&self) -> anyhow::Result<()> {
        let failing = self.certificate.iter().flat_map(|c| &c.findings).filter(|f| !f.passes).map(|f| f.name);
        let failing: Vec<&str> = failing.collect();
        let certified =
            if failing.is_empty() { String::new() } else { format!("; not certified: {}", failing.join(", ")) };
        if self.metrics.verdict == RESTS && failing.is_empty() {
            return Ok(());
        }
        Err(BadVerdict(format!(
            "--strict: found \"{}\"{certified}, expected a garment that rests",
            self.metrics.verdict
        ))
        .into())
    }

    /// Adds time to a stage and to the total, which is the sum of all.
    pub(crate) fn add_time(&mut self, stage: &'static str, time: Duration) {
        for name in [stage, "total"] {
            *self.timings_ms.entry(name).or_default() += time.as_secs_f64() * 1e3;
        }
    }

    /// Text for the terminal, up to the verdict.
    pub(crate) fn text(&self) -> String {
        let Self { metrics, table, model, motion, fabric, .. } = self;
        let (levels, singletons) = (metrics.levels, metrics.singletons);
        let mut parts =
            format!("table {table}: {} in {levels} levels, {singletons} single vertices", metrics.parts_text());
        if !self.repairs.is_empty() {
            let _ = write!(parts, ", counted after repairs of the mesh: {}", self.repairs.join("; "));
        }
        let (contact, moved) = (metrics.contact_parts, metrics.displacement_rms_mm);
        let moved = format!("{contact} PARTs touch the body, displacement {moved:.1} mm RMS");
        let two = format!("model {model}, motion {motion}, fabric {fabric}: {moved}");
        let stages = [("stage one", parts), ("stage two", two)].into_iter();
        let released = self.release.iter().map(|released| ("released edges", released.clone()));
        let lines = stages.chain(released).chain(metrics.findings()).chain(self.since_last());
        let mut out = heading(&self.garment, &self.body, (metrics.vertices, metrics.triangles), lines);
        let _ = writeln!(out, "\n{}", self.levels_table());
        if self.covered().next().is_some() {
            let _ = writeln!(out, "{}", self.ease_table());
        }
        out + &ending(self.times(), &self.outputs)
    }

    /// The verdict, the last line for the terminal.
    pub(crate) fn verdict(&self) -> String {
        self.metrics.verdict_line()
    }

    fn since_last(&self) -> impl Iterator<Item = (&'static str, String)> {
        self.since_last.iter().map(|since| ("since the last save", since.clone()))
    }

    /// The text panel of the recording.
    pub(crate) fn panel(&self) -> Panel {
        let of_model = [("model", self.model.to_owned()), ("motion", self.motion.to_owned())];
        let ease: Vec<String> = self.covered().map(|(e, _, cm)| format!("{} {cm:+.1} cm", e.at)).collect();
        let ease = (!ease.is_empty()).then(|| ("ease", ease.join(", ")));
        let facts = of_model.into_iter().chain(self.metrics.facts()).chain(ease);
        let facts = facts.chain(self.since_last());
        Panel {
            title: format!("{} on {}", self.garment, self.body),
            table: self.table.clone(),
            levels: self.levels.clone(),
            facts: facts.map(|(name, value)| (name.to_owned(), value)).collect(),
            fabric: self.fabrics.iter().flat_map(fabric_facts).chain(self.cut.iter().map(swatch_fact)).collect(),
            // The time of the recording is unknown while it is written.
            timings_ms: self
                .times()
                .filter(|(stage, _)| *stage != "record")
                .map(|(s, ms)| (s.to_owned(), ms))
                .collect(),
            warnings: self.warnings.clone(),
            command_line: self.command_line.clone(),
        }
    }

    /// Milliseconds of the stages that ran, in their order.
    fn times(&self) -> impl Iterator<Item = (&'static str, f64)> {
        [
            "load",
            "sew",
            "carry",
            "distance",
            "segment",
            "cloth",
            "mechanics",
            "refine",
            "other",
            "measure",
            "record",
            "picture",
            "total",
        ]
        .into_iter()
        .filter_map(|stage| Some((stage, *self.timings_ms.get(stage)?)))
    }

    /// The girths at which the garment surrounds the body: garment girth and ease, cm.
    fn covered(&self) -> impl Iterator<Item = (&GirthEase, f64, f64)> {
        self.ease.iter().filter_map(|ease| Some((ease, ease.garment_cm?, ease.ease_cm?)))
    }

    fn ease_table(&self) -> String {
        let header = ["at", "height cm", "body cm", "garment as cut cm", "ease cm", ""];
        let rows = self.covered().map(|(ease, garment_cm, ease_cm)| {
            let [height, body, mut garment] = [ease.height_cm, ease.body_cm, garment_cm].map(|cm| format!("{cm:.1}"));
            if let Some(under) = ease.garment_height_cm.filter(|cm| cm + 0.5 < ease.height_cm) {
                garment = format!("{garment}, under the sleeves at {under:.1}");
            }
            let fit = if ease_cm < 0.0 { format!("too small by {:.1} cm", -ease_cm) } else { String::new() };
            [ease.at.to_owned(), height, body, garment, format!("{ease_cm:+.1}"), fit]
        });
        let columns = if self.covered().any(|(_, _, cm)| cm < 0.0) { 6 } else { 5 };
        let rows = rows.map(|row| row.into_iter().take(columns).collect::<Vec<String>>());
        console::table(console::RULED, header.into_iter().take(columns), 1..5, rows)
    }

    fn levels_table(&self) -> String {
        let bound = |cm: f64| if cm.is_finite() { format!("{cm}") } else { "∞".to_owned() };
        let rows = self.levels.iter().filter(|l| l.vertices > 0).map(|l| {
            let [lower, upper] = [l.lower_cm, l.upper_cm].map(bound);
            [l.level.to_string(), lower, upper, l.parts.to_string(), l.vertices.to_string()]
        });
        console::table(console::RULED, ["level", "from cm", "to cm", "PARTs", "vertices"], 0.., rows)
    }
}

/// The first lines of a run's text: garment, body, (vertices, triangles), then a line for each name and value.
pub(crate) fn heading(
    garment: &str,
    body: &str,
    (vertices, triangles): (usize, usize),
    lines: impl Iterator<Item = (&'static str, String)>,
) -> String {
    let first = format!("{garment} on {body}: {vertices} vertices, {triangles} triangles\n");
    lines.fold(first, |text, (name, value)| text + &format!("{name:<20}{value}\n"))
}

/// The last lines of a run's text: its times and the files written.
pub(crate) fn ending(times_ms: impl Iterator<Item = (&'static str, f64)>, outputs: &[String]) -> String {
    let times: Vec<String> = times_ms.map(|(stage, ms)| format!("{stage} {ms:.1}")).collect();
    let times = format!("milliseconds: {}\n", times.join(", "));
    outputs.iter().fold(times, |text, output| text + output + "\n")
}

/// The JSON of an accuracy without the state of the drape, which the metrics contain under the same keys.
fn without_state(accuracy: &Accuracy) -> serde_json::Result<Value> {
    let mut all: Map<String, Value> = serde_json::from_value(serde_json::to_value(accuracy)?)?;
    let state: Map<String, Value> = serde_json::from_value(serde_json::to_value(accuracy.state)?)?;
    all.retain(|key, _| !state.contains_key(key));
    Ok(Value::Object(all))
}

/// The command line, the program by its bare name.
pub(crate) fn command_line() -> String {
    // File names need not be Unicode.
    let typed = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    let arguments = typed.map(|a| if a.contains(' ') { format!("'{a}'") } else { a });
    std::iter::once("partwise".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn swatch_fact(cut: &Swatch) -> (String, String) {
    let panels = if cut.panels.is_empty() { String::new() } else { format!(": {}", listed(&cut.panels)) };
    (format!("cut from {}", cut.fabric.as_deref().unwrap_or_default()), format!("{}{panels}", cut.garment))
}

pub(crate) fn fabric_facts(fabric: &Fabric) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let [weft, bias, warp] = fabric.bending_nm.map(|b| b * 1e6);
    let [stretch_weft, stretch_warp] = [fabric.stretch_weft_n_per_m, fabric.stretch_warp_n_per_m];
    vec![
        fact("name", fabric.name.clone()),
        fact("density", format!("{} kg/m²", fabric.density_kg_per_m2)),
        fact("stretch, weft and warp", format!("{stretch_weft} and {stretch_warp} N/m")),
        fact("shear", format!("{} N/m", fabric.shear_n_per_m)),
        fact("bending, weft, bias, warp", format!("{weft:.0}, {bias:.0}, {warp:.0} µN·m")),
        fact("thickness", format!("{:.2} mm", 1e3 * fabric.thickness_m)),
        fact("friction", fabric.friction.to_string()),
    ]
}

/// Prints a certificate as a table.
pub(crate) fn print_certificate(certificate: Option<&Certificate>) {
    let Some(certificate) = certificate else { return };
    let number = |x: f64| {
        if x != 0.0 && !(0.01..1e5).contains(&x.abs()) {
            return format!("{x:.2e}");
        }
        let text = format!("{x:.*}", if x.abs() < 10.0 { 3 } else { 1 });
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let rows = certificate.findings.iter().map(|f| {
        let passes = if f.passes { "passes" } else { "FAILS" };
        let text = [f.name, passes, &number(f.value), &number(f.limit), f.unit, &f.remark];
        text.map(str::to_owned)
    });
    let table = console::table(console::RULED, ["criterion", "", "value", "limit", "unit", "remark"], 2..4, rows);
    let verdict = if certificate.passes { "certified: the drape is in equilibrium" } else { "not certified" };
    console::prose(&format!("{table}\n{verdict}"));
}

/// Fails if a criterion of the certificate fails, so that the program exits with 1.
pub(crate) fn require_pass(certificate: Option<&Certificate>) -> anyhow::Result<()> {
    let failed = certificate.map_or(0, |c| c.findings.iter().filter(|f| !f.passes).count());
    anyhow::ensure!(failed == 0, "not certified: {failed} criteria fail");
    Ok(())
}
