//! What a run did, once, for three readers: a person at the terminal, a script, the recording's text panel.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use comfy_table::{CellAlignment, Table, presets};
use partwise::accuracy::Accuracy;
use partwise::assess::Assessment;
use partwise::drape::{Drape, Scene, Settings};
use partwise::fabric::Fabric;
use partwise::range_table::{Extent, METRES_PER_CM};
use partwise::record::{LevelRow, Panel};
use serde::Serialize;

/// The summary of one draped garment. Field names are the keys of `--format json`.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Summary {
    version: &'static str,
    command_line: String,
    body: String,
    garment: String,
    model: &'static str,
    fabric: String,
    table: String,
    vertices: usize,
    triangles: usize,
    part_count: usize,
    level_part_count: usize,
    singleton_parts: usize,
    parts_per_level: Vec<usize>,
    level_bounds_cm: Vec<[Option<f64>; 2]>,
    /// Extents the table itself has, by level; none for one it leaves to the run.
    #[serde(skip)]
    level_extents: Vec<Option<Extent>>,
    vertices_per_level: Vec<usize>,
    hole_vertices: usize,
    unassigned_vertices: usize,
    contact_parts: usize,
    displacement_rms_mm: f64,
    energy_j: Option<f64>,
    residual_over_weight: Option<f64>,
    refine_steps: Option<usize>,
    strain_p95: Option<f64>,
    strain_max: Option<f64>,
    pressure_max_kpa: Option<f64>,
    self_intersecting_pairs: usize,
    /// Under `--accuracy`.
    accuracy: Option<Accuracy>,
    /// Spearman's rank correlation of the paper's wrinkle measure with the mean curvature, over the seams; under
    /// `--accuracy`.
    wrinkle_rank_correlation: Option<f64>,
    penetrating_vertices: usize,
    penetration_mm: f64,
    /// Milliseconds of `load`, `distance`, `segment`, `mechanics`, `record`.
    pub(crate) timings_ms: BTreeMap<&'static str, f64>,
    pub(crate) warnings: Vec<String>,
    /// Where the recording went.
    pub(crate) outputs: Vec<String>,
}

/// Milliseconds, for people.
pub(crate) fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

