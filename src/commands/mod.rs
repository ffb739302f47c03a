//! The command line: one module per subcommand, its arguments beside its code.

mod ablation;
mod assets;
mod bench;
mod check;
mod compare;
mod console;
mod cusick;
mod fabric;
mod inputs;
mod live;
mod pattern;
mod pictures;
mod run;
mod runtime;
mod shell;
mod sinks;
mod solved;
mod stages;
mod summary;
mod sweep;
mod tune;
mod validate;
mod view;

use std::process::ExitCode;
use std::time::SystemTime;

use crate::base::{atomic_file, files};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

/// Drape a garment over a body by the two-stage PART model, every stage in Rerun
///
/// Drapes a garment over a body by the two-stage PART model of Luo, Jiang and Cong and streams every stage to the Rerun viewer.
///
/// Stage one cuts the garment into PARTs: connected areas whose distance to the body falls in one row of a range table. Stage two
/// balances gravity, the body's reaction and the pull of neighbouring PARTs, and gives every PART a displacement. Fewer PARTs are
/// faster, more PARTs are more accurate: the range table sets the trade-off.
///
/// Without a subcommand, `partwise` is `partwise run`.
#[derive(Debug, Parser)]
#[command(name = "partwise", version, after_help = include_str!("../../assets/help/run.txt"), args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::RunArgs,
    /// Allow an output to replace an input of the same run, and `assets` to replace edited files
    #[arg(long, global = true, help_heading = "Output")]
    force: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Drape one garment and record every stage (the default)
    Run(Box<run::RunArgs>),
    /// Serve a page and an HTTP interface to edit the range table while the garment follows
    ///
    /// The page has the Rerun viewer in the middle and the range table beside it. Drag a bound, or change the fabric, a measurement or
    /// the garment, and PARTs, forces and drape follow; after the edit, the drape is refined until it converges.
    ///
    /// Scripts and editors use the same session by HTTP.
    #[command(after_long_help = live::HTTP)]
    Live(Box<live::LiveArgs>),
    /// Report mesh defects of a body and a garment and how the garment fits, without draping
    Check(Box<check::CheckArgs>),
    /// Simulate the Cusick drape test of fabrics and compare it with the published ranges
    Cusick(cusick::CusickArgs),
    /// Convert a laboratory's KES or FAST sheet to a fabric file
    ///
    /// The sheet is CSV with a line for each quantity: its name, the value along the warp, the value along the weft; a single value stands
    /// for both. Values that no cloth has are refused, with the mistake of units that would explain them. What the sheet does not have is
    /// assumed, and every assumption is printed and written into the file.
    Fabric(fabric::FabricArgs),
    /// Simulate every case that others measured, and every closed form, and compare
    ///
    /// The cases are drape tests of fabrics whose constants and whose drape were both measured, by other people; drape tests with published
    /// bands; and strips with a closed form. Each case has a tolerance, the scatter between drapes of one fabric. Cases to which a
    /// constant was set are listed apart.
    ///
    /// The exit code is 0 whether or not cases pass; read `pass` of --format json or csv.
    Validate(validate::ValidateArgs),
    /// Run every point of a sweep file (tables, garments, fabrics); write a row after each, and a recording of all
    ///
    /// The points are range tables, and any other setting, over garments, sizes and fabrics.
    ///
    /// A row is written after every point (rows.jsonl; rows.csv is derived from it at the end). Ctrl-C, a crash or a full disk lose at
    /// most the current point; --resume continues from there. A point that fails is a row with its error, and the sweep continues. At
    /// the end, one recording per garment shows each table as a step, the best few side by side, and time against error.
    Sweep(Box<sweep::SweepArgs>),
    /// Compare range tables: PARTs of each level, which are split and merged, time, error
    ///
    /// Drapes a garment once for each of two to six range tables and compares them: PARTs of each level, which PARTs of the first
    /// table are kept, split or merged, the time of the two stages, and the distance of each drape from its equilibrium.
    ///
    /// Without --refine this evaluates the two-stage scheme alone, where the tables differ; refined to convergence, all end in a
    /// drape in equilibrium.
    Compare(Box<compare::CompareArgs>),
    /// Search range tables for the least error at every number of PARTs
    ///
    /// The paper adjusts its table by iteration with a computer and leaves the best one open. The search minimises the distance from
    /// the reference drape that remains when each PART moves by its nearest affine map, the motion of the coupled model. This needs no
    /// mechanics, so one exact dynamic program gives the best tables for every number of PARTs. Tables near the optimum are then
    /// ranked with the maps blended over the seams, as in the model; the best of those are draped by the model, and the one nearest to
    /// the reference is written. The first search has levels alone, over every bound that makes a difference; the second also cuts
    /// the PARTs of each level to an extent along the cloth.
    ///
    /// With --motion translation each PART moves by one displacement, as in the paper, and the optimum of that search is written
    /// without ranking by the model.
    Tune(Box<tune::TuneArgs>),
    /// Repeat the paper's Table 4: every method on the same garments, with time and error
    #[command(subcommand)]
    Bench(bench::BenchCommand),
    /// Join the shards of a sweep into the output of a single run
    Merge(Box<sweep::MergeArgs>),
    /// Summarise a sewing pattern, and draw it flat
    ///
    /// Reads a sewing pattern (JSON in the GarmentCode format: *_specification.json, or a DXF by ASTM D6673 or AAMA), checks it, sews it
    /// and lists the panels with their areas and the seams with the lengths of both sides. A DXF is sewn as the TOML file beside it
    /// says, NAME.sewing.toml; without that its pieces are listed, and --svg draws them with the numbers of their edges.
    ///
    /// `partwise --pattern FILE` drapes it, on the dress form or on --body.
    Pattern(pattern::PatternArgs),
    /// Write the built-in inputs as files: body and garments as OBJ, tables, sweeps, fabrics and measurements as TOML
    Assets(assets::AssetsArgs),
    /// Open a recording in the bundled web viewer
    View(view::ViewArgs),
    /// Print the completion script of a shell
    Completions(shell::CompletionsArgs),
    /// Print a manual page, for `man -l -`
    Man(shell::ManArgs),
}

