//! `partwise compare`: range tables side by side, as numbers and in a recording.

mod changes;
mod table;

use std::path::{Path, PathBuf};

use clap::Args;
use partwise::parts::{Parts, segment};
use partwise::range_table::{EffectiveLevel, Extent, RangeTable};
use partwise::record::Tab;
use partwise::sweep::{Plan, Point, Row, Status, row_of};
use partwise::whole_file::WholeFile;

use self::changes::Changes;
use self::table::{Compared, LevelCount};
use super::failure::UserError;
use super::run::use_threads;
use super::sinks::SinkArgs;
use super::stages::ModelName;
use super::sweep::chosen::MOST;
use super::sweep::kept::Shelf;
use super::sweep::points::{ACCURACY, Against, Bench};
use super::sweep::report::{Format, line};
use super::sweep::{cache, record_all};
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
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_value = "low-cut-dress")]
    garment: Vec<String>,
    /// Body: `form`, an OBJ file, or a TOML file of measurements
    #[arg(long, value_name = "form|FILE", default_value = "form")]
    body: String,
    /// Fabric: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "interlock", help_heading = "Stages")]
    fabric: String,
    /// Model of stage two
    #[arg(long, value_enum, default_value_t = ModelName::Coupled, help_heading = "Stages")]
    model: ModelName,
    /// Cut PARTs to this extent along the cloth for `coupled`; several make a cascade; 0 cuts nothing
    #[arg(long, value_name = "CM[,CM...]", value_delimiter = ',', default_value = "6", help_heading = "Stages")]
    max_extent: Vec<f64>,
    /// Join PARTs of fewer vertices than this to a neighbour; `coupled` joins those smaller than its finest extent in any case
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Stages")]
    min_part: usize,
    /// Newton steps at full resolution, or `converged`
    #[arg(long, value_name = "N|converged", default_value = "0", help_heading = "Stages")]
    refine: String,
    /// Timed passes of each; the median is reported
    #[arg(long, value_name = "N", default_value_t = 3, help_heading = "Stages")]
    repeats: usize,
    /// What they are measured against
    #[arg(long, value_enum, default_value_t = Against::Own, help_heading = "Stages")]
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
    /// Runs the command.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if !(2..=MOST).contains(&self.tables.len()) {
            let found = self.tables.len();
            return Err(UserError::new(format!(
                "found {found} range tables, expected 2 to {MOST}; `partwise sweep` takes more"
            )));
        }
        use_threads(self.threads)?;
        self.sinks.refuse_twice(&[("--csv", self.csv.as_deref())])?;
        interrupt::listen();
        let plan = self.plan()?;
        let shelf = Shelf::in_memory();
        let bench = Bench::new(&shelf, cache(self.cache.as_ref()));
        let bar = console::progress(Some(plan.points.len() as u64), "compare");
        let mut rows: Vec<Row> = Vec::new();
        for point in &plan.points {
            bar.set_message(format!("{}, {}", point.garment.label, point.table.label));
            let Some(row) = row_of(point, &bench, plan.warm_up, plan.repeats) else { break };
            rows.push(row);
            bar.inc(1);
        }
        bar.finish_and_clear();
        for warning in bench.warnings() {
            console::warning(&warning);
        }
        let compared = self.compared(&plan, &rows, &bench)?;
        if let Some(path) = &self.csv {
            let written = WholeFile::write(path, table::csv(&compared)?);
            written.map_err(|e| {
                UserError::new(format!("{}: cannot be written: {e}; choose another file", path.display()))
            })?;
        }
        let folder = Path::new("recordings").join("compare");
        let recordings = record_all(&rows, &shelf, "compare", &folder, &self.sinks, Tab::SideBySide)?;
        let lines: String = recordings.iter().map(line).collect();
        match self.format {
            Format::Text => console::result(&format!("{}{lines}", table::text(&compared))),
            Format::Json => console::result(&serde_json::to_string(&compared)?),
            Format::Csv => console::result(&table::csv(&compared)?),
        }
        let failed = rows.iter().filter(|row| row.status == Status::Error).count();
        if failed > 0 {
            anyhow::bail!("{failed} of {} drapes failed: the table says why", rows.len());
        }
        Ok(())
    }

    /// The comparison as a sweep of one grid.
    fn plan(&self) -> anyhow::Result<Plan> {
        let text = |s: &String| toml::Value::String(s.clone());
        let mut base = toml::Table::new();
        base.insert("body".into(), text(&self.body));
        base.insert("fabric".into(), text(&self.fabric));
        let model = match self.model {
            ModelName::Coupled => "coupled",
            ModelName::Paper => "paper",
        };
        base.insert("model".into(), model.into());
        let min_part = i64::try_from(self.min_part)?;
        base.insert("min_part".into(), min_part.into());
        let extents: Vec<f64> = self.max_extent.iter().copied().filter(|cm| *cm != 0.0).collect();
        base.insert("extent_cm".into(), if extents.is_empty() { "none".into() } else { extents.into() });
        let refine = self.refine.parse::<i64>().map_or_else(|_| text(&self.refine), Into::into);
        base.insert("refine".into(), refine);
        let list = |names: &[String]| toml::Value::Array(names.iter().map(text).collect());
        let mut grid = toml::Table::new();
        grid.insert("garments".into(), list(&self.garment));
        grid.insert("tables".into(), list(&self.tables));
        let mut file = toml::Table::new();
        file.insert("name".into(), "compare".into());
        file.insert("repeats".into(), i64::try_from(self.repeats)?.into());
        file.insert("base".into(), base.into());
        file.insert("grid".into(), grid.into());
        let plan = Plan::parse(&toml::to_string(&file)?, "command line", Path::new(""))?;
        for note in &plan.notes {
            console::note(note);
        }
        Ok(plan.with_option(ACCURACY, self.accuracy.name()))
    }

    fn compared(&self, plan: &Plan, rows: &[Row], bench: &Bench<'_>) -> anyhow::Result<Vec<Compared>> {
        let mut out: Vec<Compared> = Vec::new();
        let mut first: Option<(String, Parts)> = None;
        for row in rows {
            let point: &Point = &plan.points[row.index];
            let placed = bench.placed(point)?;
            let table = point.table.resolve(&placed.distance_m)?;
            let (mesh, topology) = (&placed.scene.garment, &placed.scene.topology);
            let parts =
                segment(topology, &placed.distance_m, &table).cut_to_table(mesh, topology, &placed.scene.rest, &table);
            let scene = point.scene_id();
            if first.as_ref().is_none_or(|(of, _)| *of != scene) {
                first = Some((scene, parts.clone()));
            }
            let changes = first.as_ref().map_or(Changes::default(), |(_, from)| Changes::between(from, &parts));
            out.push(Compared::new(row.clone(), parts.len(), changes, levels(&table, &parts)));
        }
        Ok(out)
    }
}

fn levels(table: &RangeTable, parts: &Parts) -> Vec<LevelCount> {
    let mut vertices = vec![0; parts.parts_per_level.len()];
    for part in &parts.parts {
        vertices[part.level as usize] += part.vertices.len();
    }
    let bounds = table.effective_levels();
    let counts = bounds.iter().zip(&parts.parts_per_level).zip(vertices);
    let count = |(level, ((bound, &parts), vertices)): (usize, ((&EffectiveLevel, &usize), usize))| {
        let upper_cm = bound.upper_cm.is_finite().then_some(bound.upper_cm);
        let extent_cm = bound
            .extent
            .filter(Extent::cuts)
            .map(|e| e.numbers_cm().iter().map(f64::to_string).collect::<Vec<_>>().join("x"));
        LevelCount { level, lower_cm: bound.lower_cm, upper_cm, extent_cm, vertices, parts }
    };
    counts.enumerate().map(count).collect()
}
