//! `partwise merge`: the shards of a sweep joined into what one run would have written, bit for bit but for timings.

use std::path::PathBuf;
use std::time::Instant;

use crate::record::Tab;
use crate::study::sweep::{Outcome, Status, merge, store};
use clap::Args;

use super::runtime::unwritable;
use super::sweep::record_all;
use super::sweep::report::{Format, Report};
use super::sweep::store::PointStore;
use super::{SinkArgs, console};

/// Arguments of `merge`.
#[derive(Debug, Clone, Args)]
pub(crate) struct MergeArgs {
    /// Folders that `partwise sweep --shard I/N` wrote; overlaps are fine where they agree
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,
    /// Folder of the joined sweep
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    sinks: SinkArgs,
    /// What to print on stdout
    #[arg(long, value_enum, default_value_t = Format::Text, help_heading = "Output")]
    format: Format,
}

impl MergeArgs {
    pub(crate) fn execute(&self) -> anyhow::Result<()> {
        let started = Instant::now();
        self.sinks.check_outputs(&[])?;
        let rows = merge(&self.shards, &self.out)?;
        let (manifest, _) = store::read(&self.out)?;
        let points = PointStore::in_folder(&self.out);
        let sources: Vec<PointStore> = self.shards.iter().map(|folder| PointStore::in_folder(folder)).collect();
        for row in rows.iter().filter(|row| row.status == Status::Ok) {
            for source in &sources {
                if points.adopt(source, &row.point).map_err(unwritable(&self.out, "--out"))? {
                    break;
                }
            }
        }
        let recordings = record_all(&rows, &points, &manifest.name, &self.out, &self.sinks, Tab::Stages)?;
        let report = Report {
            name: &manifest.name,
            folder: &self.out,
            outcome: &Outcome::found(rows),
            seconds: started.elapsed().as_secs_f64(),
            keeping_ms: 0.0,
            recordings: &recordings,
        };
        console::result(&report.text(self.format)?);
        Ok(())
    }
}
