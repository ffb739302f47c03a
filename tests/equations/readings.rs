//! The literal readings, failing as they must, and the same bits on any number of threads.

use super::*;

/// A cylinder of cloth (12 sides) around a box, wider at the bottom.
fn ring() -> Case {
    let corner = |i: usize, j: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / 12.0).sin_cos();
        let radius = 0.25 + 0.05 * j as f64;
        DVec3::new(radius * cos, radius * sin, -0.1 * j as f64)
    };
    let positions = (0..4).flat_map(|j| (0..12).map(move |i| corner(i, j))).collect();
    let at = |i: usize, j: usize| (j * 12 + i % 12) as u32;
    let quad =
        |i: usize, j: usize| [[at(i, j), at(i, j + 1), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i + 1, j)]];
    let triangles = (0..3).flat_map(|j| (0..12).flat_map(move |i| quad(i, j))).collect();
    let body = block(DVec3::new(0.1, 0.1, 1.0), DQuat::IDENTITY, DVec3::ZERO);
    Case::new(TriMesh::new(positions, triangles), &body, &ONE_LEVEL)
}

#[test]
fn signed_cosines_of_a_closed_ring_cancel() {
    let case = ring();
    let touching = PaperOptions { contact_distance_m: 0.2, ..given(700.0, 3e9) };
    let absolute = case.solve(&touching).parts[0];
    let signed = case.solve(&PaperOptions { cosine: Cosine::Signed, degenerate_below: 1e-300, ..touching }).parts[0];
    for axis in 0..2 {
        assert!(signed.stiffness[axis].abs() < 0.1 * absolute.stiffness[axis], "{signed:?}");
    }
    assert_eq!(absolute.degenerate, [false; 3]);
    // A regular ring cancels to rounding, which the default threshold reports as an axis without stiffness.
    let reported = case.solve(&PaperOptions { cosine: Cosine::Signed, ..touching });
    assert_eq!(reported.parts[0].degenerate, [true, true, false]);
    assert_eq!(reported.degenerate_parts, 1);
}

#[test]
fn signed_cosines_of_an_uneven_ring_explode() {
    // One corner pulled out: the sums cancel to a few per cent instead of nothing, and D grows by as much.
    let mut case = ring();
    case.garment.positions[24].x += 0.02;
    case.surface = case.body.nearest_all(&case.garment.positions);
    // The default threshold would catch this one, a ring with seams and a bust need not be so even.
    let touching = PaperOptions { contact_distance_m: 0.2, degenerate_below: 1e-3, ..given(700.0, 3e9) };
    let absolute = case.solve(&touching).parts[0];
    let signed = case.solve(&PaperOptions { cosine: Cosine::Signed, ..touching }).parts[0];
    assert!(!signed.degenerate[0]);
    assert!(signed.displacement.x.abs() > 10.0 * absolute.displacement.x.abs(), "{signed:?} {absolute:?}");
}

#[test]
fn the_cuboid_of_cloth_along_an_axis_is_empty() {
    let flat =
        Case::new(patch(DVec3::new(0.0, 0.0, 0.004), DVec3::X * SIDE, DVec3::Y * SIDE, 3, 3), &floor(), &ONE_LEVEL);
    let cuboid = |case: &Case| case.solve(&PaperOptions { volume: Volume::Cuboid, ..given(700.0, 3e9) });
    let found = cuboid(&flat);
    assert_eq!(found.weight_n, 0.0);
    close3(found.parts[0].displacement, [0.0; 3]);
    assert_eq!(found.parts[0].degenerate, [true; 3]);
    // One triangle with every edge askew has a cuboid, worked by hand: mean |Δ| to the two neighbours.
    let triangle = TriMesh::new(
        vec![DVec3::new(0.0, 0.0, 0.01), DVec3::new(0.04, 0.01, 0.02), DVec3::new(0.01, 0.05, 0.04)],
        vec![[0, 1, 2]],
    );
    let found = cuboid(&Case::new(triangle, &floor(), &ONE_LEVEL));
    let volumes = [0.025 * 0.03 * 0.02, 0.035 * 0.025 * 0.015, 0.02 * 0.045 * 0.025];
    close(found.weight_n, GRAVITY * DENSITY / THICKNESS * volumes.iter().sum::<f64>());
}

#[test]
fn cloth_on_the_skin_has_no_stiffness_if_q_is_taken_literally() {
    // Lying on a face tilted by 45°, q = 0 throughout.
    let turn = DQuat::from_rotation_y(45f64.to_radians());
    let body = block(DVec3::splat(0.5), turn, DVec3::ZERO);
    let garment = patch(turn * DVec3::new(0.0, 0.0, 0.5), turn * DVec3::X * SIDE, turn * DVec3::Y * SIDE, 2, 2);
    let mut case = Case::new(garment, &body, &ONE_LEVEL);
    case.surface.iter_mut().for_each(|s| s.signed_distance = 0.0);
    let literal = case.solve(&PaperOptions { clearance: Clearance::Literal, ..given(700.0, 3e9) });
    assert_eq!(literal.parts[0].degenerate, [true; 3]);
    close3(literal.parts[0].displacement, [0.0; 3]);
    let default = case.solve(&given(700.0, 3e9));
    close(default.parts[0].stiffness.z, 3e9 * 45f64.to_radians().cos() * THICKNESS * SIDE * SIDE * THICKNESS);
}

#[test]
fn threads_do_not_change_the_bits() {
    let case = ring();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let parts = case.parts.cut_to_extent(&case.garment, &case.topology, 0.1);
            let found = solve(
                &case.garment,
                &case.topology,
                &case.body,
                &case.surface,
                &parts,
                &cloth(),
                &PaperOptions { contact_distance_m: 0.2, ..Default::default() },
            );
            format!("{:?}", found.unwrap())
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(2));
}
