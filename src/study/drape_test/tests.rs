//! The drape test on a coarse specimen: order by stiffness, number of nodes, published bands, radii, directions of the mesh.

use super::table::{Target, targets};
use super::{DrapeTest, Drapes, STANDARDS, table_csv};
use crate::garment::fabric::{BUILT_IN, Fabric};

fn coarse(rows: usize) -> DrapeTest {
    DrapeTest { rows, ..DrapeTest::default() }
}

fn falls_inside(band: &Target) {
    for rows in [8, 10] {
        let drape = coarse(rows).run(&Fabric::by_name(&band.fabric).unwrap()).unwrap();
        let (name, percent, nodes) = (&band.fabric, 100.0 * drape.coefficient, drape.nodes.count);
        let tolerance = crate::mechanics::solver_options::NewtonOptions::default().tolerance;
        let residual = drape.residual_over_weight;
        assert!(residual < tolerance, "{name}: residual {residual:e} after {}", drape.steps);
        assert!(percent > band.low_percent && percent < band.high_percent, "{name} at {rows} rows: {percent} %");
        assert!((4..=12).contains(&nodes), "{name} at {rows} rows: {nodes} nodes");
    }
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
    let soft = coarse(6).run(&fabric).unwrap().coefficient;
    fabric.bending_nm = fabric.bending_nm.map(|b| 20.0 * b);
    let stiff = coarse(6).run(&fabric).unwrap().coefficient;
    assert!(soft > 0.1 && soft + 0.1 < stiff && stiff < 1.0, "{soft} and {stiff}");
}

#[test]
fn a_wider_rim_drapes_more() {
    let fabric = Fabric::by_name("wool").unwrap();
    let on = |specimen_m| DrapeTest { specimen_m, ..coarse(6) }.run(&fabric).unwrap().coefficient;
    let [narrow, medium, wide] = [0.12, 0.15, 0.18].map(on);
    assert!(narrow > medium + 0.05 && medium > wide + 0.05, "{narrow}, {medium} and {wide}");
}

/// Means of three starts: those of one mesh differ by up to three nodes.
#[test]
fn the_mesh_does_not_choose_the_drape_of_an_isotropic_fabric() {
    let fabric = Fabric::by_name("cotton").unwrap();
    let at = |degrees: f64| {
        let drapes = Drapes::of(&fabric, DrapeTest { turned: degrees.to_radians(), ..coarse(8) }, 3).unwrap();
        [drapes.mean(|drape| drape.coefficient), drapes.mean(|drape| drape.nodes.count as f64)]
    };
    let plain = at(0.0);
    for degrees in [15.0, 40.0] {
        let turned = at(degrees);
        assert!((turned[0] - plain[0]).abs() < 0.03, "{degrees}: {turned:?} for {plain:?}");
        assert!((turned[1] - plain[1]).abs() < 1.5, "{degrees}: {turned:?} for {plain:?}");
    }
}

#[test]
fn starts_differ_and_their_mean_and_scatter_are_those_of_a_sample() {
    let drapes = Drapes::of(&Fabric::by_name("silk").unwrap(), coarse(6), 3).unwrap();
    let all: Vec<f64> = drapes.all.iter().map(|drape| drape.coefficient).collect();
    let mean = all.iter().sum::<f64>() / 3.0;
    assert!((drapes.mean(|drape| drape.coefficient) - mean).abs() < 1e-15);
    let scatter = drapes.deviation(|drape| drape.coefficient).unwrap();
    let squares: f64 = all.iter().map(|c| (c - mean).powi(2)).sum();
    assert!(scatter > 0.0 && (scatter - (0.5 * squares).sqrt()).abs() < 1e-15);
    let one = Drapes { all: drapes.all[..1].to_vec() };
    assert_eq!(one.deviation(|drape| drape.coefficient), None);
}

#[test]
fn a_band_stands_beside_a_result_of_its_radii_alone() {
    let drapes = Drapes::of(&Fabric::by_name("denim").unwrap(), coarse(4), 1).unwrap();
    let rows = |test: &DrapeTest| {
        let csv = table_csv(test, &[("denim".to_owned(), drapes.clone()), ("a,b".to_owned(), drapes.clone())]).unwrap();
        csv::Reader::from_reader(csv.as_bytes()).records().map(Result::unwrap).collect::<Vec<_>>()
    };
    let own = rows(&coarse(4));
    assert_eq!([&own[0][0], &own[0][3], &own[0][4], &own[0][5]], ["denim", "70", "90", "false"]);
    assert_eq!([&own[1][0], &own[1][5], &own[1][6]], ["a,b", "", "no published band"]);
    let [.., jis] = STANDARDS;
    let other = rows(&DrapeTest { specimen_m: jis.specimen_m, disc_m: jis.disc_m, ..coarse(4) });
    assert_eq!(&other[0][6], "no published band");
}

#[test]
fn radii_and_meshes_that_are_no_drape_test_are_refused() {
    let error = |test: DrapeTest| test.check().unwrap_err().to_string();
    for [specimen_m, disc_m] in
        [[0.09, 0.15], [0.15, 0.15], [0.15, f64::NAN], [f64::NAN, 0.09], [30.0, 18.0], [0.15, 0.0]]
    {
        assert!(error(DrapeTest { specimen_m, disc_m, ..coarse(8) }).contains("exchanged"), "{specimen_m} {disc_m}");
    }
    assert!(error(coarse(2)).contains("at least 4"));
    for standard in STANDARDS {
        DrapeTest { specimen_m: standard.specimen_m, disc_m: standard.disc_m, ..coarse(8) }.check().unwrap();
    }
}

#[test]
fn the_stored_results_equal_the_computed_ones() {
    // One row is computed again; all of them would take most of a minute.
    let kept = include_str!("../../../assets/cusick/results.csv");
    let drapes = Drapes::of(&Fabric::by_name("interlock").unwrap(), coarse(10), 1).unwrap();
    let drawn = table_csv(&coarse(10), &[("interlock".to_owned(), drapes)]).unwrap();
    let row = drawn.lines().nth(1).unwrap();
    assert!(
        kept.lines().any(|line| line == row),
        "assets/cusick/results.csv lacks `{row}`: `partwise cusick --rows 10 --csv` writes it again"
    );
    assert_eq!(kept.lines().count(), 1 + BUILT_IN.len());
}
