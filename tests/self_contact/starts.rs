//! Perturbed starts, every other one moved so far that it may cross itself: which end at rest without a crossing.

use partwise::Scene;
use partwise::assess::perturbed;

use super::*;

/// How far the moved starts go that are to cross, in perturbations of 5 mm RMS.
const FAR: f64 = 8.0;

/// What became of some starts.
#[derive(Debug, Default)]
struct Ended {
    began_crossing: usize,
    /// Those that did not end at rest without a crossing and with nothing inside, and what is told of each.
    failed: Vec<String>,
}

/// Drapes a garment of so many vertices from the starts with these seeds: four garments, two fabrics.
fn from_starts(seeds: std::ops::RangeInclusive<u64>, vertices: usize) -> Ended {
    let names = ["pullover-1", "flared-skirt", "low-cut-dress", "pullover-2"];
    let scenes = names.map(|name| SceneSpec::new("form", format!("{name}@{vertices}")).load().unwrap().scene);
    let mut ended = Ended::default();
    for seed in seeds {
        let scene = &scenes[seed as usize % 4];
        let moved = perturbed(&scene.garment.positions, &scene.held, seed);
        let times = if seed % 2 == 0 { FAR } else { 1.0 };
        let x = scene.garment.positions.iter().zip(&moved).map(|(a, b)| a.lerp(*b, times)).collect();
        let scene = Scene { garment: scene.garment.with_positions(x), ..scene.clone() };
        let began = crossings(&scene.garment, &scene.garment.positions);
        let fabric = Fabric::by_name(if seed % 3 == 0 { "cotton" } else { "interlock" }).unwrap();
        let draped = drape(&scene, &Settings { fabric, ..Settings::default() }, &mut unobserved).unwrap();
        let residual = draped.state.as_ref().unwrap().residual_over_weight;
        ended.began_crossing += usize::from(began > 0);
        // What is told is what is there, counted once more.
        let (crossing, inside) = (draped.self_intersecting_pairs, draped.penetrating_vertices);
        assert_eq!(crossing, crossings(&scene.garment, &draped.positions), "seed {seed}");
        if crossing + inside > 0 || residual >= 1e-3 {
            let told = format!("seed {seed}: {began} crossed, {crossing} do, {inside} inside, residual {residual:.1e}");
            eprintln!("{told}");
            ended.failed.push(told);
        }
    }
    ended
}

#[test]
fn perturbed_starts_end_without_a_crossing() {
    let ended = from_starts(1..=8, 600);
    assert!(ended.began_crossing >= 3, "{ended:?}");
    assert!(ended.failed.is_empty(), "{ended:?}");
}

#[test]
#[ignore = "some minutes: cargo test --release --test self_contact hundred -- --ignored"]
fn of_a_hundred_perturbed_starts_four_at_most_fail() {
    let ended = from_starts(1..=100, 1500);
    assert!(ended.began_crossing >= 40, "{ended:?}");
    // Measured: three, all of those that were moved far.
    assert!(ended.failed.len() <= 4, "{ended:?}");
}
