//! What a run did, once, for three readers: a person at the terminal, a script, the recording's text panel.

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
use crate::study::metrics::{GirthEase, LevelCount, Metrics};
use comfy_table::Table;
use serde::Serialize;
use serde_json::{Map, Value};

use super::console;

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
    /// Which garment or panel is cut from which, where that was said.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cut: Vec<Swatch>,
    /// Constants of all of them, for people.
    #[serde(skip)]
    fabrics: Vec<Fabric>,
    table: String,
    #[serde(flatten)]
    pub(crate) metrics: Metrics,
    parts_per_level: Vec<usize>,
    level_bounds_cm: Vec<[Option<f64>; 2]>,
    vertices_per_level: Vec<usize>,
    #[serde(skip)]
    levels: Vec<LevelCount>,
    /// Garment and body at bust, waist and hip.
    ease: Vec<GirthEase>,
    /// What has changed since the save before, under `--watch`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) since_last: Option<String>,
    /// What came of letting go what was held until it rested.
    let_go: Option<String>,
    /// Every figure against the own continuation, under `--accuracy`.
    accuracy: Option<Value>,
    /// Milliseconds of `load`, `sew`, `distance`, `segment`, `mechanics`, `refine`, `other`, `measure`, `certify`, `record`, and `total`.
    timings_ms: BTreeMap<&'static str, f64>,
    pub(crate) warnings: Vec<String>,
    /// What was certified, where that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) certificate: Option<Certificate>,
    /// Where the recording went.
    pub(crate) outputs: Vec<String>,
}

