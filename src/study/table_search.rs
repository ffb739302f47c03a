//! Search for the range table of least error with a limited number of PARTs, which the paper leaves open (section 3.3: "the
//! proposed scheme cannot provide an optimal solution for the determination of the number of the levels and range values of
//! each level").
//!
//! An evolution strategy (μ + λ): in each generation, λ altered copies of the μ best tables so far are judged, and the best μ of all
//! remain. The judge is the caller's; `partwise tune` judges a table by stage two itself. A table is a list of levels, each with its
//! lower bound as a rank in the sorted distances and an extent, since the rank alone decides which vertices lie below a bound.
//!
//! | alteration | step |
//! |---|---|
//! | move a bound | by up to 1/2, 1/4, … 1/256 of all ranks |
//! | split a level, join two | at any rank |
//! | cut a level, or leave it uncut | as the level below it, or to an even extent |
//! | scale the extent of one level, of all | width and height by up to 2 or ∜2 |
//!
//! Source: Beyer, Schwefel: "Evolution strategies: a comprehensive introduction", Natural Computing 1 (2002). Limits: a
//! heuristic; another seed finds another table, and nothing bounds the distance to the best one.

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::base::math;
use crate::base::random::Random;
use crate::parts::range_table::{Extent, Level, METRES_PER_CM, RangeTable};

/// μ. Heuristic.
const PARENTS: usize = 8;

/// λ: enough for the threads of usual machines, and few enough that parents are recent. Heuristic.
const CHILDREN: usize = 16;

/// Alterations of one table, at most. Heuristic.
const ALTERATIONS: usize = 3;

/// Altered tables drawn in place of one that has too many PARTs, at most.
const TRIES: usize = 40;

/// Numbers of quantile levels, and even extents in cm, of the first tables.
const START_LEVELS: [usize; 8] = [1, 2, 3, 5, 8, 12, 20, 40];
const START_EXTENTS_CM: [f64; 6] = [10.0, 14.0, 20.0, 28.0, 40.0, 56.0];

/// Range of widths and heights of PARTs, cm: from the spacing of vertices to the length of a skirt. Heuristic.
const EXTENT_CM: std::ops::RangeInclusive<f64> = 3.0..=100.0;

/// PARTs and error of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// PARTs over all garments.
    pub(crate) parts: usize,
    /// Error, in the unit of the judge.
    pub(crate) error: f64,
}

/// A table of the search.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judged {
    pub(crate) table: RangeTable,
    pub(crate) fit: Fit,
}

/// Options of a search.
#[derive(Debug, Clone)]
pub(crate) struct SearchOptions {
    /// Tables judged.
    pub(crate) tables: usize,
    /// Whether levels may be cut to an extent.
    pub(crate) extents: bool,
    /// Tables judged first.
    pub(crate) include: Vec<RangeTable>,
}

/// Judges a table; `None` if it has too many PARTs. A table whose error exceeds the second argument may get an infinite one.
pub(crate) type Judge<'a, E> = &'a (dyn Fn(&RangeTable, f64) -> Result<Option<Fit>, E> + Sync);

/// The tables that were the best when they were found, the best of all last, over bounds between these distances (m, unsigned). The
/// result has the same bits on any number of threads. `progress` is called before each generation with the number of tables judged; when
/// it breaks, the search ends.
///
/// # Errors
/// Those of the judge.
pub(crate) fn search<E: Send>(
    distances_m: impl IntoIterator<Item = f64>,
    options: &SearchOptions,
    judge: Judge<'_, E>,
    progress: &dyn Fn(usize) -> ControlFlow<()>,
) -> Result<Vec<Judged>, E> {
    let space = Space::new(distances_m, options.extents);
    let starts = space.starts(&options.include);
    let mut parents: Vec<(Fit, Levels)> = Vec::new();
    let mut best: Vec<Judged> = Vec::new();
    let mut from = 0;
    while from < options.tables && progress(from).is_continue() {
        let worst = if parents.len() < PARENTS { f64::INFINITY } else { parents[PARENTS - 1].0.error };
        let child = |number: usize| -> Result<Option<(Fit, Levels)>, E> {
            let mut random = Random::new(number as u64);
            for _ in 0..TRIES {
                let levels = match (starts.get(number), parents.len()) {
                    (Some(start), _) => start.clone(),
                    (None, 0) => return Ok(None),
                    (None, count) => space.altered(&parents[random.below(count)].1, &mut random),
                };
                if let Some(fit) = space.table(&levels).map_or(Ok(None), |table| judge(&table, worst))? {
                    return Ok(Some((fit, levels)));
                }
                if number < starts.len() {
                    break;
                }
            }
            Ok(None)
        };
        let to = options.tables.min(from + CHILDREN);
        let children: Vec<_> = (from..to).into_par_iter().with_max_len(1).map(child).collect::<Result<_, E>>()?;
        from = to;
        for (fit, levels) in children.into_iter().flatten().filter(|(fit, _)| fit.error.is_finite()) {
            // An alteration that moves no vertex gives the same table again.
            if parents.iter().any(|(other, _)| *other == fit) {
                continue;
            }
            if best.last().is_none_or(|last| fit.error < last.fit.error) {
                best.extend(space.table(&levels).map(|table| Judged { table, fit }));
            }
            parents.push((fit, levels));
        }
        parents.sort_by(|a, b| a.0.error.total_cmp(&b.0.error));
        parents.truncate(PARENTS);
    }
    Ok(best)
}

