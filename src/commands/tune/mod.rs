//! `partwise tune`: range tables on the Pareto front of PART count and error, which the paper leaves open.

mod garment;
mod results;
mod search;

use std::path::PathBuf;

use crate::SceneSpec;
use crate::base::files::stem;
use crate::garment::BUILT_IN;
use crate::mechanics::coupled::Motion;
use crate::parts::range_table::RangeTable;
use crate::record::RecordSummary;
use crate::scene::DRESS_FORM;
use crate::study::evaluate::EvaluateOptions;
use crate::study::table_search::Front;
use clap::Args;

use self::garment::Garment;
use self::results::Verdict;
use self::search::{
    ExtentGrid, SHAPES, SHAPES_TOGETHER, Selected, WIDTHS_CM, WIDTHS_TOGETHER_CM, find, fit_extents, limits, select,
};
use super::console::{self, RowFormat};
use super::inputs::FabricArgs;
use super::runtime::{self, create_folder, interrupted, keep_results, reference_cache, refuse, use_threads};
use super::sinks::SinkArgs;
use super::sweep::report::recording_line;

/// Arguments of `tune`.
#[derive(Debug, Clone, Args)]
#[command(after_help = include_str!("../../../assets/help/tune.txt"))]
pub(crate) struct TuneArgs {
    /// Garment to tune on, as in `partwise run`; each garment gets separate tables [default: the five built-in ones]
    #[arg(long, value_name = "NAME[@VERTICES]|FILE")]
    garment: Vec<String>,
    /// Search one table for all garments together
    #[arg(long)]
    together: bool,
    /// Garment excluded from the search, on which the tables are evaluated
    #[arg(long, value_name = "NAME[@VERTICES]|FILE")]
    hold_out: Vec<String>,
    /// Body: `form`, or a mesh file with garments placed around it
    #[arg(long, value_name = "form|FILE", default_value = DRESS_FORM)]
    body: String,
    #[command(flatten)]
    fabric: FabricArgs,
    /// Bound on the number of PARTs over all garments tuned together, shared in proportion to Table 3's PARTs [default: Table 3's
    /// number for each garment]
    #[arg(long, value_name = "N", help_heading = "Search", value_parser = at_least_one)]
    max_parts: Option<usize>,
    /// Candidate widths (along the weft) of the PARTs of a level [default: 30 from 4 to 80, and uncut; for several garments together
    /// 11 from 6 to 16]
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', help_heading = "Search")]
    extents: Vec<f64>,
    /// Candidate ratios of height (along the warp) to width; 1 alone gives square PARTs [default: 0.5, 1, 2, 4; for several garments
    /// together 1, 2, 4]
    #[arg(long, value_name = "H/W[,H/W...]", value_delimiter = ',', help_heading = "Search")]
    shapes: Vec<f64>,
    /// Candidate bounds per round; the time grows with their square [default: all for levels alone on up to 6000 vertices, otherwise
    /// 400; with extents 120, for several garments together 80]
    #[arg(long, value_name = "N", help_heading = "Search")]
    candidates: Option<usize>,
    /// Motion of a PART in the search: `affine`, as in the coupled model, or `translation`, as in the paper
    #[arg(long, value_name = "affine|translation", default_value = Motion::default().name(), help_heading = "Search")]
    motion: Motion,
    /// Search levels alone
    #[arg(long, help_heading = "Search")]
    levels_only: bool,
    /// Folder of the reference drapes [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Search")]
    cache: Option<PathBuf>,
    /// Folder of the tables, the fronts and the recordings
    #[arg(long, value_name = "DIR", default_value = "recordings/tune", help_heading = "Output")]
    out: PathBuf,
    #[command(flatten)]
    sinks: SinkArgs,
    /// Format of the result on stdout; CSV prints the front
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// The kinds of tables searched.
const KINDS: [&str; 2] = ["levels", "levels and extents"];
/// Names of the CSV files.
const FRONT: &str = "front.csv";
const VERDICTS: &str = "verdicts.csv";

/// The results of all searches.
#[derive(Default)]
struct Results {
    text: String,
    fronts: Vec<(String, &'static str, Front)>,
    verdicts: Vec<Verdict>,
    tables: Vec<PathBuf>,
    recordings: Vec<RecordSummary>,
}

impl TuneArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        keep_results();
        self.sinks.check_outputs(&[])?;
        let grid = self.extent_grid()?;
        self.fabric.check_single("tune")?;
        let options = EvaluateOptions { cache: reference_cache(self.cache.as_ref()), spread_starts: 0 };
        let names: Vec<String> = if self.garment.is_empty() {
            BUILT_IN.iter().map(|n| (*n).to_owned()).filter(|n| !self.hold_out.contains(n)).collect()
        } else {
            self.garment.clone()
        };
        for name in names.iter().chain(&self.hold_out) {
            SceneSpec::new(&self.body, name).check_names()?;
        }
        create_folder(&self.out)?;
        let stems: Vec<String> = names.iter().map(|name| stem(name)).collect();
        let stems = if self.together { vec![stems.join("+")] } else { stems };
        let tables = stems.iter().flat_map(|name| KINDS.map(|kind| self.table_file(name, kind)));
        for path in tables.chain([FRONT, VERDICTS].map(|name| self.out.join(name))) {
            runtime::check(&path, "--out")?;
        }
        let load = |names: &[String]| -> anyhow::Result<Option<Vec<Garment>>> {
            names.iter().map(|name| Garment::load(name, &self.body, &self.fabric, self.motion, &options)).collect()
        };
        let (Some(garments), Some(held_out)) = (load(&names)?, load(&self.hold_out)?) else { return Ok(()) };
        let sets: Vec<Vec<&Garment>> =
            if self.together { vec![garments.iter().collect()] } else { garments.iter().map(|g| vec![g]).collect() };
        if sets.len() * sets.first().map_or(0, Vec::len) > 1 && self.sinks.save.is_some() {
            refuse!("--save accepts one recording, but there is one per garment; choose a folder with --out");
        }
        let mut found = Results::default();
        for set in &sets {
            if interrupted() {
                break;
            }
            self.tune(set, &held_out, &grid, &mut found)?;
        }
        let front = results::csv(found.fronts.iter().flat_map(results::lines))?;
        runtime::write(&self.out.join(FRONT), &front, "--out")?;
        runtime::write(&self.out.join(VERDICTS), results::csv(&found.verdicts)?, "--out")?;
        // JSON is Unicode; file names need not be.
        let name = |path: &PathBuf| path.display().to_string();
        match self.format {
            RowFormat::Csv => console::result(&front),
            RowFormat::Json => console::json(&serde_json::json!({
                "verdicts": found.verdicts,
                "tables": found.tables.iter().map(name).collect::<Vec<_>>(),
                "front": name(&self.out.join(FRONT)),
                "recordings": found.recordings.iter().map(|r| r.path.as_ref().map(name)).collect::<Vec<_>>(),
            }))?,
            RowFormat::Text => {
                let recordings: String = found.recordings.iter().map(recording_line).collect();
                let tables: String = found.tables.iter().map(|t| format!("table: {}\n", t.display())).collect();
                console::result(&format!(
                    "{}Bounds and errors, RMS to the reference drape (in parentheses: over Table 3's)\n{}\n{}\n{tables}front: {}\n{recordings}",
                    found.text,
                    results::verdicts(&found.verdicts),
                    results::worse(&found.verdicts),
                    self.out.join(FRONT).display()
                ));
            }
        }
        Ok(())
    }

