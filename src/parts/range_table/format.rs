//! Range tables as TOML: reading with file, line and row in every message, and writing so that it reads back equal.

use serde::Deserialize;
use toml::Spanned;

use super::error::{EXPECTED_ROWS, first_problem};
use super::{Extent, GapRule, Level, RangeTable, TableError};
use crate::base::files::{line_of, names_a_file, read_text};
use crate::base::serde_name::word;

/// Table 3 as printed, inside the binary.
const TABLE_3: &str = include_str!("../../../assets/tables/table-3.toml");

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    #[serde(default)]
    source: String,
    unit: Spanned<String>,
    gap: Option<Spanned<String>>,
    levels: Spanned<Vec<Spanned<Vec<f64>>>>,
}

impl RangeTable {
    /// The paper's Table 3, verbatim, hole and all.
    #[must_use]
    pub fn table_3() -> Self {
        // The text is part of the program and a test reads it, so it always parses.
        Self::parse(TABLE_3, "table-3.toml").unwrap_or_default()
    }

    /// The table of this name: `table-3`, or a file.
    pub(crate) fn by_name(name: &str) -> Result<Self, TableError> {
        match name {
            super::TABLE_3 => Ok(Self::table_3()),
            file if names_a_file(file) => Self::parse(&read_text(file.as_ref())?, file),
            other => Err(TableError::Unknown { found: other.to_owned() }),
        }
    }

