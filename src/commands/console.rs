//! What people read: results on stdout, everything else on stderr. The one place that prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::base::error_text::{with_causes, without_control};
use comfy_table::{CellAlignment, ContentArrangement, Row, Table};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Whether a result could not be printed.
static UNPRINTED: AtomicBool = AtomicBool::new(false);

/// A result, on stdout. A closed pipe (`| head`) is no error; any other failure is said, and ends the program with 1.
pub(crate) fn result(text: &str) {
    let mut stdout = std::io::stdout().lock();
    // Flushed here, as nobody hears of what fails when the program ends.
    let printed = writeln!(stdout, "{}", without_control(text.trim_end_matches('\n'))).and_then(|()| stdout.flush());
    if let Err(error) = printed.or_else(|e| if e.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(e) }) {
        UNPRINTED.store(true, Ordering::SeqCst);
        say(&paint("error: ", "31;1"), &format!("standard output: the result cannot be printed: {error}"));
    }
}

/// The looks of tables: with lines between the columns, or around all alone.
pub(crate) use comfy_table::presets::{UTF8_BORDERS_ONLY as OPEN, UTF8_FULL_CONDENSED as RULED};

/// A table that is no wider than the terminal: what does not fit goes on below. In a file its lines are as long as they are. Columns of
/// numbers, ascending, are set to the right.
pub(crate) fn table(look: &str, header: impl Into<Row>, numbers: impl IntoIterator<Item = usize>) -> Table {
    let mut table = Table::new();
    table.load_preset(look).set_content_arrangement(ContentArrangement::Dynamic).set_header(header);
    for column in numbers {
        let Some(column) = table.column_mut(column) else { break };
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Whether every result could be printed.
pub(crate) fn all_printed() -> bool {
    !UNPRINTED.load(Ordering::SeqCst)
}

/// Something worth knowing, on stderr.
pub(crate) fn note(text: &str) {
    say("", text);
}

/// Things worth knowing.
pub(crate) fn notes(texts: &[String]) {
    texts.iter().for_each(|text| note(text));
}

/// Writes to stderr; `mark` may hold colours, `text` may come from a file and may not.
fn say(mark: &str, text: &str) {
    // Where stderr is closed there is nobody left to tell.
    let _ = writeln!(std::io::stderr().lock(), "{mark}{}", without_control(text));
}

/// Something to act upon, on stderr.
pub(crate) fn warning(text: &str) {
    say(&paint("warning: ", "33;1"), text);
}

/// Things to act upon.
pub(crate) fn warnings(texts: &[String]) {
    texts.iter().for_each(|text| warning(text));
}

/// An error with its causes, on stderr.
pub(crate) fn error(error: &anyhow::Error) {
    say(&paint("error: ", "31;1"), &with_causes(error.as_ref(), "\n  because: "));
}

fn paint(text: &str, code: &str) -> String {
    if std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none() {
        format!("\u{1b}[{code}m{text}\u{1b}[0m")
    } else {
        text.to_owned()
    }
}

/// A progress bar that appears once the work has taken a while, on terminals only.
pub(crate) fn progress(length: Option<u64>, what: &str) -> ProgressBar {
    let bar = match length {
        Some(n) => ProgressBar::new(n).with_style(style("{msg} {wide_bar} {pos}/{len}  {eta} left")),
        None => ProgressBar::new_spinner().with_style(style("{spinner} {msg}  {elapsed}")),
    };
    bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(8));
    bar.set_message(without_control(what).into_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
