//! The dials of the two stages: arguments shared by every command that drapes.

use std::path::Path;

use clap::{Args, ValueEnum};
use partwise::drape::{Model, Settings};
use partwise::fabric::Fabric;
use partwise::mechanics::paper::PaperOptions;
use partwise::range_table::RangeTable;

use super::failure::UserError;
use super::inputs::{looks_like_a_file, read_text};

/// The models of stage two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ModelName {
    /// Equations (2) to (9), one displacement per PART
    Paper,
}

/// Stage one's and stage two's arguments.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct StageArgs {
    /// Range table: `table-3` (the paper's) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "table-3")]
    table: String,
    /// Join PARTs of fewer vertices than this to the neighbour with the longest common seam
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_part: usize,
    /// Model of stage two
    #[arg(long, value_enum, default_value_t = ModelName::Paper)]
    model: ModelName,
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
            ModelName::Paper => Model::Paper(PaperOptions::default()),
        };
        Ok(Settings { table: self.table()?, min_part: self.min_part, model, fabric: self.fabric()? })
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
