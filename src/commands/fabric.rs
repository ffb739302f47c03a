//! `partwise fabric`: a fabric file from a laboratory's KES or FAST sheet.

use std::path::PathBuf;

use crate::garment::lab_sheet::{LabSystem, from_csv};
use clap::Args;

use super::console;
use super::runtime::{check, write};

/// Arguments of `fabric`.
#[derive(Debug, Args)]
pub(crate) struct FabricArgs {
    /// KES sheet: rows of quantity, warp, weft in the units of the apparatus (B gf·cm²/cm, 2HB gf·cm/cm, G gf/(cm·deg), LT, WT gf·cm/cm²,
    /// EM %, T mm, W mg/cm²)
    #[arg(long, value_name = "SHEET.csv", required_unless_present = "fast", conflicts_with = "fast")]
    kes: Option<PathBuf>,
    /// FAST sheet: rows of quantity, warp, weft (E5, E20, E100 %, EB5 %, C mm, W g/m², T2 mm)
    #[arg(long, value_name = "SHEET.csv")]
    fast: Option<PathBuf>,
    /// Name of the fabric [default: the name of the sheet]
    #[arg(long)]
    name: Option<String>,
    /// Write the fabric to this file; without it, the file is printed
    #[arg(long, value_name = "FABRIC.toml")]
    out: Option<PathBuf>,
}

impl FabricArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        let Some((system, path)) =
            self.kes.as_ref().map(|p| (LabSystem::Kes, p)).or(self.fast.as_ref().map(|p| (LabSystem::Fast, p)))
        else {
            return Ok(());
        };
        if let Some(out) = &self.out {
            check(out, "--out")?;
        }
        let text = crate::base::files::read_text(path)?;
        let stem = || path.file_stem().map_or_else(|| "fabric".into(), |stem| stem.to_string_lossy().into_owned());
        let name = self.name.clone().unwrap_or_else(stem);
        let converted = from_csv(system, &text, &path.display().to_string(), &name)?;
        match &self.out {
            Some(out) => write(out, &converted.toml, "--out")?,
            None => console::document(converted.toml.as_bytes()),
        }
        console::notes(&converted.assumed);
        console::warnings(&converted.doubts);
        console::warnings(&converted.fabric.warnings());
        Ok(())
    }
}