impl Summary {
    /// Reads the figures off a result.
    pub(crate) fn new(names: [&str; 2], scene: &Scene, settings: &Settings, drape: &Drape) -> Self {
        let levels = settings.table.effective_levels();
        let mut vertices_per_level = vec![0; levels.len()];
        for part in &drape.parts.parts {
            vertices_per_level[part.level as usize] += part.vertices.len();
        }
        let squares = drape.positions.iter().zip(&scene.garment.positions).map(|(a, b)| (*a - *b).length_squared());
        let rms = (squares.sum::<f64>() / drape.positions.len().max(1) as f64).sqrt();
        let finite = |x: f64| x.is_finite().then_some(x);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command_line: command_line(),
            body: names[0].to_owned(),
            garment: names[1].to_owned(),
            model: settings.model.name(),
            fabric: settings.fabric.name.clone(),
            table: settings.table.name.clone(),
            vertices: scene.garment.vertex_count(),
            triangles: scene.garment.triangles.len(),
            part_count: drape.parts.parts.len(),
            level_part_count: drape.level_part_count,
            singleton_parts: drape.parts.singletons,
            parts_per_level: drape.parts.parts_per_level.clone(),
            level_bounds_cm: levels.iter().map(|l| [finite(l.lower_cm), finite(l.upper_cm)]).collect(),
            level_extents: levels.iter().map(|l| l.extent).collect(),
            vertices_per_level,
            hole_vertices: drape.parts.hole_vertices,
            unassigned_vertices: drape.parts.unassigned,
            contact_parts: drape.outcomes.iter().filter(|o| o.contact).count(),
            displacement_rms_mm: 1e3 * rms,
            energy_j: drape.state.as_ref().map(|s| s.energy),
            residual_over_weight: drape.state.as_ref().map(|s| s.residual_over_weight),
            refine_steps: drape.state.as_ref().map(|s| s.steps),
            strain_p95: drape.state.as_ref().map(|s| 1e-2 * s.fit.strain_p95_percent),
            strain_max: drape.state.as_ref().map(|s| 1e-2 * s.fit.strain_max_percent),
            pressure_max_kpa: drape.state.as_ref().map(|s| s.fit.pressure_max_kpa),
            self_intersecting_pairs: drape.self_intersecting_pairs,
            accuracy: None,
            wrinkle_rank_correlation: None,
            penetrating_vertices: drape.penetrating_vertices,
            penetration_mm: 1e3 * drape.penetration,
            timings_ms: BTreeMap::from([
                ("distance", ms(drape.times.distance)),
                ("segment", ms(drape.times.segment)),
                ("mechanics", ms(drape.times.mechanics)),
                ("refine", ms(drape.times.refine)),
            ]),
            warnings: drape.warnings.clone(),
            outputs: Vec::new(),
        }
    }

    /// Adds what an assessment found.
    pub(crate) fn assessed(&mut self, assessment: &Assessment) {
        self.accuracy = Some(assessment.accuracy.clone());
        self.wrinkle_rank_correlation = assessment.wrinkles.rank_correlation;
        self.warnings.extend(assessment.warnings.iter().cloned());
    }

    /// Strain, error and what else was measured, in words.
    fn findings(&self) -> Vec<(&'static str, String)> {
        let mut found = Vec::new();
        if let (Some(steps), Some(residual)) = (self.refine_steps, self.residual_over_weight) {
            found.push(("refined", format!("{steps} steps, residual {residual:.1e} of the weight")));
        }
        if let (Some(p95), Some(max)) = (self.strain_p95, self.strain_max) {
            found.push(("strain", format!("{:.1} % (P95), {:.1} % at most", 1e2 * p95, 1e2 * max)));
        }
        if let Some(pressure) = self.pressure_max_kpa {
            found.push(("pressure", format!("{pressure:.2} kPa at most")));
        }
        found.push(("inside the body", format!("{} vertices", self.penetrating_vertices)));
        found.push(("cloth through cloth", format!("{} pairs of triangles", self.self_intersecting_pairs)));
        if let Some(accuracy) = &self.accuracy {
            let canonical = accuracy.canonical_rms_mm.unwrap_or_default();
            found.push((
                "error",
                format!(
                    "{:.2} mm RMS against its own continuation, {canonical:.1} against the canonical drape",
                    accuracy.vertices.rms_mm
                ),
            ));
            if let Some(spread) = accuracy.canonical_spread_mm {
                found.push(("spread", format!("{spread:.1} mm RMS between drapes from perturbed starts")));
            }
            if let Some(best) = accuracy.representable_rms_mm {
                found.push(("representable", format!("{best:.1} mm RMS remain with one displacement a PART")));
            }
        }
        if let Some(rank) = self.wrinkle_rank_correlation {
            found.push(("wrinkles", format!("rank correlation {rank:.2} of PART jumps with the mean curvature")));
        }
        found
    }

    /// One JSON object.
    pub(crate) fn json(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string(self)?)
    }

    /// For the terminal.
    pub(crate) fn text(&self) -> String {
        let mut out =
            format!("{} on {}: {} vertices, {} triangles\n", self.garment, self.body, self.vertices, self.triangles);
        let _ = writeln!(
            out,
            "{:<20}table {}: {} PARTs in {} levels, {} of them single vertices",
            "stage one",
            self.table,
            self.part_count,
            self.parts_per_level.iter().filter(|&&n| n > 0).count(),
            self.singleton_parts
        );
        let _ = writeln!(
            out,
            "{:<20}model {}, fabric {}: {} PARTs touch the body, displacement {:.1} mm RMS",
            "stage two", self.model, self.fabric, self.contact_parts, self.displacement_rms_mm
        );
        for (name, value) in self.findings() {
            let _ = writeln!(out, "{name:<20}{value}");
        }
        let _ = writeln!(out, "\n{}", self.levels_table());
        let order = ["load", "distance", "segment", "mechanics", "refine", "record"];
        let times: Vec<String> =
            order.iter().filter_map(|stage| self.timings_ms.get(stage).map(|t| format!("{stage} {t:.1}"))).collect();
        let _ = writeln!(out, "milliseconds: {}", times.join(", "));
        for output in &self.outputs {
            let _ = writeln!(out, "{output}");
        }
        out
    }

    /// For the recording's text panel.
    pub(crate) fn panel(&self, fabric: &Fabric) -> Panel {
        let fact = |name: &str, value: String| (name.to_owned(), value);
        let metres = |cm: Option<f64>| cm.map_or(f64::INFINITY, |cm| cm * METRES_PER_CM);
        let levels = self.level_bounds_cm.iter().zip(&self.level_extents);
        let levels = levels.zip(&self.vertices_per_level).zip(&self.parts_per_level);
        Panel {
            title: format!("{} on {}", self.garment, self.body),
            table: self.table.clone(),
            levels: levels
                .map(|(((&[lower, upper], extent), &vertices), &parts)| LevelRow {
                    lower_m: metres(lower),
                    upper_m: metres(upper),
                    vertices,
                    parts,
                    extent: extent.map(|e| e.to_string()),
                })
                .collect(),
            facts: [
                fact("model", self.model.to_owned()),
                fact("vertices", self.vertices.to_string()),
                fact("PARTs", format!("{} ({} single vertices)", self.part_count, self.singleton_parts)),
                fact("touching the body", format!("{} PARTs", self.contact_parts)),
                fact("moved", format!("{:.1} mm RMS", self.displacement_rms_mm)),
            ]
            .into_iter()
            .chain(self.findings().into_iter().map(|(name, value)| fact(name, value)))
            .collect(),
            fabric: fabric_facts(fabric),
            timings_ms: ["load", "distance", "segment", "mechanics", "refine"]
                .iter()
                .filter_map(|stage| self.timings_ms.get(stage).map(|&t| ((*stage).to_owned(), t)))
                .collect(),
            warnings: self.warnings.clone(),
            command_line: self.command_line.clone(),
        }
    }

    fn levels_table(&self) -> Table {
        let mut table = Table::new();
        table.load_preset(presets::UTF8_FULL_CONDENSED).set_header(["level", "from cm", "to cm", "PARTs", "vertices"]);
        let bound = |b: Option<f64>| b.map_or_else(|| "∞".to_owned(), |b| format!("{b}"));
        let rows = self.level_bounds_cm.iter().zip(&self.parts_per_level).zip(&self.vertices_per_level).enumerate();
        for (i, (([lower, upper], parts), vertices)) in rows.filter(|(_, (_, vertices))| **vertices > 0) {
            table.add_row([(i + 1).to_string(), bound(*lower), bound(*upper), parts.to_string(), vertices.to_string()]);
        }
        for column in table.column_iter_mut() {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table
    }
}

/// The command line as typed, the program by its bare name.
pub(crate) fn command_line() -> String {
    // Names of files need not be Unicode.
    let typed = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    let arguments = typed.map(|a| if a.contains(' ') { format!("'{a}'") } else { a });
    std::iter::once("partwise".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn fabric_facts(fabric: &Fabric) -> Vec<(String, String)> {
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let [weft, bias, warp] = fabric.bending_nm.map(|b| b * 1e6);
    vec![
        fact("name", fabric.name.clone()),
        fact("density", format!("{} kg/m²", fabric.density_kg_per_m2)),
        fact(
            "stretch, weft and warp",
            format!("{} and {} N/m", fabric.stretch_weft_n_per_m, fabric.stretch_warp_n_per_m),
        ),
        fact("shear", format!("{} N/m", fabric.shear_n_per_m)),
        fact("bending, weft, bias, warp", format!("{weft:.0}, {bias:.0}, {warp:.0} µN·m")),
        fact("thickness", format!("{:.2} mm", 1e3 * fabric.thickness_m)),
        fact("friction", fabric.friction.to_string()),
    ]
}
