//! The rows in CSV and JSON.

use std::collections::BTreeSet;
use std::fs;

use crate::drape::StageTimes;
use crate::study::metrics::Metrics;
use crate::study::sweep::row::columns;
use crate::study::sweep::{Row, Status, Timing};
use proptest::prelude::*;

use super::{plan, uninterrupted};

#[test]
fn csv_and_json_lines_have_the_same_columns_and_cells() {
    let (folder, _) = uninterrupted();
    let mut csv = csv::Reader::from_path(folder.path().join("rows.csv")).unwrap();
    assert_eq!(csv.headers().unwrap().iter().collect::<Vec<_>>(), columns());
    let json = fs::read_to_string(folder.path().join("rows.jsonl")).unwrap();
    let records: Vec<_> = csv.records().map(Result::unwrap).collect();
    assert_eq!((records.len(), json.lines().count()), (200, 200));
    for (record, line) in records.iter().zip(json.lines()) {
        let object: serde_json::Map<String, serde_json::Value> = serde_json::from_str(line).unwrap();
        let (named, all): (BTreeSet<_>, BTreeSet<_>) =
            (object.keys().cloned().collect(), columns().into_iter().collect());
        // A failed point has no metrics.
        assert!(if object["status"] == "ok" { named == all } else { named.is_subset(&all) && named.len() < 20 });
        for (name, cell) in columns().iter().zip(record) {
            let same = match object.get(name) {
                None | Some(serde_json::Value::Null) => cell.is_empty(),
                Some(serde_json::Value::String(text)) => cell == text,
                Some(number) => cell.parse::<f64>().ok() == number.as_f64(),
            };
            assert!(same, "{name}: {cell} in the CSV, {:?} in the JSON", object.get(name));
        }
    }
}

#[test]
fn only_timings_are_dropped_for_comparison() {
    let measures = Metrics { rms_mm: Some(3.0), ..Metrics::default() };
    let pass = |ms| StageTimes { total: std::time::Duration::from_millis(ms), ..StageTimes::default() };
    let of = |passes: &[u64]| Timing::of(&passes.iter().map(|&ms| pass(ms)).collect::<Vec<_>>());
    let (quick, slow) = (
        Row::solved(&plan().points[0], &measures, "ab", &of(&[1])),
        Row::solved(&plan().points[0], &measures, "ab", &of(&[2, 3])),
    );
    assert_ne!(quick, slow);
    assert_eq!(quick.without_times(), slow.without_times());
    assert_eq!((quick.differences(&slow), quick.status), (Vec::<String>::new(), Status::Ok));
    let object = serde_json::to_value(slow.without_times()).unwrap();
    assert!(columns().iter().any(|name| name.starts_with("time_")));
    assert!(object.as_object().unwrap().keys().all(|name| !name.starts_with("time_")));
    let other = Row {
        metrics: Some(Metrics { rms_mm: Some(3.5), ..Metrics::default() }),
        result_hash: "cd".to_owned(),
        ..slow
    };
    assert_eq!(quick.differences(&other), ["rms_mm", "result_hash"]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Rows do not change when they are read and written again.
    #[test]
    fn metrics_survive_a_round_trip(value in any::<f64>().prop_filter("finite", |v| v.is_finite()), small in -1e3..1e3_f64) {
        let (value, point) = (value.clamp(-1e25, 1e25), &plan().points[0]);
        let measures = Metrics { displacement_rms_mm: small, rms_mm: Some(value), strain_p95: Some(small * 1e-12), ..Metrics::default() };
        let row = Row::solved(point, &measures, "", &Timing::default());
        prop_assert!((row.metrics.as_ref().unwrap().displacement_rms_mm - small).abs() <= 5e-9 * small.abs() + 1e-12);
        let read: Row = serde_json::from_str(&serde_json::to_string(&row).unwrap()).unwrap();
        prop_assert_eq!(read, row);
    }
}
