//! `partwise tune`: range tables of least error with as many PARTs as Table 3, which the paper leaves open.
//!
//! Tables are judged by stage two: the RMS over garments and fabrics of the error to the canonical drape, relative to Table 3's.

mod garment;
mod results;

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::SceneSpec;
use crate::base::files::stem;
use crate::garment::BUILT_IN;
use crate::parts::Parts;
use crate::parts::range_table::RangeTable;
use crate::record::RecordSummary;
use crate::scene::DRESS_FORM;
use crate::study::evaluate::EvaluateOptions;
use crate::study::table_search::{Fit, Judged, SearchOptions, search};
use clap::Args;

use self::garment::Garment;
use self::results::Verdict;
use super::console::{self, RowFormat};
use super::runtime::{
    self, control_flow, create_folder, interrupted, keep_results, reference_cache, refuse, use_threads,
};
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
    /// Fabrics in which a table is judged: built-in names or TOML files
    #[arg(long, value_name = "NAME|FILE[,...]", value_delimiter = ',', default_values = ["interlock", "cotton"])]
    fabric: Vec<String>,
    /// Bound on the number of PARTs over all garments tuned together, shared in proportion to Table 3's PARTs [default: Table 3's
    /// number for each garment]
    #[arg(long, value_name = "N", help_heading = "Search", value_parser = at_least_one)]
    max_parts: Option<usize>,
    /// Tables judged in each search
    #[arg(long, value_name = "N", help_heading = "Search", default_value = "600", value_parser = at_least_one)]
    tables: usize,
    /// Search levels alone
    #[arg(long, help_heading = "Search")]
    levels_only: bool,
    /// Folder of the reference drapes [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Search")]
    cache: Option<PathBuf>,
    /// Folder of the tables and the recordings
    #[arg(long, value_name = "DIR", default_value = "recordings/tune", help_heading = "Output")]
    out: PathBuf,
    #[command(flatten)]
    sinks: SinkArgs,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// The kinds of tables searched.
const KINDS: [&str; 2] = ["levels", "levels and extents"];
/// Name of the CSV file.
const VERDICTS: &str = "verdicts.csv";

/// The results of all searches.
#[derive(Default)]
struct Results {
    verdicts: Vec<Verdict>,
    tables: Vec<PathBuf>,
    recordings: Vec<RecordSummary>,
}

