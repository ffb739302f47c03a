//! `partwise cusick`: the simulated Cusick drape test of fabrics, compared with published ranges.

use std::path::PathBuf;

use crate::garment::fabric::{BUILT_IN, Fabric};
use crate::study::drape_test::results_csv;
use clap::Args;

use super::console;
use super::runtime::{check, write};

/// Bound on the rows of the mesh; 100 rows are 30,000 vertices, and more take hours.
const MAX_ROWS: u64 = 100;

/// Arguments of `cusick`.
#[derive(Debug, Args)]
pub(crate) struct CusickArgs {
    /// Fabrics to test: built-in names or TOML files [default: all built-in fabrics]
    #[arg(value_name = "NAME|FILE")]
    fabrics: Vec<String>,
    /// Rows of the mesh from the edge of the plate to the rim, 4 to 100; 12 rows have edges of half a centimetre
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(4..=MAX_ROWS))]
    rows: u64,
    /// Also write the results to this CSV file
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
        // Every name is checked before the first drape.
        names.iter().try_for_each(|name| Fabric::by_name(name).map(|_| ()))?;
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
        let header: Vec<String> = reader.headers()?.iter().map(|name| name.replace('_', " ")).collect();
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>()?;
        let table = console::table(console::RULED, &header, [], rows.iter().map(csv::StringRecord::iter));
        console::result(&table.to_string());
        Ok(())
    }
}
