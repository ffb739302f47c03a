//! What people read: results on stdout, everything else on stderr. The one place that prints.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A result, on stdout. A closed pipe (`| head`) is no error.
pub(crate) fn result(text: &str) {
    let _ = writeln!(std::io::stdout().lock(), "{}", text.trim_end_matches('\n'));
}

/// Something worth knowing, on stderr.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Something to act upon, on stderr.
pub(crate) fn warning(text: &str) {
    note(&format!("{} {text}", paint("warning:", "33;1")));
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
        said.push_str(&cause);
    }
    note(&format!("{} {said}", paint("error:", "31;1")));
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
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