impl TuneArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        keep_results();
        self.sinks.check_outputs(&[])?;
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
        let tables = stems.iter().flat_map(|name| self.kinds().iter().map(|kind| self.table_file(name, kind)));
        for path in tables.chain([self.out.join(VERDICTS)]) {
            runtime::check(&path, "--out")?;
        }
        let load = |names: &[String]| -> anyhow::Result<Option<Vec<Garment>>> {
            names.iter().map(|name| Garment::load(name, &self.body, &self.fabric, &options)).collect()
        };
        let (Some(garments), Some(held_out)) = (load(&names)?, load(&self.hold_out)?) else { return Ok(()) };
        let sets: Vec<Vec<&Garment>> =
            if self.together { vec![garments.iter().collect()] } else { garments.iter().map(|g| vec![g]).collect() };
        if sets.len() * sets.first().map_or(0, Vec::len) > 1 && self.sinks.save.is_some() {
            refuse!("--save accepts one recording, but there is one per garment; choose a folder with --out");
        }
        let mut found = Results::default();
        for set in &sets {
            self.tune(set, &held_out, &mut found)?;
        }
        let verdicts = results::csv(&found.verdicts)?;
        runtime::write(&self.out.join(VERDICTS), &verdicts, "--out")?;
        // JSON is Unicode; file names need not be.
        let name = |path: &PathBuf| path.display().to_string();
        match self.format {
            RowFormat::Csv => console::result(&verdicts),
            RowFormat::Json => console::json(&serde_json::json!({
                "verdicts": found.verdicts,
                "tables": found.tables.iter().map(name).collect::<Vec<_>>(),
                "recordings": found.recordings.iter().map(|r| r.path.as_ref().map(name)).collect::<Vec<_>>(),
            }))?,
            RowFormat::Text => {
                let recordings: String = found.recordings.iter().map(recording_line).collect();
                let tables: String = found.tables.iter().map(|t| format!("table: {}\n", t.display())).collect();
                console::result(&format!(
                    "Error of stage two, RMS to the canonical drape\n{}\n{}\n{tables}{recordings}",
                    results::verdicts(&found.verdicts),
                    results::worse(&found.verdicts),
                ));
            }
        }
        Ok(())
    }

    /// Searches tables for one set of garments.
    fn tune(&self, set: &[&Garment], held_out: &[Garment], results: &mut Results) -> anyhow::Result<()> {
        let name = set.iter().map(|g| stem(&g.name)).collect::<Vec<_>>().join("+");
        let limits = limits(set, self.max_parts.unwrap_or_else(|| set.iter().map(|g| g.table_3_parts).sum()));
        let mut found: Vec<(&'static str, Vec<Judged>)> = Vec::new();
        for &kind in self.kinds() {
            if interrupted() {
                break;
            }
            let title = format!("{name}, {kind}");
            // The second search begins where the first one ended.
            let before = found.last().and_then(|(_, judged)| judged.last()).map(|best| best.table.clone());
            let include = [RangeTable::table_3()].into_iter().chain(before).collect();
            let options = SearchOptions { tables: self.tables, extents: kind == KINDS[1], include };
            let judged = find(set, &limits, &options, &title)?;
            let Some(best) = judged.last() else {
                if interrupted() {
                    break;
                }
                refuse!(
                    "{title}: no table tried is within {limits:?} PARTs, not even a single level; allow more (--max-parts)"
                );
            };
            let table = RangeTable { name: title, ..best.table.clone() };
            let verdicts: Vec<Verdict> =
                set.iter().map(|g| Verdict::all(&name, kind, &table, g)).collect::<Result<Vec<_>, _>>()?.concat();
            let path = self.table_file(&name, kind);
            let with_source = results::with_provenance(table.clone(), self.tables, &verdicts);
            runtime::write(&path, with_source.to_toml(), "--out")?;
            results.tables.push(path);
            results.verdicts.extend(verdicts);
            for garment in held_out {
                let fitted = if table.has_extents() { garment.fit_extents(&table)? } else { None };
                for (extent_factor, table) in [(1.0, table.clone())].into_iter().chain(fitted) {
                    let verdicts = Verdict::all(&name, kind, &table, garment)?;
                    let held_out = |verdict| Verdict { held_out: true, extent_factor, ..verdict };
                    results.verdicts.extend(verdicts.into_iter().map(held_out));
                }
            }
            found.push((kind, judged));
        }
        for garment in set {
            let sinks = self.sinks.sinks_in(&self.out, &stem(&garment.name));
            if !sinks.is_empty() {
                results.recordings.push(results::record(garment, &found, sinks)?);
            }
        }
        Ok(())
    }

    fn kinds(&self) -> &'static [&'static str] {
        if self.levels_only { &KINDS[..1] } else { &KINDS }
    }

    /// The file of the table of a set of garments.
    fn table_file(&self, name: &str, kind: &str) -> PathBuf {
        self.out.join(format!("{name}-{}.toml", kind.replace(' ', "-")))
    }
}

/// Searches one table for all garments, each within its limit of PARTs.
fn find(garments: &[&Garment], limits: &[usize], options: &SearchOptions, title: &str) -> anyhow::Result<Vec<Judged>> {
    let bar = console::progress(Some(options.tables as u64), title);
    let progress = |judged: usize| -> ControlFlow<()> {
        bar.set_position(judged as u64);
        control_flow()
    };
    let judge = |table: &RangeTable, worst: f64| -> anyhow::Result<Option<Fit>> {
        let parts: Vec<Parts> = garments.iter().map(|garment| garment.parts(table)).collect();
        if parts.iter().zip(limits).any(|(parts, limit)| parts.len() > *limit) {
            return Ok(None);
        }
        let count = garments.iter().map(|garment| garment.tailored.len()).sum::<usize>() as f64;
        let mut squares = 0.0;
        for (garment, parts) in garments.iter().zip(&parts) {
            for (i, tailored) in garment.tailored.iter().enumerate() {
                squares += (garment.error_mm(i, parts)? / tailored.table_3_mm).powi(2);
                if squares > worst * worst * count {
                    return Ok(Some(Fit { parts: 0, error: f64::INFINITY }));
                }
            }
        }
        Ok(Some(Fit { parts: parts.iter().map(Parts::len).sum(), error: (squares / count).sqrt() }))
    };
    let distances = garments.iter().flat_map(|garment| garment.distances.unsigned_m.iter().copied());
    let found = search(distances, options, &judge, &progress);
    bar.finish_and_clear();
    found
}

/// The bound on the PARTs of each garment: a share of `max_parts` in proportion to Table 3's PARTs.
fn limits(garments: &[&Garment], max_parts: usize) -> Vec<usize> {
    let total: usize = garments.iter().map(|g| g.table_3_parts).sum();
    let share = |g: &&Garment| g.table_3_parts as u128 * max_parts as u128 / total.max(1) as u128;
    garments.iter().map(|g| usize::try_from(share(g)).unwrap_or(usize::MAX)).collect()
}

fn at_least_one(text: &str) -> Result<usize, String> {
    let expected = || format!("found `{text}`, expected a whole number, 1 or more");
    text.parse().ok().filter(|&n| n > 0).ok_or_else(expected)
}
