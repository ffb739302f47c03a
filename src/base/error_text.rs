//! What an error says to people: with its causes, short, and without control characters.
//!
//! Names and lines from files are quoted in messages. They can be megabytes, and must not move the cursor or set a title.

use std::borrow::Cow;
use std::error::Error;

/// Bytes of one cause, from its start and from its end: parsers quote the line first and say what is wrong last.
const LONGEST: [usize; 2] = [1200, 800];

/// An error and all that caused it, `joint` between them; a cause that an outer message quotes is said once.
#[must_use]
pub fn said(error: &(dyn Error + 'static), joint: &str) -> String {
    let mut causes: Vec<String> = Vec::new();
    let mut next = Some(error);
    while let Some(error) = next {
        let cause = error.to_string();
        // As they are, since what is shortened no longer holds all that it quoted.
        if !causes.iter().any(|outer| outer.contains(&cause)) {
            causes.push(cause);
        }
        next = error.source();
    }
    causes.iter().map(|cause| short(cause)).collect::<Vec<_>>().join(joint)
}

/// A sentence as it may be told: [`plain`], its middle left out where it is long.
#[must_use]
pub(crate) fn short(sentence: &str) -> String {
    plain(&shortened(sentence, LONGEST)).into_owned()
}

/// A text with its middle left out where it is longer than so many bytes at its start and at its end.
pub(crate) fn shortened(text: &str, [start, end]: [usize; 2]) -> Cow<'_, str> {
    if text.len() <= start + end {
        return text.into();
    }
    let (start, end) = (text.floor_char_boundary(start), text.ceil_char_boundary(text.len() - end));
    format!("{} ... ({} bytes in all) ... {}", &text[..start], text.len(), &text[end..]).into()
}

/// A text without control characters but for the ends of its lines and tabs.
#[must_use]
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return text.into();
    }
    text.chars().flat_map(|c| if harmful(c) { c.escape_default().collect() } else { vec![c] }).collect()
}

/// A value as one line of JSON that is [`plain`] already: what JSON lets stand raw (delete, and the control characters after it) is
/// escaped as JSON escapes, and reads back as it was.
///
/// # Errors
/// What cannot be written as JSON.
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
    fn what_a_file_says_cannot_move_the_cursor_nor_fill_the_screen() {
        assert_eq!(plain("two\nlines,\ta tab, é"), "two\nlines,\ta tab, é");
        let long = std::io::Error::other(format!("a\u{1b}]0;title\u{7}b\r{}", "é".repeat(9_000) + "wrong"));
        let short = said(&long, ": ");
        assert!(short.starts_with("a\\u{1b}]0;title\\u{7}b\\ré") && short.ends_with("éwrong"), "{short}");
        assert!(short.contains("(18018 bytes in all)") && short.len() < 2_200, "{short}");
    }

    #[test]
    fn a_long_cause_that_an_outer_message_quotes_is_said_once() {
        #[derive(Debug, thiserror::Error)]
        #[error("mine.toml, line 2: {0}")]
        struct Outer(#[source] std::io::Error);
        let cause = std::io::Error::other("ü".repeat(2_000) + " is none");
        let short = said(&Outer(cause), ": ");
        assert!(short.starts_with("mine.toml, line 2: ü") && short.ends_with("ü is none"), "{short}");
        assert!(short.matches("bytes in all").count() == 1 && short.len() < 2_200, "{} bytes", short.len());
    }

    #[test]
    fn json_reads_back_as_it_was_and_is_plain() {
        for name in ["denim", "d\u{8e}nim\u{7f}", "a\u{1b}]0;\n\t\"é\u{9b}31m"] {
            let text = json(&[name]).unwrap();
            assert_eq!(plain(&text), text);
            assert!(!text.contains(char::is_control), "{text:?}");
            assert_eq!(serde_json::from_str::<[String; 1]>(&text).unwrap(), [name]);
        }
    }
}
