//! Warnings of a drape whose figures alone look good: a garment that slid or fell, visible skin, slivers.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod meshes;
mod placed;

use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use partwise::Job;
use partwise::drape::{Scene, drape, unobserved};
use partwise::mesh::TriMesh;
use partwise::mesh::export::write_mesh;
use partwise::mesh::self_intersection::crossing_pairs;
use partwise::study::metrics::Metrics;
use partwise::study::sweep::{Bench, Plan, Status};

/// Rings of `around` points from the top down, closed by a point at each end where `ends` are given.
fn turned(profile: &[(f64, f64)], around: u32, ends: Option<[f64; 2]>) -> TriMesh {
    let mut mesh = TriMesh::default();
    for &(radius, z) in profile {
        mesh.positions.extend((0..around).map(|i| {
            let (y, x) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            DVec3::new(radius * x, radius * y, z)
        }));
    }
    let rings = profile.len() as u32;
    for (j, i) in (0..rings - 1).flat_map(|j| (0..around).map(move |i| (j, i))) {
        let [a, b] = [j * around + i, j * around + (i + 1) % around];
        mesh.triangles.extend([[a, a + around, b], [b, a + around, b + around]]);
    }
    if let Some([top, bottom]) = ends {
        let tip = mesh.positions.len() as u32;
        mesh.positions.extend([DVec3::Z * top, DVec3::Z * bottom]);
        let last = (rings - 1) * around;
        for (i, next) in (0..around).map(|i| (i, (i + 1) % around)) {
            mesh.triangles.extend([[tip, i, next], [tip + 1, last + next, last + i]]);
        }
    }
    mesh
}

/// A cone, 10 cm wide at the top and 40 cm at the foot (radii).
fn cone() -> TriMesh {
    let profile: Vec<(f64, f64)> = (0..=10).map(|k| (0.1 + 0.03 * f64::from(k), 1.0 - 0.1 * f64::from(k))).collect();
    turned(&profile, 32, Some([1.02, -0.02]))
}

fn sphere() -> TriMesh {
    let ring = |k: i32| {
        let (s, c) = (std::f64::consts::PI * f64::from(k) / 24.0).sin_cos();
        (0.3 * s, 1.0 + 0.3 * c)
    };
    turned(&(1..24).map(ring).collect::<Vec<_>>(), 48, Some([1.3, 0.7]))
}

fn draped(scene: &Scene) -> (Metrics, Vec<String>, Vec<DVec3>) {
    draped_by(scene, &Job::default())
}

fn draped_by(scene: &Scene, job: &Job) -> (Metrics, Vec<String>, Vec<DVec3>) {
    let result = drape(scene, &job.settings, &mut unobserved).unwrap();
    let measured = job.measure(scene, &result, None, &mut unobserved).unwrap();
    (measured.metrics, measured.warnings, result.positions)
}

#[test]
fn a_garment_that_slides_down_is_reported_with_the_edge_to_hold() {
    let mut tube = turned(&[(0.3, 0.95), (0.3, 0.9), (0.3, 0.85), (0.3, 0.8), (0.3, 0.75), (0.3, 0.7)], 40, None);
    tube.groups = vec!["waist".to_owned()];
    tube.triangle_group = vec![0; tube.triangles.len()];
    let mut scene = Scene::of_meshes(&cone(), tube).unwrap();
    let (metrics, warnings, x) = draped(&scene);
    let sank = (0..40).map(|v| scene.garment.positions[v].z - x[v].z).sum::<f64>() / 40.0;
    assert!(sank > 0.2 && (metrics.top_sank_mm - 1e3 * sank).abs() < 1e-9, "{sank}");
    let message = warnings.join("\n");
    assert!(message.contains("slid down") && message.contains("--hold top") && message.contains("waist"), "{message}");
    // A held garment stays, without a warning.
    scene.held = scene.edge("top").unwrap();
    let (metrics, warnings, _) = draped(&scene);
    assert_eq!(metrics.top_sank_mm, 0.0);
    assert!(!warnings.join("\n").contains("slid"), "{warnings:?}");
}