/// Levels by their lower bound, as a rank, with their extents. The first rank is 0, ranks ascend.
type Levels = Vec<(usize, Extent)>;

/// The tables of a search.
struct Space {
    /// Distinct distances, ascending, m.
    sorted: Vec<f64>,
    extents: bool,
}

impl Space {
    fn new(distances_m: impl IntoIterator<Item = f64>, extents: bool) -> Self {
        let mut sorted: Vec<f64> = distances_m.into_iter().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.dedup();
        Self { sorted, extents }
    }

    /// The given tables, and quantile levels with even extents.
    fn starts(&self, include: &[RangeTable]) -> Vec<Levels> {
        let rank = |bound_cm: f64| self.sorted.partition_point(|&d| d < bound_cm * METRES_PER_CM);
        let level = |level: Level| (rank(level.lower_cm), level.extent.unwrap_or(Extent::UNCUT));
        let of = |table: &RangeTable| normal(table.effective_levels().into_iter().map(level).collect());
        let mut starts: Vec<Levels> = include.iter().map(of).collect();
        for count in START_LEVELS {
            let quantiles = |extent| normal((0..count).map(|i| (i * self.sorted.len() / count, extent)).collect());
            starts.push(quantiles(Extent::UNCUT));
            if self.extents {
                starts.extend(START_EXTENTS_CM.map(|cm| quantiles(Extent::even(cm))));
            }
        }
        starts
    }

    /// A copy with one to [`ALTERATIONS`] alterations.
    fn altered(&self, levels: &Levels, random: &mut Random) -> Levels {
        let mut levels = levels.clone();
        let ranks = self.sorted.len();
        for _ in 0..=random.below(ALTERATIONS) {
            let i = random.below(levels.len());
            match random.below(if self.extents { 6 } else { 3 }) {
                0 => {
                    let step = (ranks >> (1 + random.below(8))).max(1) as f64 * random.signed();
                    levels[i].0 = (levels[i].0 as f64 + step).clamp(0.0, ranks as f64) as usize;
                }
                1 => {
                    let rank = random.below(ranks);
                    let below = levels.partition_point(|level| level.0 <= rank).saturating_sub(1);
                    levels.insert(below + 1, (rank, levels[below].1));
                }
                2 if levels.len() > 1 => {
                    levels.remove(i);
                }
                3 if !levels[i].1.cuts() => {
                    let below = levels[..i].last().map(|level| level.1).filter(Extent::cuts);
                    let even = Extent::even(START_EXTENTS_CM[random.below(START_EXTENTS_CM.len())]);
                    levels[i].1 = below.unwrap_or(even);
                }
                3 => levels[i].1 = Extent::UNCUT,
                4 => {
                    let size = random.below(2);
                    levels[i].1 = scaled(levels[i].1, [random.signed(), random.signed()], size);
                }
                5 => {
                    let (by, size) = (random.signed(), random.below(2));
                    levels.iter_mut().for_each(|level| level.1 = scaled(level.1, [by, by], size));
                }
                _ => {}
            }
            levels = normal(levels);
        }
        levels
    }

    /// The range table of these levels; `None` where two distances leave no room for a bound.
    fn table(&self, levels: &Levels) -> Option<RangeTable> {
        let halfway = |&(rank, _): &(usize, Extent)| {
            Some(0.5 * (self.sorted.get(rank.checked_sub(1)?)? + self.sorted.get(rank)?) / METRES_PER_CM)
        };
        let inner: Vec<f64> = levels[1..].iter().filter_map(halfway).collect();
        if inner.len() + 1 < levels.len() {
            return None;
        }
        let extents: Vec<_> = levels.iter().map(|level| self.extents.then_some(level.1)).collect();
        RangeTable::from_inner_bounds("", &inner).ok()?.with_extents(&extents).ok()
    }
}

/// Sorted by rank, of equal ranks the first, beginning at rank 0.
fn normal(mut levels: Levels) -> Levels {
    levels.sort_by_key(|level| level.0);
    levels.dedup_by_key(|level| level.0);
    levels[0].0 = 0;
    levels
}

