//! The `partwise` command line.

fn main() -> std::process::ExitCode {
    partwise::commands::main()
}
