//! `partwise bench table-4`: the paper's comparison as an experiment that anybody can repeat.

mod recorded;

use std::path::PathBuf;

use crate::SceneSpec;
use crate::garment::fabric::{DEFAULT_FABRIC, Fabric};
use crate::garment::{GarmentRequest, MeshCache};
use crate::study::table4::{self, Conditions, METHODS, RowLog, TEN_ROWS, Table4Error, Table4Options, Table4Row};
use clap::{Args, Subcommand};
use serde_json::json;

use crate::commands::runtime::{check, make_folder, unwritable, use_threads, write};
use crate::commands::sweep::report::Format;
use crate::commands::{UserError, console, interrupt};

const LONG_ABOUT: &str = "\
Drapes the paper's garments in every way there is: its reference methods [19], [20] and [21], its own equations (`paper`), the coupled \
model's two stages (`preview`), and those with the settled drape after (`converged`). Rounds are interleaved, so that whatever else \
the machine does hits all alike, and ratios are taken round by round.

What moves in time rests by one rule: RMS speed of the vertices under 1 cm/s over a quarter of a second. Beside the time stands what \
the paper does not report: the error against the settled drape, the residual of one common energy, strain, penetration.

Beside each method's error stand hem height and girths. What a method cannot run on has no figures, and the table says why.";

const EXAMPLES: &str = "\
Examples:
  partwise bench table-4                                       the ten rows; some ten minutes on two cores
  partwise bench table-4 --quick                               two small garments, one round: does it run?
  partwise bench table-4 --growth flared-skirt                 1,000 to 64,000 vertices: how costs grow, with fitted exponents
  partwise bench table-4 --rows pullover-1@4710 --rounds 1     one row, once
  partwise bench table-4 --recordings table-4                  a recording a row: the drapes side by side
  partwise bench table-4 --csv table-4.csv --format json       for scripts

Rows are kept in --rows-file as they are done; the same command goes on from there after Ctrl-C.";

/// Sizes of `--growth`.
const GROWTH: [usize; 4] = [1_000, 4_000, 16_000, 64_000];

/// What can be benched.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// The paper's Table 4: its reference methods, its own equations, and ours
    #[command(name = "table-4", long_about = LONG_ABOUT, after_help = EXAMPLES)]
    TableFour(TableFourArgs),
}

/// Arguments of `bench table-4`.
#[derive(Debug, Args)]
pub(crate) struct TableFourArgs {
    /// Rows: built-in garments with their vertices [default: the paper's ten]
    #[arg(long, value_name = "NAME@VERTICES", value_delimiter = ',')]
    rows: Vec<GarmentRequest>,
    /// In place of the ten rows: this garment at 1,000, 4,000, 16,000 and 64,000 vertices
    #[arg(long, value_name = "NAME", conflicts_with = "rows")]
    growth: Option<GarmentRequest>,
    /// Fabric: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = DEFAULT_FABRIC)]
    fabric: String,
    /// Counted rounds
    #[arg(long, value_name = "N", default_value_t = Table4Options::default().rounds as u64, value_parser = clap::value_parser!(u64).range(1..=1000))]
    rounds: u64,
    /// Canonical drapes from this many perturbed starts, for the spread between equilibria
    #[arg(long, value_name = "N", default_value_t = Table4Options::default().starts)]
    starts: u64,
    /// Two garments of 600 vertices, one round, no perturbed starts; nothing is kept
    #[arg(long, conflicts_with_all = ["rows", "growth", "rounds", "starts", "rows_file"])]
    quick: bool,
    /// Where rows are kept, and found again
    #[arg(long, value_name = "FILE.json", default_value = "table-4.json")]
    rows_file: PathBuf,
    /// Record each row as it is done into this folder: its drapes side by side, and plots of time
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Write a line for every method of every row to this file as well
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl BenchCommand {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        match self {
            Self::TableFour(args) => args.execute(),
        }
    }
}