/// Parses the arguments, runs the command and reports its error.
pub fn main() -> ExitCode {
    let cli = Cli::from_arg_matches(&allow_negatives(Cli::command()).get_matches()).unwrap_or_else(|e| e.exit());
    runtime::handle_interrupts();
    runtime::ignore_file_size_signal();
    if !cli.force {
        files::protect_inputs();
    }
    let checked = check_clock(SystemTime::now()).and_then(|()| runtime::check_memory(0));
    let outcome = checked.and_then(|()| match cli.command {
        None => cli.run.execute(),
        Some(Command::Run(args)) => args.execute(),
        Some(Command::Live(args)) => args.execute(),
        Some(Command::Check(args)) => args.execute(),
        Some(Command::Cusick(args)) => args.execute(),
        Some(Command::Fabric(args)) => args.execute(),
        Some(Command::Validate(args)) => args.execute(),
        Some(Command::Sweep(args)) => args.execute(),
        Some(Command::Compare(args)) => args.execute(),
        Some(Command::Tune(args)) => args.execute(),
        Some(Command::Bench(bench::BenchCommand::TableFour(args))) => args.execute(),
        Some(Command::Bench(bench::BenchCommand::Ablation(args))) => args.execute(),
        Some(Command::Merge(args)) => args.execute(),
        Some(Command::Pattern(args)) => args.execute(),
        Some(Command::Assets(args)) => args.execute(cli.force),
        Some(Command::View(args)) => args.execute(),
        Some(Command::Completions(args)) => args.execute(Cli::command()),
        Some(Command::Man(args)) => args.execute(Cli::command()),
    });
    // Threads that still write end with the process; their incomplete files are removed.
    atomic_file::abandon_all();
    match outcome {
        Ok(()) if runtime::interrupted() => ExitCode::from(130),
        Ok(()) if !console::all_printed() => ExitCode::FAILURE,
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::error(&error);
            runtime::exit_code(&error)
        }
    }
}

/// Refuses a clock before 1970: recordings contain the time since then, and Rerun panics on an earlier one.
fn check_clock(now: SystemTime) -> anyhow::Result<()> {
    if now < SystemTime::UNIX_EPOCH {
        runtime::refuse!(
            "found the clock of this machine before 1970, expected today's date: recordings contain it; set the clock"
        );
    }
    Ok(())
}

/// Parses `--edge-length -1` as a value that is out of range and not as an unknown flag.
fn allow_negatives(command: clap::Command) -> clap::Command {
    command.allow_negative_numbers(true).mut_subcommands(allow_negatives)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_clock_before_1970_is_refused() {
        check_clock(SystemTime::UNIX_EPOCH).unwrap();
        let error = check_clock(SystemTime::UNIX_EPOCH - Duration::from_secs(1)).unwrap_err().to_string();
        assert!(error.contains("before 1970") && error.contains("set the clock"), "{error}");
    }
}
