//! The search itself: levels alone, then levels cut to each extent; what was best after each iteration; which table is taken.

use partwise::range_table::RangeTable;
use partwise::table_search::{Front, FrontPoint, Progress, Search, SearchError, SearchOptions, search};

use super::wearer::{Holds, Wearer};
use crate::commands::{console, interrupt};

/// One iteration: a round of the search at one extent.
#[derive(Debug, Clone)]
pub(crate) struct Iteration {
    /// The extent searched at, m; `None` for levels alone.
    pub(crate) extent_m: Option<f64>,
    /// Its round, from 1.
    pub(crate) round: usize,
    /// All found so far that nothing beats.
    pub(crate) front: Front,
}

/// What a search came to.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    /// Every iteration, levels alone first.
    pub(crate) iterations: Vec<Iteration>,
    /// The front of levels alone.
    pub(crate) levels: Front,
    /// The front of levels and extents together.
    pub(crate) all: Front,
}

/// A table taken from a front.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    /// The table.
    pub(crate) table: RangeTable,
    /// The extent its PARTs are cut to, m.
    pub(crate) extent_m: Option<f64>,
    /// What it holds, garment by garment, in the order of the garments it was tuned on.
    pub(crate) holds: Vec<Holds>,
}

/// Searches on all garments together, over so many candidate bounds a round. Where the user stops it, what was found until then.
pub(crate) fn find(
    wearers: &[&Wearer],
    max_parts: usize,
    extents_m: &[f64],
    candidates: Option<usize>,
    what: &str,
) -> Result<Option<Found>, SearchError> {
    let samples: Vec<_> = wearers.iter().map(|w| w.sample()).collect();
    let mut found = Found { iterations: Vec::new(), levels: Front::default(), all: Front::default() };
    let runs = std::iter::once(None).chain(extents_m.iter().copied().map(Some));
    for extent_m in runs {
        if interrupt::requested() {
            break;
        }
        let mut options = match extent_m {
            None => SearchOptions::new(max_parts),
            Some(extent_m) => SearchOptions::with_extent(max_parts, extent_m),
        };
        options.candidates = candidates.unwrap_or(options.candidates);
        let title = extent_m.map_or("levels alone".to_owned(), |m| format!("cut to {:.1} cm", 100.0 * m));
        let bar = console::progress(Some(0), &format!("{what}: {title}"));
        let progress = |p: Progress| {
            bar.set_length((p.total * p.rounds) as u64);
            bar.set_position((p.total * (p.round - 1) + p.done) as u64);
        };
        let searched = search(&samples, &options, &progress);
        bar.finish_and_clear();
        match searched {
            Ok(Search { rounds }) => {
                for (round, front) in (1..).zip(&rounds) {
                    found.iterations.push(Iteration { extent_m, round, front: found.all.union(front) });
                }
                let last = rounds.last().cloned().unwrap_or_default();
                if extent_m.is_none() {
                    found.levels = last.clone();
                }
                found.all = found.all.union(&last);
            }
            // Pieces of this extent alone are too many: a larger one may do.
            Err(SearchError::TooFewParts { .. }) if extent_m.is_some() => {}
            Err(other) => return Err(other),
        }
    }
    Ok((!found.all.points.is_empty()).then_some(found))
}

/// The best table of a front under the limit: each garment at most its share (Table 3's PARTs of it, where that is the
/// limit), or where none is so even, the total.
pub(crate) fn take(front: &Front, wearers: &[&Wearer], max_parts: usize, name: &str) -> anyhow::Result<Option<Taken>> {
    let total: usize = wearers.iter().map(|w| w.table_3.parts).sum();
    let mut fallback = None;
    // Error falls along the front, so the first that is even enough from its end is the best of those.
    for point in front.points.iter().rev().filter(|p| p.parts <= max_parts) {
        let taken = taken(point, wearers, name)?;
        let even = |(holds, w): (&Holds, &&Wearer)| holds.parts * total <= w.table_3.parts * max_parts;
        if taken.holds.iter().zip(wearers).all(even) {
            return Ok(Some(taken));
        }
        fallback.get_or_insert(taken);
    }
    Ok(fallback)
}

fn taken(point: &FrontPoint, wearers: &[&Wearer], name: &str) -> anyhow::Result<Taken> {
    let table = point.table(name, "")?;
    let holds = wearers.iter().map(|w| w.holds(&table, point.extent_m)).collect();
    Ok(Taken { table, extent_m: point.extent_m, holds })
}