/// Two garments' meshes as one, connected part after connected part.
fn beside(mut mesh: TriMesh, other: &TriMesh) -> TriMesh {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

#[test]
fn the_connected_part_that_slides_or_falls_is_reported_by_its_number() {
    let tube = |radius: f64, top: f64| {
        turned(&(0..6).map(|k| (radius, top - 0.05 * f64::from(k))).collect::<Vec<_>>(), 40, None)
    };
    let cape = turned(&[(0.03, 1.05), (0.06, 1.03), (0.1, 1.02), (0.13, 0.99)], 24, None);
    // A cape that stays where it is, the highest edge of all, over trousers that do not.
    let mut scene = Scene::of_meshes(&cone(), beside(cape.clone(), &tube(0.3, 0.9))).unwrap();
    let (metrics, warnings, x) = draped(&scene);
    let of = |v: usize| scene.garment.positions[v].z - x[v].z;
    let sank = [0..24, 96..136].map(|ring| ring.clone().map(of).sum::<f64>() / ring.len() as f64);
    assert!(sank[0] < 0.05 && sank[1] > 0.15, "{sank:?}");
    assert!((metrics.top_sank_mm - 1e3 * sank[1]).abs() < 1e-9, "{} mm", metrics.top_sank_mm);
    let message =
        format!("connected part 2 of the garment's 2 has slid down: its highest edge sank by {:.0} cm", 1e2 * sank[1]);
    assert!(warnings.iter().any(|w| w.contains(&message) && w.contains("(--hold top:2)")), "{warnings:?}");
    // Holding another part does not help. Once this part is held, it stays, without a warning.
    scene.held = scene.edge("top:1").unwrap();
    assert!(draped(&scene).1.iter().any(|w| w.contains(&message[..50])), "{warnings:?}");
    scene.held = scene.edge("top:2").unwrap();
    assert!(!draped(&scene).1.iter().any(|w| w.contains("slid")));

    // One that nothing is under falls past the feet, while the cape rests: said, and no more steps are taken.
    let ring = turned(&[(0.6, 0.9), (0.6, 0.85), (0.6, 0.8)], 24, None);
    let scene = Scene::of_meshes(&cone(), beside(cape, &ring)).unwrap();
    let result = drape(&scene, &Job::default().settings, &mut unobserved).unwrap();
    let message = "connected part 2 of the garment's 2 has fallen off the body; hold its edge (--hold top:2)";
    assert!(result.warnings.iter().any(|w| w.contains(message)), "{:?}", result.warnings);
    assert!(
        result.state.is_some_and(|state| state.steps < 100) && !draped(&scene).1.iter().any(|w| w.contains("slid"))
    );
}

#[test]
fn two_ponchos_laid_flat_over_each_other_stay_on() {
    // A neck of half a metre over a body of nearly a metre round; 6 mm high in all, which is not how much of them hangs.
    let post: Vec<(f64, f64)> = (1..=8)
        .map(|k| (0.15 * (std::f64::consts::PI * f64::from(k) / 16.0).sin(), f64::from(k)))
        .map(|(r, k)| (r, 1.35 + 0.15 * (std::f64::consts::PI * k / 16.0).cos()))
        .chain([(0.15, 0.9), (0.15, 0.3)])
        .collect();
    let post = turned(&post, 40, Some([1.5, 0.3]));
    let poncho =
        |z: f64| turned(&(0..28).map(|j| (0.08 + 0.42 * f64::from(j) / 27.0, z)).collect::<Vec<_>>(), 71, None);
    let scene = Scene::of_meshes(&post, beside(poncho(1.53), &poncho(1.536))).unwrap();
    let mut job = Job::preview();
    job.settings.fabric = partwise::garment::fabric::Fabric::by_name("denim").unwrap();
    let (metrics, warnings, x) = draped_by(&scene, &job);
    let necks = [0..71, 28 * 71..29 * 71].map(|ring| ring.map(|v| x[v].z).fold(f64::INFINITY, f64::min));
    assert!(necks.iter().all(|z| *z > 1.35), "{necks:?}");
    assert!(metrics.strain_max.unwrap() < 0.5, "{:?}", metrics.strain_max);
    // Their hems are as high as their necks as placed, and sink as they should.
    assert!(metrics.top_sank_mm < 100.0 && !warnings.iter().any(|w| w.contains("slid")), "{warnings:?}");
}

#[test]
fn skin_between_vertices_outside_the_body_is_reported() {
    // Triangles of 15 cm on a sphere of 30 cm: their middles sag a centimetre under their corners.
    let cape = |around, rings: u32| {
        let ring = |k: u32| {
            let u = f64::from(k) / f64::from(rings - 1);
            (0.05 + 0.4 * u, 1.33 - 0.25 * u)
        };
        turned(&(0..rings).map(ring).collect::<Vec<_>>(), around, None)
    };
    let scene = Scene::of_meshes(&sphere(), cape(12, 5)).unwrap();
    let mut bare = Job::default();
    bare.settings.self_contact = false;
    let (metrics, warnings, x) = draped_by(&scene, &bare);
    let pairs = crossing_pairs(&scene.garment.with_positions(x), scene.body.mesh()).len();
    assert!(pairs > 0 && metrics.body_crossing_pairs == pairs && metrics.penetrating_vertices == 0, "{pairs}");
    let message = warnings.join("\n");
    assert!(message.contains(&format!("skin shows through the cloth: {pairs} pairs")), "{message}");
    assert!(message.contains("no vertex is inside"), "{message}");
    // A fine mesh shows none even so.
    let (metrics, warnings, _) = draped_by(&Scene::of_meshes(&sphere(), cape(90, 36)).unwrap(), &bare);
    assert_eq!(metrics.body_crossing_pairs, 0);
    // Its folds may go through each other, as nothing keeps them apart here.
    assert!(warnings.iter().all(|warning| !warning.contains("skin")), "{warnings:?}");
}

#[test]
fn intersecting_cloth_is_reported() {
    let ring = |k: u32| (0.05 + 0.04 * f64::from(k), 1.34 - 0.025 * f64::from(k));
    let cape = turned(&(0..10).map(ring).collect::<Vec<_>>(), 40, None);
    let moved = |by: DVec3| cape.with_positions(cape.positions.iter().map(|p| *p + by).collect());
    let over = |by: DVec3| Scene::of_meshes(&sphere(), beside(cape.clone(), &moved(by))).unwrap();
    let scene = over(DVec3::new(0.02, 0.01, 0.003));
    let mut bare = Job::default();
    bare.settings.self_contact = false;
    let (metrics, warnings, _) = draped_by(&scene, &bare);
    let message = format!("cloth goes through cloth: {} pairs", metrics.self_intersecting_pairs);
    assert!(metrics.self_intersecting_pairs > 0 && warnings.iter().any(|w| w.contains(&message)), "{warnings:?}");
    // Layers that stay apart give no warning.
    let (metrics, warnings, _) = draped(&over(DVec3::Z * 0.008));
    assert_eq!((metrics.self_intersecting_pairs, warnings.len()), (0, 0), "{warnings:?}");
}

#[test]
fn a_garment_that_falls_off_is_a_failed_row_and_the_sweep_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    write_mesh(&folder.path().join("body.obj"), &sphere()).unwrap();
    write_mesh(&folder.path().join("tube.obj"), &turned(&[(0.4, 1.2), (0.4, 1.1), (0.4, 1.0)], 30, None)).unwrap();
    let text = format!(
        "name = \"falls\"\n[base]\nbody = '{}'\ngarment = '{}'\noptions = {{ unit = \"m\", up = \"z\" }}\nrefine = \"converged\"\n[grid]\ntables = [\"table-3\", {{ quantile = 3 }}]\n",
        place("body.obj"),
        place("tube.obj")
    );
    let plan = Plan::parse(&text, "falls.toml", folder.path(), &Job::preview()).unwrap();
    assert_eq!(plan.points.len(), 2);
    let stop = AtomicBool::new(false);
    let bench = Bench::new(None, &stop);
    for point in &plan.points {
        // No row would be the user's interruption, and the end of the sweep.
        let row = bench.row(point, (0, 1), |_, _, _| Ok(())).unwrap();
        assert_eq!(row.status, Status::Error);
        assert!(row.error.contains("fallen off the body") && row.error.contains("hold"), "{}", row.error);
    }
}

