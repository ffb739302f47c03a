//! The text panel of a recording: inputs, result and timings as Markdown.

use std::fmt::Write as _;

use super::error::RERUN_VERSION;
use crate::picture::colour::legend::number;
use crate::study::metrics::LevelCount;

/// The contents of the text panel. Empty sections are left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Heading: garment and body.
    pub title: String,
    /// Name of the range table.
    pub table: String,
    /// Levels of the table, nearest first.
    pub levels: Vec<LevelCount>,
    /// Facts in two columns: vertices, PARTs, singletons, model, error, ...
    pub facts: Vec<(String, String)>,
    /// Constants of the fabric, values with units.
    pub fabric: Vec<(String, String)>,
    /// Time of each stage, ms.
    pub timings_ms: Vec<(String, f64)>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// The command that reproduces this recording.
    pub command_line: String,
}

impl Panel {
    /// The panel as Markdown.
    pub(crate) fn markdown(&self) -> String {
        let mut text = String::new();
        if !self.title.is_empty() {
            line(&mut text, format_args!("## {}\n", self.title));
        }
        for warning in &self.warnings {
            // Not a quotation, which the viewer writes in faint grey.
            line(&mut text, format_args!("**⚠ Warning: {warning}**\n"));
        }
        // First, so that it is visible without scrolling in a window of 1280 × 800.
        if !self.levels.is_empty() {
            line(&mut text, format_args!("**{}**\n", self.table));
            // Only tables with extents get a column for them.
            let with_extents = self.levels.iter().any(|row| row.extent.is_some());
            let (head, rule) = if with_extents { (" cut to, cm |", "--:|") } else { ("", "") };
            line(&mut text, format_args!("| level | cm | vertices | PARTs |{head}\n|--:|:--|--:|--:|{rule}"));
            // Empty levels are left out; the others keep their numbers.
            for row in self.levels.iter().filter(|row| row.vertices > 0) {
                let (level, range) = (row.level, range_cm(row.lower_cm, row.upper_cm));
                let extent = row.extent.map_or_else(String::new, |e| e.to_string());
                let extent = if with_extents { format!(" {extent} |") } else { String::new() };
                line(&mut text, format_args!("| {level} | {range} | {} | {} |{extent}", row.vertices, row.parts));
            }
            text.push('\n');
        }
        let (short, long): (Vec<_>, Vec<_>) = self.facts.iter().partition(|(name, value)| fits(name, value));
        two_columns(&mut text, "Drape", "", short.into_iter().map(|(k, v)| (k.as_str(), v.clone())));
        for (name, value) in long {
            line(&mut text, format_args!("**{name}:** {value}\n"));
        }
        two_columns(&mut text, "Time", "ms", self.timings_ms.iter().map(|(k, v)| (k.as_str(), number(*v))));
        two_columns(&mut text, "Fabric", "", self.fabric.iter().map(|(k, v)| (k.as_str(), v.clone())));
        if !self.command_line.is_empty() {
            line(&mut text, format_args!("**Command**\n\n```\n{}\n```\n", self.command_line));
        }
        line(&mut text, format_args!("partwise {} · Rerun {RERUN_VERSION}", env!("CARGO_PKG_VERSION")));
        text
    }
}

/// A range in centimetres, in the paper's notation.
pub(super) fn range_cm(lower_cm: f64, upper_cm: f64) -> String {
    // Rounded to a micrometre: a scaled bound has many digits.
    let cm = |cm: f64| number((cm * 1e4).round() / 1e4);
    if upper_cm.is_finite() {
        format!("{} – {}", cm(lower_cm), cm(upper_cm))
    } else {
        format!("{} – ∞", cm(lower_cm))
    }
}

/// Whether a fact fits in the columns of a table, which do not wrap; longer facts are text.
fn fits(name: &str, value: &str) -> bool {
    name.chars().count() <= 15 && value.chars().count() <= 20
}

fn two_columns<'a>(text: &mut String, title: &str, unit: &str, rows: impl Iterator<Item = (&'a str, String)>) {
    let mut rows = rows.peekable();
    if rows.peek().is_none() {
        return;
    }
    line(text, format_args!("| **{title}** | {unit} |\n|:--|--:|"));
    for (name, value) in rows {
        line(text, format_args!("| {name} | {value} |"));
    }
    text.push('\n');
}

/// Appends a line.
fn line(text: &mut String, content: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{content}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::range_table::Extent;

    #[test]
    fn the_panel_contains_every_section_and_no_empty_tables() {
        let panel = Panel {
            title: "skirt on body".into(),
            table: "Table 3".into(),
            levels: vec![
                LevelCount { level: 1, lower_cm: 0.0, upper_cm: 0.06, vertices: 4, parts: 2, extent: None },
                LevelCount { level: 2, lower_cm: 0.06, upper_cm: 0.06, vertices: 0, parts: 0, extent: None },
                LevelCount { level: 3, lower_cm: 0.06, upper_cm: f64::INFINITY, vertices: 9, parts: 1, extent: None },
            ],
            facts: vec![
                ("model".into(), "coupled".into()),
                ("wrinkles".into(), "a sentence as long as this one is text".into()),
            ],
            timings_ms: vec![("distance".into(), 12.345)],
            command_line: "partwise run --garment skirt".into(),
            ..Panel::default()
        };
        let text = panel.markdown();
        for piece in [
            "| 1 | 0 – 0.06 | 4 | 2 |",
            "| 3 | 0.06 – ∞ | 9 | 1 |",
            "| distance | 12.3 |",
            "partwise run",
            "| model | coupled |",
            "**wrinkles:** a sentence",
        ] {
            assert!(text.contains(piece), "{piece} in {text}");
        }
        assert!(!text.contains("Fabric"));
        let mut cut = panel.clone();
        (cut.levels[0].extent, cut.levels[2].extent) =
            (Some(Extent { width_cm: 6.0, height_cm: 12.0 }), Some(Extent::UNCUT));
        let text = cut.markdown();
        for piece in ["| PARTs | cut to, cm |", "| 4 | 2 | 6 × 12 |", "| 9 | 1 | not cut |"] {
            assert!(text.contains(piece), "{piece} in {text}");
        }
    }
}
