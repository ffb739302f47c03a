//! A range table, families of tables for sweeps (scaled, merged or split, quantile, geometric), and the rule that a job holds.
//!
//! Every constructor returns a checked table; name and source of a generated one describe how it was made. Bounds are centimetres.

use serde::{Deserialize, Serialize};

use super::level::{Extent, GapRule, Level, METRES_PER_CM, TableError, first_problem};

use crate::base::math;

/// The name of the paper's table.
pub(crate) const TABLE_3: &str = "table-3";

/// Most levels of a generated table. A heuristic: more levels than any garment has vertices in use, few enough to allocate.
pub(crate) const MAX_LEVELS: usize = 10_000;

fn check_count(count: usize, least: usize) -> Result<(), TableError> {
    if (least..=MAX_LEVELS).contains(&count) {
        return Ok(());
    }
    let (what, expected) = match least {
        3 => ("the number of levels of a geometric table", "at least 3 and at most 10000"),
        _ => ("the number of levels", "at least 1 and at most 10000"),
    };
    Err(TableError::value(what, count, expected))
}

/// A named, ordered list of distance levels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeTable {
    /// Its name in reports.
    pub name: String,
    /// The source of its values; empty if unknown.
    pub source: String,
    /// The level of a hole between two rows.
    pub gap: GapRule,
    /// The rows as printed, holes and all.
    pub levels: Vec<Level>,
}

impl RangeTable {
    /// A checked table.
    ///
    /// # Errors
    /// [`TableError::Row`] for a row with a [`BoundProblem`].
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

    /// Whether any level has an extent.
    #[must_use]
    pub fn has_extents(&self) -> bool {
        self.levels.iter().any(|l| l.extent.is_some())
    }

    /// The same table with its source.
    pub(crate) fn with_source(mut self, source: impl Into<String>) -> Self {
        self.source = source.into();
        self
    }

    /// Checks rows that were assembled without [`new`](Self::new).
    pub(crate) fn validate(&self) -> Result<(), TableError> {
        match first_problem(&self.levels, self.gap) {
            None => Ok(()),
            Some((row, problem)) => Err(TableError::Row { place: format!("table \"{}\"", self.name), row, problem }),
        }
    }

    /// The holes between rows, cm.
    pub(crate) fn holes_cm(&self) -> Vec<[f64; 2]> {
        self.levels.windows(2).map(|w| [w[0].upper_cm, w[1].lower_cm]).filter(|[from, to]| from < to).collect()
    }

    /// The levels after the gap rule, ascending, without holes; PARTs number their level by this list.
    pub(crate) fn effective_levels(&self) -> Vec<Level> {
        let mut out: Vec<Level> = Vec::with_capacity(self.levels.len() + 1);
        for level in &self.levels {
            let mut level = *level;
            if let Some(last) = out.last_mut().filter(|last| last.upper_cm < level.lower_cm) {
                match self.gap {
                    GapRule::ExtendLower => last.upper_cm = level.lower_cm,
                    GapRule::ExtendUpper => level.lower_cm = last.upper_cm,
                    GapRule::OwnLevel => {
                        let hole = Level::new(last.upper_cm, level.lower_cm);
                        out.push(hole);
                    }
                    // A checked table has no hole under this rule; an unchecked one keeps it, and its vertices stay
                    // unassigned, which is reported.
                    GapRule::Error => {}
                }
            }
            out.push(level);
        }
        out
    }

    /// The level of each distance (m), as index into the effective levels or `None` outside the table and for NaN; and the number of
    /// distances in a hole of the table as printed.
    #[must_use]
    pub fn assign(&self, distances_m: &[f64]) -> (Vec<Option<usize>>, usize) {
        let levels = self.effective_levels();
        let holes = self.holes_cm();
        let in_hole = |d: &&f64| holes.iter().any(|[from, to]| from * METRES_PER_CM <= **d && **d < to * METRES_PER_CM);
        let level_of = |&d: &f64| {
            let level = levels.partition_point(|l| l.lower_cm * METRES_PER_CM <= d).checked_sub(1)?;
            (d < levels[level].upper_cm * METRES_PER_CM || levels[level].upper_cm == f64::INFINITY).then_some(level)
        };
        (distances_m.iter().map(level_of).collect(), distances_m.iter().filter(in_hole).count())
    }

