//! Drapes one garment by several range tables and prints the time and the error of each against the canonical drape:
//! `cargo run --no-default-features --example sweep_tables`

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example prints")]

use std::error::Error;

use partwise::drape::unobserved;
use partwise::parts::range_table::{RangeTable, TableRule};
use partwise::study::job::{Against, Job};

fn main() -> Result<(), Box<dyn Error>> {
    let mut job = Job { accuracy: Against::Canonical, ..Job::preview() };
    job.scene.garment = std::env::args().nth(1).unwrap_or_else(|| "flared-skirt@900".to_owned());
    let input = job.scene.load()?;
    let quantile = |levels| TableRule::Quantile { name: format!("{levels} quantile levels"), levels };
    let tables = [RangeTable::table_3().into(), RangeTable::table_3().scaled(0.5)?.into(), quantile(5), quantile(20)];
    for table in tables {
        job.settings.table = table;
        let draped = job.drape(&input.scene, &mut unobserved)?;
        let metrics = job.measure(&input.scene, &draped, None, &mut unobserved)?.metrics;
        println!(
            "{:<20} {:>5} PARTs {:>8.1} ms {:>6.1} mm off",
            draped.table.name,
            metrics.part_count,
            1e3 * draped.times.total.as_secs_f64(),
            metrics.error_mm().unwrap_or_default()
        );
    }
    Ok(())
}
