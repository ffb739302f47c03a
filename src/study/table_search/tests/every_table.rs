//! The search against all tables, on a garment of twenty vertices.

use crate::mechanics::coupled::Motion;
use crate::mesh::{RestShape, Topology};
use crate::parts::range_table::{Extent, RangeTable};
use crate::parts::{Grain, segment};
use crate::study::accuracy::representable::unblended_rms_m;
use crate::study::table_search::{Sample, SearchError, SearchOptions, search};
use glam::DVec3;
use proptest::prelude::*;

use super::{ignore, is_a_front, sheet};

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn the_front_is_that_of_all_tables(
        distances in prop::collection::vec(0u32..5, 20),
        moves in prop::collection::vec(-1.0f64..1.0, 60),
        extents in prop::collection::vec((3.0f64..10.0, 0usize..3), 0..2),
        affine in any::<bool>(),
    ) {
        let motion = if affine { Motion::Affine } else { Motion::Translation };
        let mesh = sheet(5, 4);
        let topology = Topology::new(&mesh);
        let rest = RestShape::from_edges(&mesh).unwrap();
        let grain = Grain::new(&mesh, &topology, &rest);
        let distances: Vec<f64> = distances.iter().map(|&d| 0.01 * f64::from(d)).collect();
        let displacement: Vec<DVec3> = moves.chunks(3).map(DVec3::from_slice).collect();
        let sample =
            Sample { mesh: &mesh, topology: &topology, grain: &grain, distances_m: &distances, displacement: &displacement, weight: 2.5, max_parts: 14 };
        let (widths, shapes): (Vec<f64>, Vec<usize>) = extents.into_iter().unzip();
        let shapes: Vec<f64> = shapes.into_iter().flat_map(|s| [1.0, [0.5, 2.0, 4.0][s]]).collect();
        let options = SearchOptions {
            include: Vec::new(),
            motion,
            rounds: 1,
            shapes: shapes.clone(),
            ..SearchOptions::with_extents(&widths)
        };
        let found = search(&[sample], &options, &ignore);

        // Up to four bounds between five values, and each level uncut or cut to one of two shapes: 16 to 768 tables.
        let mut best = [f64::INFINITY; 15];
        let cuts = widths.iter().flat_map(|&w| shapes.iter().map(move |s| Extent { width_cm: w, height_cm: s * w }));
        let choices: Vec<Extent> = cuts.chain([Extent::UNCUT]).collect();
        for mask in 0u32..16 {
            let inner: Vec<f64> = (0..4).filter(|b| mask >> b & 1 == 1).map(|b| 0.5 + f64::from(b)).collect();
            let table = RangeTable::from_inner_bounds("all", &inner).unwrap();
            for mut code in 0..choices.len().pow(inner.len() as u32 + 1) {
                let mut extents = Vec::new();
                for _ in 0..=inner.len() {
                    extents.push(Some(choices[code % choices.len()]));
                    code /= choices.len();
                }
                let table = table.clone().with_extents(&extents).unwrap();
                let parts = segment(&topology, &distances, &table).cut_to_table(&mesh, &topology, &rest, &table);
                if parts.len() <= 14 {
                    let rms = unblended_rms_m(&parts, &mesh.positions, &displacement, motion);
                    best[parts.len()] = rms.min(best[parts.len()]);
                }
            }
        }
        if best.iter().all(|rms| rms.is_infinite()) {
            let refused = matches!(found, Err(SearchError::TooFewParts { ref max_parts }) if max_parts[..] == [14]);
            prop_assert!(refused);
            return Ok(());
        }
        let found = found.unwrap();
        is_a_front(found.front());
        let mut least = f64::INFINITY;
        for (parts, rms) in best.into_iter().enumerate() {
            least = rms.min(least);
            let point = found.front().best_within(parts);
            // The exact error may be 0, and the root of its rounding error is about 1e-8.
            prop_assert!(point.map_or(least.is_infinite(), |p| (p.rms_m - least).abs() < 1e-7));
        }
    }
}