    /// The same table with every bound times `factor`; an open end stays open.
    ///
    /// # Errors
    /// [`TableError::Value`] for a factor that is not positive and finite.
    pub fn scaled(&self, factor: f64) -> Result<Self, TableError> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(TableError::value("the factor of a scaled table", factor, "a positive, finite number"));
        }
        // Extents run along the cloth, which does not scale with the distances.
        let scale = |l: &Level| Level { lower_cm: l.lower_cm * factor, upper_cm: l.upper_cm * factor, ..*l };
        let made = Self::new(format!("{} × {factor}", self.name), self.gap, self.levels.iter().map(scale).collect())?;
        Ok(made.with_source(format!("every bound of \"{}\" times {factor}", self.name)))
    }

    /// The table, its holes assigned, merged or split into `count` levels. Merging keeps the bounds at evenly spaced ranks;
    /// splitting halves the widest finite level until there are `count`, the lowest of equals first. A level gets the smallest of the
    /// extents of the levels it overlaps.
    ///
    /// # Errors
    /// [`TableError::Value`] for 0 or over [`MAX_LEVELS`], or where no finite level is left to split.
    pub(crate) fn with_level_count(&self, count: usize) -> Result<Self, TableError> {
        let levels = self.effective_levels();
        let mut bounds: Vec<f64> = levels.iter().map(|l| l.lower_cm).collect();
        bounds.extend(levels.last().map(|l| l.upper_cm));
        check_count(count, 1)?;
        let from = levels.len();
        if count < from {
            // Rank i of the new table is rank i·from/count of the old one, rounded; first and last stay.
            bounds = (0..=count).map(|i| bounds[(2 * i * from + count) / (2 * count)]).collect();
        }
        while bounds.len() < count + 1 {
            let widest = |best: Option<(usize, f64)>, (i, w): (usize, &[f64])| match best {
                Some((_, width)) if w[1] - w[0] <= width => best,
                _ if w[1].is_infinite() => best,
                _ => Some((i, w[1] - w[0])),
            };
            let expected = "1, because the only level is open and cannot be halved";
            let (i, width) = (bounds.windows(2).enumerate().fold(None, widest))
                .ok_or_else(|| TableError::value("the number of levels", count, expected))?;
            bounds.insert(i + 1, bounds[i] + 0.5 * width);
        }
        let verb = if count < from { "merged" } else { "split" };
        let extent = |w: &[f64]| {
            let within = levels.iter().filter(|l| l.lower_cm < w[1] && w[0] < l.upper_cm);
            within.filter_map(|l| l.extent).reduce(Extent::min)
        };
        let extents: Vec<Option<Extent>> = bounds.windows(2).map(extent).collect();
        let made = Self::from_bounds(format!("{}, {count} levels", self.name), &bounds)?.with_extents(&extents)?;
        Ok(made.with_source(format!("\"{}\" {verb} from {from} to {count} levels", self.name)))
    }

    /// About `count` levels that hold equal shares of a sample of distances (m, counted unsigned). Bounds lie halfway between
    /// two neighbouring distances; repeated values of the sample reduce the number of levels.
    ///
    /// # Errors
    /// [`TableError::Value`] for no levels or a sample without a finite distance.
    pub(crate) fn quantiles(distances_m: &[f64], count: usize) -> Result<Self, TableError> {
        check_count(count, 1)?;
        let inner = quantile_bounds_cm(distances_m, count);
        if !distances_m.iter().any(|d| d.is_finite()) {
            return Err(TableError::value("the sample of a quantile table", "no finite distance", "at least one"));
        }
        let made = Self::from_inner_bounds(format!("{} quantile levels", inner.len() + 1), &inner)?;
        Ok(made.with_source(format!("equal shares of {} distances", distances_m.len())))
    }

    /// `count` levels whose bounds grow by a constant ratio from `first_cm`, the upper value of the first level, to `last_cm`,
    /// the lower value of the open last one.
    ///
    /// # Errors
    /// [`TableError::Value`] for fewer than three levels or bounds that do not grow.
    pub(crate) fn geometric(first_cm: f64, last_cm: f64, count: usize) -> Result<Self, TableError> {
        check_count(count, 3)?;
        if !(first_cm > 0.0 && last_cm > first_cm && last_cm.is_finite()) {
            let found = format!("{first_cm} to {last_cm}");
            let expected = "0 < first < last, in centimetres";
            return Err(TableError::value("the bounds of a geometric table", found, expected));
        }
        let steps = (count - 2) as f64;
        let ratio = last_cm / first_cm;
        let inner: Vec<f64> = (0..count - 1).map(|i| first_cm * math::powf(ratio, i as f64 / steps)).collect();
        let name = format!("{count} geometric levels, {first_cm} to {last_cm} cm");
        let made = Self::from_inner_bounds(name, &inner)?;
        Ok(made.with_source(format!("bounds grow by the factor {:.4}", math::powf(ratio, 1.0 / steps))))
    }

    /// A table from its inner bounds, from 0 to open.
    pub fn from_inner_bounds(name: impl Into<String>, inner_cm: &[f64]) -> Result<Self, TableError> {
        let bounds: Vec<f64> = std::iter::once(0.0).chain(inner_cm.iter().copied()).chain([f64::INFINITY]).collect();
        Self::from_bounds(name, &bounds)
    }
}

