//! Terminal output: results on stdout, everything else on stderr. No other file prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::borrow::Cow;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::base::error_text::{self, with_causes, without_control};
use clap::ValueEnum;
use comfy_table::{Cell, CellAlignment, ColumnConstraint, ContentArrangement, Row, Table, Width};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

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

/// A table that fits the terminal: long cells are wrapped between words, and words such as paths after a mark such as a slash. If its
/// columns do not fit side by side even so, further ones stand in tables below, each with the first columns again. In a file or a pipe the
/// lines have their full length. The columns listed in `numbers`, ascending, are aligned right.
pub(crate) fn table<R: Into<Row>>(
    style: &str,
    header: impl IntoIterator<Item: Into<Cell>>,
    numbers: impl IntoIterator<Item = usize>,
    rows: impl IntoIterator<Item = R>,
) -> String {
    let width = Table::new().width();
    // On a terminal no line breaks between a number and its percent sign, or about a plus-minus sign.
    let kept = |text: String| match width {
        Some(_) => text.replace(" %", "\u{a0}%").replace(" ± ", "\u{a0}±\u{a0}"),
        None => text,
    };
    let texts = |row: Row| row.cell_iter().map(Cell::content).map(kept).collect::<Vec<String>>();
    let header = texts(Row::from(header.into_iter().map(Into::into).collect::<Vec<Cell>>()));
    let rows: Vec<Vec<String>> = rows.into_iter().map(|row| texts(row.into())).collect();
    let width = width.unwrap_or(u16::MAX);
    let columns = rows.iter().map(Vec::len).fold(header.len(), usize::max);
    let numbers: Vec<usize> = numbers.into_iter().take_while(|column| *column < columns).collect();
    fitted(style, &header, &numbers, &rows, width)
}

/// The table in a terminal of this width, in characters.
fn fitted(style: &str, header: &[String], numbers: &[usize], rows: &[Vec<String>], width: u16) -> String {
    let pieces = longest(header, rows, pieces_of);
    let columns = pieces.len();
    // The columns before the first number tell the rows apart; a number in the first column does so too.
    let first_number = numbers.iter().copied().find(|column| *column > 0).unwrap_or(1);
    let keys: Vec<usize> = (0..first_number.min(columns)).collect();
    let taken = |columns: &[usize]| 1 + columns.iter().map(|c| u32::from(pieces[*c]) + 1).sum::<u32>();
    let mut tables = vec![keys.clone()];
    for column in keys.len()..columns {
        let last = tables.last_mut().filter(|last| {
            let wider = [last.as_slice(), &[column]].concat();
            last.len() == keys.len() || taken(&wider) <= u32::from(width)
        });
        match last {
            Some(last) => last.push(column),
            None => tables.push([keys.as_slice(), &[column]].concat()),
        }
    }
    let part = |columns: &Vec<usize>| {
        let of = |row: &[String]| columns.iter().filter_map(|c| row.get(*c).cloned()).collect::<Vec<String>>();
        let right = (0..columns.len()).filter(|i| numbers.contains(&columns[*i]));
        let rows: Vec<Vec<String>> = rows.iter().map(|row| of(row)).collect();
        narrow(style, &of(header), right, &rows, width).to_string()
    };
    tables.iter().map(part).collect::<Vec<String>>().join("\n")
}

/// A table of these columns in a terminal of this width; where they do not fit, the longest words are broken.
fn narrow(
    style: &str,
    header: &[String],
    numbers: impl IntoIterator<Item = usize>,
    rows: &[Vec<String>],
    width: u16,
) -> Table {
    let mut longest_word = longest(header, rows, |word| vec![word]);
    let longest_piece = longest(header, rows, pieces_of);
    let columns = longest_word.len();
    // Each column takes its padding and a separator.
    let total = |words: &[u16], padding: (u16, u16)| {
        words.iter().map(|n| n.saturating_add(padding.0 + padding.1 + 1)).fold(1, u16::saturating_add)
    };
    let fits = |padding: &(u16, u16)| total(&longest_word, *padding) <= width;
    let padding = [(1, 1), (0, 1)].into_iter().find(fits).unwrap_or((0, 0));
    while total(&longest_word, padding) > width {
        // Words that have marks are broken first.
        let above = |least: &[u16]| {
            (0..columns).filter(|c| longest_word[*c] > least[*c]).max_by_key(|c| (longest_word[*c], *c))
        };
        let Some(column) = above(&longest_piece).or_else(|| above(&vec![1; columns])) else { break };
        longest_word[column] -= 1;
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

/// Letters of the longest part of each column's words.
fn longest<'a>(header: &'a [String], rows: &'a [Vec<String>], parts: impl Fn(&'a str) -> Vec<&'a str>) -> Vec<u16> {
    let mut longest = vec![0; rows.iter().map(Vec::len).fold(header.len(), usize::max)];
    for row in std::iter::once(header).chain(rows.iter().map(Vec::as_slice)) {
        for (longest, text) in longest.iter_mut().zip(row) {
            *longest = text.split([' ', '\n']).flat_map(&parts).map(letters).fold(*longest, u16::max);
        }
    }
    longest
}

/// The parts of a word that stay together: up to and with each slash, dash or the like. A number is one part.
fn pieces_of(word: &str) -> Vec<&str> {
    if word.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c)) {
        return vec![word];
    }
    word.split_inclusive(|c| MARKS.contains(c)).collect()
}

/// Characters after which a long word may be broken.
const MARKS: &str = "/\\-_.,:;=@";

fn letters(word: &str) -> u16 {
    u16::try_from(word.chars().count()).unwrap_or(u16::MAX)
}

/// `text` with line ends in words of more than `most` letters, after the last slash, dash or the like that fits.
fn broken_after_marks(text: &str, most: u16) -> String {
    let split = |word: &str| {
        let mut lines: Vec<String> = vec![String::new()];
        for piece in pieces_of(word) {
            match lines.last_mut() {
                Some(line) if line.is_empty() || letters(line) + letters(piece) <= most => line.push_str(piece),
                _ => lines.push(piece.to_owned()),
            }
        }
        lines.join("\n")
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
        Some(n) => (ProgressBar::new(n), "{msg} {wide_bar} {pos}/{len}{left}"),
        // A longer line would wrap, and each redraw would leave its first part behind.
        None => (ProgressBar::new_spinner(), "{spinner} {wide_msg} {elapsed}"),
    };
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    // Before the first point is done, nothing is known about the time left.
    bar.set_style(style.with_key("left", |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        if state.pos() > 0 {
            let _ = write!(out, "  {:#} left", HumanDuration(state.eta()));
        }
    }));
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
        fitted(OPEN, &header.map(str::to_owned), &[2, 3], &[row.to_vec()], width).lines().map(str::to_owned).collect()
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
    fn a_table_of_too_many_columns_goes_on_below_with_its_first_columns_again() {
        let header = ["garment", "vertices", "thomaszewski2006", "converged", "canonical"].map(str::to_owned);
        let row = ["pullover-1", "4710", "1126 ± 7.12", "3.8/17.0\u{a0}%;", "76.8;"].map(str::to_owned);
        let text = fitted(RULED, &header, &[1, 2, 3, 4], &[row.to_vec()], 44);
        assert!(text.lines().all(|line| line.chars().count() <= 44), "{text}");
        // No word of the table is broken, and each table names its rows.
        for word in header.iter().chain(&row).flat_map(|text| text.split(' ')) {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert_eq!(text.matches("pullover-1").count(), text.matches('┌').count(), "{text}");
        assert!(text.matches('┌').count() > 1, "{text}");
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