    /// Reads a table; `source_name` (a path) only serves the messages.
    pub fn parse(text: &str, source_name: &str) -> Result<Self, TableError> {
        let at = |offset: usize| format!("{source_name}:{}", line_of(text, offset));
        let file: File = toml::from_str(text).map_err(|e| TableError::Syntax {
            place: e.span().map_or_else(|| source_name.to_owned(), |span| at(span.start)),
            message: e.message().replace('\n', ", "),
        })?;
        if file.unit.get_ref() != "cm" {
            let found = format!("unit = \"{}\"", file.unit.get_ref());
            let expected = "unit = \"cm\"; convert the bounds to centimetres";
            return Err(TableError::value(at(file.unit.span().start), found, expected));
        }
        let gap = match &file.gap {
            None => GapRule::default(),
            Some(rule) => word(rule.get_ref()).ok_or_else(|| {
                let expected = "\"extend-lower\", \"extend-upper\", \"own-level\" or \"error\"; choose who takes the \
                                distances between two rows that do not meet";
                TableError::value(at(rule.span().start), format!("gap = \"{}\"", rule.get_ref()), expected)
            })?,
        };
        let rows = file.levels.get_ref();
        if rows.is_empty() {
            return Err(TableError::value(at(file.levels.span().start), "no levels", EXPECTED_ROWS));
        }
        let mut levels = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let wrong = |problem| TableError::Row { place: at(row.span().start), row: i + 1, problem };
            levels.push(Level::from_numbers(row.get_ref()).map_err(wrong)?);
        }
        if let Some((row, problem)) = first_problem(&levels, gap) {
            return Err(TableError::Row { place: at(rows[row - 1].span().start), row, problem });
        }
        Ok(Self { name: file.name, source: file.source, gap, levels })
    }

    /// The table as a file that [`parse`](Self::parse) reads back to an equal one.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let quoted = |s: &str| toml::Value::String(s.to_owned()).to_string();
        let mut text = format!("name = {}\n", quoted(&self.name));
        if !self.source.is_empty() {
            text.push_str(&format!("source = {}\n", quoted(&self.source)));
        }
        text.push_str(&format!("unit = \"cm\"\ngap = \"{}\"\nlevels = [\n", self.gap));
        for level in &self.levels {
            // `{:?}` is the shortest text that reads back to the same bits; TOML spells infinity the same way.
            let numbers =
                [level.lower_cm, level.upper_cm].into_iter().chain(level.extent.iter().flat_map(Extent::numbers_cm));
            text.push_str(&format!("    [{}],\n", numbers.map(|cm| format!("{cm:?}")).collect::<Vec<_>>().join(", ")));
        }
        text.push_str("]\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::range_table::BoundProblem;

    fn file(levels: &str) -> String {
        format!("name = \"t\"\nunit = \"cm\"\nlevels = [\n{levels}\n]\n")
    }

    fn message(text: &str) -> String {
        RangeTable::parse(text, "t.toml").unwrap_err().to_string()
    }

    #[test]
    fn a_written_table_reads_back_equal() {
        let table = RangeTable::table_3();
        assert_eq!(RangeTable::parse(&table.to_toml(), "again").unwrap(), table);
        let odd = RangeTable::from_bounds("a \"quoted\"\nname", &[0.1 + 0.2, 1.0 / 3.0, f64::INFINITY]).unwrap();
        assert_eq!(RangeTable::parse(&odd.to_toml(), "odd").unwrap(), odd);
        let cut = odd.with_extents(&[Some(Extent { width_cm: 0.1 + 0.2, height_cm: 7.0 }), None]).unwrap();
        assert_eq!(RangeTable::parse(&cut.to_toml(), "cut").unwrap(), cut);
        let never = cut.with_extents(&[Some(Extent::even(2.5)), Some(Extent::UNCUT)]).unwrap();
        assert!(never.to_toml().contains(", 2.5],\n    [0.3333333333333333, inf, inf],"), "{}", never.to_toml());
        assert_eq!(RangeTable::parse(&never.to_toml(), "never").unwrap(), never);
    }

    #[test]
    fn each_bad_bound_is_named_with_its_line_and_row() {
        for (rows, line, row, word) in [
            ("[0, 1],\n[2, 1.5],", 5, 2, "above the lower"),
            ("[0, 1],\n[0.9, 2],", 5, 2, "inside the row before"),
            ("[1, 2],\n[0, 1],", 5, 2, "sort the rows"),
            ("[-1, 2],", 4, 1, "at least 0"),
            ("[nan, 2],", 4, 1, "two numbers"),
            ("[0, inf],\n[3, 4],", 4, 1, "only the last row"),
            ("[0, 1],\n[1, 2, 0],", 5, 2, "the extent [0.0]"),
            ("[0, 1, -3],", 4, 1, "the extent [-3.0]"),
            ("[0, 1, 5],\n[1, inf, 4, nan],", 5, 2, "the extent [4.0, NaN]"),
        ] {
            let text = file(rows);
            let said = message(&text);
            assert!(said.starts_with(&format!("t.toml:{line}: row {row} ")), "{said}");
            assert!(said.contains(word), "{said}");
        }
        assert!(message(&file("[0, 1],\n[2],")).starts_with("t.toml:5: row 2 has 1 numbers"));
        assert!(message(&file("[0, 1, 2, 3, 4],")).contains("or [lower, upper, width, height]"));
        assert!(message(&file("")).starts_with("t.toml:3: found no levels"));
    }

    #[test]
    fn keys_and_words_are_checked() {
        assert!(message("name = 1").starts_with("t.toml:1:"));
        assert!(message("name = \"t\"\nunit = \"mm\"\nlevels = [[0, 1]]").contains("t.toml:2: found unit = \"mm\""));
        assert!(message("name = \"t\"\nunit = \"cm\"\nlevels = [[0, 1]]\ncolour = 3").starts_with("t.toml:4:"));
        assert!(message("name = \"t\"\nunit = \"cm\"\ngap = \"close\"\nlevels = [[0, 1]]").starts_with("t.toml:3:"));
        assert!(message("name = \"t\"\nunit = \"cm\"\nlevels = [[0, 1]").contains("t.toml:"));
        assert!(message("name = \"t\"\nunit = \"cm\"").contains("levels"));
    }

    #[test]
    fn a_hole_is_an_error_where_the_table_says_so() {
        let text = format!("gap = \"error\"\n{}", file("[0, 3],\n[3.5, inf]"));
        let error = RangeTable::parse(&text, "t.toml").unwrap_err();
        let problem = BoundProblem::Hole { lower: 3.5, before: 3.0 };
        assert_eq!(error, TableError::Row { place: "t.toml:6".into(), row: 2, problem });
    }
}
