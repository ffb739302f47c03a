//! Meshes that nobody would draw so: seams of slivers, torn patterns, bodies through themselves.

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};
use partwise::drape::{Refine, Scene, drape, unobserved};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mesh::export::write_mesh;
use partwise::mesh::{Axis, RestShape, Topology, TriMesh, Unit};
use partwise::{SceneSpec, Settings};

use super::{cone, draped, sphere, turned};

#[test]
fn a_seam_of_slivers_bears_like_cloth_and_opens_by_no_more_than_a_fiftieth() {
    // A strip of 10 by 20 cm hanging from its top, cut across its middle by a row of triangles a tenth of a millimetre high.
    let (columns, side) = (10_u32, 0.01);
    let seam = 1e-4;
    let rows: Vec<f64> =
        (0..=10).map(|j| f64::from(j) * side).chain((10..=20).map(|j| f64::from(j) * side + seam)).collect();
    let strip = |rows: &[f64]| {
        let mut mesh = TriMesh::default();
        for z in rows {
            mesh.positions.extend((0..=columns).map(|i| DVec3::new(f64::from(i) * side, 0.0, -z)));
        }
        let n = columns + 1;
        for (j, i) in (0..rows.len() as u32 - 1).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let a = j * n + i;
            mesh.triangles.extend([[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]);
        }
        mesh
    };
    let body = sphere();
    let hung = |mesh: TriMesh| {
        let lifted = mesh.positions.iter().map(|p| *p + DVec3::new(0.5, 0.0, 1.2)).collect();
        let mut scene = Scene::of_meshes(&body, mesh.with_positions(lifted)).unwrap();
        scene.held = (0..=columns).collect();
        let settings = Settings { fabric: Fabric::by_name("denim").unwrap(), ..Settings::default() };
        assert_eq!(settings.refine, Refine::Converged);
        let found = drape(&scene, &settings, &mut unobserved).unwrap();
        let state = found.state.unwrap();
        assert!(
            state.residual_over_weight < 1e-3 && state.steps < 30,
            "{} after {}",
            state.residual_over_weight,
            state.steps
        );
        (found.positions, state.fit)
    };
    let (plain, _) = hung(strip(
        &rows[..10].iter().chain(&rows[11..]).map(|z| if *z > 0.1 { z - seam } else { *z }).collect::<Vec<_>>(),
    ));
    let (sewn, fit) = hung(strip(&rows));
    let lowest = |x: &[DVec3]| x.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let longer = lowest(&plain) - lowest(&sewn);
    assert!((0.0..0.02 * side + 2.0 * seam).contains(&longer), "{longer}");
    assert!(fit.strain_max_percent < 1.0, "{}", fit.strain_max_percent);
    // No mass is invented: the seam weighs what it is.
    let mesh = strip(&rows);
    let rest = RestShape::from_edges(&mesh).unwrap();
    let cloth = Cloth::new(&mesh, &Topology::new(&mesh), &rest, &Fabric::by_name("denim").unwrap(), &[]).unwrap();
    let area: f64 = cloth.areas.iter().sum();
    assert!((area - 0.1 * (0.2 + seam)).abs() < 1e-12, "{area}");
}

/// SplitMix64, for numbers that are the same everywhere.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn a_rest_shape_drawn_far_too_large_or_small_is_solved_all_the_same() {
    let seeds = std::env::var("PARTWISE_REST_SEEDS").map_or(24, |n| n.parse().unwrap());
    let mut wrong = Vec::new();
    for seed in 0..seeds {
        let mut state: u64 = seed;
        let profile = [(0.03, 1.03), (0.12, 0.98), (0.21, 0.93), (0.3, 0.88)];
        let mut scene = Scene::of_meshes(&cone(), turned(&profile, 8, None)).unwrap();
        scene.held = (0..8).collect();
        for _ in 0..=(3.0 * random(&mut state)) as usize {
            // One corner of the pattern, wherever triangles meet it, off by up to a hundred thousand kilometres.
            let v = (32.0 * random(&mut state)) as u32;
            let off = DVec2::new(random(&mut state) - 0.5, random(&mut state) - 0.5)
                * 10f64.powf(13.0 * random(&mut state) - 5.0);
            for (t, rest) in scene.garment.triangles.iter().zip(&mut scene.rest.corners) {
                let Some(corner) = t.iter().position(|&w| w == v) else { continue };
                rest[corner] += off;
                let [a, b, c] = *rest;
                if (b - a).perp_dot(c - a) < 0.0 {
                    *rest = rest.map(|p| DVec2::new(-p.x, p.y));
                }
            }
        }
        for fabric in ["interlock", "denim"] {
            let settings = Settings { fabric: Fabric::by_name(fabric).unwrap(), ..Settings::default() };
            let found = drape(&scene, &settings, &mut |step| match step.iteration {
                0..40 => ControlFlow::Continue(()),
                _ => ControlFlow::Break(()),
            });
            match found {
                Ok(found) if found.positions.iter().all(|p| p.is_finite()) => {}
                Ok(_) => wrong.push(format!("{seed} in {fabric}: not finite")),
                Err(e) => wrong.push(format!("{seed} in {fabric}: {e}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {}: {wrong:#?}", wrong.len(), 2 * seeds);
}

#[test]
fn a_pattern_torn_in_one_corner_is_reported_with_its_face() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    write_mesh(&folder.path().join("body.obj"), &cone()).unwrap();
    let cape = turned(&[(0.03, 1.03), (0.12, 0.98), (0.21, 0.93), (0.3, 0.88)], 8, None);
    let text: String = (cape.positions.iter())
        .enumerate()
        .map(|(v, p)| format!("v {} {} {}\nvt {} {}\n", p.x, p.y, p.z, if v == 17 { 4.0 } else { p.x }, p.y))
        .chain(cape.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + 1);
            format!("f {a}/{a} {b}/{b} {c}/{c}\n")
        }))
        .collect();
    std::fs::write(place("cape.obj"), text).unwrap();
    let spec = SceneSpec {
        unit: Some(Unit::M),
        up: Some(Axis::Z),
        rest: "texture".to_owned(),
        ..SceneSpec::new(place("body.obj"), place("cape.obj"))
    };
    let loaded = spec.load().unwrap();
    let notes = loaded.notes().join("\n");
    let face = cape.triangles.iter().position(|t| t.contains(&17)).unwrap() + 1;
    assert!(notes.contains("6 triangles are of another size at rest than as worn"), "{notes}");
    assert!(notes.contains(&format!("farthest off in face {face}: 4.")) || notes.contains("m long at rest"), "{notes}");
    let (metrics, warnings, x) = draped(&loaded.scene);
    assert!(x.iter().all(|p| p.is_finite()) && metrics.strain_max.is_some(), "{warnings:?}");
}

