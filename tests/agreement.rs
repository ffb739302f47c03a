//! `run` and the certificate give the same verdict on random small garments, on lathe bodies and on the dress form.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "the counts are shown with --nocapture")]

mod fixtures;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::sync::LazyLock;

use fixtures::{Diagonals, closed, tube};
use glam::DVec3;
use partwise::body::distance::Body;
use partwise::drape::{self, Settings};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::refine::Stop;
use partwise::mesh::{RestShape, TriMesh};
use partwise::study::certificate::{Certificate, certify};
use partwise::{Scene, SceneSpec};

/// Numbers in 0..1 by a seed: SplitMix64.
struct Random(u64);

impl Random {
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn count(&mut self, low: u32, high: u32) -> u32 {
        low + (self.share() * f64::from(high - low + 1)) as u32
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.count(0, all.len() as u32 - 1) as usize]
    }
}

/// Height of the lathe body, m.
const HEIGHT: f64 = 0.6;

/// A body turned on a lathe: a column with waves, closed by a point at each end. Returns its radius at a height as well.
fn lathe(random: &mut Random) -> (TriMesh, impl Fn(f64) -> f64 + use<>) {
    let around = random.count(8, 40);
    let rings = random.count(8, 30);
    let base = random.between(0.06, 0.12);
    let waves: Vec<[f64; 3]> =
        (0..3).map(|_| [random.between(0.0, 0.25), random.between(2.0, 14.0), random.between(0.0, TAU)]).collect();
    let radius = move |z: f64| {
        let waves: f64 = waves.iter().map(|[share, turns, phase]| share * (turns * z / HEIGHT + phase).sin()).sum();
        // A round shoulder at the top.
        let top = 1.0 - ((z / HEIGHT - 0.8) / 0.22).max(0.0).powi(2);
        base * (1.0 + waves) * top.max(0.1).sqrt()
    };
    let at = |share: f64, angle: f64| {
        DVec3::new(angle.cos(), angle.sin(), 0.0) * radius(share * HEIGHT) + DVec3::Z * (share * HEIGHT)
    };
    let body =
        closed(tube(around, rings, Diagonals::Parallel, at), around, DVec3::Z * -0.02, DVec3::Z * (HEIGHT + 0.01));
    (body, radius)
}

