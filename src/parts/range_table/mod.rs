//! Range tables: the lower and upper values of the distance that cut a garment into PARTs (equation 1, Table 3).
//!
//! A table is an ordered list of levels `[V_L, V_H)`. Equation (1) prints `≤` on both sides; with shared bounds that
//! would put a vertex into two levels, so the upper value belongs to the level above. Where two neighbouring levels leave a
//! hole (Table 3 has one, 3 to 3.5 cm) a [`GapRule`] says who takes it.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | V_L, V_H | lower and upper value of a level, as printed | cm |
//! | d | distance of a garment vertex from the body, unsigned | m |
//! | extent | how wide and tall a PART of the level may be along the cloth; optional, not in the paper | cm |
//!
//! Limits: distances below the first lower value or at and above a finite last upper value belong to no level; the vertices
//! there are reported as unassigned.

mod error;
mod extent;
mod families;
mod format;
mod rule;

use std::fmt;

pub use error::{BoundProblem, TableError};
pub use extent::Extent;
pub(crate) use families::MOST_LEVELS;
pub use rule::TableRule;

/// Metres in a centimetre: tables are written in centimetres, everything else is metres.
pub(crate) const METRES_PER_CM: f64 = 0.01;

/// One row of a range table, in centimetres as printed: `lower ≤ d < upper`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Lower value V_L, cm.
    pub lower_cm: f64,
    /// Upper value V_H, cm; infinite in an open last row.
    pub upper_cm: f64,
    /// How wide and tall a PART of this level may be along the cloth: PARTs are cut to it. `None`, as in the paper, leaves it
    /// to whoever runs the table (`--max-extent`).
    pub extent: Option<Extent>,
}

impl Level {
    /// A level without an extent of its own.
    #[must_use]
    pub(crate) fn new(lower_cm: f64, upper_cm: f64) -> Self {
        Self { lower_cm, upper_cm, extent: None }
    }

    /// A row as written: lower and upper value, and an extent, or its width and height, where there is one.
    fn from_numbers(row: &[f64]) -> Result<Self, BoundProblem> {
        let (lower_cm, upper_cm, extent) = match *row {
            [lower, upper] => (lower, upper, None),
            [lower, upper, extent] => (lower, upper, Some(Extent::even(extent))),
            [lower, upper, width_cm, height_cm] => (lower, upper, Some(Extent { width_cm, height_cm })),
            _ => return Err(BoundProblem::Length(row.len())),
        };
        Ok(Self { lower_cm, upper_cm, extent })
    }
}

/// The name of the paper's table.
pub(crate) const TABLE_3: &str = "table-3";

/// Who takes the distances between two rows that do not meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GapRule {
    /// The level below grows up to the next one.
    #[default]
    ExtendLower,
    /// The level above grows down to the one before.
    ExtendUpper,
    /// The hole is a level between the two.
    OwnLevel,
    /// A table with a hole is refused.
    Error,
}

impl fmt::Display for GapRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        serde::Serialize::serialize(self, f)
    }
}

/// A named, ordered list of distance levels.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "rule::Plain", try_from = "rule::Plain")]
pub struct RangeTable {
    /// What it is called in reports.
    pub name: String,
    /// Where its values come from; empty if nobody said.
    pub source: String,
    /// Who takes a hole between two rows.
    pub gap: GapRule,
    /// The rows as printed, holes and all.
    pub levels: Vec<Level>,
}

impl RangeTable {
    /// A checked table.
    ///
    /// # Errors
    /// [`TableError`] names the row that is negative, not a number, empty, out of order or overlapping, or the hole that
    /// [`GapRule::Error`] forbids.
    pub(crate) fn new(name: impl Into<String>, gap: GapRule, levels: Vec<Level>) -> Result<Self, TableError> {
        let table = Self { name: name.into(), source: String::new(), gap, levels };
        table.validate()?;
        Ok(table)
    }

    /// A checked table without holes from its ascending bounds in centimetres: `n + 1` bounds make `n` levels.
    pub fn from_bounds(name: impl Into<String>, bounds_cm: &[f64]) -> Result<Self, TableError> {
        let levels = bounds_cm.windows(2).map(|w| Level::new(w[0], w[1])).collect();
        Self::new(name, GapRule::default(), levels)
    }

    /// The same table with the extents of its rows: see [`Level::extent`]. Rows beyond the list keep theirs.
    pub fn with_extents(mut self, extents: &[Option<Extent>]) -> Result<Self, TableError> {
        for (level, &extent) in self.levels.iter_mut().zip(extents) {
            level.extent = extent;
        }
        self.validate()?;
        Ok(self)
    }

    /// Whether any level has an extent of its own.
    #[must_use]
    pub fn has_extents(&self) -> bool {
        self.levels.iter().any(|l| l.extent.is_some())
    }

    /// The same table with its origin told.
    #[must_use]
    pub(crate) fn with_source(mut self, source: impl Into<String>) -> Self {
        self.source = source.into();
        self
    }

    /// Checks rows that were put together by hand.
    pub(crate) fn validate(&self) -> Result<(), TableError> {
        match error::first_problem(&self.levels, self.gap) {
            None => Ok(()),
            Some((row, problem)) => Err(TableError::Row { place: format!("table \"{}\"", self.name), row, problem }),
        }
    }

