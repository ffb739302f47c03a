//! The command line: one file per subcommand, its arguments beside its code.

mod assets;
mod bench;
mod browser;
mod certified;
mod check;
mod compare;
mod console;
mod cusick;
mod fabrics;
mod failure;
mod inputs;
mod interrupt;
mod live;
mod measurements;
mod merge;
mod pattern;
mod readings;
mod run;
mod runtime;
mod session_recorder;
mod sinks;
mod solved;
mod stages;
mod summary;
mod sweep;
mod tune;
mod view;
mod watch;

use std::process::ExitCode;
use std::time::SystemTime;

use crate::base::{atomic_file, files};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

// What most commands take and say goes by one name in all of them.
use fabrics::FabricArgs;
use failure::UserError;
use inputs::InputArgs;
use measurements::MeasurementArgs;
use sinks::SinkArgs;
use stages::StageArgs;

const LONG_ABOUT: &str = "\
Drapes a garment over a body by the two-stage PART model of Luo, Jiang and Cong and streams every stage to the Rerun \
viewer.

Stage one cuts the garment into PARTs: connected areas whose distance to the body falls in one row of a range table. \
Stage two balances gravity, the body's reaction and the pull of neighbouring PARTs, and gives every PART a displacement. \
Fewer PARTs are faster, more are truer: the range table is the dial.

Without a subcommand, `partwise` is `partwise run`.";

const EXAMPLES: &str = "\
Examples:
  partwise                                        drape the low-cut dress, leave recordings/low-cut-dress.rrd
  partwise view recordings/low-cut-dress.rrd      look at it in a browser
  partwise --garment flared-skirt@3613 --spawn    another garment and size, straight into the native viewer
  partwise --body me.obj --garment shirt.obj      your own meshes; unit and up axis are guessed and said
  partwise live                                   a page: drag the bounds, the garment follows
  partwise --pattern shirt.json --body me.obj     sew a pattern, put it on, drape it
  partwise --table mine.toml --serve --watch      edit the table, see the PARTs change in the browser
  partwise --format json --threads 1              one JSON object on stdout, for scripts

Exit codes: 0 done, 2 something you gave cannot be used or written, 1 anything else, 130 interrupted (what was done is kept).";

#[derive(Debug, Parser)]
#[command(
    name = "partwise",
    version,
    about = "Drape a garment over a body by the two-stage PART model, every stage in Rerun",
    long_about = LONG_ABOUT,
    after_help = EXAMPLES,
    args_conflicts_with_subcommands = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::RunArgs,
    /// Let an output replace an input of the same run, and `assets` replace files that were edited
    #[arg(long, global = true, help_heading = "Output")]
    force: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Drape one garment and record every stage (the default)
    Run(Box<run::RunArgs>),
    /// Serve a page to turn the dial on, and the same by HTTP
    #[command(long_about = live::LONG_ABOUT, after_long_help = live::HTTP)]
    Live(Box<live::LiveArgs>),
    /// Report the health of a body and a garment, and how they lie about each other, without draping
    Check(Box<check::CheckArgs>),
    /// Simulate the Cusick drape test of the fabrics and set it beside the published bands
    Cusick(cusick::CusickArgs),
    /// Run every point of a sweep file: tables, garments, fabrics; a row on disk after each, and a recording of all
    #[command(long_about = sweep::LONG_ABOUT)]
    Sweep(Box<sweep::SweepArgs>),
    /// Set range tables side by side: PARTs of each level, what is split and merged, time, error
    #[command(long_about = compare::LONG_ABOUT)]
    Compare(Box<compare::CompareArgs>),
    /// Search range tables for the least error at every number of PARTs
    #[command(long_about = tune::LONG_ABOUT)]
    Tune(Box<tune::TuneArgs>),
    /// Run the paper's Table 4 again: every way to drape on the same garments, time and error together
    #[command(subcommand)]
    Bench(bench::BenchCommand),
    /// Join the shards of a sweep into what one run would have written
    Merge(Box<merge::MergeArgs>),
    /// Sum up a sewing pattern, and draw it flat
    #[command(long_about = pattern::LONG_ABOUT)]
    Pattern(pattern::PatternArgs),
    /// Write everything built in as files: body and garments as OBJ, tables, fabrics, measurements as TOML
    Assets(assets::AssetsArgs),
    /// Open a recording in the bundled web viewer
    View(view::ViewArgs),
}

/// Parses the arguments, runs the command, prints what went wrong.
pub fn main() -> ExitCode {
    let cli = Cli::from_arg_matches(&with_negatives(Cli::command()).get_matches()).unwrap_or_else(|e| e.exit());
    interrupt::listen();
    interrupt::outlive_file_limits();
    if !cli.force {
        files::protect_inputs();
    }
    let outcome = clock_is_set(SystemTime::now()).and_then(|()| match cli.command {
        None => cli.run.execute(),
        Some(Command::Run(args)) => args.execute(),
        Some(Command::Live(args)) => args.execute(),
        Some(Command::Check(args)) => args.execute(),
        Some(Command::Cusick(args)) => args.execute(),
        Some(Command::Sweep(args)) => args.execute(),
        Some(Command::Compare(args)) => args.execute(),
        Some(Command::Tune(args)) => args.execute(),
        Some(Command::Bench(command)) => command.execute(),
        Some(Command::Merge(args)) => args.execute(),
        Some(Command::Pattern(args)) => args.execute(),
        Some(Command::Assets(args)) => args.execute(cli.force),
        Some(Command::View(args)) => args.execute(),
    });
    // A thread that still writes dies with the program.
    atomic_file::abandon_all();
    match outcome {
        Ok(()) if interrupt::requested() => ExitCode::from(130),
        Ok(()) if !console::all_printed() => ExitCode::FAILURE,
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::error(&error);
            failure::exit_code(&error)
        }
    }
}

/// Refuses a clock that stands before 1970: recordings carry the time since then, and Rerun panics without one.
fn clock_is_set(now: SystemTime) -> anyhow::Result<()> {
    if now >= SystemTime::UNIX_EPOCH {
        return Ok(());
    }
    Err(UserError::new(
        "found the clock of this machine before 1970, expected today's date: recordings carry it; set the clock",
    ))
}

/// `--edge-length -1` is a number that will not do, not a flag that nobody knows.
fn with_negatives(command: clap::Command) -> clap::Command {
    command.allow_negative_numbers(true).mut_subcommands(with_negatives)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_clock_before_1970_is_refused() {
        clock_is_set(SystemTime::UNIX_EPOCH).unwrap();
        let said = clock_is_set(SystemTime::UNIX_EPOCH - Duration::from_secs(1)).unwrap_err().to_string();
        assert!(said.contains("before 1970") && said.contains("set the clock"), "{said}");
    }
}
