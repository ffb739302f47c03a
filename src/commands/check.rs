//! `partwise check`: the health of a body and a garment, and how they lie about each other, without draping.

use clap::Args;
use comfy_table::{Table, presets};
use partwise::SceneSpec;
use partwise::mesh::health::{Health, health};
use partwise::scene::Placement;
use serde::Serialize;

use super::console;
use super::inputs::InputArgs;
use super::run::Format;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Body: `form` or an OBJ file; the same as --body
    #[arg(value_name = "BODY")]
    body_file: Option<String>,
    /// Garment: a name or a file; the same as --garment
    #[arg(value_name = "GARMENT")]
    garment_file: Option<String>,
    #[command(flatten)]
    input: InputArgs,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

#[derive(Serialize)]
struct Report {
    body: Health,
    garment: Health,
    fit: Placement,
    notes: Vec<String>,
}

impl CheckArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        // As they came: what push-out would mend is a finding here.
        let mut spec = SceneSpec { push_out: false, ..self.input.spec()? };
        spec.body = self.body_file.clone().unwrap_or(spec.body);
        spec.garment = self.garment_file.clone().unwrap_or(spec.garment);
        let loaded = self.input.load(&spec)?;
        let scene = &loaded.scene;
        let report = Report {
            body: health(scene.body.mesh()),
            garment: health(&scene.garment),
            fit: Placement::new(&scene.garment, &scene.body),
            notes: loaded.notes(),
        };
        if self.format == Format::Json {
            console::result(&serde_json::to_string(&report)?);
            return Ok(());
        }
        for note in &report.notes {
            console::note(note);
        }
        let mut table = Table::new();
        table.load_preset(presets::UTF8_FULL_CONDENSED).set_header(["", &loaded.body_name, &loaded.garment_name]);
        for ((name, body), (_, garment)) in report.body.rows().into_iter().zip(report.garment.rows()) {
            table.add_row([name.to_owned(), body, garment]);
        }
        for (name, value) in report.fit.rows() {
            table.add_row([name.to_owned(), String::new(), value]);
        }
        console::result(&table.to_string());
        Ok(())
    }
}
