//! `partwise bench table-4`: the paper's comparison of methods as a repeatable experiment.

use std::path::{Path, PathBuf};

use crate::SceneSpec;
use crate::garment::fabric::{DEFAULT_FABRIC, Fabric};
use crate::garment::{GarmentRequest, MeshCache};
use crate::picture::colour::map::Range;
use crate::record::{Colours, Compared, Layout, Overlay, Picture, RecordOptions, Recorder, ScatterPoint, Sink};
use crate::scene::Scene;
use crate::study::accuracy::vertex_errors;
use crate::study::table4::{
    self, ComparedMethod, Conditions, DrapedRow, METHODS, MethodResult, RowLog, TEN_ROWS, Table4Error, Table4Options,
    Table4Row,
};
use clap::{Args, Subcommand};
use serde_json::json;

use super::ablation::AblationArgs;
use super::console::{self, RowFormat};
use super::runtime::{
    UserError, check, control_flow, create_folder, keep_results, refuse, unwritable, use_threads, write,
};

/// Sizes of `--growth`.
const GROWTH: [usize; 4] = [1_000, 4_000, 16_000, 64_000];

/// The benchmarks.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// The paper's Table 4: its reference methods, its own equations, and the coupled model
    ///
    /// Drapes the paper's garments by six methods: the reference methods [19], [20] and [21], the paper's equations (`paper`), the two
    /// stages of the coupled model (`preview`), and the coupled model refined to convergence (`converged`). The rounds of all methods
    /// are interleaved, so that other load on the machine affects all alike, and ratios are computed per round.
    ///
    /// Time-stepping methods stop by one criterion: an RMS speed of the vertices under 1 cm/s over a quarter of a second. Beside the
    /// time stand figures that the paper does not report: the error against the canonical drape, the residual of one common energy,
    /// strain, penetration.
    ///
    /// Hem height and girths complete the error of each method. A method that cannot run on a garment has no figures, and the table
    /// gives the reason.
    #[command(name = "table-4", after_help = include_str!("../../assets/help/bench-table-4.txt"))]
    TableFour(TableFourArgs),
    /// Effect of each option of the solver: every one off, or halved and doubled, one at a time
    ///
    /// Drapes a set of garments to rest with each variant, and counts steps, time, drapes that rest, and intersections. A
    /// variant of the 52 drapes takes over a minute on two cores; name the options with --only.
    Ablation(AblationArgs),
}

