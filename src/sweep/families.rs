//! Range tables made by rule: a table scaled, with more or fewer levels, by quantiles, in geometric progression.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | n | number of levels | – |
//! | V_1, V_{n−1} | smallest and largest finite bound of a geometric table | cm |
//! | r | ratio of neighbouring bounds, (V_{n−1}/V_1)^{1/(n−2)} | – |
//!
//! Source: the paper adjusts its table "by iteration with a computer" and names no family; these are the obvious ones.
//! Limits: quantiles of distances with many ties make fewer levels than asked for; the rows report how many were used.

use crate::range_table::{Level, METRES_PER_CM, RangeTable, TableError};

fn wrong(what: &'static str, found: impl ToString, expected: &'static str) -> TableError {
    TableError::Family { what, found: found.to_string(), expected }
}

/// The table with every bound multiplied by `factor`; its hole and gap rule stay.
///
/// # Errors
/// [`TableError`] where the factor is not positive and finite.
pub fn scaled(table: &RangeTable, factor: f64) -> Result<RangeTable, TableError> {
    if !(factor.is_finite() && factor > 0.0) {
        return Err(wrong("scale", factor, "a positive factor"));
    }
    let stretch = |l: &Level| Level { lower_cm: l.lower_cm * factor, upper_cm: l.upper_cm * factor };
    let levels = table.levels.iter().map(stretch).collect();
    RangeTable::new(format!("{} x{factor}", table.name), table.gap, levels)
}

/// The table with `count` levels. Fewer: neighbours are joined in runs as even as can be, row i of L going to level
/// ⌊i·n/L⌋. More: the widest closed level (the lowest of equals) is halved, again and again. Holes are given away first, by
/// the table's own rule.
///
/// # Errors
/// [`TableError`] for no levels, or where only an open level is left to halve.
pub fn with_levels(table: &RangeTable, count: usize) -> Result<RangeTable, TableError> {
    let rows = table.effective_levels();
    if count == 0 || rows.is_empty() {
        return Err(wrong("levels", count, "at least 1 level, of a table that has any"));
    }
    let mut bounds: Vec<[f64; 2]> = Vec::with_capacity(count.max(rows.len()));
    for (i, row) in rows.iter().enumerate() {
        let joins = i > 0 && i * count / rows.len() == (i - 1) * count / rows.len();
        match bounds.last_mut() {
            Some(last) if joins && count < rows.len() => last[1] = row.upper_cm,
            _ => bounds.push([row.lower_cm, row.upper_cm]),
        }
    }
    while bounds.len() < count {
        let mut widest: Option<(usize, f64)> = None;
        for (i, [lower, upper]) in bounds.iter().enumerate() {
            let width = upper - lower;
            if width.is_finite() && widest.is_none_or(|(_, w)| width > w) {
                widest = Some((i, width));
            }
        }
        let Some((i, width)) = widest else {
            return Err(wrong("levels", count, "a table with a closed level that can be halved"));
        };
        let [lower, upper] = bounds[i];
        let middle = lower + 0.5 * width;
        bounds[i] = [lower, middle];
        bounds.insert(i + 1, [middle, upper]);
    }
    let levels = bounds.into_iter().map(|[lower_cm, upper_cm]| Level { lower_cm, upper_cm }).collect();
    RangeTable::new(format!("{} {count} levels", table.name), table.gap, levels)
}

/// `count` levels of equally many vertices each, from the distances of a garment's vertices (m); the first starts at 0,
/// the last is open. Ties stay in one level, so there can be fewer.
///
/// # Errors
/// [`TableError`] for no levels or no finite distances.
pub fn quantile(distances_m: &[f64], count: usize) -> Result<RangeTable, TableError> {
    let mut sorted: Vec<f64> = distances_m.iter().copied().filter(|d| d.is_finite()).collect();
    if count == 0 || sorted.is_empty() {
        return Err(wrong("quantile", format!("{count} levels of {} distances", sorted.len()), "at least 1 of each"));
    }
    sorted.sort_by(f64::total_cmp);
    let mut bounds = vec![0.0];
    for k in 1..count {
        let bound_cm = sorted[k * sorted.len() / count] / METRES_PER_CM;
        if bounds.last().is_some_and(|&last| bound_cm > last) {
            bounds.push(bound_cm);
        }
    }
    bounds.push(f64::INFINITY);
    RangeTable::from_bounds(format!("quantile {count}"), &bounds)
}

