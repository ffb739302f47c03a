//! The coupled PART solve: properties that hold for every table.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod fixtures;

use fixtures::{Diagonals, cube, far_away, flipped, grid, isotropic, tube};
use glam::DVec3;
use partwise::GRAVITY;
use partwise::body::distance::Body;
use partwise::garment::fabric::Fabric;
use partwise::mechanics::coupled::{
    CoupledError, CoupledOptions, CoupledResult, Garment, Motion, Motions, Weights, push_out, solve,
};
use partwise::mechanics::energy::Cloth;
use partwise::mesh::{RestShape, Topology, TriMesh};
use partwise::parts::range_table::RangeTable;
use partwise::parts::{Parts, segment};

/// An upright sheet of `columns` × `rows` squares of `h` metres in the plane y = 0, its top edge at z = 0.
fn sheet(columns: u32, rows: u32, h: f64) -> TriMesh {
    flipped(grid(columns, rows, Diagonals::Alternating, |i, j| DVec3::new(f64::from(i) * h, 0.0, -f64::from(j) * h)))
}

fn fabric(stiffness: f64) -> Fabric {
    Fabric { shear_n_per_m: 0.4 * stiffness, ..isotropic(0.2, stiffness, 0.0, 2e-5) }
}

/// PARTs by bounds of some distance (m), as stage one makes them.
fn levels(topology: &Topology, distance: &[f64], bounds_cm: &[f64]) -> Parts {
    segment(topology, distance, &RangeTable::from_bounds("levels", bounds_cm).unwrap())
}

/// One level cut to `extent` metres.
fn pieces(mesh: &TriMesh, topology: &Topology, extent: f64) -> Parts {
    levels(topology, &vec![0.1; mesh.vertex_count()], &[0.0, f64::INFINITY]).cut_to_extent(mesh, topology, extent)
}

/// Iterations until nothing moves any more.
fn converged() -> CoupledOptions {
    CoupledOptions { max_iterations: 3000, least_change_m: 1e-9, ..Default::default() }
}

/// Solves from the mesh's own positions, which are its rest shape too.
fn settle(
    mesh: &TriMesh,
    body: &Body,
    fabric: &Fabric,
    held: &[u32],
    parts: impl Fn(&Topology) -> Parts,
    options: &CoupledOptions,
) -> Result<CoupledResult, CoupledError> {
    let topology = Topology::new(mesh);
    let rest = RestShape::from_edges(mesh).unwrap();
    let cloth = Cloth::new(mesh, &topology, &rest, fabric, held).unwrap();
    let garment = Garment { mesh, topology: &topology, cloth: &cloth };
    solve(&garment, body, &parts(&topology), &mesh.positions, options)
}

#[test]
fn a_hanging_strip_of_one_two_and_five_parts_stretches_by_its_closed_form() {
    let (length, k) = (0.6, 60.0);
    let mesh = sheet(10, 60, 0.01);
    let held: Vec<u32> = (0..=10).collect();
    let fabric = fabric(k);
    // ρ g L² / 2k: 5.9 mm.
    let expected = fabric.density_kg_per_m2 * GRAVITY * length * length / (2.0 * k);
    for (count, tolerance) in [(1, 0.02), (2, 0.05), (5, 0.05)] {
        let depth: Vec<f64> = mesh.positions.iter().map(|x| -x.z).collect();
        let mut bounds: Vec<f64> = (0..count).map(|i| 100.0 * length * f64::from(i) / f64::from(count)).collect();
        bounds.push(f64::INFINITY);
        let parts = |topology: &Topology| levels(topology, &depth, &bounds);
        let result = settle(&mesh, &far_away(), &fabric, &held, parts, &converged()).unwrap();
        assert_eq!(result.parts.len(), count as usize);
        let hem: f64 = result.positions[60 * 11..].iter().map(|x| -x.z).sum::<f64>() / 11.0 - length;
        assert!((hem / expected - 1.0).abs() < tolerance, "{count} PARTs: {hem} against {expected} m");
        assert!(held.iter().all(|&v| result.positions[v as usize] == mesh.positions[v as usize]));
    }
}