impl Summary {
    /// Reads the figures off a result.
    pub(crate) fn new(
        loaded: &Loaded,
        settings: &Settings,
        drape: &Drape,
        measured: &Measured,
    ) -> anyhow::Result<Self> {
        let levels = LevelCount::all(&drape.table, &drape.parts);
        let finite = |x: f64| x.is_finite().then_some(x);
        let accuracy = measured.evaluation.as_ref().map(|a| without_state(&a.accuracy)).transpose()?;
        let warnings = [loaded.warnings(), drape.warnings.clone(), measured.warnings.clone()].concat();
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
            parts_per_level: levels.iter().map(|l| l.parts).collect(),
            level_bounds_cm: levels.iter().map(|l| [finite(l.lower_cm), finite(l.upper_cm)]).collect(),
            vertices_per_level: levels.iter().map(|l| l.vertices).collect(),
            levels,
            ease: GirthEase::all(&loaded.scene, loaded.girths_at_m, &drape.positions),
            since_last: None,
            let_go: drape.let_go.map(|let_go| let_go.to_string()),
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
            ("mechanics", times.mechanics),
            ("refine", times.refine),
            ("other", times.other()),
        ];
        stages.into_iter().for_each(|(stage, time)| summary.add_time(stage, time));
        Ok(summary)
    }

    /// Adds time to a stage and to the total, which is the sum of all.
    pub(crate) fn add_time(&mut self, stage: &'static str, time: Duration) {
        for name in [stage, "total"] {
            *self.timings_ms.entry(name).or_default() += time.as_secs_f64() * 1e3;
        }
    }

    pub(crate) fn json(&self) -> anyhow::Result<String> {
        Ok(crate::base::error_text::json(self)?)
    }

    /// For the terminal.
    pub(crate) fn text(&self) -> String {
        let metrics = &self.metrics;
        let (vertices, triangles) = (metrics.vertices, metrics.triangles);
        let mut out = format!("{} on {}: {vertices} vertices, {triangles} triangles\n", self.garment, self.body);
        let (table, parts, levels, singletons) =
            (&self.table, metrics.parts_text(), metrics.levels, metrics.singletons);
        let stage_one = format!("table {table}: {parts} in {levels} levels, {singletons} of them single vertices");
        let _ = writeln!(out, "{:<20}{stage_one}", "stage one");
        let _ = writeln!(
            out,
            "{:<20}model {}, motion {}, fabric {}: {} PARTs touch the body, displacement {:.1} mm RMS",
            "stage two", self.model, self.motion, self.fabric, metrics.contact_parts, metrics.displacement_rms_mm
        );
        if let Some(let_go) = &self.let_go {
            let _ = writeln!(out, "{:<20}{let_go}", "let go");
        }
        let since = self.since_last.iter().map(|since| ("since the last save", since.clone()));
        for (name, value) in metrics.findings().into_iter().chain(since) {
            let _ = writeln!(out, "{name:<20}{value}");
        }
        let _ = writeln!(out, "\n{}", self.levels_table());
        if self.covered().next().is_some() {
            let _ = writeln!(out, "{}", self.ease_table());
        }
        out + &ended(self.times(), &self.outputs)
    }

    /// For the recording's text panel.
    pub(crate) fn panel(&self) -> Panel {
        let of_model = [("model", self.model.to_owned()), ("motion", self.motion.to_owned())];
        let ease: Vec<String> = self.covered().map(|(e, _, cm)| format!("{} {cm:+.1} cm", e.at)).collect();
        let ease = (!ease.is_empty()).then(|| ("ease", ease.join(", ")));
        let facts = of_model.into_iter().chain(self.metrics.facts()).chain(ease);
        let facts = facts.chain(self.since_last.iter().map(|since| ("since the last save", since.clone())));
        Panel {
            title: format!("{} on {}", self.garment, self.body),
            table: self.table.clone(),
            levels: self.levels.clone(),
            facts: facts.map(|(name, value)| (name.to_owned(), value)).collect(),
            fabric: self.fabrics.iter().flat_map(fabric_facts).chain(self.cut.iter().map(swatch_fact)).collect(),
            // How long the recording takes is not known while it is made.
            timings_ms: self
                .times()
                .filter(|(stage, _)| *stage != "record")
                .map(|(s, ms)| (s.to_owned(), ms))
                .collect(),
            warnings: self.warnings.clone(),
            command_line: self.command_line.clone(),
        }
    }

    /// Milliseconds of the stages there were, in their order.
    fn times(&self) -> impl Iterator<Item = (&'static str, f64)> {
        ["load", "sew", "distance", "segment", "mechanics", "refine", "other", "measure", "record", "total"]
            .into_iter()
            .filter_map(|stage| Some((stage, *self.timings_ms.get(stage)?)))
    }

    /// Where the garment goes round the body: its girth and its ease, cm.
    fn covered(&self) -> impl Iterator<Item = (&GirthEase, f64, f64)> {
        self.ease.iter().filter_map(|ease| Some((ease, ease.garment_cm?, ease.ease_cm?)))
    }

    fn ease_table(&self) -> Table {
        let header = ["at", "height cm", "body cm", "garment as cut cm", "ease cm"];
        let mut table = console::table(console::RULED, header, 1..);
        for (ease, garment_cm, ease_cm) in self.covered() {
            let [height, body, mut garment] = [ease.height_cm, ease.body_cm, garment_cm].map(|cm| format!("{cm:.1}"));
            if let Some(under) = ease.garment_height_cm.filter(|cm| cm + 0.5 < ease.height_cm) {
                garment = format!("{garment}, under the sleeves at {under:.1}");
            }
            let lengths = [height, body, garment];
            table.add_row([ease.at.to_owned()].into_iter().chain(lengths).chain([format!("{ease_cm:+.1}")]));
        }
        table
    }

    fn levels_table(&self) -> Table {
        let mut table = console::table(console::RULED, ["level", "from cm", "to cm", "PARTs", "vertices"], 0..);
        let bound = |cm: f64| if cm.is_finite() { format!("{cm}") } else { "∞".to_owned() };
        for l in self.levels.iter().filter(|l| l.vertices > 0) {
            let cells = [l.level.to_string(), bound(l.lower_cm), bound(l.upper_cm)];
            table.add_row(cells.into_iter().chain([l.parts.to_string(), l.vertices.to_string()]));
        }
        table
    }
}

/// How a run for the terminal ends: its times, and what was written.
pub(crate) fn ended(times_ms: impl Iterator<Item = (&'static str, f64)>, outputs: &[String]) -> String {
    let times: Vec<String> = times_ms.map(|(stage, ms)| format!("{stage} {ms:.1}")).collect();
    let times = format!("milliseconds: {}\n", times.join(", "));
    outputs.iter().fold(times, |text, output| text + output + "\n")
}

/// An accuracy's JSON without the state of the drape, which the figures tell: one key, one meaning.
fn without_state(accuracy: &Accuracy) -> serde_json::Result<Value> {
    let mut all: Map<String, Value> = serde_json::from_value(serde_json::to_value(accuracy)?)?;
    let state: Map<String, Value> = serde_json::from_value(serde_json::to_value(accuracy.state)?)?;
    all.retain(|key, _| !state.contains_key(key));
    Ok(Value::Object(all))
}

/// The command line as typed, the program by its bare name.
pub(crate) fn command_line() -> String {
    // Names of files need not be Unicode.
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
