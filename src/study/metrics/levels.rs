//! Vertices and PARTs of each level of a range table.

use serde::{Deserialize, Serialize};

use crate::parts::Parts;
use crate::parts::range_table::{Extent, METRES_PER_CM, RangeTable};

/// One level of a range table on a garment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LevelCount {
    /// Its number, from 1, nearest the body.
    pub level: usize,
    /// Lower value, cm.
    pub lower_cm: f64,
    /// Upper value, cm; infinite for the open last level, which is `null` in JSON.
    pub upper_cm: f64,
    /// The extent its PARTs are cut to by the table itself, cm.
    #[serde(rename = "extent_cm")]
    pub extent: Option<Extent>,
    /// Vertices in it.
    pub vertices: usize,
    /// PARTs in it.
    pub parts: usize,
}

impl LevelCount {
    /// The levels of `table` with the vertices and PARTs of `parts`, which the table made.
    pub(crate) fn all(table: &RangeTable, parts: &Parts) -> Vec<Self> {
        let levels = table.effective_levels();
        let mut counts: Vec<Self> = (levels.iter().enumerate())
            .map(|(index, l)| Self {
                level: index + 1,
                lower_cm: l.lower_cm,
                upper_cm: l.upper_cm,
                extent: l.extent,
                ..Self::default()
            })
            .collect();
        for part in &parts.parts {
            counts[part.level as usize].parts += 1;
            counts[part.level as usize].vertices += part.vertices.len();
        }
        counts
    }

    /// Lower value, m.
    pub(crate) fn lower_m(&self) -> f64 {
        self.lower_cm * METRES_PER_CM
    }

    /// Upper value, m.
    pub(crate) fn upper_m(&self) -> f64 {
        self.upper_cm * METRES_PER_CM
    }
}
