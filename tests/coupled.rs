//! The coupled PART solve: what a coarse cloth must do whatever its figures.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use glam::{DVec2, DVec3};
use partwise::distance::Body;
use partwise::fabric::Fabric;
use partwise::mechanics::coupled::{
    CoarseMesh, CoupledError, CoupledOptions, Garment, blend, coarse_rest, push_out, smooth_translations, solve,
};
use partwise::mesh::{RestShape, Topology, TriMesh};
use partwise::parts::{Parts, segment};
use partwise::range_table::RangeTable;

/// An upright sheet of `columns` × `rows` squares of `h` metres in the plane y = 0, its top edge at z = 0.
fn sheet(columns: u32, rows: u32, h: f64) -> TriMesh {
    let at = |i: u32, j: u32| DVec3::new(f64::from(i) * h, 0.0, -f64::from(j) * h);
    let positions = (0..=rows).flat_map(|j| (0..=columns).map(move |i| at(i, j))).collect();
    let v = |i: u32, j: u32| j * (columns + 1) + i;
    let squares = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let triangles = squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [v(i, j), v(i + 1, j), v(i, j + 1), v(i + 1, j + 1)];
            if (i + j) % 2 == 0 { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] }
        })
        .collect();
    TriMesh::new(positions, triangles)
}

/// A cube of half edge `r` about `centre`.
fn cube(centre: DVec3, r: f64) -> Body {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { r } else { -r };
        centre + DVec3::new(side(0), side(1), side(2))
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Body::new(&TriMesh::new((0..8).map(corner).collect(), triangles)).unwrap()
}

fn far_away() -> Body {
    cube(DVec3::splat(50.0), 1.0)
}

fn fabric(stiffness: f64) -> Fabric {
    Fabric {
        name: "test".into(),
        source: "round figures".into(),
        density_kg_per_m2: 0.2,
        thickness_m: 0.001,
        stretch_weft_n_per_m: stiffness,
        stretch_warp_n_per_m: stiffness,
        shear_n_per_m: 0.4 * stiffness,
        poisson: 0.0,
        bending_nm: [2e-5; 3],
        friction: 0.3,
    }
}

/// One level cut to `extent` metres.
fn pieces(mesh: &TriMesh, topology: &Topology, extent: f64) -> Parts {
    let table = RangeTable::from_bounds("one", &[0.0, f64::INFINITY]).unwrap();
    segment(topology, &vec![0.1; mesh.vertex_count()], &table).cut_to_extent(mesh, topology, extent)
}

fn single(extent: f64) -> CoupledOptions {
    CoupledOptions { extents_m: vec![extent], tolerance: 1e-6, least_move_m: 0.0, max_steps: 200, ..Default::default() }
}

#[test]
fn the_coarse_cloth_of_a_sheet_is_a_sheet() {
    let mesh = sheet(30, 20, 0.01);
    let topology = Topology::new(&mesh);
    let parts = pieces(&mesh, &topology, 0.06);
    let coarse = CoarseMesh::new(&mesh, &topology, &parts, &vec![false; mesh.vertex_count()]);
    let nodes = TriMesh::new(coarse.nodes_of(&mesh.positions), coarse.triangles.clone());
    let coarse_topology = Topology::new(&nodes);
    assert!(coarse.loose.is_empty());
    assert!(coarse_topology.edge_valence.iter().all(|&v| v <= 2));
    assert_eq!(coarse_topology.boundary_loops().len(), 1);
    // A disk: V − E + F = 1.
    let euler = nodes.vertex_count() as i64 - coarse_topology.edges.len() as i64 + nodes.triangles.len() as i64;
    assert_eq!(euler, 1);
    // Every PART that reaches the edge has its node there, so the coarse cloth is as wide as the sheet.
    let on_edge = topology.boundary_vertices();
    for (part, &node) in parts.parts.iter().zip(&coarse.node_vertex) {
        assert!(part.vertices.contains(&node));
        assert_eq!(part.vertices.iter().any(|&v| on_edge[v as usize]), on_edge[node as usize]);
    }
}

