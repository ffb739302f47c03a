//! Tests of the table search: against all tables on a small garment, and against stage one on a larger one.

mod every_table;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::mechanics::coupled::Motion;
use crate::mesh::{RestShape, Topology, TriMesh};
use crate::parts::range_table::RangeTable;
use crate::parts::{Grain, Parts, segment};
use crate::study::accuracy::representable::unblended_rms_m;
use crate::study::table_search::{Front, FrontPoint, Progress, Sample, Search, SearchError, SearchOptions, search};
use glam::DVec3;

impl Search {
    /// The final front.
    fn front(&self) -> &Front {
        const NONE: &Front = &Front { points: Vec::new(), best: None };
        self.rounds.last().unwrap_or(NONE)
    }
}

impl Front {
    /// The least error with at most this many PARTs.
    fn best_within(&self, max_parts: usize) -> Option<&FrontPoint> {
        self.points[..self.points.partition_point(|p| p.parts <= max_parts)].last()
    }
}

/// A sheet of `w` by `h` vertices, 2 cm apart.
fn sheet(w: usize, h: usize) -> TriMesh {
    let at = |i: usize, j: usize| (j * w + i) as u32;
    let positions = (0..w * h).map(|v| DVec3::new(0.02 * (v % w) as f64, 0.02 * (v / w) as f64, 0.0)).collect();
    let quad = |i: usize, j: usize| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        if (i + j).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    };
    TriMesh::new(positions, (0..h - 1).flat_map(|j| (0..w - 1).flat_map(move |i| quad(i, j))).collect())
}

/// A sheet with distances and displacements that wave at different rates.
struct Wavy {
    mesh: TriMesh,
    topology: Topology,
    rest: RestShape,
    grain: Grain,
    distances: Vec<f64>,
    displacement: Vec<DVec3>,
}

impl Wavy {
    fn new(w: usize, h: usize, phase: f64) -> Self {
        let mesh = sheet(w, h);
        let topology = Topology::new(&mesh);
        let rest = RestShape::from_edges(&mesh).unwrap();
        let grain = Grain::new(&mesh, &topology, &rest);
        let distance = |x: &DVec3| 0.05 + 0.2 * x.y + 0.01 * (40.0 * x.x + phase).sin();
        let moved = |x: &DVec3| {
            let fold = 0.05 * (25.0 * x.x + 10.0 * x.y + phase).cos();
            DVec3::new(fold, 0.3 * fold, -0.1 * x.y * x.y)
        };
        let distances = mesh.positions.iter().map(distance).collect();
        let displacement = mesh.positions.iter().map(moved).collect();
        Self { mesh, topology, rest, grain, distances, displacement }
    }

    fn sample(&self, weight: f64, max_parts: usize) -> Sample<'_> {
        let Self { mesh, topology, grain, distances, displacement, .. } = self;
        Sample { mesh, topology, grain, distances_m: distances, displacement, weight, max_parts }
    }

    /// Representable error of the PARTs, moved by translations or affine maps, m.
    fn rms(&self, parts: &Parts, motion: Motion) -> f64 {
        unblended_rms_m(parts, &self.mesh.positions, &self.displacement, motion)
    }

    fn parts(&self, table: &RangeTable) -> Parts {
        segment(&self.topology, &self.distances, table).cut_to_table(&self.mesh, &self.topology, &self.rest, table)
    }
}