#[test]
fn each_connected_part_and_each_group_can_be_held_by_its_edge() {
    // Two tubes about a cone, far too wide to stay where they are.
    let tube = |top: f64| turned(&[(0.35, top), (0.35, top - 0.05), (0.35, top - 0.1)], 24, None);
    let upper = tube(0.9);
    let first = upper.positions.len() as u32;
    let mut both = beside(upper, &tube(0.6));
    both.groups = ["upper", "inside", "lower"].map(str::to_owned).to_vec();
    both.triangle_group = (0..both.triangles.len()).map(|t| if t < 96 { 0 } else { 2 }).collect();
    let mut scene = Scene::of_meshes(&cone(), both).unwrap();
    let ring = |from: u32| (from..from + 24).collect::<Vec<u32>>();
    assert_eq!(scene.edge("top").unwrap(), ring(0));
    assert_eq!(scene.edge("top:2").unwrap(), ring(first));
    assert_eq!(scene.edges("top:2, top:1").unwrap(), [ring(0), ring(first)].concat());
    assert_eq!(scene.edge("upper").unwrap(), [ring(0), ring(48)].concat());
    for (what, expected) in
        [("top:3", "`top:1` to `top:2`"), ("top:x", "2 connected parts"), ("inside", "no open edge"), ("hem", "upper")]
    {
        let message = scene.edges(what).unwrap_err().to_string();
        assert!(message.contains("--hold") && message.contains(expected), "{message}");
    }
    scene.held = scene.edges("top:1,top:2").unwrap();
    let (metrics, _, x) = draped(&scene);
    assert!(metrics.residual_over_weight.unwrap() < 1e-3 && metrics.top_sank_mm == 0.0);
    assert!(scene.held.iter().all(|&v| x[v as usize] == scene.garment.positions[v as usize]));
}

