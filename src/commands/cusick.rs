//! `partwise cusick`: the drape test of the fabrics, beside the published bands.

use std::path::PathBuf;

use crate::garment::fabric::{BUILT_IN, Fabric};
use crate::study::drape_test::results_csv;
use clap::Args;

use super::console;
use super::runtime::{check, write};

/// Rows of a mesh beyond which a drape takes hours: 30,000 vertices.
const MOST_ROWS: u64 = 100;

/// Arguments of `cusick`.
#[derive(Debug, Args)]
pub(crate) struct CusickArgs {
    /// Fabrics to test: built-in names or TOML files [default: all that are built in]
    #[arg(value_name = "NAME|FILE")]
    fabrics: Vec<String>,
    /// Rows of the mesh from the plates' edge to the rim, 4 to 100: 12 is half a centimetre
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(4..=MOST_ROWS))]
    rows: u64,
    /// Write the results to this file as well, as CSV
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
}

impl CusickArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        if let Some(path) = &self.csv {
            check(path, "--csv")?;
        }
        let names: Vec<&str> = match self.fabrics.as_slice() {
            [] => BUILT_IN.to_vec(),
            some => some.iter().map(String::as_str).collect(),
        };
        // Before any of them is draped.
        names.iter().try_for_each(|name| Fabric::by_name(name).map(|_| ()))?;
        // Seconds a fabric, and nothing is written before the last.
        let bar = console::progress(Some(names.len() as u64), "drape test");
        let mut csv = String::new();
        for name in names {
            let one = results_csv(&[name], usize::try_from(self.rows)?)?;
            let (header, row) = one.split_once('\n').unwrap_or((&one, ""));
            if csv.is_empty() {
                csv = format!("{header}\n");
            }
            csv += row;
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let Some(path) = &self.csv {
            write(path, &csv, "--csv")?;
        }
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let mut table = console::table(console::RULED, reader.headers()?.iter(), []);
        for row in reader.records() {
            table.add_row(row?.iter());
        }
        console::result(&table.to_string());
        Ok(())
    }
}
