//! Perturbed starts, every second one moved so far that it may intersect itself: the drape converges without intersections.

use partwise::Scene;
use partwise::study::evaluate::perturbed;

use super::*;

/// Scale of the perturbation (5 mm RMS) for starts that should intersect themselves.
const LARGE: f64 = 8.0;

/// Outcomes of several starts.
#[derive(Debug, Default)]
struct Outcomes {
    /// Number of starts with intersections.
    intersecting_starts: usize,
    /// Descriptions of the drapes that did not converge, or have intersections or penetration.
    failed: Vec<String>,
}

/// Drapes four garments of about `vertices` vertices in two fabrics, one start for each seed.
fn from_starts(seeds: std::ops::RangeInclusive<u64>, vertices: usize) -> Outcomes {
    let names = ["pullover-1", "flared-skirt", "low-cut-dress", "pullover-2"];
    let scenes = names.map(|name| SceneSpec::new("form", format!("{name}@{vertices}")).load().unwrap().scene);
    let mut outcomes = Outcomes::default();
    for seed in seeds {
        let scene = &scenes[seed as usize % 4];
        let moved = perturbed(&scene.garment.positions, &scene.held, seed);
        let times = if seed % 2 == 0 { LARGE } else { 1.0 };
        let x = scene.garment.positions.iter().zip(&moved).map(|(a, b)| a.lerp(*b, times)).collect();
        let scene = Scene { garment: scene.garment.with_positions(x), ..scene.clone() };
        let began = crossings(&scene.garment, &scene.garment.positions);
        let fabric = Fabric::by_name(if seed % 3 == 0 { "cotton" } else { "interlock" }).unwrap();
        let draped = drape(&scene, &Settings { fabric, ..Settings::default() }, &mut unobserved).unwrap();
        let residual = draped.state.as_ref().unwrap().residual_over_weight;
        outcomes.intersecting_starts += usize::from(began > 0);
        // The reported number of pairs equals an independent count.
        let (crossing, inside) = (draped.self_intersecting_pairs, draped.penetrating_vertices);
        assert_eq!(crossing, crossings(&scene.garment, &draped.positions), "seed {seed}");
        if crossing + inside > 0 || residual >= 1e-3 {
            let report =
                format!("seed {seed}: {began} crossed, {crossing} do, {inside} inside, residual {residual:.1e}");
            eprintln!("{report}");
            outcomes.failed.push(report);
        }
    }
    outcomes
}

#[test]
fn perturbed_starts_end_without_intersections() {
    let outcomes = from_starts(1..=8, 600);
    assert!(outcomes.intersecting_starts >= 3, "{outcomes:?}");
    assert!(outcomes.failed.is_empty(), "{outcomes:?}");
}

#[test]
#[ignore = "some minutes: cargo test --release --test self_contact hundred -- --ignored"]
fn a_hundred_perturbed_starts_rest_without_intersections() {
    let outcomes = from_starts(1..=100, 1500);
    assert!(outcomes.intersecting_starts >= 40, "{outcomes:?}");
    assert!(outcomes.failed.is_empty(), "{outcomes:?}");
}

/// Two hanging tubes, one around the other, with the radius in m at each (layer, row, column).
fn tubes(radius: impl Fn(usize, u32, u32) -> f64) -> TriMesh {
    const AROUND: u32 = 24;
    const ROWS: u32 = 12;
    let tube = |layer: usize| {
        let at = |j: u32, i: u32| {
            let (s, c) = (TAU * f64::from(i) / f64::from(AROUND)).sin_cos();
            let r = radius(layer, j, i);
            DVec3::new(r * c, r * s, -0.01 * f64::from(j))
        };
        let positions = (0..=ROWS).flat_map(|j| (0..AROUND).map(move |i| (j, i))).map(|(j, i)| at(j, i)).collect();
        let corner = |j: u32, i: u32| j * AROUND + i % AROUND;
        let squares = (0..ROWS).flat_map(|j| (0..AROUND).map(move |i| (j, i)));
        let triangles = squares.flat_map(|(j, i)| {
            let [a, b, c, d] = [corner(j, i), corner(j, i + 1), corner(j + 1, i), corner(j + 1, i + 1)];
            [[a, c, b], [b, c, d]]
        });
        TriMesh::new(positions, triangles.collect())
    };
    both(tube(0), tube(1))
}

#[test]
fn a_tangled_start_that_contours_cannot_untangle_restarts_from_the_placement() {
    let apart = |layer: usize| [0.05, 0.06][layer];
    let mesh = tubes(|layer, j, i| if (layer, j, i) == (1, 9, 5) { 0.047 } else { apart(layer) });
    // From row 5 down the inner tube is outside. Moving the intersection contour up or down does not shorten it.
    let start = tubes(|layer, j, _| if layer == 0 && j >= 5 { 0.07 } else { apart(layer) }).positions;
    let held: Vec<u32> = (0..24).chain(13 * 24..14 * 24).collect();
    let (placed, began) = (crossings(&mesh, &mesh.positions), crossings(&mesh, &start));
    assert!(placed > 0 && began > 5 * placed, "{placed} as placed, {began} at the start");
    let end = rests(&mesh, &held, None, start);
    // Measured: 3 steps; 52 if the contour has to slide off the lower edge.
    assert!(end.steps <= 10, "{} steps", end.steps);
}