/// Arguments of `bench table-4`.
#[derive(Debug, Args)]
pub(crate) struct TableFourArgs {
    /// Rows: built-in garments with vertex counts [default: the paper's ten]
    #[arg(long, value_name = "NAME@VERTICES", value_delimiter = ',')]
    rows: Vec<GarmentRequest>,
    /// Instead of the ten rows: this garment at 1,000, 4,000, 16,000 and 64,000 vertices
    #[arg(long, value_name = "NAME", conflicts_with = "rows")]
    growth: Option<GarmentRequest>,
    /// Fabric: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_FABRIC)]
    fabric: String,
    /// Measured rounds
    #[arg(long, value_name = "N", default_value_t = Table4Options::default().rounds as u64, value_parser = clap::value_parser!(u64).range(1..=1000))]
    rounds: u64,
    /// Canonical drapes from this many perturbed starts, for the spread between equilibria
    #[arg(long, value_name = "N", default_value_t = Table4Options::default().starts)]
    starts: u64,
    /// Two garments of 600 vertices, one round, no perturbed starts; no rows file
    #[arg(long, conflicts_with_all = ["rows", "growth", "rounds", "starts", "rows_file"])]
    quick: bool,
    /// File of finished rows, also read at the start
    #[arg(long, value_name = "FILE.json", default_value = "table-4.json")]
    rows_file: PathBuf,
    /// Record each finished row into this folder: its drapes side by side, and plots of time
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Also write a line for every method of every row to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Format of the result on stdout
    #[arg(long, value_enum, default_value_t = RowFormat::Text)]
    format: RowFormat,
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl TableFourArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        let rows_file = if self.quick { None } else { Some((&self.rows_file, "--rows-file")) };
        for (path, flag) in self.csv.iter().map(|path| (path, "--csv")).chain(rows_file) {
            check(path, flag)?;
        }
        let fabric = Fabric::by_name(&self.fabric)?;
        let options = self.options();
        let conditions = Conditions::here(&fabric.name, &options);
        let requested = self.requested()?;
        let mut log = if self.quick {
            RowLog { conditions, rows: Vec::new() }
        } else {
            RowLog::open(&self.rows_file, conditions).map_err(|e| UserError(e.to_string()))?
        };
        if let Some(folder) = &self.recordings {
            create_folder(folder)?;
        }
        keep_results();
        let missing: Vec<&(String, usize)> =
            requested.iter().filter(|(name, n)| log.find(name, *n).is_none()).collect();
        let found = requested.len() - missing.len();
        let runs = options.warm_up + options.rounds;
        let bar = console::progress(Some((missing.len() * runs * METHODS.len()) as u64), "table 4");
        for (done, (name, vertices)) in missing.iter().enumerate() {
            let (mut begun, before) = (0, (done * runs * METHODS.len()) as u64);
            let mut last = (usize::MAX, String::new());
            let mut observe = |round: usize, of: usize, method: &str| {
                if last.0 != round || last.1 != method {
                    last = (round, method.to_owned());
                    bar.set_position(before + begun);
                    begun = (begun + 1).min((runs * METHODS.len()) as u64);
                    bar.set_message(format!("{name}@{vertices}: {method}, round {} of {of}", (round + 1).min(of)));
                }
                control_flow()
            };
            let spec = SceneSpec::new(SceneSpec::default().body, format!("{name}@{vertices}"));
            let loaded = spec.load_with(&MeshCache::in_user_cache())?;
            match table4::row((name, *vertices), &loaded.scene, &fabric, &options, &mut observe) {
                Ok(draped_row) => {
                    log.rows.push(draped_row.row.clone());
                    // Written before the recording, so that a full disk loses the recording and not the row.
                    if !self.quick {
                        let file = &self.rows_file;
                        log.write(file).map_err(unwritable(file, "--rows-file"))?;
                    }
                    if let Some(folder) = &self.recordings {
                        let path = record(folder, &draped_row, &loaded.scene, &log.rows)?;
                        bar.suspend(|| console::note(&format!("recording: {}", path.display())));
                    }
                }
                Err(Table4Error::Interrupted) => break,
                Err(error) => return Err(error.into()),
            }
        }
        bar.finish_and_clear();
        self.report(&log, &requested, found)
    }

    fn options(&self) -> Table4Options {
        if self.quick {
            return Table4Options { rounds: 1, warm_up: 0, starts: 0, ..Table4Options::default() };
        }
        let rounds = usize::try_from(self.rounds).unwrap_or(usize::MAX);
        Table4Options { rounds, starts: self.starts, ..Table4Options::default() }
    }

    /// Garments and vertex counts, in order.
    fn requested(&self) -> anyhow::Result<Vec<(String, usize)>> {
        if self.quick {
            return Ok(["flared-skirt", "pullover-1"].map(|name| (name.to_owned(), 600)).to_vec());
        }
        if let Some(GarmentRequest { name, vertices }) = &self.growth {
            if let Some(vertices) = vertices {
                let rows = GROWTH.map(|n| format!("{name}@{n}")).join(",");
                refuse!(
                    "--growth {name}@{vertices}: found a number of vertices, expected the name alone; for other sizes use --rows {rows}"
                );
            }
            SceneSpec::new(SceneSpec::default().body, name.clone()).check_names()?;
            return Ok(GROWTH.iter().map(|n| (name.clone(), *n)).collect());
        }
        if self.rows.is_empty() {
            return Ok(TEN_ROWS.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect());
        }
        let row = |GarmentRequest { name, vertices }: &GarmentRequest| {
            let Some(vertices) = *vertices else {
                refuse!("--rows {name}: found no number of vertices, expected {name}@VERTICES")
            };
            SceneSpec::new(SceneSpec::default().body, format!("{name}@{vertices}")).check_names()?;
            Ok((name.clone(), vertices))
        };
        self.rows.iter().map(row).collect()
    }

    fn report(&self, log: &RowLog, requested: &[(String, usize)], found: usize) -> anyhow::Result<()> {
        let rows: Vec<Table4Row> = requested.iter().filter_map(|(name, n)| log.find(name, *n)).cloned().collect();
        let csv = table4::csv_lines(&rows)?;
        if let Some(path) = &self.csv {
            write(path, &csv, "--csv")?;
        }
        let missing = requested.len() - rows.len();
        match self.format {
            RowFormat::Csv => console::result(&csv),
            RowFormat::Json => {
                console::json(&json!({ "conditions": log.conditions, "rows": rows, "missing_rows": missing }))?;
            }
            RowFormat::Text => console::prose(&text(log, &rows)),
        }
        if self.recordings.is_some() && found > 0 {
            console::note(&format!(
                "{found} rows were found in {} and not draped again: they have no recording",
                self.rows_file.display()
            ));
        }
        if missing > 0 {
            let all = requested.len();
            console::warning(&format!("{missing} of {all} rows are missing; the same command continues"));
        }
        Ok(())
    }
}

