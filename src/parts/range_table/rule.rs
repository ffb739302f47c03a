//! A table, or the rule that makes one from the garment's distances; and both as plain data for jobs.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::error::EXPECTED_ROWS;
use super::{Extent, GapRule, Level, RangeTable, TableError};

/// A range table, or the rule that makes one from the garment's distances.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TableRule {
    /// The same rows for every garment.
    Rows(RangeTable),
    /// So many levels of equally many vertices, which depend on the garment.
    Quantile {
        /// What the table is called.
        name: String,
        /// Number of levels.
        levels: usize,
    },
}

impl TableRule {
    /// What the table is called in reports.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Rows(table) => &table.name,
            Self::Quantile { name, .. } => name,
        }
    }

    /// The same under another name.
    #[must_use]
    pub(crate) fn named(mut self, new: impl Into<String>) -> Self {
        match &mut self {
            Self::Rows(RangeTable { name, .. }) | Self::Quantile { name, .. } => *name = new.into(),
        }
        self
    }

    /// What determines a result: the table without its name and source.
    pub(crate) fn anonymous(mut self) -> Self {
        if let Self::Rows(table) = &mut self {
            table.source.clear();
        }
        self.named("")
    }

    /// The table for a garment whose vertices have these distances to the body (m).
    pub fn resolve(&self, distances_m: &[f64]) -> Result<RangeTable, TableError> {
        match self {
            Self::Rows(table) => Ok(table.clone()),
            Self::Quantile { name, levels } => {
                Ok(RangeTable { name: name.clone(), ..RangeTable::quantiles(distances_m, *levels)? })
            }
        }
    }
}

impl From<RangeTable> for TableRule {
    fn from(table: RangeTable) -> Self {
        Self::Rows(table)
    }
}

/// A bound or an extent, cm. JSON has no infinity: there it is the word that TOML has for it.
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
            Either::Word(word) => {
                Err(serde::de::Error::custom(format!("found \"{word}\", expected centimetres or \"inf\"")))
            }
        }
    }
}

/// A table as its file has it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plain {
    name: String,
    #[serde(default)]
    source: String,
    #[serde(default)]
    gap: GapRule,
    levels: Vec<Vec<Cm>>,
}

impl From<RangeTable> for Plain {
    fn from(table: RangeTable) -> Self {
        let row = |l: &Level| {
            let extent = l.extent.iter().flat_map(Extent::numbers_cm);
            [l.lower_cm, l.upper_cm].into_iter().chain(extent).map(Cm).collect()
        };
        Self { levels: table.levels.iter().map(row).collect(), name: table.name, source: table.source, gap: table.gap }
    }
}

impl TryFrom<Plain> for RangeTable {
    type Error = TableError;

    fn try_from(plain: Plain) -> Result<Self, TableError> {
        let place = || format!("table \"{}\"", plain.name);
        let rows = plain.levels.iter().enumerate().map(|(i, row)| {
            let cm: Vec<f64> = row.iter().map(|cm| cm.0).collect();
            Level::from_numbers(&cm).map_err(|problem| TableError::Row { place: place(), row: i + 1, problem })
        });
        let levels = rows.collect::<Result<Vec<_>, _>>()?;
        if levels.is_empty() {
            return Err(TableError::value(place(), "no levels", EXPECTED_ROWS));
        }
        Ok(Self::new(plain.name, plain.gap, levels)?.with_source(plain.source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let said = serde_json::from_str::<TableRule>(&text).unwrap_err().to_string();
            assert!(said.contains(word), "{said}");
        }
    }
}
