//! The range tables a session offers by name: the paper's, and those that were searched for.

use crate::base::files::names_a_file;
use crate::parts::range_table::{RangeTable, TABLE_3, TableError};

/// The tables of `assets/tuned/`, inside the binary.
const TUNED: [(&str, &str); 10] = [
    ("pullover-1-levels", include_str!("../../assets/tuned/pullover-1-levels.toml")),
    ("pullover-1-levels-and-extents", include_str!("../../assets/tuned/pullover-1-levels-and-extents.toml")),
    ("pullover-2-levels", include_str!("../../assets/tuned/pullover-2-levels.toml")),
    ("pullover-2-levels-and-extents", include_str!("../../assets/tuned/pullover-2-levels-and-extents.toml")),
    ("flared-skirt-levels", include_str!("../../assets/tuned/flared-skirt-levels.toml")),
    ("flared-skirt-levels-and-extents", include_str!("../../assets/tuned/flared-skirt-levels-and-extents.toml")),
    ("low-cut-dress-levels", include_str!("../../assets/tuned/low-cut-dress-levels.toml")),
    ("low-cut-dress-levels-and-extents", include_str!("../../assets/tuned/low-cut-dress-levels-and-extents.toml")),
    ("long-sleeved-dress-levels", include_str!("../../assets/tuned/long-sleeved-dress-levels.toml")),
    (
        "long-sleeved-dress-levels-and-extents",
        include_str!("../../assets/tuned/long-sleeved-dress-levels-and-extents.toml"),
    ),
];

/// The names of the tables a session knows: `table-3` first.
#[must_use]
pub fn preset_names() -> Vec<&'static str> {
    std::iter::once(TABLE_3).chain(TUNED.iter().map(|(name, _)| *name)).collect()
}

/// The table of this name: a preset or a TOML file.
pub(super) fn table(name: &str) -> Result<RangeTable, TableError> {
    if let Some((known, text)) = TUNED.iter().find(|(known, _)| *known == name) {
        return RangeTable::parse(text, known);
    }
    if name == TABLE_3 || names_a_file(name) {
        return RangeTable::by_name(name);
    }
    Err(TableError::Value {
        what: "table".to_owned(),
        found: format!("\"{name}\""),
        expected: "table-3, a tuned table such as \"low-cut-dress-levels\", or rows {\"levels\": [[lower, upper], ...]}",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_reads() {
        for name in preset_names() {
            assert!(table(name).unwrap().levels.len() > 1, "{name}");
        }
    }
}
