//! Which table of a front is taken: the one that the model itself makes most of.
//!
//! The search is guided by what maps of each PART's own leave, which is additive and so has an exact optimum, and is not what the
//! model moves: that blends the maps, folds, slides and sticks. Tables that are alike to the search differ by a third in the model, so
//! those near the optimum are ranked by the blended bound first, which costs a factorisation, and the best of these by a preview each.
//! Asked for translations, the question is the paper's, and the optimum itself is the answer.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::mechanics::coupled::Motion;
use crate::parts::range_table::RangeTable;
use crate::study::table_search::{Front, FrontPoint};
use rayon::prelude::*;

use super::garment::{Garment, TableFit, TableQuality};
use crate::commands::{console, interrupt};

/// Previews of one search, for several garments no fewer than [`LEAST`] tables of them all.
const PREVIEWS: usize = 32;
const LEAST: usize = 12;

/// Bounds computed for each table that is draped.
const BOUNDS: usize = 3;

/// A table taken from a front.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    pub(crate) table: RangeTable,
    /// What it holds, garment by garment, in the order of the garments it was tuned on.
    pub(crate) holds: Vec<TableFit>,
    /// What it is worth, in the same order.
    pub(crate) worth: Vec<TableQuality>,
    /// Tables that were draped to choose it.
    pub(crate) draped: usize,
}

/// The best table of a front with which every garment is within its limit. `fronts` are those of all rounds: tables that a later
/// one beat by a hair count as well.
pub(crate) fn check(
    fronts: &[&Front],
    garments: &[&Garment],
    limits: &[usize],
    name: &str,
) -> anyhow::Result<Option<Taken>> {
    let Some(best) = fronts.last().and_then(|front| front.best.as_ref()) else { return Ok(None) };
    let mut tables = vec![best.table(name, "")?];
    if garments.iter().all(|w| w.motion == Motion::Affine) {
        let nearest = near(fronts, best, garments, limits, name)?;
        tables.extend(nearest);
    }
    let bar = console::progress(Some(tables.len() as u64), &format!("{name}: previews"));
    let tried = AtomicUsize::new(0);
    let errors: Vec<f64> = tables
        .par_iter()
        .enumerate()
        .with_max_len(1)
        .map(|(i, table)| {
            // Stopped, the best to the search is what there is.
            if i > 0 && interrupt::requested() {
                return Ok(f64::INFINITY);
            }
            let errors = relative(garments.iter().map(|w| Ok(w.model_mm(table)? / w.table_3_worth.model_mm)));
            tried.fetch_add(1, Ordering::Relaxed);
            bar.inc(1);
            errors
        })
        .collect::<anyhow::Result<_>>()?;
    bar.finish_and_clear();
    let Some(least) = (0..errors.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b])) else { return Ok(None) };
    let table = tables.swap_remove(least);
    let holds = garments.iter().map(|w| w.holds(&table)).collect();
    let worth = garments.iter().map(|w| w.worth(&table)).collect::<anyhow::Result<_>>()?;
    Ok(Some(Taken { table, holds, worth, draped: tried.into_inner() }))
}

/// The tables of least blended bound among those of least guiding error, without the best.
fn near(
    fronts: &[&Front],
    best: &FrontPoint,
    garments: &[&Garment],
    limits: &[usize],
    name: &str,
) -> anyhow::Result<Vec<RangeTable>> {
    let mut points: Vec<&FrontPoint> = Vec::new();
    for point in fronts.iter().flat_map(|front| &front.points) {
        if point != best && !points.contains(&point) {
            points.push(point);
        }
    }
    points.sort_by(|a, b| a.rms_m.total_cmp(&b.rms_m));
    let draped = (PREVIEWS / garments.len().max(1)).max(LEAST);
    let mut bounded: Vec<(f64, RangeTable)> = Vec::new();
    for some in points.chunks(BOUNDS * draped) {
        let bounds = some.par_iter().with_max_len(1).map(|point| {
            let table = point.table(name, "")?;
            let parts: Vec<_> = garments.iter().map(|w| w.parts(&table)).collect();
            if interrupt::requested() || parts.iter().zip(limits).any(|(parts, limit)| parts.len() > *limit) {
                return Ok(None);
            }
            let ratio = |(w, parts): (&&Garment, _)| Ok(w.affine_mm(parts)? / w.table_3_worth.affine_mm);
            Ok(Some((relative(garments.iter().zip(&parts).map(ratio))?, table)))
        });
        bounded.extend(bounds.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten());
        // Where garments have limits of their own, most of a front is beyond one of them.
        if bounded.len() >= draped {
            break;
        }
    }
    bounded.sort_by(|a, b| a.0.total_cmp(&b.0));
    bounded.truncate(draped - 1);
    Ok(bounded.into_iter().map(|(_, table)| table).collect())
}

/// Root of the mean square over garments of errors relative to Table 3's.
fn relative(ratios: impl ExactSizeIterator<Item = anyhow::Result<f64>>) -> anyhow::Result<f64> {
    let garments = ratios.len() as f64;
    let squares: f64 = ratios.map(|ratio| Ok(ratio?.powi(2))).sum::<anyhow::Result<f64>>()?;
    Ok((squares / garments).sqrt())
}
