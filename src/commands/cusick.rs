//! `partwise cusick`: the drape test of the fabrics, beside the published bands.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;
use comfy_table::{Table, presets};
use partwise::fabric::BUILT_IN;
use partwise::mechanics::cusick::results_csv;
use partwise::mesh::WholeFile;

use super::console;

/// Arguments of `cusick`.
#[derive(Debug, Args)]
pub(crate) struct CusickArgs {
    /// Built-in fabrics to test [default: all of them]
    #[arg(value_name = "FABRIC")]
    fabrics: Vec<String>,
    /// Rows of the mesh from the plates' edge to the rim: 12 is half a centimetre
    #[arg(long, value_name = "N", default_value_t = 12)]
    rows: usize,
    /// Write the results to this file as well, as CSV
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
}

impl CusickArgs {
    /// Drapes and prints.
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        let names: Vec<&str> = match self.fabrics.as_slice() {
            [] => BUILT_IN.to_vec(),
            some => some.iter().map(String::as_str).collect(),
        };
        let bar = console::progress(Some(names.len() as u64), "drape test");
        let mut csv = String::new();
        for name in names {
            let one = results_csv(&[name], self.rows)?;
            let (header, row) = one.split_once('\n').unwrap_or((&one, ""));
            if csv.is_empty() {
                csv = format!("{header}\n");
            }
            csv += row;
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let Some(path) = &self.csv {
            WholeFile::write(path, csv.as_bytes()).with_context(|| format!("{}: cannot be written", path.display()))?;
        }
        let mut table = Table::new();
        table.load_preset(presets::UTF8_FULL_CONDENSED);
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        table.set_header(reader.headers()?.iter());
        for row in reader.records() {
            table.add_row(row?.iter());
        }
        console::result(&table.to_string());
        Ok(())
    }
}
