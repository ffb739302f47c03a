//! `partwise tune`: range tables on the front of PART count and error, which the paper leaves open.

mod check;
mod find;
mod fit;
mod garment;
mod recording;
mod report;

use std::path::PathBuf;

use crate::base::files::stem;
use crate::garment::BUILT_IN;
use crate::mechanics::coupled::Motion;
use crate::parts::range_table::RangeTable;
use crate::record::RecordSummary;
use crate::scene::DRESS_FORM;
use crate::study::evaluate::EvaluateOptions;
use crate::study::table_search::Front;
use clap::Args;

use self::check::{Taken, check};
use self::find::{SHAPES, SHAPES_TOGETHER, WIDTHS_CM, WIDTHS_TOGETHER_CM, find, limits};
use self::garment::Garment;
use self::report::Verdict;
use super::fabrics::FabricArgs;
use super::failure::UserError;
use super::runtime::{self, cache, make_folder, use_threads};
use super::sinks::SinkArgs;
use super::sweep::report::{Format, line};
use super::{console, interrupt};

pub(super) const LONG_ABOUT: &str = "\
Searches range tables for the least error at every number of PARTs.

The paper adjusts its table by iteration with a computer and leaves the best one open. The search is guided by what remains of the \
reference drape when each PART moves by the affine map nearest to it, which is what the coupled model moves PARTs by, and takes no \
mechanics to compute, so that the best tables for every number of PARTs come out of one exact dynamic program. Tables near the best \
are then bounded with the maps blended over the seams, as the model blends them, the best of those draped by the model, and the \
one nearest to the reference is written. First levels alone are searched, over every bound that makes a difference; then levels each \
of whose PARTs may be cut to an extent of its own along the cloth.

With --motion translation the question is the paper's: each PART moves by one displacement, and the table written is the \
optimum of that, whatever the model makes of it.";

const EXAMPLES: &str = "\
Examples:
  partwise tune --garment flared-skirt                        a table for one garment, in recordings/tune/
  partwise tune                                               a table for each of the five garments
  partwise tune --together --garment pullover-1 --garment flared-skirt --hold-out low-cut-dress
                                                              one table for two garments, tried on a third
  partwise compare table-3 recordings/tune/flared-skirt-levels.toml --garment flared-skirt";

/// Arguments of `tune`.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct TuneArgs {
    /// Garment to tune on, as in `partwise run`; each gets tables of its own [default: the five built-in ones]
    #[arg(long, value_name = "NAME[@VERTICES]|FILE")]
    garment: Vec<String>,
    /// One table for all garments together
    #[arg(long)]
    together: bool,
    /// Garment that the search does not see and the tables are tried on
    #[arg(long, value_name = "NAME[@VERTICES]|FILE")]
    hold_out: Vec<String>,
    /// Body: `form`, or an OBJ file with garments placed around it
    #[arg(long, value_name = "form|FILE.obj", default_value = DRESS_FORM)]
    body: String,
    #[command(flatten)]
    cloth: FabricArgs,
    /// Most PARTs a table may make, over all garments tuned together, each its share of Table 3's [default: as many as Table 3
    /// makes of each]
    #[arg(long, value_name = "N", help_heading = "Search", value_parser = at_least_one)]
    max_parts: Option<usize>,
    /// Widths (along the weft) a level may be cut to [default: 30 from 4 to 80, and not to be cut is open to it too;
    /// for several garments together 11 from 6 to 16]
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', help_heading = "Search")]
    extents: Vec<f64>,
    /// Heights of pieces (along the warp) over their widths; 1 alone keeps them as wide as tall [default: 0.5, 1, 2, 4; for
    /// several garments together 1, 2, 4]
    #[arg(long, value_name = "H/W[,H/W...]", value_delimiter = ',', help_heading = "Search")]
    shapes: Vec<f64>,
    /// Bounds tried in each round; the time grows with the square [default: all for levels alone on up to 6000 vertices,
    /// otherwise 400; with extents 120, for several garments together 80]
    #[arg(long, value_name = "N", help_heading = "Search")]
    candidates: Option<usize>,
    /// How a PART moves in the search: `affine`, as the coupled model moves it, or `translation`, as in the paper
    #[arg(long, value_name = "affine|translation", default_value = Motion::default().name(), help_heading = "Search")]
    motion: Motion,
    /// Search levels alone
    #[arg(long, help_heading = "Search")]
    levels_only: bool,
    /// Where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Search")]
    cache: Option<PathBuf>,
    /// Folder of the tables, the fronts and the recordings
    #[arg(long, value_name = "DIR", default_value = "recordings/tune", help_heading = "Output")]
    out: PathBuf,
    #[command(flatten)]
    sinks: SinkArgs,
    /// What to print on stdout; CSV is the front
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

