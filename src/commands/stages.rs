//! The dials of the two stages: arguments shared by every command that drapes.

use std::path::Path;

use crate::base::files::names_a_file;
use crate::base::serde_name;
use crate::drape::{Model, Refine, Settings};
use crate::mechanics::coupled::Motion;
use crate::parts::range_table::{GapRule, RangeTable, TABLE_3};
use clap::Args;

use super::readings::{self, Reading};
use super::{FabricArgs, UserError};

/// Stage one's and stage two's arguments beside the range table.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct DialArgs {
    /// Join PARTs of fewer vertices than this to the neighbour with the longest common seam, before any is cut; 1 is
    /// the paper's definition
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_part: usize,
    /// Model of stage two: `coupled` (all PARTs at once) or `paper` (equations (2) to (9), every PART for itself)
    #[arg(long, value_name = "coupled|paper", default_value = "coupled", value_parser = model)]
    model: Model,
    /// Cut PARTs to this extent along the cloth, for `coupled`; several, falling, make a cascade; by default, and with
    /// 0, the table alone makes them
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', value_parser = extent)]
    max_extent: Vec<f64>,
    /// How a PART moves, for `coupled`: by an `affine` map (shifted, turned, stretched, sheared) or by one
    /// displacement, a `translation`, as in the paper; blended over the seams either way
    #[arg(long, value_name = "affine|translation", default_value = Motion::default().name())]
    motion: Motion,
    #[arg(long = "reading", value_name = "KEY=VALUE", value_parser = readings::parse, help = readings::HELP)]
    readings: Vec<Reading>,
    #[command(flatten)]
    pub(crate) cloth: FabricArgs,
    /// Let cloth go through cloth: for comparing, and for garments that are known not to touch themselves
    #[arg(long)]
    no_self_contact: bool,
}

/// The arguments of one drape.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct StageArgs {
    /// Range table: `table-3` (the paper's) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = TABLE_3)]
    pub(super) table: String,
    /// Newton steps at full resolution afterwards; 0 is the two-stage scheme alone [default: converged, 0 for `paper`]
    #[arg(long, value_name = "N|converged")]
    refine: Option<Refine>,
    /// Who takes a hole between two levels, whatever the table says: extend-lower, extend-upper, own-level, error
    #[arg(long, value_name = "RULE", value_parser = gap_rule)]
    gap: Option<GapRule>,
    #[command(flatten)]
    pub(crate) dials: DialArgs,
}

impl DialArgs {
    /// The dials over those of `start`.
    pub(crate) fn over(&self, start: Settings) -> anyhow::Result<Settings> {
        let extents: Vec<f64> = self.max_extent.iter().copied().filter(|cm| *cm != 0.0).collect();
        if !extents.is_sorted_by(|a, b| a > b) {
            let found = extents.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
            return Err(UserError::new(format!(
                "--max-extent {found}: found extents that do not fall, expected a cascade from coarse to fine, e.g. 12,6"
            )));
        }
        let model = match &self.model {
            Model::Paper(_) => Model::Paper(readings::options(&self.readings)?),
            coupled => coupled.clone().with_extents_cm(&extents).with_motion(self.motion),
        };
        let (fabric, self_contact) = (self.cloth.first()?, !self.no_self_contact);
        Ok(Settings { min_part: self.min_part, model, fabric, self_contact, ..start })
    }
}

impl StageArgs {
    /// The flags that were set and act on the two stages or on what follows them: no reference method has them.
    pub(crate) fn of_two_stages(&self) -> Vec<&'static str> {
        let DialArgs { min_part, model, max_extent, motion, readings, no_self_contact, .. } = &self.dials;
        let all = [
            ("--table", self.table != TABLE_3),
            ("--refine", self.refine.is_some()),
            ("--gap", self.gap.is_some()),
            ("--min-part", *min_part != 1),
            ("--model", *model != Model::default()),
            ("--max-extent", !max_extent.is_empty()),
            ("--motion", *motion != Motion::default()),
            ("--reading", !readings.is_empty()),
            ("--no-self-contact", *no_self_contact),
        ];
        all.into_iter().filter(|(_, set)| *set).map(|(flag, _)| flag).collect()
    }

    /// The files behind the arguments, for `--watch`.
    pub(crate) fn files(&self) -> Vec<&Path> {
        std::iter::once(&self.table)
            .chain(&self.dials.cloth.fabric)
            .filter(|v| names_a_file(v))
            .map(Path::new)
            .collect()
    }

    /// Reads tables and fabrics.
    pub(crate) fn settings(&self) -> anyhow::Result<Settings> {
        let mut table = RangeTable::by_name(&self.table)?;
        if let Some(gap) = self.gap {
            table.gap = gap;
            table.validate()?;
        }
        let settings = self.dials.over(Settings { table: table.into(), ..Settings::default() })?;
        Ok(Settings { refine: self.refine.unwrap_or(settings.model.default_refine()), ..settings })
    }
}

fn model(name: &str) -> Result<Model, String> {
    Model::by_name(name).ok_or_else(|| format!("found `{name}`, expected coupled or paper"))
}

fn extent(text: &str) -> Result<f64, String> {
    let known = text.trim().parse().ok().filter(|cm: &f64| cm.is_finite() && *cm >= 0.0);
    known.ok_or_else(|| format!("found `{text}`, expected centimetres, or 0 for PARTs as the table makes them"))
}

fn gap_rule(text: &str) -> Result<GapRule, String> {
    serde_name::parse(text)
        .ok_or_else(|| format!("found `{text}`, expected extend-lower, extend-upper, own-level or error"))
}