    /// Searches tables for one set of garments.
    fn tune(
        &self,
        set: &[&Garment],
        held_out: &[Garment],
        grid: &ExtentGrid,
        results: &mut Results,
    ) -> anyhow::Result<()> {
        let name = set.iter().map(|g| stem(&g.name)).collect::<Vec<_>>().join("+");
        let limits = limits(set, self.max_parts.unwrap_or_else(|| set.iter().map(|g| g.table_3.parts).sum()));
        let Some(found) = find(set, &limits, grid, self.candidates, &name)? else { return Ok(()) };
        let mut all_selected: Vec<(&'static str, Selected)> = Vec::new();
        let fronts: Vec<&Front> = found.iterations.iter().map(|i| &i.front).collect();
        let kinds = [(KINDS[0], &fronts[..found.levels]), (KINDS[1], &fronts[..])];
        for (kind, fronts) in kinds.into_iter().take(if fronts.len() == found.levels { 1 } else { 2 }) {
            let Some(front) = fronts.last().copied() else { continue };
            let title = format!("{name}, {kind}");
            let exact = kind == KINDS[0] && found.exact;
            results.text.push_str(&results::front(&title, front, set, exact));
            results.fronts.push((name.clone(), kind, front.clone()));
            let Some(selected) = select(fronts, set, &limits, &title)? else { continue };
            let path = self.table_file(&name, kind);
            runtime::write(&path, results::with_provenance(&selected, set).to_toml(), "--out")?;
            results.tables.push(path);
            let table = &selected.table;
            let tuned = set.iter().zip(&selected.qualities);
            results.verdicts.extend(tuned.map(|(g, quality)| Verdict::new(&name, kind, table, *quality, g)));
            for garment in held_out {
                let evaluate = |table: &RangeTable, extent_factor: f64| {
                    let verdict = Verdict::new(&name, kind, table, garment.quality(table)?, garment);
                    Ok::<_, anyhow::Error>(Verdict { held_out: true, extent_factor, ..verdict })
                };
                results.verdicts.push(evaluate(table, 1.0)?);
                if table.has_extents()
                    && let Some((factor, table)) = fit_extents(table, garment)?
                {
                    results.verdicts.push(evaluate(&table, factor)?);
                }
            }
            all_selected.push((kind, selected));
        }
        for garment in set {
            let sinks = self.sinks.sinks_in(&self.out, &stem(&garment.name));
            if !sinks.is_empty() {
                results.recordings.push(results::record(garment, set, &found, &all_selected, sinks)?);
            }
        }
        Ok(())
    }

    /// The candidate extents of the search.
    fn extent_grid(&self) -> anyhow::Result<ExtentGrid> {
        if self.levels_only {
            return Ok(ExtentGrid { widths_cm: Vec::new(), shapes: Vec::new() });
        }
        let invalid = |values: &[f64]| values.iter().copied().find(|x| !(x.is_finite() && *x > 0.0));
        if let Some(found) = invalid(&self.extents) {
            refuse!("--extents: found {found}, expected centimetres above 0; --levels-only for none");
        }
        if let Some(found) = invalid(&self.shapes) {
            refuse!("--shapes: found {found}, expected ratios of height to width above 0");
        }
        let together = self.together && self.garment.len() != 1;
        let widths = if together { &WIDTHS_TOGETHER_CM[..] } else { &WIDTHS_CM };
        let shapes = if together { &SHAPES_TOGETHER[..] } else { &SHAPES };
        let or = |given: &[f64], default: &[f64]| if given.is_empty() { default } else { given }.to_vec();
        Ok(ExtentGrid { widths_cm: or(&self.extents, widths), shapes: or(&self.shapes, shapes) })
    }

    /// The file of the table of a set of garments.
    fn table_file(&self, name: &str, kind: &str) -> PathBuf {
        self.out.join(format!("{name}-{}.toml", kind.replace(' ', "-")))
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    let expected = || format!("found `{text}`, expected a whole number of PARTs, 1 or more");
    text.parse().ok().filter(|&n| n > 0).ok_or_else(expected)
}
