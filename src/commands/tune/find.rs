//! The search itself: levels alone, then levels and extents; what was best after each iteration; which table is taken.

use partwise::range_table::RangeTable;
use partwise::table_search::{Front, FrontPoint, Progress, Search, SearchError, SearchOptions, search};

use super::wearer::{Holds, Wearer};
use crate::commands::{console, interrupt};

/// One iteration: a round of one search.
#[derive(Debug, Clone)]
pub(crate) struct Iteration {
    /// What was searched.
    pub(crate) what: &'static str,
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
    /// Whether every bound was tried for it: no table of levels alone is better then.
    pub(crate) exact: bool,
    /// The front of levels and extents together.
    pub(crate) all: Front,
}

/// A table taken from a front.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    /// The table.
    pub(crate) table: RangeTable,
    /// What it holds, garment by garment, in the order of the garments it was tuned on.
    pub(crate) holds: Vec<Holds>,
}

/// Searches on all garments together, over so many candidate bounds a round. Where the user stops it, what was found until then.
pub(crate) fn find(
    wearers: &[&Wearer],
    max_parts: usize,
    (extents_cm, shapes): (&[f64], &[f64]),
    candidates: Option<usize>,
    what: &str,
) -> Result<Option<Found>, SearchError> {
    let samples: Vec<_> = wearers.iter().map(|w| w.sample()).collect();
    let mut found = Found { iterations: Vec::new(), levels: Front::default(), exact: false, all: Front::default() };
    let levels = ("levels alone", SearchOptions::new(max_parts));
    let both = (
        "levels and extents",
        SearchOptions { shapes: shapes.to_vec(), ..SearchOptions::with_extents(max_parts, extents_cm) },
    );
    for (title, mut options) in [levels, both].into_iter().take(if extents_cm.is_empty() { 1 } else { 2 }) {
        if interrupt::requested() {
            break;
        }
        if let Some(candidates) = candidates {
            (options.candidates, options.exact_up_to) = (candidates, candidates);
        }
        let bar = console::progress(Some(0), &format!("{what}: {title}"));
        let progress = |p: Progress| {
            bar.set_length((p.total * p.rounds) as u64);
            bar.set_position((p.total * (p.round - 1) + p.done) as u64);
        };
        let searched = search(&samples, &options, &progress);
        bar.finish_and_clear();
        let Search { rounds, exact } = searched?;
        for (round, front) in (1..).zip(&rounds) {
            found.iterations.push(Iteration { what: title, round, front: found.all.union(front) });
        }
        let last = rounds.last().cloned().unwrap_or_default();
        if options.widths_cm.is_empty() {
            (found.levels, found.exact) = (last.clone(), exact);
        }
        found.all = found.all.union(&last);
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
    let holds = wearers.iter().map(|w| w.holds(&table)).collect();
    Ok(Taken { table, holds })
}
