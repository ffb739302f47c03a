//! `partwise compare`: compares range tables in numbers and in a recording.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::base::files::names_a_file;
use crate::drape::{Refine, Settings};
use crate::parts::range_table::{Extent, RangeTable, TableRule};
use crate::parts::{Parts, UNASSIGNED, segment};
use crate::record::Tab;
use crate::study::job::Against;
use crate::study::metrics::LevelCount;
use crate::study::sweep::{Bench, MAX_PASSES, Plan, Row, Status, cell};
use crate::{Job, SceneSpec};
use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value};

use super::console::{self, RowFormat};
use super::pictures::PictureArgs;
use super::runtime::{UserError, keep_results, reference_cache, refuse, use_threads, write};
use super::sinks::SinkArgs;
use super::stages::ModelArgs;
use super::sweep::recording::MAX_SIDE_BY_SIDE;
use super::sweep::report::{recording_line, rows_text};
use super::sweep::store::{PointStore, StoringBench};
use super::sweep::{NOT_STORED, record_all};

/// Arguments of `compare`.
#[derive(Debug, Clone, Args)]
#[command(after_help = include_str!("../../assets/help/compare.txt"))]
pub(crate) struct CompareArgs {
    /// Range tables: `table-3` (the paper's) or TOML files; the first is the reference of the comparison
    #[arg(required = true, value_name = "NAME|FILE")]
    tables: Vec<String>,
    /// Garment, as in `partwise run`; of several, each is compared separately
    #[arg(long, value_name = "NAME[@VERTICES]|FILE", default_values_t = [SceneSpec::default().garment])]
    garment: Vec<String>,
    /// Body: `form`, a mesh file, or a TOML file of measurements
    #[arg(long, value_name = "form|FILE", default_value_t = SceneSpec::default().body)]
    body: String,
    #[command(flatten)]
    model: ModelArgs,
    /// Newton steps at full resolution, or `converged`
    #[arg(long, value_name = "N|converged", default_value_t = Job::preview().settings.refine, help_heading = "Stages")]
    refine: Refine,
    /// Timed passes per table; the median is reported
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=MAX_PASSES as u64), help_heading = "Stages")]
    repeats: u64,
    /// Reference of the errors: `none`, `canonical` (the canonical drape of garment, body and fabric), or `own` (also each drape's own
    /// continuation to convergence)
    #[arg(long, value_name = "none|canonical|own", default_value_t = Against::Own, help_heading = "Stages")]
    accuracy: Against,
    /// Folder of the reference drapes [default: the user's cache folder]
    #[arg(long, value_name = "DIR", help_heading = "Stages")]
    cache: Option<PathBuf>,
    #[command(flatten)]
    sinks: SinkArgs,
    #[command(flatten)]
    picture: PictureArgs,
    /// Also write the comparison to this CSV file, one line per level
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    csv: Option<PathBuf>,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text, help_heading = "Output")]
    format: RowFormat,
    /// Worker threads; results do not depend on it [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Output")]
    threads: Option<usize>,
}

