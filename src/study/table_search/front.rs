//! The Pareto front of PART count and representable error.

use super::extent_grid::ExtentGrid;
use super::program::Path;
use crate::parts::range_table::{Extent, RangeTable, TableError};

/// A Pareto-optimal table: no other table has both fewer PARTs and a smaller error.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrontPoint {
    /// PARTs over all garments.
    pub parts: usize,
    /// Representable error, root of the weighted mean square over garments, m.
    pub rms_m: f64,
    /// Bounds between its levels, cm; the first level starts at 0, the last is open.
    pub inner_bounds_cm: Vec<f64>,
    /// The extent of each level; empty where levels alone were searched.
    pub extents: Vec<Extent>,
}

impl FrontPoint {
    /// The table of a path with the given number of PARTs.
    pub(super) fn on(path: &Path, parts: usize, inner_cm: &[f64], extents: &ExtentGrid) -> Self {
        // The first level starts at 0.
        let bounds = path.levels.iter().filter_map(|level| inner_cm.get(level.lower.checked_sub(1)?).copied());
        let cut = if extents.cuts() { &path.levels[..] } else { &[] };
        Self {
            parts,
            rms_m: path.squared.max(0.0).sqrt(),
            inner_bounds_cm: bounds.collect(),
            extents: cut.iter().map(|level| extents.extent(level.extent)).collect(),
        }
    }

    /// Converts the point to a named range table with its extents.
    ///
    /// # Errors
    /// [`TableError`] if the bounds do not ascend.
    pub(crate) fn table(&self, name: &str, source: &str) -> Result<RangeTable, TableError> {
        let table = RangeTable::from_inner_bounds(name, &self.inner_bounds_cm)?.with_source(source);
        table.with_extents(&self.extents.iter().copied().map(Some).collect::<Vec<_>>())
    }
}

/// Tables by ascending number of PARTs and descending error.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Front {
    /// The tables.
    pub points: Vec<FrontPoint>,
    /// The table of least error with which every garment is within its limit. For one garment it is the last of `points`; for
    /// several it need not be among them, as they count PARTs of all garments together.
    pub best: Option<FrontPoint>,
}

impl Front {
    /// The points of both fronts that no other point dominates.
    pub(crate) fn union(&self, other: &Self) -> Self {
        let mut all: Vec<&FrontPoint> = self.points.iter().chain(&other.points).collect();
        all.sort_by(|a, b| a.parts.cmp(&b.parts).then(a.rms_m.total_cmp(&b.rms_m)));
        let mut points: Vec<FrontPoint> = Vec::new();
        for point in all {
            if points.last().is_none_or(|last| point.rms_m < last.rms_m) {
                points.push(point.clone());
            }
        }
        let best = [&self.best, &other.best].into_iter().flatten().min_by(|a, b| a.rms_m.total_cmp(&b.rms_m));
        Self { points, best: best.cloned() }
    }
}
