//! Forged drapes: positions that look like a drape, made from one or from its placement. The certificate refuses every one.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod fixtures;

use fixtures::{Diagonals, far_away, rectangle, sphere, tube};
use glam::{DMat3, DVec3};
use partwise::Scene;
use partwise::body::distance::Body;
use partwise::drape::{self, Settings};
use partwise::garment::fabric::Fabric;
use partwise::mesh::{RestShape, TriMesh};
use partwise::study::certificate::certify;

/// A scene and its drape.
struct Draped {
    name: &'static str,
    scene: Scene,
    x: Vec<DVec3>,
}

fn draped(name: &'static str, body: Body, garment: TriMesh, hold: bool) -> Draped {
    let rest = RestShape::from_edges(&garment).unwrap();
    let mut scene = Scene::new(body, garment, rest);
    if hold {
        scene.held = scene.edges("top").unwrap();
    }
    let x = drape::drape(&scene, &Settings::default(), &mut drape::unobserved).unwrap().positions;
    let certificate = certify(&scene, &Settings::default().fabric, &x).unwrap();
    assert!(certificate.passes, "{name}: {:#?}", certificate.findings);
    Draped { name, scene, x }
}

/// A cloth over a ball, a curtain that hangs free, and a skirt over a ball.
fn all() -> [Draped; 3] {
    let ball = || Body::new(&sphere(DVec3::ZERO, 0.1, 23, 32)).unwrap();
    let mut cloth = rectangle(DVec3::X * 0.24, DVec3::Y * 0.24, 12, 12);
    cloth.positions.iter_mut().for_each(|x| *x += DVec3::new(-0.12, -0.12, 0.105));
    let ring = |radius: f64, angle: f64, z: f64| DVec3::new(radius * angle.cos(), radius * angle.sin(), z);
    let curtain = tube(16, 9, Diagonals::Alternating, |share, angle| ring(0.1, angle, 0.3 * share));
    let skirt =
        tube(20, 11, Diagonals::Alternating, |share, angle| ring(0.13 - 0.02 * share, angle, 0.25 * share - 0.2));
    [
        draped("cloth over a ball", ball(), cloth, false),
        draped("curtain", far_away(), curtain, true),
        draped("skirt over a ball", ball(), skirt, true),
    ]
}

/// A number in −1..1 by index.
fn noise(i: usize) -> f64 {
    (i as f64 * 12.9898).sin()
}

/// Forgeries of a drape by name; each is of the drape, or of the drape and its placement.
fn forgeries(drape: &Draped) -> Vec<(String, Vec<DVec3>)> {
    let Draped { scene, x, .. } = drape;
    let n = x.len();
    let middle = x.iter().sum::<DVec3>() / n as f64;
    let each =
        |f: &dyn Fn(usize, DVec3) -> DVec3| -> Vec<DVec3> { x.iter().enumerate().map(|(i, x)| f(i, *x)).collect() };
    let turned = |axis: DVec3, degrees: f64| {
        let turn = DMat3::from_axis_angle(axis.normalize(), degrees.to_radians());
        each(&|_, x| middle + turn * (x - middle))
    };
    let one = (0..n).rfind(|v| !scene.held.contains(&(*v as u32))).unwrap();
    let beside = scene.garment.triangles.iter().find(|t| t.contains(&(one as u32))).unwrap();
    let beside = beside.iter().map(|v| *v as usize).find(|v| *v != one).unwrap();
    let smoothed = |times: usize| {
        let mut x = x.clone();
        for _ in 0..times {
            let mut sums = vec![(DVec3::ZERO, 0.0); n];
            for t in &scene.garment.triangles {
                for (k, &v) in t.iter().enumerate() {
                    sums[v as usize].0 += x[t[(k + 1) % 3] as usize];
                    sums[v as usize].1 += 1.0;
                }
            }
            x = sums.iter().map(|(sum, count)| *sum / *count).collect();
        }
        x
    };
    let swapped = |a: usize, b: usize| {
        let mut x = x.clone();
        x.swap(a, b);
        x
    };
    let ways = [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let mut all = Vec::new();
    let mut add = |name: String, x: Vec<DVec3>| all.push((name, x));
    for way in ways {
        add(format!("moved by 20 mm along {way}"), each(&|_, x| x + way * 0.02));
        add(format!("a vertex moved by 5 mm along {way}"), each(&|i, x| if i == one { x + way * 0.005 } else { x }));
    }
    for (axis, degrees) in [(DVec3::X, 20.0), (DVec3::Y, 20.0), (DVec3::new(1.0, 1.0, 0.0), 8.0)] {
        add(format!("turned by {degrees}° about {axis}"), turned(axis, degrees));
    }
    for scale in [0.9, 1.1, 1.5] {
        add(format!("scaled by {scale}"), each(&|_, x| middle + (x - middle) * scale));
    }
    for share in [1.0, 0.75, 0.5, 0.25] {
        let placed = &scene.garment.positions;
        add(format!("{share} of the placement"), each(&|i, x| x.lerp(placed[i], share)));
    }
    for mm in [1.0, 3.0, 10.0] {
        add(format!("waves of {mm} mm"), each(&|_, x| x + DVec3::ONE * (1e-3 * mm * (60.0 * x.x + 40.0 * x.z).sin())));
    }
    for mm in [0.5, 1.0, 3.0] {
        let off = |i: usize| DVec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
        add(format!("noise of {mm} mm"), each(&|i, x| x + off(i) * (1e-3 * mm)));
    }
    for times in [1, 10] {
        add(format!("smoothed {times} times"), smoothed(times));
    }
    add("two neighbours exchanged".to_owned(), swapped(one, beside));
    add("two vertices exchanged".to_owned(), swapped(0, n / 2));
    add("flattened".to_owned(), each(&|_, x| DVec3::new(x.x, x.y, middle.z)));
    add("upside down".to_owned(), each(&|_, x| DVec3::new(x.x, x.y, 2.0 * middle.z - x.z)));
    add("at one point".to_owned(), each(&|_, _| middle));
    add("folded in two".to_owned(), each(&|_, x| DVec3::new(middle.x - (x.x - middle.x).abs(), x.y, x.z)));
    all
}

#[test]
fn no_forged_drape_is_certified() {
    let mut count = 0;
    let mut passed = Vec::new();
    for drape in all() {
        for (name, x) in forgeries(&drape) {
            count += 1;
            if certify(&drape.scene, &Settings::default().fabric, &x).unwrap().passes {
                passed.push(format!("{}: {name}", drape.name));
            }
        }
        // The drape of another fabric.
        count += 1;
        if certify(&drape.scene, &Fabric::by_name("denim").unwrap(), &drape.x).unwrap().passes {
            passed.push(format!("{}: of another fabric", drape.name));
        }
    }
    assert!(passed.is_empty(), "of {count}: {passed:#?}");
    assert!(count >= 110, "{count}");
}
