//! What an error says to people: with its causes, short, and without control characters.
//!
//! Names and lines from files are quoted in messages. They can be megabytes, and must not move the cursor or set a title.

use std::borrow::Cow;
use std::error::Error;

/// Characters of one cause, from its start and from its end: parsers quote the line first and say what is wrong last.
const LONGEST: [usize; 2] = [1200, 800];

/// An error and all that caused it, `joint` between them; a cause that an outer message quotes is said once.
#[must_use]
pub fn said(error: &(dyn Error + 'static), joint: &str) -> String {
    let mut text = String::new();
    let mut next = Some(error);
    while let Some(error) = next {
        let cause = error.to_string();
        if !text.contains(&cause) {
            text += if text.is_empty() { "" } else { joint };
            let place = |n: usize| cause.char_indices().nth(n).map_or(cause.len(), |(place, _)| place);
            match cause.chars().count().checked_sub(LONGEST[0] + LONGEST[1]) {
                None | Some(0) => text += &cause,
                Some(more) => {
                    let (start, end) = (&cause[..place(LONGEST[0])], &cause[place(LONGEST[0] + more)..]);
                    text += &format!("{start} ... ({} bytes in all) ... {end}", cause.len());
                }
            }
        }
        next = error.source();
    }
    plain(&text).into_owned()
}

/// A text without control characters but for the ends of its lines and tabs.
#[must_use]
pub fn plain(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return text.into();
    }
    text.chars().flat_map(|c| if harmful(c) { c.escape_default().collect() } else { vec![c] }).collect()
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
        assert!(short.contains("(18018 bytes in all)") && short.len() < 5_000, "{short}");
    }
}