impl TableFourArgs {
    fn execute(&self) -> anyhow::Result<()> {
        use_threads(self.threads)?;
        let kept = if self.quick { None } else { Some((&self.rows_file, "--rows-file")) };
        for (path, flag) in self.csv.iter().map(|path| (path, "--csv")).chain(kept) {
            check(path, flag)?;
        }
        let fabric = Fabric::by_name(&self.fabric)?;
        let options = self.options();
        let conditions = Conditions::here(&fabric.name, &options);
        let asked = self.asked()?;
        let mut log = if self.quick {
            RowLog { conditions, rows: Vec::new() }
        } else {
            RowLog::open(&self.rows_file, conditions).map_err(|e| UserError::new(e.to_string()))?
        };
        if let Some(folder) = &self.recordings {
            make_folder(folder)?;
        }
        interrupt::keep();
        let left: Vec<&(String, usize)> = asked.iter().filter(|(name, n)| log.find(name, *n).is_none()).collect();
        let kept = asked.len() - left.len();
        let runs = options.warm_up + options.rounds;
        let bar = console::progress(Some((left.len() * runs * METHODS.len()) as u64), "table 4");
        for (done, (name, vertices)) in left.iter().enumerate() {
            let (mut begun, before) = (0, (done * runs * METHODS.len()) as u64);
            let mut last = (usize::MAX, String::new());
            let mut listen = |round: usize, of: usize, what: &str| {
                if last.0 != round || last.1 != what {
                    last = (round, what.to_owned());
                    bar.set_position(before + begun);
                    begun = (begun + 1).min((runs * METHODS.len()) as u64);
                    bar.set_message(format!("{name}@{vertices}: {what}, round {} of {of}", (round + 1).min(of)));
                }
                interrupt::go_on()
            };
            let spec = SceneSpec::new(SceneSpec::default().body, format!("{name}@{vertices}"));
            let loaded = spec.load_with(&MeshCache::in_user_cache())?;
            match table4::row((name, *vertices), &loaded.scene, &fabric, &options, &mut listen) {
                Ok(draped_row) => {
                    log.rows.push(draped_row.row.clone());
                    // Kept before it is recorded: a disk that is full then costs a picture and no row.
                    if !self.quick {
                        let file = &self.rows_file;
                        log.write(file).map_err(unwritable(file, "--rows-file"))?;
                    }
                    if let Some(folder) = &self.recordings {
                        let path = recorded::record(folder, &draped_row, &loaded.scene, &log.rows)?;
                        bar.suspend(|| console::note(&format!("recording: {}", path.display())));
                    }
                }
                Err(Table4Error::Interrupted) => break,
                Err(error) => return Err(error.into()),
            }
        }
        bar.finish_and_clear();
        self.report(&log, &asked, kept)
    }

    fn options(&self) -> Table4Options {
        if self.quick {
            return Table4Options { rounds: 1, warm_up: 0, starts: 0, ..Table4Options::default() };
        }
        // The parser bounds it.
        let rounds = usize::try_from(self.rounds).unwrap_or(usize::MAX);
        Table4Options { rounds, starts: self.starts, ..Table4Options::default() }
    }

    /// Garments and vertices, in order.
    fn asked(&self) -> anyhow::Result<Vec<(String, usize)>> {
        if self.quick {
            return Ok(["flared-skirt", "pullover-1"].map(|name| (name.to_owned(), 600)).to_vec());
        }
        if let Some(GarmentRequest { name, vertices }) = &self.growth {
            if let Some(vertices) = vertices {
                let rows = GROWTH.map(|n| format!("{name}@{n}")).join(",");
                return Err(UserError::new(format!(
                    "--growth {name}@{vertices}: found a number of vertices, expected the name alone; for sizes of your own take --rows {rows}"
                )));
            }
            SceneSpec::new(SceneSpec::default().body, name.clone()).check_names()?;
            return Ok(GROWTH.iter().map(|n| (name.clone(), *n)).collect());
        }
        if self.rows.is_empty() {
            return Ok(TEN_ROWS.iter().map(|(name, n)| ((*name).to_owned(), *n)).collect());
        }
        let row = |request: &GarmentRequest| match request.vertices {
            Some(vertices) => Ok((request.name.clone(), vertices)),
            None => Err(UserError::new(format!(
                "--rows {}: found no number of vertices, expected {}@VERTICES",
                request.name, request.name
            ))),
        };
        let asked: Vec<(String, usize)> = self.rows.iter().map(row).collect::<Result<_, _>>()?;
        // Before any of them is draped.
        for (name, vertices) in &asked {
            SceneSpec::new(SceneSpec::default().body, format!("{name}@{vertices}")).check_names()?;
        }
        Ok(asked)
    }

    fn report(&self, log: &RowLog, asked: &[(String, usize)], kept: usize) -> anyhow::Result<()> {
        let rows: Vec<Table4Row> = asked.iter().filter_map(|(name, n)| log.find(name, *n)).cloned().collect();
        let csv = table4::csv_lines(&rows)?;
        if let Some(path) = &self.csv {
            write(path, &csv, "--csv")?;
        }
        if self.recordings.is_some() && kept > 0 {
            console::note(&format!(
                "{kept} rows were found in {} and not draped again: they have no recording",
                self.rows_file.display()
            ));
        }
        let missing = asked.len() - rows.len();
        match self.format {
            Format::Csv => console::result(&csv),
            Format::Json => {
                let json = json!({ "conditions": log.conditions, "rows": rows, "missing_rows": missing });
                console::result(&crate::base::error_text::json(&json)?);
            }
            Format::Text => console::result(&text(log, &rows)),
        }
        if missing > 0 {
            console::warning(&format!("{missing} of {} rows are not done; the same command goes on", asked.len()));
        }
        Ok(())
    }
}

/// For people.
fn text(log: &RowLog, rows: &[Table4Row]) -> String {
    let mut out = log.conditions.text();
    for cells in table4::tables(rows).into_iter().chain(table4::exponents(rows)) {
        let mut table = console::table(console::RULED, &cells.header, 1..);
        table.add_rows(&cells.rows);
        out += &format!("\n\n{}\n{table}", cells.title);
    }
    for (row, entry) in rows.iter().flat_map(|row| row.entries.iter().map(move |entry| (row, entry))) {
        if let Some(error) = &entry.error {
            out += &format!("\n{}@{}: {}: {error}", row.garment, row.asked, entry.method);
        }
    }
    out
}
