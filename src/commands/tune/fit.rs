//! A tuned table on a garment it was not tuned on: its extents scaled until it makes as many PARTs there as Table 3 does.
//!
//! A garment of another size has other PARTs at the same extents. The factor is found by counting PARTs, which takes the garment
//! and its distances but no drape of it.

use crate::parts::range_table::{Extent, RangeTable};
use rayon::prelude::*;

use super::garment::Garment;

/// Factors tried, 2 % apart: 1/8 to 8.
const STEPS: std::ops::RangeInclusive<i32> = -105..=105;

/// The table with its extents scaled, and the factor: as many PARTs as can be, but no more than Table 3 makes of the garment. `None` where no factor makes so few.
pub(super) fn fitted(table: &RangeTable, garment: &Garment) -> anyhow::Result<Option<(f64, RangeTable)>> {
    let tried: Vec<(usize, f64, RangeTable)> = STEPS
        .into_par_iter()
        .map(|step| {
            let factor = 1.02f64.powi(step);
            let table = scaled(table, factor)?;
            Ok((garment.parts(&table).len(), factor, table))
        })
        .collect::<anyhow::Result<_>>()?;
    let allowed = tried.into_iter().filter(|(parts, ..)| *parts <= garment.table_3.parts);
    Ok(allowed.max_by_key(|(parts, ..)| *parts).map(|(_, factor, table)| (factor, table)))
}

fn scaled(table: &RangeTable, factor: f64) -> anyhow::Result<RangeTable> {
    let scale = |e: Extent| Extent { width_cm: factor * e.width_cm, height_cm: factor * e.height_cm };
    let extents: Vec<Option<Extent>> = table.levels.iter().map(|l| l.extent.map(scale)).collect();
    Ok(table.clone().with_extents(&extents)?)
}