/// Ignores the progress.
fn ignore(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Few candidates and rounds, to keep the tests short.
fn coarse(candidates: usize, options: SearchOptions) -> SearchOptions {
    SearchOptions { candidates, candidates_around: 9, exact_up_to: 0, rounds: 3, ..options }
}

fn is_a_front(front: &Front) {
    assert!(front.points.windows(2).all(|w| w[0].parts < w[1].parts && w[0].rms_m > w[1].rms_m));
}

#[test]
fn every_point_has_the_parts_and_the_error_of_stage_one() {
    let (a, b) = (Wavy::new(31, 24, 0.0), Wavy::new(17, 28, 1.3));
    let kinds =
        [(120, &[][..], Motion::Translation), (120, &[], Motion::Affine), (300, &[8.0, 10.0, 15.0], Motion::Affine)];
    for (max_parts, widths_cm, motion) in kinds {
        let options = SearchOptions { motion, ..coarse(40, SearchOptions::with_extents(widths_cm)) };
        let samples = [a.sample(1.0, 2 * max_parts / 3), b.sample(3.0, max_parts / 3)];
        let found = search(&samples, &options, &ignore).unwrap();
        is_a_front(found.front());
        assert!(found.front().points.len() > 10);
        for point in &found.front().points {
            let table = point.table("found", "test").unwrap();
            assert_eq!(table.has_extents(), !widths_cm.is_empty());
            let cut = [&a, &b].map(|g| g.parts(&table));
            assert_eq!(cut[0].len() + cut[1].len(), point.parts);
            let e = [(&a, &cut[0]), (&b, &cut[1])].map(|(g, parts)| g.rms(parts, motion));
            let rms = ((e[0] * e[0] + 3.0 * e[1] * e[1]) / 4.0).sqrt();
            assert!((rms - point.rms_m).abs() < 1e-9, "{rms} {}", point.rms_m);
        }
    }
}

#[test]
fn no_included_table_is_better_and_no_round_is_worse() {
    let garment = Wavy::new(31, 24, 0.4);
    let included = RangeTable::table_3().scaled(1.7).unwrap();
    let parts = garment.parts(&included);
    let rms = garment.rms(&parts, Motion::Affine);
    let options = SearchOptions { candidates: 20, exact_up_to: 0, include: vec![included], ..SearchOptions::default() };
    let found = search(&[garment.sample(1.0, parts.len())], &options, &ignore).unwrap();
    let best: Vec<f64> = found.rounds.iter().map(|f| f.best_within(parts.len()).unwrap().rms_m).collect();
    assert!(best[0] <= rms);
    assert!(best.windows(2).all(|w| w[1] <= w[0]));
    assert!(best[2] < best[0], "rounds around the best table should find a better one: {best:?}");
    // The search over all bounds is at least as good as one over some, for any number of PARTs.
    let exact = search(&[garment.sample(1.0, parts.len())], &SearchOptions::default(), &ignore).unwrap();
    assert!(exact.exact && exact.rounds.len() == 1 && !found.exact);
    for point in &found.front().points {
        assert!(exact.front().best_within(point.parts).unwrap().rms_m <= point.rms_m + 1e-12);
    }
    let front = found.front();
    let last = front.points.last().unwrap();
    assert_eq!(front.points.iter().find(|p| p.rms_m <= last.rms_m), Some(last));
    assert_eq!(front.best_within(0), None);
}

#[test]
fn an_extent_for_each_level_is_never_worse_than_one_for_all() {
    let garment = Wavy::new(31, 24, 0.4);
    let found = |widths_cm: &[f64]| {
        let options = SearchOptions { candidates: 25, rounds: 1, ..SearchOptions::with_extents(widths_cm) };
        search(&[garment.sample(1.0, 60)], &options, &ignore).unwrap().front().clone()
    };
    let front = found(&[20.0, 30.0, 1.0]);
    is_a_front(&front);
    // A level cut to 1 cm has more PARTs than allowed.
    assert!(front.points.iter().all(|p| p.extents.iter().all(|e| e.width_cm > 1.0)));
    for fewer in [&[][..], &[20.0], &[30.0]] {
        for point in &found(fewer).points {
            assert!(front.best_within(point.parts).unwrap().rms_m <= point.rms_m + 1e-12);
        }
    }
    let has = |p: &FrontPoint, cm: f64| p.extents.iter().any(|e| e.width_cm == cm);
    let mixed = |p: &&FrontPoint| has(p, 20.0) && has(p, 30.0);
    let mixed = front.points.iter().find(mixed).unwrap();
    assert_eq!(mixed.extents.len(), mixed.inner_bounds_cm.len() + 1);
    let table = mixed.table("found", "test").unwrap();
    let again = RangeTable::parse(&table.to_toml(), "again").unwrap();
    assert_eq!(garment.parts(&again).len(), mixed.parts);
}

#[test]
fn no_garment_exceeds_its_limit_for_the_sake_of_another() {
    // One garment breaks into many pieces at any extent, the other into few, so minimising the sum alone would exceed a limit.
    let (large, small) = (Wavy::new(40, 30, 0.0), Wavy::new(16, 10, 1.3));
    let limits = [90, 70];
    let samples = [large.sample(1.0, limits[0]), small.sample(1.0, limits[1])];
    let options = coarse(30, SearchOptions::with_extents(&[4.0, 6.0, 8.0, 10.0, 15.0, 20.0]));
    let front = search(&samples, &options, &ignore).unwrap().front().clone();
    let best = front.best.as_ref().unwrap();
    let table = best.table("best", "test").unwrap();
    let parts = [&large, &small].map(|g| g.parts(&table).len());
    assert_eq!(best.parts, parts[0] + parts[1]);
    assert!(parts[0] <= limits[0] && parts[1] <= limits[1], "{parts:?}");
    // At least one garment is near its limit; otherwise a finer table would be better.
    assert!(10 * parts[0] > 9 * limits[0] || 10 * parts[1] > 9 * limits[1], "{parts:?}");
    // The best table is at least as good as every table of the front within the limits.
    let mut within = 0;
    for point in &front.points {
        let table = point.table("other", "test").unwrap();
        if large.parts(&table).len() <= limits[0] && small.parts(&table).len() <= limits[1] {
            within += 1;
            assert!(best.rms_m <= point.rms_m + 1e-15);
        }
    }
    assert!(within > 10 && within < front.points.len());
}

#[test]
fn thin_and_uncut_levels_are_excluded_on_request() {
    let garment = Wavy::new(31, 24, 0.4);
    let other = Wavy::new(17, 28, 1.3);
    for samples in [&[garment.sample(1.0, 60)][..], &[garment.sample(1.0, 60), other.sample(1.0, 60)]] {
        let options = coarse(40, SearchOptions::with_extents(&[10.0, 20.0, 30.0]));
        let thinnest = |thinnest_cm: f64, uncut: bool| {
            let options = SearchOptions { thinnest_cm, uncut, ..options.clone() };
            let front = search(samples, &options, &ignore).unwrap().front().clone();
            let levels = front.points.iter().flat_map(|p| p.table("t", "test").unwrap().levels);
            let whole = front.points.iter().any(|p| p.extents.iter().any(|e| !e.cuts()));
            (levels.map(|l| l.upper_cm - l.lower_cm).fold(f64::INFINITY, f64::min), whole)
        };
        let (any, whole) = thinnest(0.0, true);
        assert!(any < 2.0 && whole, "{any} {whole}");
        let (thick, whole) = thinnest(2.0, false);
        assert!(thick >= 2.0 - 1e-12 && !whole, "{thick} {whole}");
    }
}

#[test]
fn threads_do_not_change_the_search_and_progress_counts_up() {
    let garment = Wavy::new(25, 20, 0.0);
    let other = Wavy::new(12, 15, 0.7);
    let run = |threads: usize, widths_cm: &[f64], samples: &[Sample<'_>]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let calls = AtomicUsize::new(0);
        let options = coarse(30, SearchOptions::with_extents(widths_cm));
        let found = pool.install(|| {
            search(samples, &options, &|p| {
                assert!(p.done <= p.total && p.round <= p.rounds);
                calls.fetch_add(1, Ordering::Relaxed);
                ControlFlow::Continue(())
            })
        });
        assert!(calls.into_inner() > 60);
        format!("{:?}", found.unwrap())
    };
    for widths_cm in [&[][..], &[8.0, 12.0]] {
        for samples in [&[garment.sample(1.0, 200)][..], &[garment.sample(1.0, 80), other.sample(2.0, 50)]] {
            assert_eq!(run(1, widths_cm, samples), run(2, widths_cm, samples));
        }
    }
}

#[test]
fn a_cancelled_search_keeps_the_finished_rounds() {
    let garment = Wavy::new(25, 20, 0.0);
    for samples in [&[garment.sample(1.0, 80)][..], &[garment.sample(1.0, 80), garment.sample(2.0, 80)]] {
        let until = |round: usize| {
            let progress = move |p: Progress| {
                if p.round < round || p.done < 5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            };
            search(samples, &coarse(30, SearchOptions::default()), &progress).unwrap()
        };
        assert!(until(1).rounds.is_empty() && until(1).front().points.is_empty());
        let whole = until(usize::MAX);
        assert_eq!(until(3).rounds, whole.rounds[..2]);
    }
}

#[test]
fn a_limit_above_the_vertex_count_equals_the_vertex_count() {
    let garment = Wavy::new(12, 10, 0.2);
    let found =
        |max_parts: usize| search(&[garment.sample(1.0, max_parts)], &coarse(20, SearchOptions::default()), &ignore);
    assert_eq!(found(usize::MAX), found(120));
    let both = [garment.sample(1.0, usize::MAX), garment.sample(2.0, 1 << 60)];
    assert!(search(&both, &coarse(20, SearchOptions::default()), &ignore).is_ok());
}

#[test]
fn affine_maps_represent_a_rotation_and_translations_do_not() {
    let mut garment = Wavy::new(31, 24, 0.4);
    garment.displacement = garment.mesh.positions.iter().map(|x| DVec3::new(-x.y, x.x, 0.0) * 0.3).collect();
    let best = |motion: Motion| {
        let options = SearchOptions { motion, ..SearchOptions::default() };
        let found = search(&[garment.sample(1.0, 40)], &options, &ignore).unwrap();
        found.front().best.clone().unwrap()
    };
    let (affine, translation) = (best(Motion::Affine), best(Motion::Translation));
    // One PART represents the rotation exactly.
    assert!(affine.rms_m < 1e-5 && translation.rms_m > 1e-3, "{affine:?} {translation:?}");
}

#[test]
fn invalid_samples_are_rejected() {
    let garment = Wavy::new(5, 4, 0.0);
    let error_of = |sample: Sample<'_>| search(&[sample], &SearchOptions::default(), &ignore).unwrap_err();
    assert_eq!(search(&[], &SearchOptions::default(), &ignore), Err(SearchError::NoGarment));
    let short = Sample { distances_m: &garment.distances[1..], ..garment.sample(1.0, 5) };
    assert!(matches!(error_of(short), SearchError::Length { garment: 1, found: 19, expected: 20, .. }));
    assert!(matches!(error_of(garment.sample(0.0, 5)), SearchError::Weight { .. }));
    assert_eq!(error_of(garment.sample(1.0, 0)), SearchError::TooFewParts { max_parts: vec![0] });
    let mut distances = garment.distances.clone();
    distances[7] = f64::NAN;
    let holed = Sample { distances_m: &distances, ..garment.sample(1.0, 5) };
    assert_eq!(error_of(holed), SearchError::NotFinite { garment: 1, vertex: 7 });
}

#[test]
fn the_built_in_tables_survive_a_round_trip() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/tuned");
    let mut found = 0;
    let entries = |folder: &std::path::Path| -> Vec<std::path::PathBuf> {
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let inside = entries(&folder).into_iter().filter(|path| path.is_dir());
    for path in inside.flat_map(|folder| entries(&folder)).chain(entries(&folder)) {
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            let table = RangeTable::parse(&text, &path.display().to_string()).unwrap();
            assert_eq!(table.to_toml(), text, "{}", path.display());
            assert_eq!(table.has_extents(), path.to_string_lossy().contains("extents"));
            found += 1;
        }
    }
    // Two for each garment, one by translations, and two for each garment left out.
    assert_eq!(found, 10 + 5 + 10);
}
