//! The text of an error for display: with its causes, shortened, and without control characters.
//!
//! Messages quote names and lines of input files. A quoted line can be megabytes long, and its control characters could move
//! the terminal's cursor or set the window's title.

use std::any::Any;
use std::borrow::Cow;
use std::error::Error;

/// Bytes that [`short`] keeps from the start and from the end of a text. Parsers quote the line first and end with the
/// mistake, so both ends matter. A heuristic: the two fill one screen.
const KEPT_BYTES: [usize; 2] = [1200, 800];

/// Least Jaro-Winkler likeness of a mistyped name. A heuristic, a little above the one that clap has for options.
const ALIKE: f64 = 0.8;

/// The messages of an error and of its causes, joined by `separator`. A cause that an outer message already contains is left out.
#[must_use]
pub fn with_causes(error: &(dyn Error + 'static), separator: &str) -> String {
    let mut causes: Vec<String> = Vec::new();
    let mut next = Some(error);
    while let Some(error) = next {
        // The message of `toml` about a number in place of a name.
        let message = error.to_string().replace("wanted string or table", "expected a name in quotes");
        let cause = with_suggestion(message);
        // Compared before shortening: a shortened message no longer contains the whole cause.
        if !causes.iter().any(|outer| outer.contains(&cause)) {
            causes.push(cause);
        }
        next = error.source();
    }
    causes.iter().map(|cause| short(cause)).collect::<Vec<_>>().join(separator)
}

/// The message of a panic.
pub(crate) fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("without a message")
}

/// ", did you mean `table-3`?" for the known name that is most like a mistyped one; empty where none is alike.
#[must_use]
pub(crate) fn did_you_mean<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let likeness = |name: &'a str| (strsim::jaro_winkler(&found.to_lowercase(), name), name);
    let best = known.into_iter().map(likeness).max_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|best| best.0 > ALIKE).map_or_else(String::new, |(_, name)| format!(", did you mean `{name}`?"))
}

/// A message with the known key that is like the unknown one which it reports, as serde and sweep files word it.
fn with_suggestion(message: String) -> String {
    let suggested = || {
        let start = ["unknown field `", "unknown key `", "unknown variant `"]
            .iter()
            .find_map(|before| Some(message.find(before)? + before.len()))?;
        let (found, after) = message[start..].split_once('`')?;
        let (_, known) = after.split_once("expected one of ")?;
        let known = known.lines().next()?.split(';').next()?;
        let meant = did_you_mean(found, known.split(", ").map(|name| name.trim_matches('`')));
        let (before, rest) = message.split_at(start + found.len() + 1);
        Some(format!("{before}{meant}{}", if meant.is_empty() { rest } else { rest.trim_start_matches(',') }))
    };
    suggested().unwrap_or(message)
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
    fn a_mistyped_name_is_answered_by_the_one_that_is_like_it() {
        let garments = ["pullover-1", "pullover-2", "flared-skirt", "low-cut-dress", "long-sleeved-dress"];
        for (found, meant) in [
            ("pulover-1", "pullover-1"),
            ("Pullover_2", "pullover-2"),
            ("flaredskirt", "flared-skirt"),
            ("lowcut-dress", "low-cut-dress"),
        ] {
            assert_eq!(did_you_mean(found, garments), format!(", did you mean `{meant}`?"));
        }
        assert_eq!(did_you_mean("table3", ["table-3"]), ", did you mean `table-3`?");
        for other in ["", "trousers", "xyz"] {
            assert_eq!(did_you_mean(other, garments), "");
        }
    }

    #[test]
    fn a_mistyped_key_is_answered_by_the_one_that_is_like_it() {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(dead_code, reason = "only parsed")]
        struct Lengths {
            bust_cm: Option<f64>,
            underbust_cm: Option<f64>,
            waist_cm: Option<f64>,
        }
        let text = |key: &str| with_causes(&toml::from_str::<Lengths>(&format!("{key} = 3")).unwrap_err(), ": ");
        assert!(
            text("wast_cm").contains("unknown field `wast_cm`, did you mean `waist_cm`? expected one of"),
            "{}",
            text("wast_cm")
        );
        assert!(text("colour").contains("unknown field `colour`, expected one of"), "{}", text("colour"));
        let sweep = std::io::Error::other("a.toml:3: unknown key `tabels`, expected one of bodies, tables, sizes");
        assert!(with_causes(&sweep, ": ").contains("`tabels`, did you mean `tables`? expected"));
    }

    #[test]
    fn a_number_in_place_of_a_name_is_answered_by_what_is_expected() {
        #[derive(Debug, serde::Deserialize)]
        enum Side {
            Front,
        }
        let number = toml::from_str::<std::collections::BTreeMap<String, Side>>("side = 1");
        let text = with_causes(&number.map(|_| Side::Front).unwrap_err(), ": ");
        assert!(text.contains("expected a name in quotes"), "{text}");
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
