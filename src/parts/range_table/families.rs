//! Families of range tables made by rule, to sweep over: scaled, merged or split, quantile and geometric ones.
//!
//! Each yields a checked table whose name and source say how it was made. Bounds are centimetres.

use super::{Extent, Level, METRES_PER_CM, RangeTable, TableError};

/// Levels that a made table can have: more than any garment fills, few enough to make at once.
pub(crate) const MOST_LEVELS: usize = 10_000;

fn check_count(count: usize, least: usize) -> Result<(), TableError> {
    if (least..=MOST_LEVELS).contains(&count) {
        return Ok(());
    }
    let (what, expected) = match least {
        3 => ("the number of levels of a geometric table", "at least 3 and at most 10000"),
        _ => ("the number of levels", "at least 1 and at most 10000"),
    };
    Err(TableError::value(what, count, expected))
}

impl RangeTable {
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

    /// The table, its holes given away, merged or split into `count` levels. Merging keeps the bounds at evenly spaced ranks;
    /// splitting halves the widest finite level again and again, the lowest of equals first. A level takes the smallest of the
    /// extents that its distances had.
    ///
    /// # Errors
    /// [`TableError::Value`] for none or over ten thousand, or for more than one where no finite level is left to split.
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
            let found = bounds.windows(2).enumerate().fold(None, widest);
            let (i, width) = found.ok_or_else(|| {
                TableError::value(
                    "the number of levels",
                    count,
                    "1, because the only level is open and cannot be halved",
                )
            })?;
            bounds.insert(i + 1, bounds[i] + 0.5 * width);
        }
        let verb = if count < from { "merged" } else { "split" };
        let extent = |w: &[f64]| {
            let within = levels.iter().filter(|l| l.lower_cm < w[1] && w[0] < l.upper_cm);
            within.filter_map(|l| l.extent).reduce(Extent::smaller)
        };
        let extents: Vec<Option<Extent>> = bounds.windows(2).map(extent).collect();
        let made = Self::from_bounds(format!("{}, {count} levels", self.name), &bounds)?.with_extents(&extents)?;
        Ok(made.with_source(format!("\"{}\" {verb} from {from} to {count} levels", self.name)))
    }

    /// About `count` levels that hold equal shares of a sample of distances (m, counted unsigned). Bounds lie halfway between
    /// two neighbouring distances; where the sample repeats a value there are fewer levels than asked for.
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
        let inner: Vec<f64> = (0..count - 1).map(|i| first_cm * ratio.powf(i as f64 / steps)).collect();
        let name = format!("{count} geometric levels, {first_cm} to {last_cm} cm");
        let made = Self::from_inner_bounds(name, &inner)?;
        Ok(made.with_source(format!("bounds grow by the factor {:.4}", ratio.powf(1.0 / steps))))
    }

    /// A table from its inner bounds, from 0 to open.
    pub fn from_inner_bounds(name: impl Into<String>, inner_cm: &[f64]) -> Result<Self, TableError> {
        let bounds: Vec<f64> = std::iter::once(0.0).chain(inner_cm.iter().copied()).chain([f64::INFINITY]).collect();
        Self::from_bounds(name, &bounds)
    }
}

/// At most `shares − 1` bounds (cm, ascending, distinct, above 0) between equal shares of the distances, each halfway between
/// two neighbouring ones so that none lies on a bound.
pub(super) fn quantile_bounds_cm(distances_m: &[f64], shares: usize) -> Vec<f64> {
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

#[cfg(test)]
mod tests {
    use super::*;

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
            assert_eq!(d.iter().filter(|&&d| table.level_of(d) == Some(level)).count(), 125);
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