/// The tables as text.
fn text(log: &RowLog, rows: &[Table4Row]) -> String {
    let mut out = log.conditions.text();
    for cells in table4::tables(rows).into_iter().chain(table4::exponents(rows)) {
        // The vertices tell rows of one garment apart.
        let table = console::table(console::RULED, &cells.header, 2.., &cells.rows);
        out += &format!("\n\n{}\n{table}", cells.title);
    }
    for (row, entry) in rows.iter().flat_map(|row| row.entries.iter().map(move |entry| (row, entry))) {
        if let Some(error) = &entry.error {
            out += &format!("\n{}@{}: {}: {error}", row.garment, row.asked, entry.method);
        }
    }
    out
}

/// Quantile of the distances at the upper end of the colour scale; larger distances have the last colour. A heuristic.
const COLOUR_QUANTILE: f64 = 0.75;

/// Records a row into a folder: its drapes side by side, coloured by the distance to the canonical drape, and times over errors and
/// over vertices. `rows` are the rows so far, including this one.
fn record(folder: &Path, draped_row: &DrapedRow, scene: &Scene, rows: &[Table4Row]) -> anyhow::Result<PathBuf> {
    let DrapedRow { row, draped, canonical } = draped_row;
    let name = format!("{}-{}", row.garment, row.asked);
    let path = folder.join(format!("{name}.rrd"));
    let titles = METHODS.map(ComparedMethod::title);
    let caption = |(entry, title): (&MethodResult, &str)| match entry.error {
        None => format!("{title}: {:.0} ms, {:.1} mm canonical error", entry.median_ms, entry.canonical_rms_mm),
        Some(_) => format!("{title}: cannot run here"),
    };
    let mut recorder = Recorder::open(RecordOptions {
        sinks: vec![Sink::File(path.clone())],
        name: format!("{name}: Table 4"),
        layout: Layout {
            table4: true,
            compare: row.entries.iter().zip(titles).map(caption).collect(),
            ..Layout::default()
        },
        ..RecordOptions::default()
    })?;
    recorder.body(0, scene.body.mesh())?;
    recorder.garment(0, &scene.garment)?;
    let distances_mm = |x: &Vec<_>| vertex_errors(x, canonical).into_iter().map(|m| 1e3 * m).collect::<Vec<f64>>();
    let errors_mm: Vec<Option<Vec<f64>>> = draped.iter().map(|x| x.as_ref().map(distances_mm)).collect();
    let range = Range::to_quantile(errors_mm.iter().flatten().flatten().copied(), COLOUR_QUANTILE);
    for (slot, (x, errors_mm)) in draped.iter().zip(&errors_mm).enumerate() {
        let (Some(x), Some(values)) = (x, errors_mm) else { continue };
        let colours = Colours::Overlay(Overlay { name: "distance", unit: "mm", values, positions: None }, range);
        recorder.compare(&Compared { index: 0, slot, caption: "", draped: x, colours })?;
    }
    let points = |of: &Table4Row, place: fn(&Table4Row, usize) -> [f64; 2], named: bool| {
        let ran = (0..of.entries.len()).filter(|&i| of.entries[i].error.is_none());
        let point = |i: usize| {
            let [x, y] = place(of, i);
            ScatterPoint { label: titles[i], x, y, group: i, named }
        };
        ran.map(point).collect::<Vec<_>>()
    };
    let errors = points(row, |row, i| [row.entries[i].median_ms, row.entries[i].canonical_rms_mm], true);
    recorder.scatter(0, Picture::of_error("time, ms"), &errors)?;
    let growth = |of: &Table4Row| points(of, |row, i| [row.vertices as f64, row.entries[i].median_ms], false);
    recorder.scatter(0, Picture::of_growth(), &rows.iter().flat_map(growth).collect::<Vec<_>>())?;
    recorder.finish()?;
    Ok(path)
}
