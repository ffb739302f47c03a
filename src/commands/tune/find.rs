//! The search itself: levels alone, then levels and extents; what was best after each iteration.

use crate::study::table_search::{Front, Progress, Search, SearchError, SearchOptions, search};

use super::garment::Garment;
use crate::commands::{console, interrupt};

/// One iteration: a round of one search.
#[derive(Debug, Clone)]
pub(crate) struct Iteration {
    pub(crate) what: &'static str,
    /// Its round, from 1.
    pub(crate) round: usize,
    /// All found so far that nothing beats.
    pub(crate) front: Front,
}

/// What a search came to.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Every iteration, levels alone first.
    pub(crate) iterations: Vec<Iteration>,
    /// How many of them are of levels alone.
    pub(crate) levels: usize,
    /// Whether every bound was tried there: no table of levels alone is better then.
    pub(crate) exact: bool,
}

/// Widths a level may be cut to, cm.
pub(crate) const WIDTHS_CM: [f64; 30] = [
    4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 22.0, 24.0, 26.0,
    28.0, 30.0, 33.0, 36.0, 40.0, 45.0, 50.0, 60.0, 70.0, 80.0,
];

/// Heights over widths.
pub(crate) const SHAPES: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// The same for one table for several garments: from half of about 12 cm to what still folds in the model. With none wider left out, pullover-1,
/// held out, lost more than with Table 3 to levels left nearly whole; with up to 24 cm the skirt, held out, hung as stiff as with Table 3.
pub(crate) const WIDTHS_TOGETHER_CM: [f64; 11] = [6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0];

/// Heights over widths for several garments: cloth folds around the body.
pub(crate) const SHAPES_TOGETHER: [f64; 3] = [1.0, 2.0, 4.0];

/// Thinnest level of a table for several garments, cm.
const THINNEST_CM: f64 = 0.5;

/// Searches on all garments together, over so many candidate bounds a round. Where the user stops it, what was found until then.
pub(crate) fn find(
    garments: &[&Garment],
    limits: &[usize],
    (extents_cm, shapes): (&[f64], &[f64]),
    candidates: Option<usize>,
    what: &str,
) -> Result<Option<Found>, SearchError> {
    let samples: Vec<_> = garments.iter().zip(limits).map(|(w, limit)| w.sample(*limit)).collect();
    let mut found = Found { iterations: Vec::new(), levels: 0, exact: false };
    let mut all = Front::default();
    let levels = ("levels alone", SearchOptions::default());
    let both =
        ("levels and extents", SearchOptions { shapes: shapes.to_vec(), ..SearchOptions::with_extents(extents_cm) });
    for (title, mut options) in [levels, both].into_iter().take(if extents_cm.is_empty() { 1 } else { 2 }) {
        if interrupt::requested() {
            break;
        }
        if garments.len() > 1 && !options.widths_cm.is_empty() {
            // Meant for garments that are not here: what only fits these ones finely is left out.
            (options.thinnest_cm, options.uncut) = (THINNEST_CM, false);
            (options.candidates, options.rounds) = (80, 4);
        }
        options.motion = garments.first().map_or(options.motion, |w| w.motion);
        if let Some(candidates) = candidates {
            (options.candidates, options.exact_up_to) = (candidates, candidates);
        }
        let bar = console::progress(Some(0), &format!("{what}: {title}"));
        let progress = |p: Progress| {
            bar.set_length((p.total * p.rounds) as u64);
            bar.set_position((p.total * (p.round - 1) + p.done) as u64);
            interrupt::go_on()
        };
        let searched = search(&samples, &options, &progress);
        bar.finish_and_clear();
        let Search { rounds, exact } = searched?;
        for (round, front) in (1..).zip(&rounds) {
            found.iterations.push(Iteration { what: title, round, front: all.union(front) });
        }
        if options.widths_cm.is_empty() {
            (found.levels, found.exact) = (rounds.len(), exact);
        }
        all = found.iterations.last().map(|i| i.front.clone()).unwrap_or_default();
    }
    Ok((!all.points.is_empty()).then_some(found))
}

/// The most PARTs of each garment: its share of a total, as Table 3 spends them.
pub(crate) fn limits(garments: &[&Garment], max_parts: usize) -> Vec<usize> {
    let total: usize = garments.iter().map(|w| w.table_3.parts).sum();
    let share = |w: &&Garment| w.table_3.parts as u128 * max_parts as u128 / total.max(1) as u128;
    garments.iter().map(|w| usize::try_from(share(w)).unwrap_or(usize::MAX)).collect()
}