/// Kinds of tables that are searched for.
const KINDS: [&str; 2] = ["levels", "levels and extents"];
/// Names of the other files.
const FRONT: &str = "front.csv";
const VERDICTS: &str = "verdicts.csv";

/// All that was found.
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
        interrupt::keep();
        self.sinks.check_outputs(&[])?;
        let ladder = self.ladder()?;
        self.cloth.only("tune")?;
        let options = EvaluateOptions { cache: cache(self.cache.as_ref()), spread_starts: 0 };
        let names: Vec<String> = if self.garment.is_empty() {
            BUILT_IN.iter().map(|n| (*n).to_owned()).filter(|n| !self.hold_out.contains(n)).collect()
        } else {
            self.garment.clone()
        };
        make_folder(&self.out)?;
        let stems: Vec<String> = names.iter().map(|name| stem(name)).collect();
        let stems = if self.together { vec![stems.join("+")] } else { stems };
        let tables = stems.iter().flat_map(|name| KINDS.map(|kind| self.table_file(name, kind)));
        for path in tables.chain([FRONT, VERDICTS].map(|name| self.out.join(name))) {
            runtime::check(&path, "--out")?;
        }
        let load = |names: &[String]| -> anyhow::Result<Option<Vec<Garment>>> {
            names.iter().map(|name| Garment::load(name, &self.body, &self.cloth, self.motion, &options)).collect()
        };
        let (Some(garments), Some(held_out)) = (load(&names)?, load(&self.hold_out)?) else { return Ok(()) };
        let sets: Vec<Vec<&Garment>> =
            if self.together { vec![garments.iter().collect()] } else { garments.iter().map(|w| vec![w]).collect() };
        if sets.len() * sets.first().map_or(0, Vec::len) > 1 && self.sinks.save.is_some() {
            return Err(UserError::new(
                "--save takes one recording and this makes one a garment; choose a folder with --out",
            ));
        }
        let mut results = Results::default();
        for set in &sets {
            if interrupt::requested() {
                break;
            }
            self.tune(set, &held_out, (&ladder.0, &ladder.1), &mut results)?;
        }
        let front = report::csv(results.fronts.iter().flat_map(report::lines))?;
        runtime::write(&self.out.join(FRONT), &front, "--out")?;
        runtime::write(&self.out.join(VERDICTS), report::csv(&results.verdicts)?, "--out")?;
        // JSON is Unicode; names of files need not be.
        let name = |path: &PathBuf| path.display().to_string();
        match self.format {
            Format::Csv => console::result(&front),
            Format::Json => console::result(&crate::base::error_text::json(&serde_json::json!({
                "verdicts": results.verdicts,
                "tables": results.tables.iter().map(name).collect::<Vec<_>>(),
                "front": name(&self.out.join(FRONT)),
                "recordings": results.recordings.iter().map(|r| r.path.as_ref().map(name)).collect::<Vec<_>>(),
            }))?),
            Format::Text => {
                let recordings: String = results.recordings.iter().map(line).collect();
                let tables: String = results.tables.iter().map(|t| format!("table: {}\n", t.display())).collect();
                console::result(&format!(
                    "{}Errors beside Table 3's: of the bounds and of the model, against the reference drape\n{}\n{}{tables}front: {}\n{recordings}",
                    results.text,
                    report::verdicts(&results.verdicts),
                    report::worse(&results.verdicts),
                    self.out.join(FRONT).display()
                ));
            }
        }
        Ok(())
    }

    /// Searches for one set of garments.
    fn tune(
        &self,
        set: &[&Garment],
        held_out: &[Garment],
        (extents_cm, shapes): (&[f64], &[f64]),
        results: &mut Results,
    ) -> anyhow::Result<()> {
        let name = set.iter().map(|w| stem(&w.name)).collect::<Vec<_>>().join("+");
        let limits = limits(set, self.max_parts.unwrap_or_else(|| set.iter().map(|w| w.table_3.parts).sum()));
        let Some(found) = find(set, &limits, (extents_cm, shapes), self.candidates, &name)? else {
            return Ok(());
        };
        let mut taken: Vec<(&'static str, Taken)> = Vec::new();
        let fronts: Vec<&Front> = found.iterations.iter().map(|i| &i.front).collect();
        let kinds = [(KINDS[0], &fronts[..found.levels]), (KINDS[1], &fronts[..])];
        for (kind, fronts) in kinds.into_iter().take(if fronts.len() == found.levels { 1 } else { 2 }) {
            let Some(front) = fronts.last().copied() else { continue };
            let exact = kind == KINDS[0] && found.exact;
            results.text.push_str(&report::front(&format!("{name}, {kind}"), front, set, exact));
            results.fronts.push((name.clone(), kind, front.clone()));
            let Some(best) = check(fronts, set, &limits, &format!("{name}, {kind}"))? else { continue };
            let path = self.table_file(&name, kind);
            runtime::write(&path, report::with_provenance(&best, set).to_toml(), "--out")?;
            results.tables.push(path);
            let on = |w: &Garment, table: &RangeTable| {
                Ok::<_, anyhow::Error>(Verdict::new((&name, kind), table, w.worth(table)?, w))
            };
            let mine =
                set.iter().zip(&best.worth).map(|(w, worth)| Verdict::new((&name, kind), &best.table, *worth, w));
            results.verdicts.extend(mine);
            for w in held_out {
                results.verdicts.push(on(w, &best.table)?.held_out(1.0));
                if best.table.has_extents()
                    && let Some((factor, table)) = fit::fitted(&best.table, w)?
                {
                    results.verdicts.push(on(w, &table)?.held_out(factor));
                }
            }
            taken.push((kind, best));
        }
        for garment in set {
            let sinks = self.sinks.sinks_in(&self.out, &stem(&garment.name));
            if !sinks.is_empty() {
                results.recordings.push(recording::record(garment, set, &found, &taken, sinks)?);
            }
        }
        Ok(())
    }

    /// Widths (cm) and heights over widths; both empty for levels alone.
    fn ladder(&self) -> anyhow::Result<(Vec<f64>, Vec<f64>)> {
        if self.levels_only {
            return Ok((Vec::new(), Vec::new()));
        }
        if let Some(wrong) = self.extents.iter().find(|cm| !(cm.is_finite() && **cm > 0.0)) {
            return Err(UserError::new(format!(
                "--extents: found {wrong}, expected centimetres above 0; --levels-only for none"
            )));
        }
        if let Some(wrong) = self.shapes.iter().find(|shape| !(shape.is_finite() && **shape > 0.0)) {
            return Err(UserError::new(format!("--shapes: found {wrong}, expected heights over widths above 0")));
        }
        let together = self.together && self.garment.len() != 1;
        let widths = if together { &WIDTHS_TOGETHER_CM[..] } else { &WIDTHS_CM };
        let shapes = if together { &SHAPES_TOGETHER[..] } else { &SHAPES };
        let or = |given: &[f64], default: &[f64]| if given.is_empty() { default } else { given }.to_vec();
        Ok((or(&self.extents, widths), or(&self.shapes, shapes)))
    }

    /// Where the table of a set of garments is written.
    fn table_file(&self, name: &str, kind: &str) -> PathBuf {
        self.out.join(format!("{name}-{}.toml", kind.replace(' ', "-")))
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    let expected = || format!("found `{text}`, expected a whole number of PARTs, 1 or more");
    text.parse().ok().filter(|&n| n > 0).ok_or_else(expected)
}
