//! `partwise pattern`: what a sewing pattern holds, and how it looks flat.

use std::path::PathBuf;

use crate::SceneSpec;
use crate::garment::pattern::{self, SewingPattern};
use clap::Args;
use serde::Serialize;

use super::console;
use super::run::Format;
use super::runtime::{check, write};

pub(crate) const LONG_ABOUT: &str = "\
Reads a sewing pattern (JSON as GarmentCode writes it: *_specification.json), checks it, sews it and sums it up: panels with their areas, \
seams with the lengths of both sides.

`partwise --pattern FILE` drapes it, on the dress form or on --body.";

/// Arguments of `pattern`.
#[derive(Debug, Args)]
pub(crate) struct PatternArgs {
    /// The pattern
    #[arg(value_name = "FILE.json")]
    file: PathBuf,
    /// Draw the flat panels in their true size, with their seams numbered
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
    /// Length of the edges that it is meshed with
    #[arg(long, value_name = "CM", default_value_t = SceneSpec::default().edge_cm)]
    edge_length: f64,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

#[derive(Serialize)]
struct PanelRow {
    name: String,
    label: Option<String>,
    edges: usize,
    area_cm2: f64,
    vertices: usize,
    triangles: usize,
}

#[derive(Serialize)]
struct SeamRow {
    number: usize,
    sides: [String; 2],
    length_cm: [f64; 2],
    gathered_percent: f64,
    right_wrong: bool,
}

#[derive(Serialize)]
struct Report {
    name: String,
    vertices: usize,
    triangles: usize,
    panels: Vec<PanelRow>,
    seams: Vec<SeamRow>,
    notes: Vec<String>,
}

impl PatternArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if let Some(path) = &self.svg {
            check(path, "--svg")?;
        }
        let pattern = pattern::read(&self.file)?;
        let sewn = pattern::sew(&pattern, 0.01 * self.edge_length)?;
        let panels = pattern.panels.iter().zip(&sewn.panels).map(|(panel, sewn)| PanelRow {
            name: panel.name.clone(),
            label: panel.label.clone(),
            edges: panel.edges.len(),
            area_cm2: 1e4 * panel.signed_area().abs(),
            vertices: sewn.vertices.len(),
            triangles: sewn.triangles.len(),
        });
        let seams = pattern.stitches.iter().enumerate().map(|(i, stitch)| SeamRow {
            number: i + 1,
            sides: stitch.sides.map(|side| pattern.edge_name(side)),
            length_cm: pattern.lengths(stitch).map(|m| 100.0 * m),
            gathered_percent: 100.0 * (pattern.gathering(stitch) - 1.0),
            right_wrong: stitch.right_wrong,
        });
        let report = Report {
            name: pattern.name.clone(),
            vertices: sewn.mesh.vertex_count(),
            triangles: sewn.mesh.triangles.len(),
            panels: panels.collect(),
            seams: seams.collect(),
            notes: pattern.notes.iter().chain(&sewn.notes).cloned().collect(),
        };
        if let Some(path) = &self.svg {
            write(path, pattern::to_svg(&pattern), "--svg")?;
        }
        if self.format == Format::Json {
            console::result(&crate::base::error_text::json(&report)?);
            return Ok(());
        }
        console::notes(&report.notes);
        console::result(&report.text());
        if let Some(path) = &self.svg {
            console::note(&format!("drawing: {}", path.display()));
        }
        Ok(())
    }
}

impl Report {
    fn text(&self) -> String {
        let mut panels = console::table(console::RULED, ["panel", "for", "edges", "cm²", "vertices"], 3..);
        for p in &self.panels {
            let label = p.label.clone().unwrap_or_default();
            let numbers = [p.edges.to_string(), format!("{:.0}", p.area_cm2), p.vertices.to_string()];
            panels.add_row([p.name.clone(), label].into_iter().chain(numbers));
        }
        let mut seams = console::table(console::RULED, ["seam", "of", "and", "cm", "cm", ""], 3..);
        for s in &self.seams {
            let gathered = if s.gathered_percent > 100.0 * SewingPattern::GATHERED {
                format!("gathered {:.0} %", s.gathered_percent)
            } else if s.right_wrong {
                "turned over".to_owned()
            } else {
                String::new()
            };
            let [a, b] = &s.sides;
            let [la, lb] = s.length_cm.map(|l| format!("{l:.1}"));
            seams.add_row([s.number.to_string(), a.clone(), b.clone(), la, lb, gathered]);
        }
        let (name, vertices, triangles) = (&self.name, self.vertices, self.triangles);
        format!("{name}: sewn, {vertices} vertices and {triangles} triangles\n{panels}\n{seams}\n")
    }
}
