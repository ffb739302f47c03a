//! `partwise compare`: range tables side by side, as numbers and in a recording.

mod changes;
mod table;

use std::path::{Path, PathBuf};

use crate::drape::{Refine, Settings};
use crate::parts::range_table::{RangeTable, TableRule};
use crate::parts::{Parts, segment};
use crate::record::Tab;
use crate::study::job::Against;
use crate::study::metrics::LevelCount;
use crate::study::sweep::{Bench, MOST_PASSES, Plan, Row, Status};
use crate::{Job, SceneSpec};
use clap::Args;

use self::changes::Changes;
use self::table::Compared;
use super::failure::UserError;
use super::runtime::{cache, use_threads, write};
use super::sinks::SinkArgs;
use super::stages::DialArgs;
use super::sweep::chosen::MOST;
use super::sweep::points::KeepingBench;
use super::sweep::record_all;
use super::sweep::report::{Format, line};
use super::sweep::store::PointStore;
use super::{console, interrupt};

pub(super) const LONG_ABOUT: &str = "\
Drapes a garment once for each of two to six range tables and sets them side by side: PARTs of each level, which PARTs of the \
first table are kept, split or merged, the time of the two stages, and how far the drape they give is from where it would settle.

Without --refine this judges the two-stage scheme alone, which is where tables differ; refined to convergence they all end in a \
settled drape.";

const EXAMPLES: &str = "\
Examples:
  partwise compare table-3 mine.toml                                  one garment, a recording in recordings/compare/
  partwise compare table-3 a.toml b.toml --garment pullover-1 --garment flared-skirt@3613 --csv levels.csv
  partwise compare table-3 mine.toml --max-extent 12 --refine 10      other dials, the same for all";

/// Arguments of `compare`.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// Range tables: `table-3` (the paper's) or TOML files; the others are compared with the first
    #[arg(required = true, value_name = "NAME|FILE")]
    tables: Vec<String>,
    /// Garment, as in `partwise run`; several are compared one by one
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_values_t = [SceneSpec::default().garment])]
    garment: Vec<String>,
    /// Body: `form`, an OBJ file, or a TOML file of measurements
    #[arg(long, value_name = "form|FILE", default_value_t = SceneSpec::default().body)]
    body: String,
    #[command(flatten)]
    dials: DialArgs,
    /// Newton steps at full resolution, or `converged`
    #[arg(long, value_name = "N|converged", default_value_t = Job::preview().settings.refine, help_heading = "Stages")]
    refine: Refine,
    /// Timed passes of each; the median is reported
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=MOST_PASSES as u64), help_heading = "Stages")]
    repeats: u64,
    /// What they are measured against: `none`, `canonical` (the drape of garment, body and fabric), or `own`
    /// continuation too
    #[arg(long, value_name = "none|canonical|own", default_value_t = Against::Own, help_heading = "Stages")]
    accuracy: Against,
    /// Where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Stages")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    sinks: SinkArgs,
    /// Write the comparison to this CSV file too, a line for each level
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    csv: Option<PathBuf>,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

impl CompareArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if !(2..=MOST).contains(&self.tables.len()) {
            let found = self.tables.len();
            let text = format!("found {found} range tables, expected 2 to {MOST}; `partwise sweep` takes more");
            return Err(UserError::new(text));
        }
        use_threads(self.threads)?;
        self.sinks.check_outputs(&[("--csv", self.csv.as_deref())])?;
        interrupt::keep();
        let plan = self.plan()?;
        let store = PointStore::in_memory();
        let bench = KeepingBench::new(&store, cache(self.cache.as_ref()));
        // What cannot be loaded is said before anything is draped, and is the user's to mend.
        for point in &plan.points {
            let loaded = bench.bench.scene(point).map_err(|error| UserError::new(error.to_string()))?;
            self.dials.cloth.check_used(&loaded)?;
        }
        let bar = console::progress(Some(plan.points.len() as u64), "compare");
        let mut rows: Vec<Row> = Vec::new();
        for point in &plan.points {
            bar.set_message(format!("{}, {}", point.garment, point.job.settings.table.name()));
            let Some(row) = bench.row(point, (0, self.repeats as usize)) else { break };
            rows.push(row);
            bar.inc(1);
        }
        bar.finish_and_clear();
        console::warnings(&bench.bench.warnings());
        let compared = compared(&plan, &rows, &bench.bench)?;
        if let Some(path) = &self.csv {
            write(path, table::csv(&compared)?, "--csv")?;
        }
        let folder = Path::new("recordings").join("compare");
        let recordings = record_all(&rows, &store, "compare", &folder, &self.sinks, Tab::SideBySide)?;
        let lines: String = recordings.iter().map(line).collect();
        match self.format {
            Format::Text => console::result(&format!("{}{lines}", table::text(&compared))),
            Format::Json => console::result(&crate::base::error_text::json(&compared)?),
            Format::Csv => console::result(&table::csv(&compared)?),
        }
        let failed = rows.iter().filter(|row| row.status == Status::Error).count();
        if failed > 0 {
            let text = format!("{failed} of {} drapes failed: the table says why", rows.len());
            // Body, garment and tables are the user's; a panic is not.
            let ours = rows.iter().any(|row| row.error.starts_with("panicked"));
            return Err(if ours { anyhow::Error::msg(text) } else { UserError::new(text) });
        }
        Ok(())
    }

    /// The comparison as a plan: every table on every garment.
    fn plan(&self) -> anyhow::Result<Plan> {
        self.dials.cloth.only("compare")?;
        let settings = Settings { refine: self.refine, ..self.dials.over(Job::preview().settings)? };
        let table = |name: &String| Ok(TableRule::from(RangeTable::by_name(name)?).named(name));
        let tables: Vec<TableRule> = self.tables.iter().map(table).collect::<anyhow::Result<_>>()?;
        let mut jobs = Vec::new();
        for garment in &self.garment {
            let scene = SceneSpec::new(&self.body, garment);
            scene.check_names()?;
            jobs.extend(tables.iter().map(|table| Job {
                scene: scene.clone(),
                settings: Settings { table: table.clone(), ..settings.clone() },
                accuracy: self.accuracy,
                ..Job::preview()
            }));
        }
        let plan = Plan::of_jobs("compare", jobs)?;
        console::notes(&plan.notes);
        Ok(plan)
    }
}

fn compared(plan: &Plan, rows: &[Row], bench: &Bench<'_>) -> anyhow::Result<Vec<Compared>> {
    let mut out: Vec<Compared> = Vec::new();
    let mut first: Option<(String, Parts)> = None;
    for row in rows {
        let point = &plan.points[row.index];
        let loaded = bench.scene(point)?;
        let (scene, distances_m) = (&loaded.scene, loaded.scene.distances_m()?);
        let table = point.job.settings.table.resolve(&distances_m)?;
        let parts = segment(&scene.topology, &distances_m, &table);
        let parts = parts.cut_to_table(&scene.garment, &scene.topology, &scene.rest, &table);
        let id = point.scene_id();
        if first.as_ref().is_none_or(|(of, _)| *of != id) {
            first = Some((id, parts.clone()));
        }
        let changes = first.as_ref().map_or(Changes::default(), |(_, from)| Changes::between(from, &parts));
        let per_level = LevelCount::all(&table, &parts);
        out.push(Compared { row: row.clone(), changes, per_level });
    }
    Ok(out)
}