/// A small garment about a body whose radius is known: a tube, a skirt that flares, or a cape that hangs from the shoulder.
fn garment(random: &mut Random, radius: impl Fn(f64) -> f64) -> TriMesh {
    let (around, rings) = (random.count(8, 20), random.count(4, 10));
    if random.share() < 0.25 {
        // A cape, laid flat above the shoulder.
        let (inner, outer) = (random.between(0.02, 0.05), random.between(0.1, 0.25));
        let diagonals = random.of(&[Diagonals::Parallel, Diagonals::Alternating]);
        return tube(around, rings, diagonals, |share, angle| {
            let r = outer + share * (inner - outer);
            DVec3::new(r * angle.cos(), r * angle.sin(), HEIGHT + 0.02)
        });
    }
    let high = random.between(0.45, 0.97) * HEIGHT;
    let low = high - random.between(0.08, 0.3);
    let (ease, flare) = (random.between(0.003, 0.03), random.of(&[0.0, 0.02, 0.06]));
    let diagonals = random.of(&[Diagonals::Parallel, Diagonals::Alternating]);
    tube(around, rings, diagonals, |share, angle| {
        let z = low + share * (high - low);
        // Sides of a polygon lie inside its circle.
        let r = radius(z).max(if flare > 0.0 { radius(high) } else { 0.0 }) + ease + flare * (1.0 - share);
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

struct Verdict {
    seed: u64,
    rests: bool,
    stop: Stop,
    residual: f64,
    warnings: Vec<String>,
    certificate: Certificate,
}

impl Verdict {
    fn text(&self) -> String {
        let failed = self.certificate.findings.iter().filter(|f| !f.passes);
        let failed =
            failed.map(|f| format!("{} {:.2e} ({})", f.name, f.value, f.remark)).collect::<Vec<_>>().join("; ");
        format!("seed {}: {:?} {:.1e}, {failed}; {:?}", self.seed, self.stop, self.residual, self.warnings)
    }
}

/// The dress form, and the heights (m) between which garments are made for it: from the knees to the waist.
static FORM: LazyLock<Body> = LazyLock::new(|| SceneSpec::new("form", "flared-skirt@600").load().unwrap().scene.body);
const ON_THE_FORM: [f64; 2] = [0.5, 1.1];

/// The radius about the vertical axis through the form's middle that encloses it at a height, in the heights of a lathe body.
fn radius_of_form(z: f64) -> f64 {
    let [low, high] = ON_THE_FORM;
    let height = low + z / HEIGHT * (high - low);
    let near = FORM.mesh().positions.iter().filter(|x| (x.z - height).abs() < 0.03);
    near.map(|x| x.truncate().length()).filter(|r| *r < 0.25).fold(0.0, f64::max)
}

fn scene(seed: u64) -> (Scene, Settings) {
    let mut random = Random(seed);
    let fabric = random.of(&["jersey", "interlock", "cotton", "denim"]);
    let (body, garment) = if seed % 5 == 4 {
        let mut garment = garment(&mut random, radius_of_form);
        let [low, high] = ON_THE_FORM;
        garment.positions.iter_mut().for_each(|x| x.z = low + x.z / HEIGHT * (high - low));
        (FORM.clone(), garment)
    } else {
        let (body, radius) = lathe(&mut random);
        (Body::new(&body).unwrap(), garment(&mut random, radius))
    };
    let rest = RestShape::from_edges(&garment).unwrap();
    let mut scene = Scene::new(body, garment, rest);
    if random.share() < 0.5 {
        scene.held = scene.edges("top").unwrap();
    }
    (scene, Settings { fabric: Fabric::by_name(fabric).unwrap(), ..Settings::default() })
}

fn judged(seed: u64, scene: &Scene, settings: &Settings) -> Verdict {
    let drape = drape::drape(scene, settings, &mut drape::unobserved).unwrap();
    let certificate = certify(scene, &settings.fabric, &drape.positions).unwrap();
    let state = drape.state.unwrap();
    let rests = state.stop == Stop::Converged && drape.warnings.iter().all(|w| !w.contains("not settled"));
    Verdict {
        seed,
        rests,
        stop: state.stop,
        residual: state.residual_over_weight,
        warnings: drape.warnings,
        certificate,
    }
}

/// Lines of the certificate that judge whether the cloth rests; the others are warnings of their own.
const REST: [&str; 6] =
    ["residual", "forces add up", "friction", "still moving", "distance to rest", "lowest curvature"];

#[test]
fn run_and_certificate_agree_on_random_garments() {
    let count: u64 = std::env::var("PARTWISE_SAMPLES").map_or(60, |n| n.parse().unwrap());
    let first: u64 = std::env::var("PARTWISE_FIRST").map_or(0, |n| n.parse().unwrap());
    let mut differ = String::new();
    let (mut rest, mut unsettled, mut differing) = (0, 0, 0);
    for seed in first..first + count {
        let (scene, settings) = scene(seed);
        let verdict = judged(seed, &scene, &settings);
        let passes = verdict.certificate.findings.iter().filter(|f| REST.contains(&f.name)).all(|f| f.passes);
        rest += usize::from(verdict.rests);
        unsettled += usize::from(!verdict.rests && verdict.stop != Stop::Interrupted);
        if verdict.rests != passes {
            differing += 1;
            let _ = writeln!(differ, "{}", verdict.text());
        }
    }
    println!("{count} garments, {rest} rest, {unsettled} are warned of, {differing} differ\n{differ}");
    assert_eq!(differing, 0, "{differ}");
}

/// Triangles bear hardly any compression, so a stiffness in bending that forbids buckling shortens the cloth at small forces.
#[test]
fn a_garment_that_its_fabric_crushes_is_warned_of() {
    let scene = SceneSpec::new("form", "flared-skirt@600").load().unwrap().scene;
    let crushed = |bending_nm: [f64; 3]| {
        let fabric = Fabric { bending_nm, ..Fabric::by_name("interlock").unwrap() };
        let drape = scene.drape(&Settings { fabric, ..Settings::default() }).unwrap();
        drape.warnings.iter().any(|warning| warning.contains("crushed to") && warning.contains("bending_nm"))
    };
    assert!(crushed([100.0; 3]));
    assert!(!crushed(Fabric::by_name("interlock").unwrap().bending_nm));
}