#[test]
fn rings_shrink_to_the_radius_that_hangs_straight_down() {
    // A cone from 20 to 32 cm, 36 cm along its side, its top held: it hangs as a cylinder of 20 cm, folds and all.
    let (around, rows, top, hem, side) = (96, 36, 0.20, 0.32, 0.36);
    let slope = f64::sqrt(side * side - (hem - top) * (hem - top)) / side;
    let at = |share: f64, angle: f64| {
        let radius = top + (hem - top) * share;
        DVec3::new(radius * angle.cos(), radius * angle.sin(), -slope * side * share)
    };
    let mesh = flipped(tube(around, rows + 1, Diagonals::Alternating, at));
    let radius = |x: &DVec3| x.x.hypot(x.y);
    let out: Vec<f64> = mesh.positions.iter().map(|x| radius(x) - top).collect();
    let held: Vec<u32> = (0..around).collect();
    let parts = |topology: &Topology| levels(topology, &out, &[0.0, 2.0, 4.0, 6.0, 8.0, 10.0, f64::INFINITY]);
    // Blended maps hold the hem out by three of its twelve centimetres.
    let tolerance = 0.2;
    for options in [CoupledOptions::default(), converged()] {
        let result = settle(&mesh, &far_away(), &fabric(60.0), &held, parts, &options).unwrap();
        assert_eq!(result.parts.len(), 6);
        let last = &result.positions[(rows * around) as usize..];
        let mean = |of: &dyn Fn(&DVec3) -> f64| last.iter().map(of).sum::<f64>() / last.len() as f64;
        assert!((mean(&radius) / top - 1.0).abs() < tolerance, "the hem hangs at {} m: {options:?}", mean(&radius));
        let drop = -mean(&|x| x.z);
        assert!((drop / side - 1.0).abs() < 0.02, "the hem hangs {drop} m down: {options:?}");
    }
}

#[test]
fn blended_maps_hold_every_rigid_and_affine_motion() {
    let mesh = sheet(24, 24, 0.01);
    let topology = Topology::new(&mesh);
    let parts = pieces(&mesh, &topology, 0.08);
    let weights = Weights::new(&topology, &mesh.positions, &parts);
    for v in 0..mesh.vertex_count() {
        let sum: f64 = weights.of(v).iter().map(|w| w.1).sum();
        assert!((sum - 1.0).abs() < 1e-12, "the weights of vertex {v} sum to {sum}");
    }
    let shear = |x: &DVec3| DVec3::new(0.1 * x.x - 0.2 * x.z, 0.1 * x.x + 0.3, 0.2 * x.x);
    let motion: Vec<DVec3> = mesh.positions.iter().map(shear).collect();
    let left = |how| {
        let fit =
            Motions::new(&parts, weights.clone(), &mesh.positions, how).nearest(&mesh.positions, &motion).unwrap();
        fit.iter().zip(&motion).map(|(f, u)| f.distance(*u)).fold(0.0, f64::max)
    };
    assert!(left(Motion::Affine) < 1e-5, "{}", left(Motion::Affine));
    // One displacement a PART tears what only turns.
    assert!(left(Motion::Translation) > 1e-3, "{}", left(Motion::Translation));
}

#[test]
fn a_falling_sheet_turns_freely() {
    // Held by two corners of its upper edge, pushed out of the vertical by its start: it swings down as a whole.
    let upright = sheet(12, 12, 0.01);
    let tilted = upright.positions.iter().map(|p| DVec3::new(p.x, -0.8 * p.z, 0.6 * p.z)).collect();
    let mesh = upright.with_positions(tilted);
    let one = |topology: &Topology| pieces(&mesh, topology, 10.0);
    let held: Vec<u32> = (0..=12).collect();
    let result = settle(&mesh, &far_away(), &fabric(4000.0), &held, one, &converged()).unwrap();
    let hem = result.positions[12 * 13 + 6];
    assert!(hem.y.abs() < 2e-3 && (hem.z + 0.12).abs() < 1e-3, "the hem hangs at {hem}");
}

#[test]
fn forces_balance_on_every_part() {
    let mesh = sheet(20, 30, 0.01);
    let held: Vec<u32> = (0..=20).collect();
    let parts = |topology: &Topology| pieces(&mesh, topology, 0.05);
    let result = settle(&mesh, &far_away(), &fabric(60.0), &held, parts, &converged()).unwrap();
    let weight = 0.2 * 0.3 * 0.2 * GRAVITY;
    let total: DVec3 = result.parts.iter().map(|p| p.gravity).sum();
    assert!((total + DVec3::Z * weight).length() < 1e-9 * weight);
    for part in result.parts.iter().filter(|p| !p.held) {
        assert!(!part.in_contact && part.resultant == 0.0);
        let left = (part.gravity + part.reaction + part.pull).length();
        assert!(left < 2e-3 * weight, "{left} of {weight} N are left");
    }
    assert!(result.residual_over_weight < 1e-3, "{}", result.residual_over_weight);
    assert!(result.parts.iter().any(|p| p.held));
}

