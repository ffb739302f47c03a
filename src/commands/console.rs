//! Terminal output: results on stdout, everything else on stderr. No other file prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::borrow::Cow;
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
    document(format!("{}\n", without_control(text.trim_end_matches('\n'))).as_bytes());
}

/// Prints bytes on stdout as they are.
pub(crate) fn document(bytes: &[u8]) {
    let mut stdout = std::io::stdout().lock();
    // Flushed here, because a failure of the flush at program exit is not reported.
    let printed = stdout.write_all(bytes).and_then(|()| stdout.flush());
    if let Err(error) = printed.or_else(|e| if e.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(e) }) {
        UNPRINTED.store(true, Ordering::SeqCst);
        report("error: ", "31;1", &format!("standard output: the result cannot be printed: {error}"));
    }
}

/// Prints a result for people: long lines are broken between words on a terminal.
pub(crate) fn prose(text: &str) {
    result(&wrapped(text, terminal_width()));
}

/// Width of the terminal on stdout, in characters; `None` for a file or a pipe.
fn terminal_width() -> Option<usize> {
    Table::new().width().map(usize::from)
}

/// `text` with long lines broken between words, as a terminal of this width would break them within words. Tables stay as they are.
fn wrapped(text: &str, width: Option<usize>) -> Cow<'_, str> {
    let Some(width) = width.filter(|width| *width > 2 * INDENT) else { return text.into() };
    let is_long = |line: &str| line.chars().count() > width && !line.starts_with(['│', '┌', '└', '╞', '├']);
    if !text.lines().any(is_long) {
        return text.into();
    }
    let wrap = |line: &str| {
        let mut lines = String::new();
        let mut used = 0;
        // Runs of spaces align the values of a heading.
        for word in line.split_inclusive(' ') {
            let letters = word.trim_end_matches(' ').chars().count();
            if used > INDENT && used + letters > width {
                lines.truncate(lines.trim_end_matches(' ').len());
                lines += &format!("\n{}", " ".repeat(INDENT));
                used = INDENT;
            }
            if !(word == " " && used == INDENT && lines.contains('\n')) {
                lines += word;
                used += word.chars().count();
            }
        }
        lines
    };
    let lines = text.split('\n').map(|line| if is_long(line) { wrap(line) } else { line.to_owned() });
    lines.collect::<Vec<_>>().join("\n").into()
}

/// Indentation of the further lines of a long one.
const INDENT: usize = 4;

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
/// all are broken, such as paths, after a mark such as a slash if they have one. In a file or a pipe the lines have their full length. The
/// columns listed in `numbers`, ascending, are aligned right.
pub(crate) fn table<R: Into<Row>>(
    style: &str,
    header: impl IntoIterator<Item: Into<Cell>>,
    numbers: impl IntoIterator<Item = usize>,
    rows: impl IntoIterator<Item = R>,
) -> Table {
    let width = Table::new().width();
    // On a terminal no line breaks between a number and its percent sign.
    let kept = |text: String| if width.is_some() { text.replace(" %", "\u{a0}%") } else { text };
    let texts = |row: Row| row.cell_iter().map(Cell::content).map(kept).collect::<Vec<String>>();
    let header = texts(Row::from(header.into_iter().map(Into::into).collect::<Vec<Cell>>()));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|row| texts(row.into())).collect();
    let width = width.unwrap_or(u16::MAX);
    fitted(style, &header, numbers, &rows, width)
}

