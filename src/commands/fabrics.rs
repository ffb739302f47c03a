//! `--fabric`: what garments are cut from, one for all or one for each.

use crate::SceneSpec;
use crate::garment::fabric::{DEFAULT_FABRIC, Fabric};
use crate::scene::{CutError, Loaded, SceneError};
use clap::Args;

use super::UserError;

/// The fabrics.
#[derive(Debug, Clone, Args)]
pub(crate) struct FabricArgs {
    /// Fabric: a built-in name or a TOML file. Where garments are worn over each other, one for all, or one for each --garment, in the
    /// same order; fabrics of single panels by --fabrics [default: interlock]
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) fabric: Vec<String>,
}

impl FabricArgs {
    /// The fabric of what has none of its own.
    pub(crate) fn first(&self) -> anyhow::Result<Fabric> {
        Ok(Fabric::by_name(self.fabric.first().map_or(DEFAULT_FABRIC, String::as_str))?)
    }

    /// The fabric, for commands that take one.
    pub(crate) fn only(&self, command: &str) -> anyhow::Result<Fabric> {
        match self.fabric.len() {
            0 | 1 => self.first(),
            found => Err(UserError::new(format!("{command}: found {found} times --fabric, expected one for all"))),
        }
    }

    /// Gives each garment of `spec` its fabric, where there are several.
    pub(crate) fn give(&self, spec: SceneSpec) -> anyhow::Result<SceneSpec> {
        if let [] | [_] = &self.fabric[..] {
            return Ok(spec);
        }
        let spec = SceneSpec { fabrics: self.fabric.clone(), ..spec };
        spec.check_names()?;
        Ok(spec)
    }

    /// Refuses a fabric that nothing is cut from.
    pub(crate) fn check_used(&self, loaded: &Loaded) -> anyhow::Result<()> {
        let [fabric] = &self.fabric[..] else { return Ok(()) };
        if loaded.scene.takes_the_settings_fabric() {
            return Ok(());
        }
        let mut by: Vec<&str> = loaded.swatches.iter().filter_map(|swatch| swatch.by.as_deref()).collect();
        by.dedup();
        Err(SceneError::from(CutError::Unfit(format!(
            "--fabric {fabric}: found nothing to cut from it, every panel has its own ({}); take --fabric away, or `default` there",
            by.join(", ")
        )))
        .into())
    }
}
