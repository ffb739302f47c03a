//! The Pareto front of PART count and representable error.

use crate::range_table::{Extent, RangeTable, TableError};

/// A table that no other found beats in both PARTs and error.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontPoint {
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
    /// As a table with a name, extents and all.
    ///
    /// # Errors
    /// [`TableError`] where the bounds were changed so that they no longer ascend.
    pub fn table(&self, name: &str, source: &str) -> Result<RangeTable, TableError> {
        let table = RangeTable::from_inner_bounds(name, &self.inner_bounds_cm)?.with_source(source);
        table.with_extents(&self.extents.iter().copied().map(Some).collect::<Vec<_>>())
    }
}

/// Tables by ascending number of PARTs and descending error.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Front {
    /// The tables.
    pub points: Vec<FrontPoint>,
}

impl Front {
    /// The least error with at most so many PARTs.
    #[must_use]
    pub fn best_within(&self, max_parts: usize) -> Option<&FrontPoint> {
        self.points[..self.points.partition_point(|p| p.parts <= max_parts)].last()
    }

    /// The fewest PARTs with at most this error, m.
    #[must_use]
    pub fn coarsest_within(&self, rms_m: f64) -> Option<&FrontPoint> {
        self.points.iter().find(|p| p.rms_m <= rms_m)
    }

    /// What neither front beats.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let mut all: Vec<&FrontPoint> = self.points.iter().chain(&other.points).collect();
        all.sort_by(|a, b| a.parts.cmp(&b.parts).then(a.rms_m.total_cmp(&b.rms_m)));
        let mut points: Vec<FrontPoint> = Vec::new();
        for point in all {
            if points.last().is_none_or(|last| point.rms_m < last.rms_m) {
                points.push(point.clone());
            }
        }
        Self { points }
    }
}
