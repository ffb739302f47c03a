//! The text of an error for display: with its causes, shortened, and without control characters.
//!
//! Messages quote names and lines of input files. A quoted line can be megabytes long, and its control characters could move
//! the terminal's cursor or set the window's title.

use std::borrow::Cow;
use std::error::Error;

/// Bytes that [`short`] keeps from the start and from the end of a text. Parsers quote the line first and end with the
/// mistake, so both ends matter. A heuristic: the two fill one screen.
const KEPT_BYTES: [usize; 2] = [1200, 800];

/// The messages of an error and of its causes, joined by `separator`. A cause that an outer message already contains is left out.
#[must_use]
pub fn with_causes(error: &(dyn Error + 'static), separator: &str) -> String {
    let mut causes: Vec<String> = Vec::new();
    let mut next = Some(error);
    while let Some(error) = next {
        let cause = error.to_string();
        // Compared before shortening: a shortened message no longer contains the whole cause.
        if !causes.iter().any(|outer| outer.contains(&cause)) {
            causes.push(cause);
        }
        next = error.source();
    }
    causes.iter().map(|cause| short(cause)).collect::<Vec<_>>().join(separator)
}

/// A text with control characters escaped and, above [`KEPT_BYTES`], its middle left out.
pub(crate) fn short(text: &str) -> String {
    without_control(&shortened(text, KEPT_BYTES)).into_owned()
}

/// A text without its middle if it is longer than `start` + `end` bytes, which it keeps at its two ends.
pub(crate) fn shortened(text: &str, [start, end]: [usize; 2]) -> Cow<'_, str> {
    if text.len() <= start + end {
        return text.into();
    }
    let (start, end) = (text.floor_char_boundary(start), text.ceil_char_boundary(text.len() - end));
    format!("{} ... ({} bytes in all) ... {}", &text[..start], text.len(), &text[end..]).into()
}

/// A text with its control characters escaped, except newlines and tabs.
pub(crate) fn without_control(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return text.into();
    }
    text.chars().flat_map(|c| if harmful(c) { c.escape_default().collect() } else { vec![c] }).collect()
}

/// A value as one line of JSON without control characters. JSON allows U+007F to U+009F unescaped; here they are escaped, too.
pub(crate) fn json(value: &impl serde::Serialize) -> serde_json::Result<String> {
    let text = serde_json::to_string(value)?;
    if !text.contains(char::is_control) {
        return Ok(text);
    }
    let escaped = |c: char| if c.is_control() { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    Ok(text.chars().map(escaped).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_text_is_shortened_and_has_no_control_characters() {
        assert_eq!(without_control("two\nlines,\ta tab, é"), "two\nlines,\ta tab, é");
        let long = std::io::Error::other(format!("a\u{1b}]0;title\u{7}b\r{}", "é".repeat(9_000) + "wrong"));
        let short = with_causes(&long, ": ");
        assert!(short.starts_with("a\\u{1b}]0;title\\u{7}b\\ré") && short.ends_with("éwrong"), "{short}");
        assert!(short.contains("(18018 bytes in all)") && short.len() < 2_200, "{short}");
    }

    #[test]
    fn a_long_cause_that_an_outer_message_quotes_appears_once() {
        #[derive(Debug, thiserror::Error)]
        #[error("mine.toml, line 2: {0}")]
        struct Outer(#[source] std::io::Error);
        let cause = std::io::Error::other("ü".repeat(2_000) + " is invalid");
        let short = with_causes(&Outer(cause), ": ");
        assert!(short.starts_with("mine.toml, line 2: ü") && short.ends_with("ü is invalid"), "{short}");
        assert!(short.matches("bytes in all").count() == 1 && short.len() < 2_200, "{} bytes", short.len());
    }

    #[test]
    fn json_reads_back_equal_and_has_no_control_characters() {
        for name in ["denim", "d\u{8e}nim\u{7f}", "a\u{1b}]0;\n\t\"é\u{9b}31m"] {
            let text = json(&[name]).unwrap();
            assert_eq!(without_control(&text), text);
            assert!(!text.contains(char::is_control), "{text:?}");
            assert_eq!(serde_json::from_str::<[String; 1]>(&text).unwrap(), [name]);
        }
    }
}
