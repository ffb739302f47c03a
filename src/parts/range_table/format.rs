//! Range tables as text: TOML files, with file, line and row in every message, and the plain form inside jobs and recordings.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Spanned;

use super::level::{EXPECTED_ROWS, GapRule, Level, TableError, first_problem};
use super::table::{RangeTable, TABLE_3};
use crate::base::files::{line_of, names_a_file, read_text};
use crate::base::serde_name;

/// Table 3 as printed, compiled in.
const TABLE_3_TOML: &str = include_str!("../../../assets/tables/table-3.toml");

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
    /// The paper's Table 3, verbatim, including its hole.
    #[must_use]
    pub fn table_3() -> Self {
        // A test parses the text, so the default never applies.
        Self::parse(TABLE_3_TOML, "table-3.toml").unwrap_or_default()
    }

    /// The table of this name: `table-3` or a file.
    pub(crate) fn by_name(name: &str) -> Result<Self, TableError> {
        match name {
            TABLE_3 => Ok(Self::table_3()),
            file if names_a_file(file) => Self::parse(&read_text(file.as_ref())?, file),
            other => Err(TableError::Unknown { found: other.to_owned() }),
        }
    }

    /// Parses a table; `source_name` (a path) appears in messages only.
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
            Some(rule) => serde_name::parse(rule.get_ref()).ok_or_else(|| {
                let expected = "\"extend-lower\", \"extend-upper\", \"own-level\" or \"error\"; choose the level \
                                of the distances between two rows that do not meet";
                TableError::value(at(rule.span().start), format!("gap = \"{}\"", rule.get_ref()), expected)
            })?,
        };
        let rows = file.levels.get_ref();
        if rows.is_empty() {
            return Err(TableError::value(at(file.levels.span().start), "no levels", EXPECTED_ROWS));
        }
        let wrong = |row: usize, problem| TableError::Row { place: at(rows[row - 1].span().start), row, problem };
        let level = |(i, row): (usize, &Spanned<Vec<f64>>)| {
            Level::from_numbers(row.get_ref()).map_err(|problem| wrong(i + 1, problem))
        };
        let levels = rows.iter().enumerate().map(level).collect::<Result<Vec<_>, _>>()?;
        if let Some((row, problem)) = first_problem(&levels, gap) {
            return Err(wrong(row, problem));
        }
        Ok(Self { name: file.name, source: file.source, gap, levels })
    }

    /// The table as TOML that [`parse`](Self::parse) reads back to an equal one.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let quoted = |s: &str| toml::Value::String(s.to_owned()).to_string();
        let mut text = format!("name = {}\n", quoted(&self.name));
        if !self.source.is_empty() {
            text.push_str(&format!("source = {}\n", quoted(&self.source)));
        }
        text.push_str(&format!("unit = \"cm\"\ngap = \"{}\"\nlevels = [\n", self.gap));
        for level in &self.levels {
            // `{:?}` is the shortest text that parses to the same bits, and writes infinity as TOML does.
            let numbers: Vec<String> = level.numbers_cm().map(|cm| format!("{cm:?}")).collect();
            text.push_str(&format!("    [{}],\n", numbers.join(", ")));
        }
        text.push_str("]\n");
        text
    }
}

/// A bound or an extent, cm. JSON has no infinity, so it is written as the string `inf`, TOML's word.
struct Cm(f64);

impl Serialize for Cm {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        if self.0.is_infinite() { out.serialize_str("inf") } else { out.serialize_f64(self.0) }
    }
}

impl<'de> Deserialize<'de> for Cm {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected centimetres or \"inf\"")]
        enum Either {
            Number(f64),
            Word(String),
        }
        match Either::deserialize(from)? {
            Either::Number(cm) => Ok(Self(cm)),
            Either::Word(word) if word == "inf" => Ok(Self(f64::INFINITY)),
            Either::Word(word) => Err(D::Error::custom(format!("found \"{word}\", expected centimetres or \"inf\""))),
        }
    }
}

/// A table as jobs and recordings serialise it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Plain {
    name: String,
    #[serde(default)]
    source: String,
    #[serde(default)]
    gap: GapRule,
    levels: Vec<Vec<Cm>>,
}

impl Serialize for RangeTable {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        let levels = self.levels.iter().map(|level| level.numbers_cm().map(Cm).collect()).collect();
        Plain { name: self.name.clone(), source: self.source.clone(), gap: self.gap, levels }.serialize(out)
    }
}

impl<'de> Deserialize<'de> for RangeTable {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let plain = Plain::deserialize(from)?;
        let place = || format!("table \"{}\"", plain.name);
        let rows = plain.levels.iter().enumerate().map(|(i, row)| {
            let cm: Vec<f64> = row.iter().map(|cm| cm.0).collect();
            Level::from_numbers(&cm).map_err(|problem| TableError::Row { place: place(), row: i + 1, problem })
        });
        let levels = rows.collect::<Result<Vec<_>, _>>().map_err(D::Error::custom)?;
        if levels.is_empty() {
            return Err(D::Error::custom(TableError::value(place(), "no levels", EXPECTED_ROWS)));
        }
        let table = Self::new(plain.name, plain.gap, levels).map_err(D::Error::custom)?;
        Ok(table.with_source(plain.source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::range_table::{BoundProblem, Extent, TableRule};

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
            let found = message(&text);
            assert!(found.starts_with(&format!("t.toml:{line}: row {row} ")), "{found}");
            assert!(found.contains(word), "{found}");
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
    fn a_hole_is_an_error_if_the_table_requires_it() {
        let text = format!("gap = \"error\"\n{}", file("[0, 3],\n[3.5, inf]"));
        let error = RangeTable::parse(&text, "t.toml").unwrap_err();
        let problem = BoundProblem::Hole { lower: 3.5, before: 3.0 };
        assert_eq!(error, TableError::Row { place: "t.toml:6".into(), row: 2, problem });
    }

    #[test]
    fn a_table_survives_json_with_its_open_end_and_bad_rows_are_refused() {
        let table = RangeTable::table_3().with_extents(&[Some(Extent { width_cm: 6.0, height_cm: f64::INFINITY })]);
        let rule = TableRule::from(table.unwrap());
        let text = serde_json::to_string(&rule).unwrap();
        assert!(text.contains("\"inf\""), "{text}");
        assert_eq!(serde_json::from_str::<TableRule>(&text).unwrap(), rule);
        for (levels, word) in
            [("[]", "no levels"), ("[[1]]", "row 1"), ("[[0, 2], [1, 3]]", "row 2"), ("[[0, \"far\"]]", "far")]
        {
            let text = format!("{{\"rows\": {{\"name\": \"t\", \"levels\": {levels}}}}}");
            let message = serde_json::from_str::<TableRule>(&text).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
