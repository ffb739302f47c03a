//! What people read: results on stdout, everything else on stderr. The one place that prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::borrow::Cow;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Whether a result could not be printed.
static UNPRINTED: AtomicBool = AtomicBool::new(false);
/// Characters of one cause of an error: names and lines from a file can be megabytes.
const LONGEST_CAUSE: usize = 2000;

/// A result, on stdout. A closed pipe (`| head`) is no error; any other failure is said, and ends the program with 1.
pub(crate) fn result(text: &str) {
    let mut stdout = std::io::stdout().lock();
    // Flushed here, as nobody hears of what fails when the program ends.
    let printed = writeln!(stdout, "{}", plain(text.trim_end_matches('\n'))).and_then(|()| stdout.flush());
    if let Err(error) = printed.or_else(|e| if e.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(e) }) {
        UNPRINTED.store(true, Ordering::SeqCst);
        say(&paint("error: ", "31;1"), &format!("standard output: the result cannot be printed: {error}"));
    }
}

/// Whether every result could be printed.
pub(crate) fn all_printed() -> bool {
    !UNPRINTED.load(Ordering::SeqCst)
}

/// Something worth knowing, on stderr.
pub(crate) fn note(text: &str) {
    say("", text);
}

/// Writes to stderr; `mark` may hold colours, `text` may come from a file and may not.
fn say(mark: &str, text: &str) {
    // Where stderr is closed there is nobody left to tell.
    let _ = writeln!(std::io::stderr().lock(), "{mark}{}", plain(text));
}

/// Without control characters: names and words from files are quoted, and must not move the cursor or set a title.
fn plain(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return text.into();
    }
    text.chars().flat_map(|c| if harmful(c) { c.escape_default().collect() } else { vec![c] }).collect()
}

/// Something to act upon, on stderr.
pub(crate) fn warning(text: &str) {
    say(&paint("warning: ", "33;1"), text);
}

/// An error with its causes, on stderr.
pub(crate) fn error(error: &anyhow::Error) {
    let mut said = String::new();
    for cause in error.chain().map(ToString::to_string) {
        // An outer message often quotes its source already.
        if said.contains(&cause) {
            continue;
        }
        if !said.is_empty() {
            said.push_str("\n  because: ");
        }
        match cause.char_indices().nth(LONGEST_CAUSE) {
            None => said.push_str(&cause),
            Some((end, _)) => said += &format!("{} ... ({} bytes in all)", &cause[..end], cause.len()),
        }
    }
    say(&paint("error: ", "31;1"), &said);
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
    bar.set_message(plain(what).into_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_says_cannot_move_the_cursor() {
        assert_eq!(plain("two\nlines,\ta tab, é"), "two\nlines,\ta tab, é");
        assert_eq!(plain("a\u{1b}]0;title\u{7}b\r"), "a\\u{1b}]0;title\\u{7}b\\r");
    }
}