#[test]
fn forces_balance_on_every_part_that_leans_on_a_body() {
    // A strip in three bands that hangs on a block: gravity, cloth and body in one balance.
    let mesh = sheet(10, 40, 0.01);
    let held: Vec<u32> = (0..=10).collect();
    let body = Body::new(&cube(DVec3::new(0.05, 0.101, -0.25), 0.1)).unwrap();
    let depth: Vec<f64> = mesh.positions.iter().map(|x| -x.z).collect();
    let parts = |topology: &Topology| levels(topology, &depth, &[0.0, 15.0, 28.0, f64::INFINITY]);
    let result = settle(&mesh, &body, &fabric(60.0), &held, parts, &converged()).unwrap();
    let weight = 0.1 * 0.4 * 0.2 * GRAVITY;
    let total: DVec3 = result.parts.iter().map(|p| p.gravity).sum();
    assert!((total + DVec3::Z * weight).length() < 1e-9 * weight);
    assert!(result.residual_over_weight < 1e-3, "{}", result.residual_over_weight);
    for part in result.parts.iter().filter(|p| !p.held) {
        let left = (part.gravity + part.reaction + part.pull).length();
        assert!(left < 2e-3 * weight, "{left} of {weight} N are left");
    }
    assert!(body.nearest_all(&result.positions).iter().all(|p| p.signed_distance > 0.0));
}

#[test]
fn vertices_in_no_level_go_with_the_nearest_part() {
    let mesh = sheet(10, 30, 0.01);
    let depth: Vec<f64> = mesh.positions.iter().map(|x| -x.z).collect();
    let held: Vec<u32> = (0..=10).collect();
    // The lowest third is in no level.
    let parts = |topology: &Topology| levels(topology, &depth, &[0.0, 10.0, 20.0]);
    assert!(parts(&Topology::new(&mesh)).unassigned > 100);
    let result = settle(&mesh, &far_away(), &fabric(60.0), &held, parts, &converged()).unwrap();
    let expected = 0.2 * GRAVITY * 0.3 * 0.3 / 120.0;
    let lower = -result.positions.last().unwrap().z - 0.3;
    assert!((lower / expected - 1.0).abs() < 0.1, "{lower} against {expected} m");
}

#[test]
fn the_same_bits_twice_and_on_one_thread() {
    let mesh = sheet(20, 20, 0.01);
    let body = Body::new(&cube(DVec3::new(0.1, 0.12, -0.1), 0.1)).unwrap();
    let parts = |topology: &Topology| pieces(&mesh, topology, 0.05);
    let options = CoupledOptions::default();
    let run = || settle(&mesh, &body, &fabric(60.0), &[0, 20], parts, &options).unwrap().positions;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
    let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap().install(run);
    assert!(one == two && one == run());
}

#[test]
fn the_push_out_leaves_held_vertices_and_nothing_inside() {
    let body = Body::new(&cube(DVec3::ZERO, 0.1)).unwrap();
    let inside = vec![DVec3::new(0.09, 0.01, 0.0), DVec3::new(0.02, -0.08, 0.01), DVec3::new(0.2, 0.0, 0.0)];
    let mut x = inside.clone();
    assert_eq!(push_out(&body, &[false, true, false], &[0.001; 3], &mut x), 1);
    assert!((x[0] - DVec3::new(0.101, 0.01, 0.0)).length() < 1e-12);
    assert_eq!(x[1..], inside[1..]);
}

#[test]
fn unsolvable_inputs_are_refused_with_the_cause() {
    let mesh = sheet(8, 8, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let fabric = fabric(60.0);
    let cloth = Cloth::new(&mesh, &topology, &rest, &fabric, &[0]).unwrap();
    let garment = Garment { mesh: &mesh, topology: &topology, cloth: &cloth };
    let options = CoupledOptions::default();
    let short = solve(&garment, &far_away(), &pieces(&mesh, &topology, 1.0), &mesh.positions[1..], &options);
    assert!(matches!(short.unwrap_err(), CoupledError::Count { found: 80, expected: 81, .. }));
    let nowhere = levels(&topology, &[0.5; 81], &[0.0, 10.0]);
    let none = solve(&garment, &far_away(), &nowhere, &mesh.positions, &options);
    assert!(matches!(none.unwrap_err(), CoupledError::NoParts));
}