/// Width and height times 2 to these powers, or, with `size` 1, to a quarter of them; to a tenth of a centimetre. An uncut extent stays.
fn scaled(extent: Extent, powers: [f64; 2], size: usize) -> Extent {
    if !extent.cuts() {
        return extent;
    }
    let scale = |cm: f64, power: f64| {
        let cm = cm * math::powf(2.0, if size == 0 { power } else { 0.25 * power });
        (10.0 * cm.clamp(*EXTENT_CM.start(), *EXTENT_CM.end())).round() / 10.0
    };
    Extent { width_cm: scale(extent.width_cm, powers[0]), height_cm: scale(extent.height_cm, powers[1]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Distances of 500 vertices, up to 20 cm.
    fn distances() -> impl Iterator<Item = f64> {
        (0..500).map(|i| 0.2 * (f64::from(i) / 500.0).powi(2))
    }

    /// Prefers bounds at 2 and 7 cm and, in between, PARTs of 12 by 30 cm. A table has a PART for each level and more for each cut.
    fn judge(table: &RangeTable, _: f64) -> Result<Option<Fit>, Infallible> {
        let cut = |level: &Level| level.extent.map_or(0.0, |e| 100.0 / e.width_cm) as usize;
        let parts = table.levels.iter().map(|level| 1 + cut(level)).sum();
        let bounds: Vec<f64> = table.levels[1..].iter().map(|level| level.lower_cm).collect();
        let far = |cm: f64| bounds.iter().map(|b| (b - cm).abs()).fold(10.0, f64::min);
        let middle = table.levels.iter().find(|level| level.lower_cm <= 4.0 && level.upper_cm > 4.0).unwrap();
        let extent = middle.extent.filter(Extent::cuts).unwrap_or(Extent::even(100.0));
        let off = (extent.width_cm / 12.0).ln().abs() + (extent.height_cm / 30.0).ln().abs();
        Ok((parts <= 20).then_some(Fit { parts, error: far(2.0) + far(7.0) + off }))
    }

    fn found(tables: usize, extents: bool) -> Vec<Judged> {
        let go_on = |_: usize| ControlFlow::Continue(());
        let include = vec![RangeTable::table_3()];
        search(distances(), &SearchOptions { tables, extents, include }, &judge, &go_on).unwrap()
    }

    #[test]
    fn a_search_nears_the_optimum_within_the_limit_and_each_table_is_better_than_the_one_before() {
        let levels = found(400, false);
        assert!(levels.last().unwrap().fit.error - (100.0f64 / 12.0).ln() - (100.0f64 / 30.0).ln() < 0.05);
        assert!(levels.iter().all(|judged| !judged.table.has_extents()));
        let both = found(1500, true);
        assert!(both.last().unwrap().fit.error < 0.2, "{:?}", both.last());
        for pair in both.windows(2) {
            assert!(pair[1].fit.error < pair[0].fit.error && pair[1].fit.parts <= 20);
        }
        // Longer searches begin as shorter ones do.
        assert_eq!(found(400, true)[..], both[..found(400, true).len()]);
    }

    #[test]
    fn threads_do_not_change_a_search() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| found(200, true))
        };
        assert_eq!(on(1), on(3));
    }

    #[test]
    fn a_search_that_is_broken_off_keeps_its_best_table() {
        let until = |judged: usize| if judged < 96 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) };
        let options = SearchOptions { tables: 400, extents: true, include: vec![RangeTable::table_3()] };
        let kept = search(distances(), &options, &judge, &until).unwrap();
        assert_eq!(kept, found(96, true));
        assert!(!kept.is_empty());
    }

    #[test]
    fn an_included_table_is_the_first_and_has_the_same_levels() {
        let space = Space::new(distances(), false);
        let first = space.table(&space.starts(&[RangeTable::table_3()])[0]).unwrap();
        let distances: Vec<f64> = distances().collect();
        let levels = |table: &RangeTable| {
            let assigned = table.assign(&distances).0;
            (1..distances.len()).map(|v| assigned[v] == assigned[v - 1]).collect::<Vec<_>>()
        };
        assert_eq!(levels(&first), levels(&RangeTable::table_3()));
    }

    #[test]
    fn the_built_in_tables_survive_a_round_trip() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/tuned");
        let entries = |folder: &std::path::Path| -> Vec<std::path::PathBuf> {
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
        };
        let inside = entries(&folder).into_iter().filter(|path| path.is_dir());
        let mut found = 0;
        for path in inside.flat_map(|folder| entries(&folder)).chain(entries(&folder)) {
            if path.extension().is_some_and(|e| e == "toml") {
                let text = std::fs::read_to_string(&path).unwrap();
                let table = RangeTable::parse(&text, &path.display().to_string()).unwrap();
                assert_eq!(table.to_toml(), text, "{}", path.display());
                assert_eq!(table.has_extents(), path.to_string_lossy().contains("extents"));
                found += 1;
            }
        }
        // Two for each garment, and two for each garment left out.
        assert_eq!(found, 10 + 10);
    }
}
