//! The text panel: what was run, on what, with which result and how fast, as Markdown.

use std::fmt::Write as _;

use super::legend::number;

/// Version of the viewer the recording is made for.
pub const RERUN_VERSION: &str = "0.36.3";

/// One row of the range table as solved.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelRow {
    /// Lower value, m.
    pub lower_m: f64,
    /// Upper value, m; infinite for the last level.
    pub upper_m: f64,
    /// Vertices in it.
    pub vertices: usize,
    /// PARTs in it.
    pub parts: usize,
    /// The extent its PARTs are cut to by the table, cm, as people read it.
    pub extent: Option<String>,
}

/// Everything the text panel shows. Empty pieces are left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Headline: garment and body.
    pub title: String,
    /// Name of the range table.
    pub table: String,
    /// Its levels, nearest first.
    pub levels: Vec<LevelRow>,
    /// Facts in two columns: vertices, PARTs, singletons, model, error, ...
    pub facts: Vec<(String, String)>,
    /// The fabric: constant and value with unit.
    pub fabric: Vec<(String, String)>,
    /// Time of each stage, ms.
    pub timings_ms: Vec<(String, f64)>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// The command that makes this recording.
    pub command_line: String,
}

impl Panel {
    /// The panel as Markdown.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = String::new();
        if !self.title.is_empty() {
            line(&mut text, format_args!("## {}\n", self.title));
        }
        let (short, long): (Vec<_>, Vec<_>) = self.facts.iter().partition(|(name, value)| fits(name, value));
        two_columns(&mut text, "Drape", "", short.into_iter().map(|(k, v)| (k.as_str(), v.clone())));
        for (name, value) in long {
            line(&mut text, format_args!("**{name}:** {value}\n"));
        }
        for warning in &self.warnings {
            line(&mut text, format_args!("> ⚠ {warning}\n"));
        }
        two_columns(&mut text, "Time", "ms", self.timings_ms.iter().map(|(k, v)| (k.as_str(), number(*v))));
        if !self.levels.is_empty() {
            line(&mut text, format_args!("**{}**\n", self.table));
            // Only tables with extents get a column for them.
            let own = self.levels.iter().any(|row| row.extent.is_some());
            let (head, rule) = if own { (" cut to, cm |", "--:|") } else { ("", "") };
            line(&mut text, format_args!("| level | cm | vertices | PARTs |{head}\n|--:|:--|--:|--:|{rule}"));
            // An empty level says nothing; the others keep their numbers.
            for (i, row) in self.levels.iter().enumerate().filter(|(_, row)| row.vertices > 0) {
                let (level, range) = (i + 1, range_cm(row.lower_m, row.upper_m));
                let extent = if own { format!(" {} |", row.extent.as_deref().unwrap_or("")) } else { String::new() };
                line(&mut text, format_args!("| {level} | {range} | {} | {} |{extent}", row.vertices, row.parts));
            }
            text.push('\n');
        }
        two_columns(&mut text, "Fabric", "", self.fabric.iter().map(|(k, v)| (k.as_str(), v.clone())));
        if !self.command_line.is_empty() {
            line(&mut text, format_args!("**Command**\n\n```\n{}\n```\n", self.command_line));
        }
        let own = env!("CARGO_PKG_VERSION");
        line(&mut text, format_args!("partwise {own} · Rerun {RERUN_VERSION}"));
        text
    }
}

/// A range in centimetres as the paper prints it.
#[must_use]
pub fn range_cm(lower_m: f64, upper_m: f64) -> String {
    // 100 × a centimetre bound read from a table is off by an ulp; a micrometre is far below any bound.
    let cm = |m: f64| number((m * 1e6).round() / 1e4);
    if upper_m.is_finite() { format!("{} – {}", cm(lower_m), cm(upper_m)) } else { format!("{} –", cm(lower_m)) }
}

/// Whether a fact fits beside others in the panel's width. A table's columns do not wrap: what is longer is text.
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

fn line(text: &mut String, content: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{content}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_panel_holds_what_it_is_given_and_no_empty_tables() {
        let panel = Panel {
            title: "skirt on body".into(),
            table: "Table 3".into(),
            levels: vec![
                LevelRow { lower_m: 0.0, upper_m: 0.0006, vertices: 4, parts: 2, extent: None },
                LevelRow { lower_m: 0.0006, upper_m: 0.0006, vertices: 0, parts: 0, extent: None },
                LevelRow { lower_m: 0.0006, upper_m: f64::INFINITY, vertices: 9, parts: 1, extent: None },
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
            "| 3 | 0.06 – | 9 | 1 |",
            "| distance | 12.3 |",
            "partwise run",
            "| model | coupled |",
            "**wrinkles:** a sentence",
        ] {
            assert!(text.contains(piece), "{piece} in {text}");
        }
        assert!(!text.contains("Fabric"));
        let mut cut = panel.clone();
        (cut.levels[0].extent, cut.levels[2].extent) = (Some("6 × 12".into()), Some("not cut".into()));
        let text = cut.markdown();
        for piece in ["| PARTs | cut to, cm |", "| 4 | 2 | 6 × 12 |", "| 9 | 1 | not cut |"] {
            assert!(text.contains(piece), "{piece} in {text}");
        }
    }
}
