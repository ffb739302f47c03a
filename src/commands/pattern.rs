//! `partwise pattern`: panels and seams of a sewing pattern, and a drawing of the flat panels.

use std::path::PathBuf;

use crate::SceneSpec;
use crate::garment::pattern::{self, SewingPattern};
use clap::Args;
use serde_json::{Value, json};

use super::console::{self, Format};
use super::runtime::{check, write};

/// Arguments of `pattern`.
#[derive(Debug, Args)]
pub(crate) struct PatternArgs {
    /// Sewing pattern: JSON of GarmentCode, or a DXF (ASTM D6673, AAMA), sewn if FILE.sewing.toml is beside it
    #[arg(value_name = "FILE.json|FILE.dxf")]
    file: PathBuf,
    /// Draw the flat panels in true size with numbered edges and seams
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
    /// Edge length of the mesh
    #[arg(long, value_name = "CM", default_value_t = SceneSpec::default().edge_cm)]
    edge_length: f64,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

impl PatternArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if let Some(path) = &self.svg {
            check(path, "--svg")?;
        }
        let pattern = pattern::read_unsewn(&self.file)?;
        let sewn = pattern::sew(&pattern, 0.01 * self.edge_length)?;
        let (vertices, triangles) = (sewn.mesh.vertex_count(), sewn.mesh.triangles.len());
        let notes = [&pattern.notes[..], &sewn.notes].concat();
        if let Some(path) = &self.svg {
            write(path, pattern::to_svg(&pattern), "--svg")?;
        }
        // Each row as cells of the table and as JSON.
        let panels = pattern.panels.iter().zip(&sewn.panels).map(|(panel, sewn)| {
            let (edges, area_cm2, vertices) = (panel.edges.len(), 1e4 * panel.signed_area().abs(), sewn.vertices.len());
            let label = panel.label.clone().unwrap_or_default();
            let cells = [panel.name.clone(), label, edges.to_string(), format!("{area_cm2:.0}"), vertices.to_string()];
            let json = json!({
                "name": panel.name, "label": panel.label, "edges": edges, "area_cm2": area_cm2,
                "vertices": vertices, "triangles": sewn.triangles.len(),
            });
            (cells, json)
        });
        let seams = pattern.stitches.iter().enumerate().map(|(i, stitch)| {
            let [a, b] = stitch.sides.map(|side| pattern.edge_name(side));
            let length_cm = pattern.lengths(stitch).map(|m| 100.0 * m);
            let gathered = 100.0 * (pattern.gathering(stitch) - 1.0);
            let json = json!({
                "number": i + 1, "sides": [a, b], "length_cm": length_cm, "gathered_percent": gathered,
                "right_wrong": stitch.right_wrong,
            });
            let remark = if gathered > 100.0 * SewingPattern::GATHERED {
                format!("gathered {gathered:.0} %")
            } else {
                (if stitch.right_wrong { "reversed" } else { "" }).to_owned()
            };
            let [a_cm, b_cm] = length_cm.map(|cm| format!("{cm:.1}"));
            ([(i + 1).to_string(), a, b, a_cm, b_cm, remark], json)
        });
        let (panel_cells, panels): (Vec<_>, Vec<Value>) = panels.unzip();
        let (seam_cells, seams): (Vec<_>, Vec<Value>) = seams.unzip();
        let name = &pattern.name;
        if self.format == Format::Json {
            return Ok(console::json(&json!({
                "name": name, "vertices": vertices, "triangles": triangles, "panels": panels, "seams": seams, "notes": notes,
            }))?);
        }
        let header = ["panel", "label", "edges", "area cm²", "vertices"];
        let panels = console::table(console::RULED, header, 2.., panel_cells);
        let header = ["seam", "side A", "side B", "A cm", "B cm", ""];
        let seams = console::table(console::RULED, header, 3..5, seam_cells);
        console::result(&format!("{name}: sewn, {vertices} vertices and {triangles} triangles\n{panels}\n{seams}"));
        console::notes(&notes);
        if let Some(path) = &self.svg {
            console::note(&format!("drawing: {}", path.display()));
        }
        Ok(())
    }
}