#[test]
fn coarse_rest_lengths_are_those_of_the_pattern() {
    let mesh = sheet(30, 20, 0.01);
    let topology = Topology::new(&mesh);
    let parts = pieces(&mesh, &topology, 0.06);
    let coarse = CoarseMesh::new(&mesh, &topology, &parts, &vec![false; mesh.vertex_count()]);
    let own = RestShape::from_edges(&mesh).unwrap();
    // A pattern 30 % wider and 10 % longer than placed, as a gathered hem is.
    let stretched =
        RestShape { corners: own.corners.iter().map(|c| c.map(|p| DVec2::new(1.3 * p.x, 1.1 * p.y))).collect() };
    let rest = coarse_rest(&mesh, &topology, &stretched, &parts, &coarse);
    for (&triangle, flat) in coarse.triangles.iter().zip(&rest.corners) {
        let placed = triangle.map(|p| mesh.positions[coarse.node_vertex[p as usize] as usize]);
        let height = (placed[1] - placed[0]).cross(placed[2] - placed[0]).length();
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let d = placed[j] - placed[i];
            let expected = (1.3 * d.x).hypot(1.1 * d.z);
            let found = flat[j] - flat[i];
            // Slivers are fattened by design; the rest is exact, grain included.
            if height > 0.2 * d.length_squared() {
                assert!((found.length() - expected).abs() < 1e-9, "{} against {expected}", found.length());
            }
        }
    }
}

#[test]
fn a_hanging_sheet_stretches_as_its_closed_form_says() {
    let (length, k) = (0.6, 60.0);
    let mesh = sheet(20, 60, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(k), far_away());
    let held: Vec<u32> = (0..=20).collect();
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &held };
    let parts = pieces(&mesh, &topology, 10.0);
    let result = solve(&garment, &body, &parts, &mesh.positions, &single(0.05)).unwrap();
    assert!(result.residual_over_weight() < 1e-6, "{:?}", result.warnings);
    let hem: Vec<f64> = (0..=20).map(|i| result.positions[60 * 21 + i].z).collect();
    let lower = -hem.iter().sum::<f64>() / hem.len() as f64 - length;
    // ρ g L² / 2k: 5.88 mm. Nodes at the edge lump half a PART too much there: 10 %.
    let expected = cloth.density_kg_per_m2 * partwise::GRAVITY * length * length / (2.0 * k);
    assert!((lower / expected - 1.0).abs() < 0.1, "{lower} against {expected}");
    for &v in &held {
        assert_eq!(result.positions[v as usize], mesh.positions[v as usize]);
    }
}

#[test]
fn a_strap_one_part_wide_holds() {
    // Four centimetres wide, cut to twelve: a chain of PARTs of which no three meet.
    let (length, k) = (0.4, 60.0);
    let mesh = sheet(4, 40, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(k), far_away());
    let held: Vec<u32> = (0..=4).collect();
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &held };
    let parts = pieces(&mesh, &topology, 10.0);
    let chain = parts.cut_to_extent(&mesh, &topology, 0.12);
    let coarse = CoarseMesh::new(&mesh, &topology, &chain, &vec![false; mesh.vertex_count()]);
    assert!(coarse.triangles.is_empty() && chain.len() > 2, "{} PARTs are no chain", chain.len());
    let result = solve(&garment, &body, &parts, &mesh.positions, &single(0.12)).unwrap();
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    let lower = -result.positions.last().unwrap().z - length;
    // ρ g L² / 2k: 2.6 mm, and no more than the lumping of some PARTs of 3 cm off.
    let expected = cloth.density_kg_per_m2 * partwise::GRAVITY * length * length / (2.0 * k);
    assert!((lower / expected - 1.0).abs() < 0.2, "{lower} against {expected}");
}

#[test]
fn forces_balance_at_every_free_node() {
    let mesh = sheet(20, 30, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(60.0), far_away());
    let held: Vec<u32> = (0..=20).collect();
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &held };
    let result = solve(&garment, &body, &pieces(&mesh, &topology, 10.0), &mesh.positions, &single(0.05)).unwrap();
    let weight = 0.2 * 0.3 * 0.2 * partwise::GRAVITY;
    let total: DVec3 = result.part_results.iter().map(|p| p.gravity).sum();
    assert!((total + DVec3::Z * weight).length() < 1e-9 * weight);
    for part in &result.part_results {
        assert!(!part.in_contact && part.resultant == 0.0);
        if !part.held {
            assert!((part.gravity + part.reaction + part.pull).length() < 1e-5 * weight);
        }
    }
    assert!(result.part_results.iter().any(|p| p.held));
}