impl CompareArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if !(2..=MAX_SIDE_BY_SIDE).contains(&self.tables.len()) {
            let found = self.tables.len();
            refuse!("found {found} range tables, expected 2 to {MAX_SIDE_BY_SIDE}; `partwise sweep` accepts more");
        }
        use_threads(self.threads)?;
        self.picture.check_before(false, &NOT_STORED)?;
        self.sinks.check_outputs(&[("--csv", self.csv.as_deref()), self.picture.output()])?;
        keep_results();
        let plan = self.plan()?;
        let store = PointStore::in_memory();
        let bench = StoringBench::new(&store, reference_cache(self.cache.as_ref()));
        // Errors of the inputs are reported before the first drape, with exit code 2.
        for point in &plan.points {
            let loaded = bench.bench.scene(point).map_err(|error| UserError(error.to_string()))?;
            self.model.fabric.check_used(&loaded)?;
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
        let compared = compared(&plan, &rows, &bench.bench)?;
        if let Some(path) = &self.csv {
            write(path, csv(&compared)?, "--csv")?;
        }
        let folder = Path::new("recordings").join("compare");
        let recordings = record_all(&rows, &store, "compare", &folder, &self.sinks, Tab::SideBySide)?;
        console::notes(self.picture.draw_sweep("compare", &rows, &store)?.as_slice());
        let recordings: String = recordings.iter().map(recording_line).collect();
        match self.format {
            RowFormat::Text => console::prose(&(text(&compared) + &recordings)),
            RowFormat::Json => console::json(&compared)?,
            RowFormat::Csv => console::result(&csv(&compared)?),
        }
        console::warnings(&bench.bench.warnings());
        let failed = rows.iter().filter(|row| row.status == Status::Error).count();
        if failed > 0 {
            let text = format!("{failed} of {} drapes failed: the table contains the reasons", rows.len());
            // A panic is a defect of the program; any other failure is due to body, garment or table.
            anyhow::ensure!(!rows.iter().any(|row| row.error.starts_with("panicked")), text);
            refuse!("{text}");
        }
        Ok(())
    }

    /// The comparison as a plan: every table on every garment.
    fn plan(&self) -> anyhow::Result<Plan> {
        self.model.fabric.check_single("compare")?;
        let settings = Settings { refine: self.refine, ..self.model.apply(Job::preview().settings)? };
        let table = |(name, label): (&String, &String)| Ok(TableRule::from(RangeTable::by_name(name)?).named(label));
        let labels = labels(&self.tables);
        let tables: Vec<TableRule> = self.tables.iter().zip(&labels).map(table).collect::<anyhow::Result<_>>()?;
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

/// The file names without folder and ending, which leave room for the numbers; where two are equal, all tables as they were given.
fn labels(tables: &[String]) -> Vec<String> {
    let short = tables.iter().map(|table| {
        let stem = Path::new(table).file_stem().filter(|_| names_a_file(table));
        stem.map_or_else(|| table.clone(), |stem| stem.to_string_lossy().into_owned())
    });
    let short: Vec<String> = short.collect();
    if short.iter().collect::<BTreeSet<_>>().len() == tables.len() { short } else { tables.to_vec() }
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

/// Differences between the PARTs of two tables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
struct Changes {
    /// PARTs of the first table with the same vertices in the second.
    kept: usize,
    /// PARTs of the first table whose vertices are in several PARTs of the second.
    split: usize,
    /// PARTs of the second table with vertices from several PARTs of the first.
    merged: usize,
}

impl Changes {
    /// The differences from `from` to `to`. Vertices without a PART count as one further PART in `split` and `merged`.
    fn between(from: &Parts, to: &Parts) -> Self {
        let pairs = from.part_of_vertex.iter().zip(&to.part_of_vertex);
        let mut meet: Vec<(u32, u32)> = pairs.map(|(&a, &b)| (a, b)).collect();
        meet.sort_unstable();
        meet.dedup();
        let mut back: Vec<(u32, u32)> = meet.iter().map(|&(a, b)| (b, a)).collect();
        back.sort_unstable();
        let runs = |pairs: &[(u32, u32)]| pairs.chunk_by(|p, q| p.0 == q.0).filter(|run| run.len() > 1).count();
        let alone = |pairs: &[(u32, u32)], key: u32| {
            let first = pairs.partition_point(|p| p.0 < key);
            pairs.get(first + 1).is_none_or(|p| p.0 != key)
        };
        let kept = meet.iter().filter(|&&(a, b)| a != UNASSIGNED && alone(&meet, a) && alone(&back, b)).count();
        Self { kept, split: runs(&meet), merged: runs(&back) }
    }
}

/// One table on one garment.
#[derive(Debug, Clone, Serialize)]
struct Compared {
    /// The row, as in a sweep.
    #[serde(flatten)]
    row: Row,
    /// Changes from the first table.
    #[serde(flatten)]
    changes: Changes,
    /// Counts of each level.
    per_level: Vec<LevelCount>,
}

impl Compared {
    /// PARTs defined by the levels alone, before the model cuts them.
    fn parts_by_levels(&self) -> usize {
        self.per_level.iter().map(|level| level.parts).sum()
    }
}

/// The comparison as text: the rows, then for each garment the changes of PARTs and the levels.
fn text(all: &[Compared]) -> String {
    let rows: Vec<Row> = all.iter().map(|c| c.row.clone()).collect();
    let mut out = rows_text(&rows);
    for compared in all.chunk_by(|a, b| a.row.garment == b.row.garment) {
        let changes = compared.iter().map(|c| {
            let Changes { kept, split, merged } = c.changes;
            let counts = [c.parts_by_levels(), kept, split, merged].map(|n| n.to_string());
            [c.row.table.clone()].into_iter().chain(counts).collect::<Vec<_>>()
        });
        let garment = &compared[0].row.garment;
        let changes = console::table(console::OPEN, ["table", "PARTs", "kept", "split", "merged"], 1.., changes);
        let _ = writeln!(out, "\n{garment}: PARTs by levels alone, and changes from the first table\n{changes}");
        let tables = compared.iter().map(|c| c.row.table.as_str());
        let header = ["level cm"].into_iter().chain(tables);
        let _ =
            writeln!(out, "PARTs of each level\n{}", console::table(console::OPEN, header, 0.., level_rows(compared)));
    }
    out
}

/// The occupied levels of all tables, ascending, and the PARTs that each table has in them. Levels with other bounds are other rows: their
/// PARTs do not compare.
fn level_rows(compared: &[Compared]) -> Vec<Vec<String>> {
    let levels = |c: &'_ Compared| c.per_level.clone().into_iter().filter(|level| level.vertices > 0);
    let mut bounds: Vec<[f64; 2]> = compared.iter().flat_map(levels).map(|l| [l.lower_cm, l.upper_cm]).collect();
    bounds.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    bounds.dedup();
    let row = |[lower, upper]: [f64; 2]| {
        let cells = compared.iter().map(|c| {
            let level = levels(c).find(|l| [l.lower_cm, l.upper_cm] == [lower, upper]);
            level.map_or_else(|| "–".to_owned(), |level| parts_text(&level))
        });
        [range(lower, upper)].into_iter().chain(cells).collect()
    };
    bounds.into_iter().map(row).collect()
}

/// The PARTs of a level, and the extent that they are cut to.
fn parts_text(level: &LevelCount) -> String {
    let extent = level.extent.filter(Extent::cuts).map_or_else(String::new, |extent| format!(", cut to {extent} cm"));
    format!("{}{extent}", level.parts)
}

/// The bounds of a level.
fn range(lower_cm: f64, upper_cm: f64) -> String {
    let short = |cm: f64| format!("{cm:.3}").trim_end_matches('0').trim_end_matches('.').to_owned();
    let upper = if upper_cm.is_finite() { short(upper_cm) } else { "∞".to_owned() };
    format!("{}–{upper}", short(lower_cm))
}

/// Columns of the CSV: those of the row and of the level.
const HEADER: &str = "garment,table,level,lower_cm,upper_cm,extent_cm,vertices,parts,level_part_count,kept,split,merged,\
    part_count,time_total_ms,rms_mm,canonical_rms_mm,representable_rms_mm,representable_affine_rms_mm,error";

/// The comparison as CSV: one line per level with the totals of its table; a failed table has one line without a level.
fn csv(all: &[Compared]) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(HEADER.split(','))?;
    for c in all {
        let mut cells: Map<String, Value> = serde_json::from_value(serde_json::to_value(c)?)?;
        let mut write =
            |cells: &Map<String, Value>| writer.write_record(HEADER.split(',').map(|name| cell(cells.get(name))));
        if c.row.status == Status::Error || c.per_level.is_empty() {
            write(&cells)?;
            continue;
        }
        for level in &c.per_level {
            cells.extend(serde_json::from_value::<Map<String, Value>>(serde_json::to_value(level)?)?);
            write(&cells)?;
        }
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DVec3;
    use crate::mesh::{Topology, TriMesh};

    /// The PARTs of a strip of vertices at 0, 1, 2, ... cm from the body.
    fn cut(bounds_cm: &[f64]) -> Parts {
        cut_by(&RangeTable::from_inner_bounds("t", bounds_cm).unwrap())
    }

    fn cut_by(table: &RangeTable) -> Parts {
        let n = 12_u32;
        let positions = (0..n).map(|i| DVec3::new(f64::from(i / 2), f64::from(i % 2), 0.0)).collect();
        let triangles = (0..n - 2).map(|i| [i, i + 1, i + 2]).collect();
        let topology = Topology::new(&TriMesh::new(positions, triangles));
        let distance: Vec<f64> = (0..n).map(|i| 0.01 * f64::from(i / 2) + 0.001).collect();
        segment(&topology, &distance, table)
    }

    #[test]
    fn levels_with_unlike_bounds_are_rows_of_their_own() {
        let of = |table: &RangeTable| {
            let parts = cut_by(table);
            Compared { row: Row::default(), changes: Changes::default(), per_level: LevelCount::all(table, &parts) }
        };
        let [coarse, fine] = [[2.0, 4.0].as_slice(), &[2.0, 3.0, 4.0]]
            .map(|bounds| of(&RangeTable::from_inner_bounds("t", bounds).unwrap()));
        let rows = level_rows(&[coarse, fine]);
        let cells: Vec<Vec<&str>> = rows.iter().map(|row| row.iter().map(String::as_str).collect()).collect();
        assert_eq!(
            cells,
            [["0–2", "1", "1"], ["2–3", "–", "1"], ["2–4", "1", "–"], ["3–4", "–", "1"], ["4–∞", "1", "1"]]
        );
    }

    #[test]
    fn tables_are_labelled_by_their_file_names_unless_these_are_equal() {
        let of = |tables: [&str; 2]| labels(&tables.map(str::to_owned));
        assert_eq!(of(["table-3", "assets/tables/table-3-12cm.toml"]), ["table-3", "table-3-12cm"]);
        assert_eq!(of(["a/t.toml", "b/t.toml"]), ["a/t.toml", "b/t.toml"]);
    }

    #[test]
    fn counts_of_kept_split_and_merged_parts_match_a_hand_count() {
        let (coarse, fine) = (cut(&[2.0, 4.0]), cut(&[2.0, 3.0, 4.0]));
        assert_eq!(Changes::between(&coarse, &fine), Changes { kept: 2, split: 1, merged: 0 });
        assert_eq!(Changes::between(&fine, &coarse), Changes { kept: 2, split: 0, merged: 1 });
        assert_eq!(Changes::between(&fine, &fine), Changes { kept: 4, split: 0, merged: 0 });
        // A moved bound splits one PART and merges its piece into the neighbour.
        assert_eq!(Changes::between(&cut(&[2.0]), &cut(&[3.0])), Changes { kept: 0, split: 1, merged: 1 });
        // Vertices without a PART are not a kept PART.
        let none = cut_by(&RangeTable::from_bounds("none", &[50.0, 60.0]).unwrap());
        assert_eq!(Changes::between(&none, &none), Changes::default());
    }
}
