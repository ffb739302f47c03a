//! The dials of the two stages: arguments shared by every command that drapes.

use std::path::Path;

use clap::{Args, ValueEnum};
use partwise::drape::{Model, Refine, Settings};
use partwise::fabric::Fabric;
use partwise::mechanics::coupled::CoupledOptions;
use partwise::range_table::{GapRule, RangeTable};

use super::failure::UserError;
use super::inputs::{looks_like_a_file, read_text};
use super::readings::{self, Reading};

/// The models of stage two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ModelName {
    /// All PARTs at once, as the nodes of a coarse cloth
    Coupled,
    /// Equations (2) to (9), every PART for itself
    Paper,
}

/// Stage one's and stage two's arguments.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct StageArgs {
    /// Range table: `table-3` (the paper's) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "table-3")]
    table: String,
    /// Join PARTs of fewer vertices than this to the neighbour with the longest common seam; 1 is the
    /// paper's definition. `coupled` joins those smaller than its finest extent in any case
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_part: usize,
    /// Model of stage two
    #[arg(long, value_enum, default_value_t = ModelName::Coupled)]
    model: ModelName,
    /// Cut PARTs to this extent along the cloth for `coupled`; several make a cascade from coarse to fine; 0 cuts nothing
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', default_value = "6")]
    max_extent: Vec<f64>,
    /// Newton steps at full resolution afterwards; 0 is the two-stage scheme alone [default: converged, 0 for `paper`]
    #[arg(long, value_name = "N|converged")]
    refine: Option<Refine>,
    #[arg(long = "reading", value_name = "KEY=VALUE", value_parser = readings::parse, help = readings::HELP)]
    readings: Vec<Reading>,
    /// Who takes a hole between two levels, whatever the table says: extend-lower, extend-upper, own-level, error
    #[arg(long, value_name = "RULE", value_parser = gap_rule)]
    gap: Option<GapRule>,
    /// Fabric: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "interlock")]
    fabric: String,
}

impl StageArgs {
    /// The files behind the arguments, for `--watch`.
    pub(crate) fn files(&self) -> Vec<&Path> {
        [&self.table, &self.fabric].into_iter().filter(|v| looks_like_a_file(v)).map(Path::new).collect()
    }

    /// Reads tables and fabrics.
    pub(crate) fn settings(&self) -> anyhow::Result<Settings> {
        let model = match self.model {
            ModelName::Paper => Model::Paper(readings::options(&self.readings)),
            ModelName::Coupled => {
                let extents_m = self.max_extent.iter().filter(|e| **e != 0.0).map(|cm| cm / 100.0).collect();
                Model::Coupled(CoupledOptions { extents_m, ..CoupledOptions::default() })
            }
        };
        let refine = match self.model {
            ModelName::Paper => Refine::Steps(0),
            ModelName::Coupled => Refine::Converged,
        };
        Ok(Settings {
            table: self.gapped(self.table()?)?,
            min_part: self.min_part,
            model,
            refine: self.refine.unwrap_or(refine),
            fabric: self.fabric()?,
        })
    }

    fn gapped(&self, mut table: RangeTable) -> anyhow::Result<RangeTable> {
        if let Some(gap) = self.gap {
            table.gap = gap;
            table.validate()?;
        }
        Ok(table)
    }

    fn table(&self) -> anyhow::Result<RangeTable> {
        if looks_like_a_file(&self.table) {
            return Ok(RangeTable::parse(&read_text(Path::new(&self.table))?, &self.table)?);
        }
        match self.table.as_str() {
            "table-3" => Ok(RangeTable::table_3()),
            other => Err(UserError::new(format!(
                "no range table is called `{other}`; expected `table-3` or a file ending in .toml"
            ))),
        }
    }

    fn fabric(&self) -> anyhow::Result<Fabric> {
        if looks_like_a_file(&self.fabric) {
            return Ok(Fabric::parse(&read_text(Path::new(&self.fabric))?, &self.fabric)?);
        }
        Ok(Fabric::by_name(&self.fabric)?)
    }
}

fn gap_rule(text: &str) -> Result<GapRule, String> {
    [GapRule::ExtendLower, GapRule::ExtendUpper, GapRule::OwnLevel, GapRule::Error]
        .into_iter()
        .find(|rule| rule.as_str() == text)
        .ok_or_else(|| format!("found `{text}`, expected extend-lower, extend-upper, own-level or error"))
}