/// `count` levels whose bounds grow by a constant ratio: [0, first), then geometric up to `last`, then [last, ∞), cm.
///
/// # Errors
/// [`TableError`] for fewer than 3 levels or bounds that are not 0 < first < last.
pub fn geometric(count: usize, first_cm: f64, last_cm: f64) -> Result<RangeTable, TableError> {
    if count < 3 {
        return Err(wrong("geometric", count, "at least 3 levels: [0, first), one between, [last, inf)"));
    }
    if !(first_cm > 0.0 && first_cm < last_cm && last_cm.is_finite()) {
        return Err(wrong("geometric", format!("{first_cm} to {last_cm} cm"), "0 < first_cm < last_cm"));
    }
    let steps = count - 2;
    let mut bounds = vec![0.0];
    for k in 0..=steps {
        // The ends are taken as given, not as powers that rounding moves.
        bounds.push(match k {
            0 => first_cm,
            k if k == steps => last_cm,
            k => first_cm * (last_cm / first_cm).powf(k as f64 / steps as f64),
        });
    }
    bounds.push(f64::INFINITY);
    RangeTable::from_bounds(format!("geometric {count}"), &bounds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(table: &RangeTable) -> Vec<[f64; 2]> {
        table.effective_levels().iter().map(|l| [l.lower_cm, l.upper_cm]).collect()
    }

    #[test]
    fn scaling_keeps_rows_and_hole() {
        let half = scaled(&RangeTable::table_3(), 0.5).unwrap();
        assert_eq!((half.levels.len(), half.holes_cm()), (19, vec![[1.5, 1.75]]));
        assert_eq!(half.levels[18].upper_cm, f64::INFINITY);
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(scaled(&half, bad).is_err());
        }
    }

    #[test]
    fn fewer_levels_join_neighbours_and_more_halve_the_widest() {
        let table = RangeTable::from_bounds("t", &[0.0, 1.0, 2.0, 6.0, f64::INFINITY]).unwrap();
        assert_eq!(bounds(&with_levels(&table, 2).unwrap()), [[0.0, 2.0], [2.0, f64::INFINITY]]);
        assert_eq!(bounds(&with_levels(&table, 3).unwrap()), [[0.0, 2.0], [2.0, 6.0], [6.0, f64::INFINITY]]);
        let six = [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 4.0], [4.0, 6.0], [6.0, f64::INFINITY]];
        assert_eq!(bounds(&with_levels(&table, 6).unwrap()), six);
        for n in 1..60 {
            let made = with_levels(&RangeTable::table_3(), n).unwrap();
            assert_eq!((made.levels.len(), made.holes_cm().len()), (n, 0));
        }
        let open = RangeTable::from_bounds("open", &[0.0, f64::INFINITY]).unwrap();
        assert!(with_levels(&open, 2).is_err() && with_levels(&table, 0).is_err());
    }

    #[test]
    fn quantiles_hold_equally_many_vertices() {
        let distances: Vec<f64> = (0..1000).map(|i| 0.001 * f64::from(i * 7 % 1000)).collect();
        let table = quantile(&distances, 8).unwrap();
        let mut held = [0; 8];
        for d in &distances {
            held[table.level_of(*d).unwrap()] += 1;
        }
        assert!(held.iter().all(|&n| n == 125), "{held:?}");
        assert_eq!(quantile(&[0.01; 50], 8).unwrap().levels.len(), 2);
        assert!(quantile(&[], 8).is_err() && quantile(&[f64::NAN], 8).is_err() && quantile(&[0.1], 0).is_err());
    }

    #[test]
    fn geometric_bounds_grow_by_one_ratio() {
        let table = geometric(6, 0.1, 1.6).unwrap();
        let found: Vec<f64> = table.levels.iter().map(|l| l.upper_cm).collect();
        for (bound, hand) in found.iter().zip([0.1, 0.2, 0.4, 0.8, 1.6]) {
            assert!((bound - hand).abs() < 1e-12);
        }
        assert_eq!(table.levels.len(), 6);
        assert!(geometric(2, 0.1, 1.0).is_err() && geometric(5, 1.0, 0.5).is_err() && geometric(5, 0.0, 1.0).is_err());
    }
}