#[test]
fn a_body_that_goes_through_itself_is_draped_over() {
    // Two spheres through each other, one of them turned inside out: inside and outside change from point to point.
    let mut body = sphere();
    let mut other = sphere();
    let first = body.positions.len() as u32;
    other.positions.iter_mut().for_each(|p| *p += DVec3::new(0.02, 0.01, 0.005));
    body.positions.extend(other.positions);
    body.triangles.extend(other.triangles.iter().map(|t| [t[0] + first, t[2] + first, t[1] + first]));
    let ring = |k: u32| (0.05 + 0.04 * f64::from(k), 1.34 - 0.025 * f64::from(k));
    let cape = turned(&(0..10).map(ring).collect::<Vec<_>>(), 40, None);
    for fabric in ["interlock", "denim"] {
        let scene = Scene::of_meshes(&body, cape.clone()).unwrap();
        let settings = Settings { fabric: Fabric::by_name(fabric).unwrap(), ..Settings::default() };
        let found = drape(&scene, &settings, &mut |step| match step.iteration {
            0..60 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        });
        assert!(found.unwrap().positions.iter().all(|p| p.is_finite()));
    }
}

#[test]
fn a_stray_triangle_in_an_open_body_does_not_end_the_drape() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let mut body = sphere();
    body.triangles.retain(|t| t.iter().all(|&v| body.positions[v as usize].z > 0.9));
    let first = body.positions.len() as u32;
    body.positions.extend([DVec3::new(0.1, 0.0, 1.36), DVec3::new(-0.05, 0.08, 1.3), DVec3::new(-0.05, -0.08, 1.25)]);
    body.triangles.push([first, first + 1, first + 2]);
    write_mesh(&folder.path().join("body.obj"), &body).unwrap();
    let ring = |k: u32| (0.05 + 0.04 * f64::from(k), 1.34 - 0.025 * f64::from(k));
    write_mesh(&folder.path().join("cape.obj"), &turned(&(0..10).map(ring).collect::<Vec<_>>(), 40, None)).unwrap();
    let spec = SceneSpec {
        unit: Some(Unit::M),
        up: Some(Axis::Z),
        open_body: true,
        ..SceneSpec::new(place("body.obj"), place("cape.obj"))
    };
    let scene = spec.load().unwrap().scene;
    let found = drape(&scene, &Settings::default(), &mut |step| match step.iteration {
        0..60 => ControlFlow::Continue(()),
        _ => ControlFlow::Break(()),
    });
    assert!(found.unwrap().positions.iter().all(|p| p.is_finite()));
}

#[test]
fn seams_bridged_by_long_triangles_are_reported_when_the_garment_falls_through() {
    // Two panels on either side of a ball, each 60 cm wide, and nothing but long triangles between them over it.
    let (columns, rows, side) = (31_u32, 16_u32, 0.02);
    let mut mesh = TriMesh::default();
    for x in [-0.4, 0.4] {
        let at = |v: u32| DVec3::new(x, side * f64::from(v % columns) - 0.3, 1.36 - side * f64::from(v / columns));
        mesh.positions.extend((0..columns * rows).map(at));
    }
    let far = columns * rows;
    let quad = |a: u32, right: u32, below: u32| [[a, a + below, a + right], [a + right, a + below, a + right + below]];
    let cells = (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| j * columns + i));
    for a in cells {
        mesh.triangles.extend(quad(a, 1, columns));
        mesh.triangles.extend(quad(far + a, 1, columns).map(|[a, b, c]| [a, c, b]));
    }
    mesh.triangles.extend((0..columns - 1).flat_map(|i| quad(i, 1, far)).map(|[a, b, c]| [a, c, b]));
    let (metrics, warnings, _) = draped(&Scene::of_meshes(&sphere(), mesh).unwrap());
    assert!(metrics.top_sank_mm > 100.0, "{} mm", metrics.top_sank_mm);
    let bridges = format!("{} of its triangles are up to 80 cm long", 2 * (columns - 1));
    assert!(warnings.iter().any(|w| w.contains(&bridges) && w.contains("--pattern")), "{warnings:?}");
}