#[test]
fn excessive_strain_and_pressure_are_reported() {
    let ring = |k: u32| (0.05 + 0.04 * f64::from(k), 1.34 - 0.025 * f64::from(k));
    let cape = turned(&(0..10).map(ring).collect::<Vec<_>>(), 40, None);
    let mut scene = Scene::of_meshes(&sphere(), cape).unwrap();
    // A preview that rests on the body presses on it.
    let job = Job::preview();
    let preview = drape(&scene, &job.settings, &mut unobserved).unwrap();
    let metrics = job.measure(&scene, &preview, None, &mut unobserved).unwrap().metrics;
    assert!(metrics.contact_parts > 0 && metrics.pressure_max_kpa.unwrap() > 0.0, "{:?}", metrics.pressure_max_kpa);
    // Cut for somebody of less than half the size, and held at both ends.
    scene.rest.corners.iter_mut().flatten().for_each(|p| *p *= 0.4);
    scene.held = (0..40).chain(360..400).collect();
    let (metrics, warnings, _) = draped(&scene);
    assert!(metrics.strain_max.unwrap() > 0.5, "{:?}", metrics.strain_max);
    let warning = warnings.iter().find(|w| w.contains("more than fabrics bear")).unwrap();
    // Both openings are held at their length before the rest shape changed.
    assert!(warning.contains("its opening at a height of"), "{warning}");
}