#[test]
fn a_sheet_that_falls_on_a_block_rests_on_it() {
    // Laid flat 3 cm above a block, nothing held.
    let upright = sheet(24, 24, 0.01);
    let flat = upright.positions.iter().map(|p| DVec3::new(p.x - 0.12, -p.z - 0.12, 0.03)).collect();
    let mesh = upright.with_positions(flat);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(60.0), cube(DVec3::new(0.0, 0.0, -0.1), 0.1));
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &[] };
    let parts = pieces(&mesh, &topology, 10.0);
    // Nearer to rest than a preview, so that the reaction is the weight.
    let extents_m = vec![0.06, 0.03];
    let options = CoupledOptions { extents_m, tolerance: 1e-2, least_move_m: 1e-3, ..Default::default() };
    let result = solve(&garment, &body, &parts, &mesh.positions, &options).unwrap();
    assert_eq!(result.stages.len(), 2);
    assert!(result.stages[1].part_count > result.stages[0].part_count);
    assert!(body.nearest_all(&result.positions).iter().all(|p| p.signed_distance > 0.0));
    let weight = 0.24 * 0.24 * 0.2 * partwise::GRAVITY;
    let carried: f64 = result.part_results.iter().map(|p| p.reaction.z).sum();
    assert!((carried / weight - 1.0).abs() < 0.02, "{carried} of {weight} N");
    // The middle lies on the block, the corners hang over its edge.
    assert!(result.positions[12 * 25 + 12].z < 0.004);
    assert!([0, 24, 24 * 25, 24 * 25 + 24].iter().all(|&v: &usize| result.positions[v].z < -0.002));
}

#[test]
fn the_same_bits_twice_and_on_one_thread() {
    let mesh = sheet(20, 20, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(60.0), cube(DVec3::new(0.1, 0.12, -0.1), 0.1));
    let held: Vec<u32> = vec![0, 20];
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &held };
    let parts = pieces(&mesh, &topology, 10.0);
    let options = CoupledOptions { extents_m: vec![0.05], ..Default::default() };
    let run = || solve(&garment, &body, &parts, &mesh.positions, &options).unwrap().positions;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
    let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap().install(run);
    assert!(one == two && one == run());
}

#[test]
fn the_blend_keeps_a_rotation_where_translations_tear_it() {
    let mesh = sheet(24, 24, 0.01);
    let topology = Topology::new(&mesh);
    let parts = pieces(&mesh, &topology, 0.08);
    let coarse = CoarseMesh::new(&mesh, &topology, &parts, &vec![false; mesh.vertex_count()]);
    let turn = |x: DVec3| DVec3::new(x.x - 0.2 * x.z, 0.1 * x.x, x.z + 0.2 * x.x) - x;
    let at_nodes: Vec<DVec3> = coarse.nodes_of(&mesh.positions).into_iter().map(turn).collect();
    let worst = |u: Vec<DVec3>| u.iter().zip(&mesh.positions).map(|(u, &x)| u.distance(turn(x))).fold(0.0, f64::max);
    let affine = worst(blend(&topology, &parts, &coarse, &mesh.positions, &at_nodes, 4));
    let translations = worst(smooth_translations(&topology, &parts, &at_nodes));
    // The Tikhonov term costs two per cent of the linear part.
    assert!(affine < 5e-4 && translations > 5.0 * affine, "{affine} against {translations}");
    let shift = vec![DVec3::new(0.1, -0.2, 0.3); parts.len()];
    let moved = blend(&topology, &parts, &coarse, &mesh.positions, &shift, 5);
    assert!(moved.iter().all(|u| u.distance(shift[0]) < 1e-14));
}

#[test]
fn the_push_out_leaves_held_vertices_and_nothing_inside() {
    let body = cube(DVec3::ZERO, 0.1);
    let inside = vec![DVec3::new(0.09, 0.01, 0.0), DVec3::new(0.02, -0.08, 0.01), DVec3::new(0.2, 0.0, 0.0)];
    let mut x = inside.clone();
    assert_eq!(push_out(&body, &[false, true, false], 0.001, &mut x), 1);
    assert!((x[0] - DVec3::new(0.101, 0.01, 0.0)).length() < 1e-12);
    assert_eq!(x[1..], inside[1..]);
}

#[test]
fn what_cannot_be_solved_says_why() {
    let mesh = sheet(8, 8, 0.01);
    let topology = Topology::new(&mesh);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let (cloth, body) = (fabric(60.0), far_away());
    let garment = Garment { mesh: &mesh, topology: &topology, rest: &rest, fabric: &cloth, held: &[0] };
    let parts = pieces(&mesh, &topology, 10.0);
    let run = |extents: &[f64], start: &[DVec3]| {
        let options = CoupledOptions { extents_m: extents.to_vec(), ..Default::default() };
        solve(&garment, &body, &parts, start, &options).unwrap_err()
    };
    assert!(matches!(run(&[-0.1], &mesh.positions), CoupledError::Extent(e) if e == -0.1));
    assert!(matches!(run(&[0.05], &mesh.positions[1..]), CoupledError::Count { found: 80, expected: 81, .. }));
    // A whole sheet as one PART is no cloth.
    assert!(matches!(run(&[], &mesh.positions), CoupledError::NoCloth { parts: 1 }));
}
