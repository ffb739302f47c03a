//! Arguments of the two stages, shared by the commands that drape.

use std::path::Path;

use crate::base::files::names_a_file;
use crate::base::serde_name;
use crate::drape::{Model, Refine, Settings};
use crate::mechanics::coupled::Motion;
use crate::mechanics::paper::PaperOptions;
use crate::mechanics::solver_options::SolverOptions;
use crate::parts::range_table::{GapRule, RangeTable, TABLE_3};
use clap::Args;
use serde_json::{Value, json};

use super::inputs::FabricArgs;
use super::runtime::refuse;

/// Arguments of the two stages other than the range table.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct ModelArgs {
    /// Merge PARTs with fewer vertices than this into the neighbour with the longest common seam, before PARTs are cut; 1 is the
    /// paper's definition
    #[arg(long, value_name = "N", default_value_t = 1)]
    min_part: usize,
    /// Model of stage two: `coupled` (all PARTs at once) or `paper` (equations (2) to (9), each PART separately)
    #[arg(long, value_name = "coupled|paper", default_value = "coupled", value_parser = model)]
    model: Model,
    /// Cut PARTs to this extent along the cloth, for `coupled`; several decreasing extents form a cascade. By default, and with 0,
    /// the range table alone defines the PARTs
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', value_parser = extent)]
    max_extent: Vec<f64>,
    /// Motion of a PART, for `coupled`: an `affine` map (translation, rotation, stretch, shear) or a `translation`, as in the paper;
    /// both are blended over the seams
    #[arg(long, value_name = "affine|translation", default_value = Motion::default().name())]
    motion: Motion,
    #[arg(long = "reading", value_name = "KEY=VALUE", value_parser = reading, help = READINGS)]
    readings: Vec<Reading>,
    #[command(flatten)]
    pub(crate) fabric: FabricArgs,
    /// Disable contact of cloth with cloth: for comparisons, and for garments that cannot touch themselves
    #[arg(long)]
    no_self_contact: bool,
    /// Set an option of the solver at full resolution, for experiments, e.g. newton.damping=3; `bench ablation --list` prints all
    #[arg(long = "solver", value_name = "GROUP.KEY=VALUE", value_parser = solver_option)]
    solver: Vec<String>,
}

/// The arguments of one drape.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stages")]
pub(crate) struct StageArgs {
    /// Range table: `table-3` (the paper's) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = TABLE_3)]
    pub(super) table: String,
    /// Newton steps at full resolution after the two stages; 0 is the two-stage scheme alone [default: converged, 0 for `paper`]
    #[arg(long, value_name = "N|converged")]
    refine: Option<Refine>,
    /// Level of a distance in a gap between two levels, in place of the table's rule: extend-lower, extend-upper, own-level, error
    #[arg(long, value_name = "RULE", value_parser = gap_rule)]
    gap: Option<GapRule>,
    #[command(flatten)]
    pub(crate) model: ModelArgs,
}

impl ModelArgs {
    /// `base` with these arguments applied.
    pub(crate) fn apply(&self, base: Settings) -> anyhow::Result<Settings> {
        let extents: Vec<f64> = self.max_extent.iter().copied().filter(|cm| *cm != 0.0).collect();
        if !extents.is_sorted_by(|a, b| a > b) {
            let found = extents.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
            refuse!("--max-extent {found}: found extents that do not decrease, expected a cascade such as 12,6");
        }
        let model = match &self.model {
            Model::Paper(_) => Model::Paper(paper_options(&self.readings)?),
            coupled => coupled.clone().with_extents_cm(&extents).with_motion(self.motion),
        };
        let (fabric, self_contact) = (self.fabric.first()?, !self.no_self_contact);
        let solver = self.solver.iter().try_fold(base.solver, |solver, text| solver.assign(text))?;
        Ok(Settings { min_part: self.min_part, model, fabric, self_contact, solver, ..base })
    }
}