/// At most `shares − 1` bounds (cm, ascending, distinct, above 0) between equal shares of the distances, each halfway between
/// two neighbouring ones so that none lies on a bound.
fn quantile_bounds_cm(distances_m: &[f64], shares: usize) -> Vec<f64> {
    let mut sorted: Vec<f64> = distances_m.iter().map(|d| d.abs()).filter(|d| d.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let mut bounds = Vec::new();
    for i in 1..shares {
        let rank = i * sorted.len() / shares;
        if rank == 0 || sorted[rank] <= sorted[rank - 1] {
            continue;
        }
        let bound = 0.5 * (sorted[rank - 1] + sorted[rank]) / METRES_PER_CM;
        if bound > bounds.last().copied().unwrap_or(0.0) {
            bounds.push(bound);
        }
    }
    bounds
}

/// A range table, or the rule that makes one from the garment's distances.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TableRule {
    /// The same rows for every garment.
    Rows(RangeTable),
    /// `levels` levels of equally many vertices; the bounds depend on the garment.
    Quantile {
        /// Name of the table.
        name: String,
        /// Number of levels.
        levels: usize,
    },
}

impl TableRule {
    /// Name of the table in reports.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Rows(table) => &table.name,
            Self::Quantile { name, .. } => name,
        }
    }

    /// The same rule under another name.
    pub(crate) fn named(mut self, new: impl Into<String>) -> Self {
        match &mut self {
            Self::Rows(RangeTable { name, .. }) | Self::Quantile { name, .. } => *name = new.into(),
        }
        self
    }

    /// The rule without name and source, which do not affect a result.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::range_table::BoundProblem;

    fn level_of(table: &RangeTable, distance_m: f64) -> Option<usize> {
        table.assign(&[distance_m]).0[0]
    }

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
    fn the_gap_rule_assigns_the_hole() {
        let mut table = RangeTable::table_3();
        let of = |t: &RangeTable| level_of(t, 0.032);
        assert_eq!(of(&table), Some(12));
        table.gap = GapRule::ExtendUpper;
        assert_eq!(of(&table), Some(13));
        table.gap = GapRule::OwnLevel;
        assert_eq!(of(&table), Some(13));
        assert_eq!(table.effective_levels()[13], Level::new(3.0, 3.5));
        assert_eq!(level_of(&table, 0.036), Some(14));
        table.gap = GapRule::Error;
        assert!(matches!(table.validate(), Err(TableError::Row { row: 14, problem: BoundProblem::Hole { .. }, .. })));
        assert_eq!(of(&table), None);
    }

    #[test]
    fn bounds_belong_to_the_level_above() {
        let table = RangeTable::table_3();
        assert_eq!(level_of(&table, 0.0), Some(0));
        assert_eq!(level_of(&table, 0.005), Some(7));
        assert_eq!(level_of(&table, 0.005 - 1e-12), Some(6));
        assert_eq!(level_of(&table, 0.11), Some(18));
        assert_eq!(level_of(&table, 1e9), Some(18));
        assert_eq!(level_of(&table, f64::INFINITY), Some(18));
        assert_eq!(level_of(&table, f64::NAN), None);
    }

    #[test]
    fn distances_outside_all_rows_are_unassigned() {
        let table = RangeTable::from_bounds("two rows", &[1.0, 2.0, 4.0]).unwrap();
        let found = table.assign(&[0.005, 0.01, 0.039, 0.04]);
        assert_eq!(found.0, [None, Some(0), Some(1), None]);
        assert_eq!(RangeTable::table_3().assign(&[0.029, 0.03, 0.034, 0.035]).1, 2);
    }

    #[test]
    fn scaling_keeps_the_hole_and_the_open_end() {
        let half = RangeTable::table_3().scaled(0.5).unwrap();
        assert_eq!(half.name, "Table 3 × 0.5");
        assert_eq!(half.holes_cm(), [[1.5, 1.75]]);
        assert_eq!(half.levels[18], Level::new(5.5, f64::INFINITY));
        assert!(RangeTable::table_3().scaled(0.0).is_err());
        assert!(RangeTable::table_3().scaled(f64::NAN).is_err());
    }

    #[test]
    fn levels_merge_and_split_to_any_number() {
        let table = RangeTable::table_3();
        for count in 1..60 {
            let made = table.with_level_count(count).unwrap();
            assert_eq!(made.levels.len(), count);
            assert!(made.holes_cm().is_empty());
            assert_eq!((made.levels[0].lower_cm, made.levels[count - 1].upper_cm), (0.0, f64::INFINITY));
        }
        // 4.5–7 cm is the widest finite level of Table 3, 2.5–3.5 (with its hole) would be cut after 7–9.
        let split = table.with_level_count(20).unwrap();
        assert!(split.levels.contains(&Level::new(4.5, 5.75)));
        assert!(table.with_level_count(0).is_err());
        assert!(RangeTable::from_bounds("open", &[0.0, f64::INFINITY]).unwrap().with_level_count(2).is_err());
    }

    #[test]
    fn quantile_levels_hold_equal_shares() {
        let d: Vec<f64> = (0..1000).map(|i| 1e-5 * f64::from(i * i)).collect();
        let table = RangeTable::quantiles(&d, 8).unwrap();
        assert_eq!(table.levels.len(), 8);
        for level in 0..8 {
            assert_eq!(d.iter().filter(|&&d| level_of(&table, d) == Some(level)).count(), 125);
        }
        // A repeated value cannot be cut.
        assert_eq!(RangeTable::quantiles(&[0.01; 50], 8).unwrap().levels.len(), 1);
        assert_eq!(RangeTable::quantiles(&[0.01, 0.01, -0.02], 5).unwrap().levels.len(), 2);
        assert!(RangeTable::quantiles(&[], 3).is_err());
        assert!(RangeTable::quantiles(&[0.1], 0).is_err());
    }

    #[test]
    fn geometric_bounds_grow_by_one_ratio() {
        let table = RangeTable::geometric(0.1, 10.0, 6).unwrap();
        assert_eq!(table.levels.len(), 6);
        for pair in table.levels[1..5].windows(2) {
            let ratio = pair[1].lower_cm / pair[0].lower_cm;
            assert!((ratio - 100f64.powf(0.25)).abs() < 1e-12, "{ratio}");
        }
        assert!((table.levels[5].lower_cm - 10.0).abs() < 1e-12);
        assert!(RangeTable::geometric(0.0, 10.0, 6).is_err());
        assert!(RangeTable::geometric(0.1, 10.0, 2).is_err());
    }
}
