//! Terminal output: results on stdout, everything else on stderr. No other file prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::base::error_text::{self, with_causes, without_control};
use clap::ValueEnum;
use comfy_table::{Cell, CellAlignment, ColumnConstraint, ContentArrangement, Row, Table, Width};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// The format of a result on stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Tables for people
    Text,
    /// One JSON object
    Json,
}

/// The format of a result that consists of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum RowFormat {
    /// Tables for people
    Text,
    /// One JSON object
    Json,
    /// The rows as CSV
    Csv,
}

/// Set when a result could not be printed.
static UNPRINTED: AtomicBool = AtomicBool::new(false);

/// Prints a result on stdout. A closed pipe (`| head`) is not an error; any other failure is reported, and the program exits with 1.
pub(crate) fn result(text: &str) {
    let mut stdout = std::io::stdout().lock();
    // Flushed here, because a failure of the flush at program exit is not reported.
    let printed = writeln!(stdout, "{}", without_control(text.trim_end_matches('\n'))).and_then(|()| stdout.flush());
    if let Err(error) = printed.or_else(|e| if e.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(e) }) {
        UNPRINTED.store(true, Ordering::SeqCst);
        report("error: ", "31;1", &format!("standard output: the result cannot be printed: {error}"));
    }
}

/// Prints a result as one line of JSON.
pub(crate) fn json(value: &impl serde::Serialize) -> serde_json::Result<()> {
    error_text::json(value).map(|text| result(&text))
}

/// Whether every result could be printed.
pub(crate) fn all_printed() -> bool {
    !UNPRINTED.load(Ordering::SeqCst)
}

/// Styles of tables: a border alone, or lines between the columns as well.
pub(crate) use comfy_table::presets::{UTF8_BORDERS_ONLY as OPEN, UTF8_FULL_CONDENSED as RULED};

/// A table that fits the terminal: long cells are wrapped between words. If even the longest words do not fit side by side, the longest of
/// all are broken, such as paths. In a file or a pipe the lines have their full length. The columns listed in `numbers`, ascending, are aligned right.
pub(crate) fn table<R: Into<Row>>(
    style: &str,
    header: impl IntoIterator<Item: Into<Cell>>,
    numbers: impl IntoIterator<Item = usize>,
    rows: impl IntoIterator<Item = R>,
) -> Table {
    let mut table = Table::new();
    table.load_preset(style).set_content_arrangement(ContentArrangement::Dynamic).set_header(header).add_rows(rows);
    for column in numbers {
        let Some(column) = table.column_mut(column) else { break };
        column.set_cell_alignment(CellAlignment::Right);
    }
    let width = table.width().unwrap_or(u16::MAX);
    fit(&mut table, width);
    table
}

/// Sets padding and column widths for a terminal of this width, in characters.
fn fit(table: &mut Table, width: u16) {
    let mut longest_word = vec![0_u16; table.column_count()];
    for row in table.header().into_iter().chain(table.row_iter()) {
        for (longest, cell) in longest_word.iter_mut().zip(row.cell_iter()) {
            let content = cell.content();
            let words = content.split_whitespace().map(|word| u16::try_from(word.chars().count()).unwrap_or(u16::MAX));
            *longest = words.fold(*longest, u16::max);
        }
    }
    // Each column takes its padding and a separator.
    let total = |words: &[u16], padding: (u16, u16)| {
        words.iter().map(|n| n.saturating_add(padding.0 + padding.1 + 1)).fold(1, u16::saturating_add)
    };
    let fits = |padding: &(u16, u16)| total(&longest_word, *padding) <= width;
    let padding = [(1, 1), (0, 1)].into_iter().find(fits).unwrap_or((0, 0));
    while total(&longest_word, padding) > width
        && let Some(longest) = longest_word.iter_mut().max().filter(|longest| **longest > 1)
    {
        *longest -= 1;
    }
    for (column, longest) in table.column_iter_mut().zip(longest_word) {
        let least = Width::Fixed(longest.saturating_add(padding.0 + padding.1));
        column.set_padding(padding).set_constraint(ColumnConstraint::LowerBoundary(least));
    }
}

/// Prints information on stderr.
pub(crate) fn note(text: &str) {
    report("", "", text);
}

/// Prints several notes.
pub(crate) fn notes(texts: &[String]) {
    texts.iter().for_each(|text| note(text));
}

/// Prints a warning on stderr: a problem that the user should act on.
pub(crate) fn warning(text: &str) {
    report("warning: ", "33;1", text);
}

/// Prints several warnings.
pub(crate) fn warnings(texts: &[String]) {
    texts.iter().for_each(|text| warning(text));
}

/// Prints an error with its causes on stderr.
pub(crate) fn error(error: &anyhow::Error) {
    report("error: ", "31;1", &with_causes(error.as_ref(), "\n  because: "));
}

/// Writes to stderr. The mark is coloured on a terminal; control characters in `text`, which may quote a file, are escaped.
fn report(mark: &str, colour: &str, text: &str) {
    let mut stderr = std::io::stderr().lock();
    let coloured = !colour.is_empty() && stderr.is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let mark = if coloured { format!("\u{1b}[{colour}m{mark}\u{1b}[0m") } else { mark.to_owned() };
    // A closed stderr leaves no channel to report on.
    let _ = writeln!(stderr, "{mark}{}", without_control(text));
}

/// A progress bar, shown on terminals only; without `length` a spinner.
pub(crate) fn progress(length: Option<u64>, title: &str) -> ProgressBar {
    let (bar, template) = match length {
        Some(n) => (ProgressBar::new(n), "{msg} {wide_bar} {pos}/{len}  {eta} left"),
        None => (ProgressBar::new_spinner(), "{spinner} {msg}  {elapsed}"),
    };
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(8));
    bar.set_message(without_control(title).into_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(width: u16, setting: &str) -> Vec<String> {
        let header = ["garment", "setting", "canonical error mm", "translation bound mm"];
        let mut table = table(OPEN, header, 2.., [["flared-skirt@3920", setting, "45.8", "76.9"]]);
        table.set_width(width);
        fit(&mut table, width);
        table.lines().collect()
    }

    #[test]
    fn a_narrow_table_breaks_between_words_and_within_the_longest_word_alone() {
        let narrow = lines(52, "table-3");
        assert!(narrow.iter().all(|line| line.chars().count() <= 52), "{narrow:#?}");
        for word in ["flared-skirt@3920", "table-3", "canonical", "translation"] {
            assert!(narrow.iter().any(|line| line.contains(word)), "{word}: {narrow:#?}");
        }
        let broken = lines(60, &"path/".repeat(20));
        assert!(broken.iter().all(|line| line.chars().count() <= 60), "{broken:#?}");
        for word in ["canonical", "translation"] {
            assert!(broken.iter().any(|line| line.contains(word)), "{word}: {broken:#?}");
        }
    }
}
