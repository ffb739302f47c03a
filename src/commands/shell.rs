//! `partwise completions` and `partwise man`: the command line as a completion script of a shell, and as manual pages.

use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;

use super::console;
use super::runtime::refuse;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// Shell
    #[arg(value_enum)]
    shell: Shell,
}

impl CompletionsArgs {
    /// Prints the script for `command`, the whole command line.
    pub(crate) fn execute(&self, mut command: Command) -> anyhow::Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "partwise", &mut script);
        console::document(&script);
        Ok(())
    }
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// Subcommand [default: the page of the program, which lists them]
    #[arg(value_name = "COMMAND")]
    subcommand: Option<String>,
}

impl ManArgs {
    /// Prints the page of a subcommand of `command`, or of `command` itself.
    pub(crate) fn execute(&self, mut command: Command) -> anyhow::Result<()> {
        // Gives the subcommands their full names.
        command.build();
        let page = match &self.subcommand {
            None => command,
            Some(name) => match command.find_subcommand(name) {
                Some(found) => found.clone().display_name(format!("partwise-{name}")),
                None => {
                    let names: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
                    refuse!("found `{name}`, expected one of {}", names.join(", "))
                }
            },
        };
        let mut text = Vec::new();
        Man::new(page).render(&mut text)?;
        console::document(&text);
        Ok(())
    }
}