/// The table in a terminal of this width, in characters.
fn fitted(
    style: &str,
    header: &[String],
    numbers: impl IntoIterator<Item = usize>,
    rows: &[Vec<String>],
    width: u16,
) -> Table {
    let columns = rows.iter().map(Vec::len).fold(header.len(), usize::max);
    let mut longest_word = vec![0_u16; columns];
    for row in std::iter::once(header).chain(rows.iter().map(Vec::as_slice)) {
        for (longest, text) in longest_word.iter_mut().zip(row) {
            *longest = text.split([' ', '\n']).map(letters).fold(*longest, u16::max);
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
    let broken = |row: &[String]| -> Vec<String> {
        row.iter().zip(&longest_word).map(|(text, most)| broken_after_marks(text, *most)).collect()
    };
    let mut table = Table::new();
    table.load_preset(style).set_content_arrangement(ContentArrangement::Dynamic).set_header(broken(header));
    table.add_rows(rows.iter().map(|row| broken(row)));
    if width < u16::MAX {
        table.set_width(width);
    }
    for column in numbers {
        let Some(column) = table.column_mut(column) else { break };
        column.set_cell_alignment(CellAlignment::Right);
    }
    for (column, longest) in table.column_iter_mut().zip(longest_word) {
        let least = Width::Fixed(longest.saturating_add(padding.0 + padding.1));
        column.set_padding(padding).set_constraint(ColumnConstraint::LowerBoundary(least));
    }
    table
}

fn letters(word: &str) -> u16 {
    u16::try_from(word.chars().count()).unwrap_or(u16::MAX)
}

/// `text` with line ends in words of more than `most` letters, after the last slash, dash or the like that fits.
fn broken_after_marks(text: &str, most: u16) -> String {
    let most = usize::from(most);
    let split = |word: &str| {
        let mut pieces = Vec::new();
        let mut rest: Vec<char> = word.chars().collect();
        while rest.len() > most {
            let fits = &rest[..most];
            let Some(mark) = fits.iter().rposition(|c| "/\\-_.,:;=@".contains(*c)) else { break };
            pieces.push(rest.drain(..=mark).collect::<String>());
        }
        pieces.push(rest.into_iter().collect());
        pieces.join("\n")
    };
    // Lines and runs of spaces stay as they are.
    text.split('\n').map(|line| line.split(' ').map(split).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("\n")
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
    let width = terminal_width().filter(|_| stderr.is_terminal());
    let text = without_control(text);
    // The mark has no width that counts where it is coloured, so that the text alone is measured.
    let _ = writeln!(stderr, "{mark}{}", wrapped(&text, width.map(|width| width.saturating_sub(MARK))));
}

/// Longest mark before a text, in characters.
const MARK: usize = 9;

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
        let row = ["flared-skirt@3920", setting, "45.8", "76.9"].map(str::to_owned);
        fitted(OPEN, &header.map(str::to_owned), 2.., &[row.to_vec()], width).lines().collect()
    }

    #[test]
    fn long_lines_are_broken_between_words_and_tables_are_not() {
        let text = "milliseconds: load 106.9, distance 28.8, mechanics 206.1, total 6746.2\n│ a table as it is, however long its lines │\nshort";
        let lines = wrapped(text, Some(40)).into_owned();
        let lines: Vec<&str> = lines.lines().collect();
        assert_eq!(lines[..2], ["milliseconds: load 106.9, distance 28.8,", "    mechanics 206.1, total 6746.2"]);
        assert!(lines[2].starts_with('│') && lines[3] == "short", "{lines:?}");
        assert_eq!(wrapped(text, None), text);
        let aligned = wrapped("refined             4 steps, residual 3.8e-4 of the weight", Some(44)).into_owned();
        assert!(aligned.starts_with("refined             4 steps, residual 3.8e-4\n"), "{aligned}");
    }

    #[test]
    fn a_narrow_table_breaks_between_words_and_within_the_longest_word_alone() {
        let narrow = lines(52, "table-3");
        assert!(narrow.iter().all(|line| line.chars().count() <= 52), "{narrow:#?}");
        for word in ["flared-skirt@3920", "table-3", "canonical", "translation"] {
            assert!(narrow.iter().any(|line| line.contains(word)), "{word}: {narrow:#?}");
        }
        let path = lines(60, "assets/tables/table-3-12cm.toml");
        for piece in ["assets/tables/", "table-3-12cm.toml"] {
            assert!(path.iter().any(|line| line.contains(piece)), "{piece}: {path:#?}");
        }
        let broken = lines(60, &"path/".repeat(20));
        assert!(broken.iter().all(|line| line.chars().count() <= 60), "{broken:#?}");
        for word in ["canonical", "translation"] {
            assert!(broken.iter().any(|line| line.contains(word)), "{word}: {broken:#?}");
        }
    }
}
