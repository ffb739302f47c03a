//! The drape test on a coarse specimen: order by stiffness, number of folds, published bands.

use super::{Target, maxima, results_csv, run, targets};
use crate::garment::fabric::Fabric;

fn falls_inside(band: &Target) {
    let result = run(&Fabric::by_name(&band.fabric).unwrap(), 8).unwrap();
    let (name, percent) = (&band.fabric, 100.0 * result.coefficient);
    let tolerance = crate::mechanics::refine::RefineOptions::default().tolerance;
    assert!(
        result.residual_over_weight < tolerance,
        "{name}: residual {:e} after {}",
        result.residual_over_weight,
        result.steps
    );
    assert!(percent > band.low_percent && percent < band.high_percent, "{name}: {percent} %");
    assert!((4..=12).contains(&result.folds), "{name}: {} folds", result.folds);
}

#[test]
fn cotton_wool_and_denim_fall_inside_bands_that_nothing_was_set_to() {
    let mut checks = targets().unwrap();
    checks.retain(|band| !band.calibrated_to);
    assert_eq!(checks.iter().map(|band| band.fabric.as_str()).collect::<Vec<_>>(), ["cotton", "wool", "denim"]);
    checks.iter().for_each(falls_inside);
}

#[test]
fn silk_is_still_where_it_was_calibrated_to() {
    let mut set = targets().unwrap();
    set.retain(|band| band.calibrated_to);
    assert_eq!(set.iter().map(|band| band.fabric.as_str()).collect::<Vec<_>>(), ["silk"]);
    set.iter().for_each(falls_inside);
}

#[test]
fn a_stiffer_fabric_drapes_less() {
    let mut fabric = Fabric::by_name("jersey").unwrap();
    let soft = run(&fabric, 6).unwrap().coefficient;
    fabric.bending_nm = fabric.bending_nm.map(|b| 20.0 * b);
    let stiff = run(&fabric, 6).unwrap().coefficient;
    assert!(soft > 0.1 && soft + 0.1 < stiff && stiff < 1.0, "{soft} and {stiff}");
}

#[test]
fn results_come_as_csv_with_their_bands() {
    let csv = results_csv(&["jersey", "denim"], 4).unwrap();
    let rows: Vec<csv::StringRecord> = csv::Reader::from_reader(csv.as_bytes()).records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 2);
    assert_eq!((&rows[0][4], &rows[0][5]), ("", "no published band"));
    assert_eq!((&rows[1][0], &rows[1][2], &rows[1][3], &rows[1][4]), ("denim", "70", "90", "false"));
    assert!(results_csv(&["felt"], 4).is_err());
    assert!(run(&Fabric::by_name("silk").unwrap(), 2).is_err());
}

#[test]
fn the_stored_results_equal_the_computed_ones() {
    // One row is drawn again; all of them would take the better part of a minute.
    let kept = include_str!("../../../assets/cusick/results.csv");
    let drawn = results_csv(&["interlock"], 10).unwrap();
    let row = drawn.lines().nth(1).unwrap();
    assert!(
        kept.lines().any(|line| line == row),
        "assets/cusick/results.csv lacks `{row}`: `partwise cusick --rows 10 --csv` writes it again"
    );
    assert_eq!(kept.lines().count(), 1 + crate::garment::fabric::BUILT_IN.len());
}

#[test]
fn folds_are_counted_once_around() {
    let wave = |n: f64| {
        (0..200).map(|i| 0.12 + 0.01 * (n * std::f64::consts::TAU * f64::from(i) / 200.0).cos()).collect::<Vec<_>>()
    };
    assert_eq!(maxima(&wave(6.0)), 6);
    assert_eq!(maxima(&wave(1.0)), 1);
    assert_eq!(maxima(&[0.12; 50]), 0);
}