    /// The holes between rows, cm.
    #[must_use]
    pub(crate) fn holes_cm(&self) -> Vec<[f64; 2]> {
        let meets = self.levels.windows(2).map(|w| [w[0].upper_cm, w[1].lower_cm]);
        meets.filter(|[from, to]| from < to).collect()
    }

    /// The levels after the gap rule, ascending, without holes; PARTs number their level by this list.
    #[must_use]
    pub(crate) fn effective_levels(&self) -> Vec<Level> {
        let mut out: Vec<Level> = Vec::with_capacity(self.levels.len() + 1);
        for level in &self.levels {
            let mut lower_cm = level.lower_cm;
            let before = out.last().map(|l| l.upper_cm);
            if let (Some(before), Some(last)) = (before, out.last_mut())
                && before < lower_cm
            {
                match self.gap {
                    GapRule::ExtendLower => last.upper_cm = lower_cm,
                    GapRule::ExtendUpper => lower_cm = before,
                    GapRule::OwnLevel => out.push(Level::new(before, lower_cm)),
                    // A checked table has no hole under this rule; an unchecked one keeps it, and its vertices stay
                    // unassigned, which is reported.
                    GapRule::Error => {}
                }
            }
            out.push(Level { lower_cm, ..*level });
        }
        out
    }

    /// Index into [`effective_levels`](Self::effective_levels) of a distance in metres; `None` outside the table or NaN.
    #[must_use]
    pub fn level_of(&self, distance_m: f64) -> Option<usize> {
        level_in(&self.effective_levels(), distance_m)
    }

    /// The level of each distance (m), and which of them a hole took.
    #[must_use]
    pub fn assign(&self, distances_m: &[f64]) -> Assignment {
        let levels = self.effective_levels();
        let holes = self.holes_cm();
        let level_of_vertex: Vec<_> = distances_m.iter().map(|&d| level_in(&levels, d)).collect();
        let in_hole = |d: &&f64| holes.iter().any(|[from, to]| from * METRES_PER_CM <= **d && **d < to * METRES_PER_CM);
        let hole_vertices = distances_m.iter().filter(in_hole).count();
        Assignment { level_of_vertex, hole_vertices }
    }
}

/// What [`RangeTable::assign`] found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// Index into the effective levels, or `None` outside the table.
    pub level_of_vertex: Vec<Option<usize>>,
    /// How many distances lie in a hole of the table as printed.
    pub hole_vertices: usize,
}

fn level_in(levels: &[Level], distance_m: f64) -> Option<usize> {
    let above = levels.partition_point(|l| l.lower_cm * METRES_PER_CM <= distance_m);
    let level = above.checked_sub(1)?;
    (distance_m < levels[level].upper_cm * METRES_PER_CM || levels[level].upper_cm == f64::INFINITY).then_some(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_3_is_verbatim_with_its_hole() {
        let table = RangeTable::table_3();
        assert_eq!(table.levels.len(), 19);
        assert_eq!(table.holes_cm(), [[3.0, 3.5]]);
        assert_eq!(table.levels[0], Level::new(0.0, 0.06));
        assert_eq!(table.levels[18], Level::new(11.0, f64::INFINITY));
        assert_eq!(table.gap, GapRule::ExtendLower);
    }

    #[test]
    fn the_gap_rule_says_who_takes_the_hole() {
        let mut table = RangeTable::table_3();
        let of = |t: &RangeTable| t.level_of(0.032);
        assert_eq!(of(&table), Some(12));
        table.gap = GapRule::ExtendUpper;
        assert_eq!(of(&table), Some(13));
        table.gap = GapRule::OwnLevel;
        assert_eq!(of(&table), Some(13));
        assert_eq!(table.effective_levels()[13], Level::new(3.0, 3.5));
        assert_eq!(table.level_of(0.036), Some(14));
        table.gap = GapRule::Error;
        assert!(matches!(table.validate(), Err(TableError::Row { row: 14, problem: BoundProblem::Hole { .. }, .. })));
        assert_eq!(of(&table), None);
    }

    #[test]
    fn bounds_belong_to_the_level_above() {
        let table = RangeTable::table_3();
        assert_eq!(table.level_of(0.0), Some(0));
        assert_eq!(table.level_of(0.005), Some(7));
        assert_eq!(table.level_of(0.005 - 1e-12), Some(6));
        assert_eq!(table.level_of(0.11), Some(18));
        assert_eq!(table.level_of(1e9), Some(18));
        assert_eq!(table.level_of(f64::INFINITY), Some(18));
        assert_eq!(table.level_of(f64::NAN), None);
    }

    #[test]
    fn what_no_row_covers_is_unassigned() {
        let table = RangeTable::from_bounds("two rows", &[1.0, 2.0, 4.0]).unwrap();
        let found = table.assign(&[0.005, 0.01, 0.039, 0.04]);
        assert_eq!(found.level_of_vertex, [None, Some(0), Some(1), None]);
        assert_eq!(RangeTable::table_3().assign(&[0.029, 0.03, 0.034, 0.035]).hole_vertices, 2);
    }
}