impl StageArgs {
    /// The given flags of the two stages and the refinement, which the reference methods do not support.
    pub(crate) fn two_stage_flags(&self) -> Vec<&'static str> {
        let ModelArgs { min_part, model, max_extent, motion, readings, no_self_contact, solver, .. } = &self.model;
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
            ("--solver", !solver.is_empty()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(flag, _)| flag).collect()
    }

    /// The arguments that name files.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        let table = Some(&self.table).filter(|name| names_a_file(name)).map(Path::new);
        table.into_iter().chain(self.model.fabric.files())
    }

    /// The settings, with table and fabric read.
    pub(crate) fn settings(&self) -> anyhow::Result<Settings> {
        let mut table = RangeTable::by_name(&self.table)?;
        if let Some(gap) = self.gap {
            table.gap = gap;
            table.validate()?;
        }
        let settings = self.model.apply(Settings { table: table.into(), ..Settings::default() })?;
        Ok(Settings { refine: self.refine.unwrap_or(settings.model.default_refine()), ..settings })
    }
}

fn model(name: &str) -> Result<Model, String> {
    Model::by_name(name).ok_or_else(|| format!("found `{name}`, expected coupled or paper"))
}

fn extent(text: &str) -> Result<f64, String> {
    let extent = text.trim().parse().ok().filter(|cm: &f64| cm.is_finite() && *cm >= 0.0);
    extent.ok_or_else(|| format!("found `{text}`, expected centimetres, or 0 for PARTs defined by the table alone"))
}

fn gap_rule(text: &str) -> Result<GapRule, String> {
    serde_name::parse(text)
        .ok_or_else(|| format!("found `{text}`, expected extend-lower, extend-upper, own-level or error"))
}

fn solver_option(text: &str) -> Result<String, String> {
    SolverOptions::default().assign(text).map_err(|error| error.to_string())?;
    Ok(text.to_owned())
}

const READINGS: &str = "\
Interpretations of equations (2) to (9) for `paper`, the default first:
volume=area|cuboid, cosine=absolute|signed|in-surface, clearance=plus-thickness|literal, contactless=as-equation-6|as-printed, \
body-force=balance|N/m³, line-force=membrane|N/m⁵, contact-distance=0.5 (cm)";

/// A field of [`PaperOptions`] and its value.
type Reading = (String, Value);

fn reading(text: &str) -> Result<Reading, String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, e.g. cosine=signed")?;
    let number = value.parse::<f64>().ok().filter(|x| x.is_finite() && *x >= 0.0);
    let reading = match (key, number) {
        ("contact-distance", Some(cm)) => ("contact_distance_m".to_owned(), json!(cm / 100.0)),
        (_, Some(given)) => (key.replace('-', "_"), json!({ "given": given })),
        (_, None) => (key.replace('-', "_"), json!(value)),
    };
    paper_options(std::slice::from_ref(&reading)).map_err(|_| READINGS.to_owned())?;
    Ok(reading)
}

/// The default options with `readings` in place of some.
fn paper_options(readings: &[Reading]) -> serde_json::Result<PaperOptions> {
    serde_json::from_value(Value::Object(readings.iter().cloned().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::paper::{BodyForce, Cosine, Volume};

    #[test]
    fn readings_are_parsed_and_unknown_ones_refused() {
        let readings = ["cosine=signed", "contact-distance=1.5", "body-force=12", "contactless=as-equation-6"];
        let options = paper_options(&readings.map(|text| reading(text).unwrap())).unwrap();
        assert_eq!(options.cosine, Cosine::Signed);
        assert_eq!(options.contact_distance_m, 0.015);
        assert_eq!(options.body_force, BodyForce::Given(12.0));
        assert_eq!(options.volume, Volume::default());
        for right in ["volume=area", "clearance=plus-thickness", "body-force=balance", "line-force=membrane"] {
            assert!(reading(right).is_ok(), "{right}");
        }
        for wrong in ["cosine", "cosine=sine", "tangent=1", "body-force=much", "contact-distance=-1", "cosine=3"] {
            assert!(reading(wrong).is_err(), "{wrong}");
        }
    }
}
