//! Decimated garments: properties they preserve, and prolongation to the full mesh.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use glam::{DMat3, DQuat, DVec3};
use partwise::drape::unobserved;
use partwise::mechanics::refine::Stop;
use partwise::mesh::coarse::Coarse;
use partwise::mesh::{RestShape, Topology, TriMesh};
use partwise::parts::range_table::TableRule;
use partwise::study::job::{Against, Job};

/// An open tube of this radius and height, m, its rows shifted against each other.
fn tube(radius: f64, height: f64, around: usize, rows: usize) -> TriMesh {
    let point = |row: usize, i: usize| {
        let angle = TAU * (i as f64 + 0.5 * (row % 2) as f64) / around as f64;
        DVec3::new(radius * angle.cos(), radius * angle.sin(), height * row as f64 / (rows - 1) as f64)
    };
    let positions = (0..rows).flat_map(|row| (0..around).map(move |i| point(row, i))).collect();
    let mut triangles = Vec::new();
    for row in 0..rows - 1 {
        let at = |row: usize, i: usize| (row * around + i % around) as u32;
        for i in 0..around {
            // The upper row runs half an edge ahead of an even one.
            let lead = row % 2;
            let (a, b) = (at(row, i), at(row, i + 1));
            let (c, d) = (at(row + 1, i + lead), at(row + 1, i + lead + around - 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriMesh::new(positions, triangles)
}

fn coarse(mesh: &TriMesh) -> Coarse {
    Coarse::new(mesh, &RestShape::from_edges(mesh).unwrap(), mesh.vertex_count() / 4).unwrap()
}

#[test]
fn each_coarse_triangle_has_the_fabric_of_most_of_its_area() {
    let mesh = tube(0.3, 0.6, 64, 30);
    let low = |t: &[u32; 3]| t.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() < 3.0 * 0.25;
    let cut_from: Vec<u16> = mesh.triangles.iter().map(|t| u16::from(low(t))).collect();
    let rest = RestShape { cut_from, ..RestShape::from_edges(&mesh).unwrap() };
    let coarse = Coarse::new(&mesh, &rest, mesh.vertex_count() / 4).unwrap();
    let share = |rest: &RestShape| {
        let areas = rest.areas();
        let of_second = (0..areas.len()).filter(|&t| rest.fabric_of(t) == 1).map(|t| areas[t]).sum::<f64>();
        of_second / areas.iter().sum::<f64>()
    };
    let [fine, coarse_share] = [share(&rest), share(&coarse.rest)];
    assert!((fine - coarse_share).abs() < 0.03, "{fine} of the cloth, {coarse_share} of the coarse one");
    for (t, triangle) in coarse.mesh.triangles.iter().enumerate() {
        let z = triangle.map(|v| coarse.mesh.positions[v as usize].z);
        // Away from the seam there is no doubt.
        if z.iter().all(|z| *z < 0.2) || z.iter().all(|z| *z > 0.3) {
            assert_eq!(coarse.rest.fabric_of(t), usize::from(z[0] < 0.25), "triangle {t} at {z:?}");
        }
    }
}

#[test]
fn it_has_a_quarter_of_the_vertices_the_same_edges_of_cloth_and_no_slivers() {
    let mesh = tube(0.2, 0.6, 60, 33);
    let coarse = coarse(&mesh);
    let count = coarse.mesh.vertex_count();
    // A regular grid leaves edges that are all as long: some may not go.
    assert!((490..=600).contains(&count), "{count} vertices of {}", mesh.vertex_count());
    assert_eq!(coarse.topology.boundary_loops().len(), Topology::new(&mesh).boundary_loops().len());
    assert!(coarse.topology.edge_valence.iter().all(|v| *v <= 2));
    for t in 0..coarse.mesh.triangles.len() {
        let [a, b, c] = coarse.mesh.corners(t);
        let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        let shape = 2.0 * 3f64.sqrt() * coarse.mesh.double_area_vector(t).length() / squares;
        assert!(shape > 0.3, "triangle {t} is a sliver: {shape} of an equilateral one");
    }
    let (old, new) = (mesh.triangle_areas(), coarse.rest.areas());
    let ratio = new.iter().sum::<f64>() / old.iter().sum::<f64>();
    assert!((0.98..=1.0).contains(&ratio), "{ratio} of the cloth");
}

#[test]
fn a_mesh_so_full_of_holes_that_nothing_can_go_is_left_and_drapes() {
    let mut mesh = tube(0.32, 0.6, 60, 33);
    let mut t = 0;
    mesh.triangles.retain(|_| {
        t += 1;
        t % 4 != 0
    });
    let rest = RestShape::from_edges(&mesh).unwrap();
    assert!(Coarse::new(&mesh, &rest, mesh.vertex_count() / 4).is_none());
    // Decimation ends: a step that does not reduce the mesh returns `None`, so that the sequence of coarser garments is finite.
    let job = Job::preview();
    let body = tube(0.3, 0.6, 60, 33);
    let mut closed = body.clone();
    let (low, high) = (closed.positions.len() as u32, closed.positions.len() as u32 + 1);
    closed.positions.extend([DVec3::ZERO, DVec3::Z * 0.6]);
    let top = 32 * 60;
    for (i, next) in (0..60).map(|i| (i, (i + 1) % 60)) {
        closed.triangles.extend([[low, next, i], [high, top + i, top + next]]);
    }
    let scene = partwise::Scene::of_meshes(&closed, mesh).unwrap();
    let found = job.drape(&scene, &mut unobserved).unwrap();
    assert!(found.positions.iter().all(|p| p.is_finite()));
}

#[test]
fn its_rest_shape_is_that_of_the_cloth_about_it() {
    // Cut wider than it stands by a tenth, and shorter by a twentieth.
    let mesh = tube(0.2, 0.6, 60, 33);
    let mut rest = RestShape::from_edges(&mesh).unwrap();
    for p in rest.corners.iter_mut().flatten() {
        *p = glam::DVec2::new(1.1 * p.x, 0.95 * p.y);
    }
    let coarse = Coarse::new(&mesh, &rest, mesh.vertex_count() / 4).unwrap();
    let as_it_stands = RestShape::from_edges(&coarse.mesh).unwrap();
    for (t, (rest, stands)) in coarse.rest.corners.iter().zip(&as_it_stands.corners).enumerate() {
        for i in 0..3 {
            let (rest, stands) = (rest[(i + 1) % 3] - rest[i], stands[(i + 1) % 3] - stands[i]);
            let expected = glam::DVec2::new(1.1 * stands.x, 0.95 * stands.y);
            // Up and down are one direction of the warp.
            let off = rest.distance(expected).min(rest.distance(-expected));
            assert!(off < 0.01 * expected.length(), "triangle {t}: {rest}, expected {expected}");
        }
    }
}

#[test]
fn the_full_garment_follows_any_affine_map_exactly() {
    let mesh = tube(0.2, 0.6, 60, 33);
    let coarse = coarse(&mesh);
    let turn = DMat3::from_quat(DQuat::from_rotation_y(0.7) * DQuat::from_rotation_z(2.0));
    let moved = |x: DVec3| turn * x + DVec3::new(0.3, -0.2, 1.0);
    let to: Vec<DVec3> = coarse.mesh.positions.iter().map(|x| moved(*x)).collect();
    let followed = coarse.prolong(&mesh.positions, &to);
    let off = mesh.positions.iter().zip(&followed).map(|(x, y)| moved(*x).distance(*y)).fold(0.0, f64::max);
    assert!(off < 1e-12, "off by {off} m");
}

#[test]
fn it_bends_between_coarse_vertices_and_is_not_creased_along_their_edges() {
    // A tube flattened to an ellipse: chords alone would be off by their sag, s²/8R: 3 mm for edges of 7 cm.
    let mesh = tube(0.2, 0.6, 60, 33);
    let coarse = coarse(&mesh);
    let moved = |x: DVec3| {
        let angle = x.y.atan2(x.x);
        let radius = 0.2 + 0.02 * (2.0 * angle).cos();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), x.z)
    };
    let to: Vec<DVec3> = coarse.mesh.positions.iter().map(|x| moved(*x)).collect();
    let followed = coarse.prolong(&mesh.positions, &to);
    // At a hem the neighbours are on one side.
    let inner = mesh.positions.iter().zip(&followed).filter(|(x, _)| (0.1..0.5).contains(&x.z));
    let off = inner.map(|(x, y)| moved(*x).distance(*y)).fold(0.0, f64::max);
    assert!(off < 1e-3, "off by {off} m");
}

#[test]
fn a_mesh_that_is_non_manifold_or_far_from_its_rest_shape_has_no_coarse_mesh() {
    let mesh = tube(0.2, 0.6, 60, 33);
    let mut rest = RestShape::from_edges(&mesh).unwrap();
    rest.corners[7] = rest.corners[7].map(|p| 0.2 * p);
    assert!(Coarse::new(&mesh, &rest, 400).is_some(), "the point of a dart");
    for row in 0..32 {
        rest.corners[120 * row + 7] = rest.corners[120 * row + 9].map(|p| 0.2 * p);
    }
    assert!(Coarse::new(&mesh, &rest, 400).is_none(), "a seam that stands open");
    let mut three = mesh.clone();
    three.triangles.push([0, 1, 300]);
    let rest = RestShape::from_edges(&three).unwrap();
    assert!(Coarse::new(&three, &rest, 400).is_none(), "three triangles at an edge");
}

#[test]
fn a_preview_that_starts_on_the_coarse_mesh_hangs_by_its_parts_on_any_number_of_threads() {
    // 425 vertices on the coarse cloth, for three rings.
    let mut job = Job { accuracy: Against::Own, ..Job::preview() };
    job.scene.garment = "flared-skirt@1700".to_owned();
    job.settings.table = TableRule::Quantile { name: "3 quantile levels".to_owned(), levels: 3 };
    let input = job.scene.load().unwrap();
    let drape = || job.drape(&input.scene, &mut unobserved).unwrap();
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(drape);
    let (one, two) = (on(1), on(2));
    assert_eq!(one.positions, two.positions);
    assert!(one.parts.len() <= 10 && one.warnings.is_empty(), "{} PARTs, {:?}", one.parts.len(), one.warnings);
    let metrics = job.measure(&input.scene, &one, None, &mut unobserved).unwrap().metrics;
    let (error, bound) = (metrics.rms_mm.unwrap(), metrics.own_affine_rms_mm.unwrap());
    assert!(metrics.penetrating_vertices == 0 && error <= 1.5 * bound + 3.0, "{error} mm, the bound is {bound} mm");
}

#[test]
fn a_large_garment_rests_on_the_coarse_mesh_first_on_any_number_of_threads_and_can_be_stopped_there() {
    let job = Job { scene: partwise::SceneSpec::new("form", "flared-skirt@6000"), ..Job::default() };
    let scene = job.scene.load().unwrap().scene;
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut iterations = Vec::new();
        let draped = pool.install(|| {
            job.drape(&scene, &mut |step| {
                iterations.push(step.iteration);
                ControlFlow::Continue(())
            })
        });
        (draped.unwrap(), iterations)
    };
    let ((one, iterations), (two, _)) = (on(1), on(2));
    assert_eq!(one.positions, two.positions);
    let state = one.state.as_ref().unwrap();
    assert!(state.stop == Stop::Converged && one.self_intersecting_pairs == 0 && one.penetrating_vertices == 0);
    // Steps on the coarse mesh are reported as step 0: its start, at most twenty steps, its rest, and the start of the full mesh.
    let before = iterations.iter().filter(|iteration| **iteration == 0).count();
    assert!((4..=23).contains(&before) && state.steps <= 12, "{before} before, then {}", state.steps);

    let mut seen = 0;
    let stopped = job.drape(&scene, &mut |step| {
        assert_eq!(step.positions.len(), scene.garment.vertex_count());
        seen += 1;
        if seen > 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let stopped = stopped.unwrap();
    assert_eq!(stopped.state.unwrap().stop, Stop::Interrupted);
    assert_eq!(stopped.preview, one.preview);
    assert_eq!(seen, 4, "once more where the full garment begins");
}
