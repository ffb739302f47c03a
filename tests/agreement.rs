//! `run` and the certificate give the same verdict on random small garments, on lathe bodies and on the dress form.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "the counts are shown with --nocapture")]

mod fixtures;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::ops::{ControlFlow, Range};
use std::sync::LazyLock;

use fixtures::{Diagonals, closed, tube};
use glam::DVec3;
use partwise::body::distance::Body;
use partwise::drape::{self, Drape, Refine, Settings};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::refine::{RefineOptions, Step, Stop, refine};
use partwise::mesh::{RestShape, TriMesh};
use partwise::study::certificate::{Certificate, certify};
use partwise::study::metrics::Metrics;
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

/// The seeds of a test: `PARTWISE_SAMPLES` of them from `PARTWISE_FIRST`, `count` from 0 without.
fn samples(count: u64) -> Range<u64> {
    let number = |name, default| std::env::var(name).map_or(default, |n| n.parse().unwrap());
    let first = number("PARTWISE_FIRST", 0);
    first..first + number("PARTWISE_SAMPLES", count)
}

/// Lines of the certificate that judge whether the cloth rests; the others are warnings of their own.
const REST: [&str; 6] =
    ["residual", "forces add up", "friction", "still moving", "distance to rest", "lowest curvature"];

#[test]
fn run_and_certificate_agree_on_random_garments() {
    let seeds = samples(60);
    let count = seeds.clone().count();
    let mut differ = String::new();
    let (mut rest, mut unsettled, mut differing) = (0, 0, 0);
    for seed in seeds {
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

/// A drape, and where its steps at full resolution began.
fn draped(scene: &Scene, settings: &Settings) -> (Drape, Vec<DVec3>) {
    let mut start = Vec::new();
    let mut observer = |step: &Step<'_>| {
        if step.iteration == 0 && start.is_empty() {
            start = step.positions.to_vec();
        }
        ControlFlow::Continue(())
    };
    let drape = drape::drape(scene, settings, &mut observer).unwrap();
    (drape, start)
}

/// Largest and RMS movement (mm) of a drape at rest whose steps are continued to a tenth of the residual, and the verdict there; `None`
/// if the steps from `start` do not lead to `rest`, or do not reach that residual.
fn moved_at_a_tenth(scene: &Scene, settings: &Settings, start: Vec<DVec3>, rest: &[DVec3]) -> Option<([f64; 2], bool)> {
    let fabrics = scene.fabrics(&settings.fabric);
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabrics, &scene.held).unwrap();
    let options = RefineOptions { continued_to: Some(1e-4), ..RefineOptions::default() };
    let mut passed = false;
    let mut observer = |step: &Step<'_>| {
        passed |= step.positions == rest;
        // The steps of the run end under 2,000; those of another way may not.
        if step.iteration > 300 && !passed { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let end = refine(&cloth, &scene.body, start, &options, &mut observer).unwrap();
    if !passed || end.stop != Stop::Converged || end.residual_over_weight >= 1e-4 {
        return None;
    }
    let mm: Vec<f64> = rest.iter().zip(&end.positions).map(|(a, b)| 1e3 * a.distance(*b)).collect();
    let rms = (mm.iter().map(|mm| mm * mm).sum::<f64>() / mm.len() as f64).sqrt();
    let certificate = certify(scene, &settings.fabric, &end.positions).unwrap();
    let rests = certificate.findings.iter().filter(|f| REST.contains(&f.name)).all(|f| f.passes);
    Some(([mm.iter().copied().fold(0.0, f64::max), rms], rests))
}

#[test]
fn garments_at_rest_stay_where_they_are_at_a_tenth_of_the_residual() {
    let (mut moves, mut other) = (Vec::new(), 0);
    for seed in samples(60) {
        let (scene, settings) = scene(seed);
        let (drape, start) = draped(&scene, &settings);
        if drape.state.as_ref().unwrap().stop != Stop::Converged {
            continue;
        }
        match moved_at_a_tenth(&scene, &settings, start, &drape.positions) {
            None => other += 1,
            Some(([most_mm, rms_mm], rests)) => {
                println!("seed {seed}: {most_mm:.4} mm, RMS {rms_mm:.4} mm, rests {rests}");
                assert!(rests, "seed {seed}");
                moves.push(most_mm);
            }
        }
    }
    moves.sort_by(f64::total_cmp);
    let [n, over] = [moves.len(), moves.iter().filter(|mm| **mm > 1.0).count()];
    let [half, tenth] = [moves[n / 2], moves[n * 9 / 10]];
    println!(
        "{n} continued: {half:.4} mm in the median, {tenth:.3} mm of nine in ten, {over} by over a millimetre; {other} went another way"
    );
    assert!(half < 0.05 && tenth < 0.5 && 20 * over <= n && 10 * other <= n);
}

/// Triangles bear hardly any compression, so a stiffness in bending that forbids buckling shortens the cloth at small forces.
#[test]
fn a_garment_that_its_fabric_crushes_is_warned_of_and_not_certified() {
    let scene = SceneSpec::new("form", "flared-skirt@600").load().unwrap().scene;
    let interlock = Fabric::by_name("interlock").unwrap();
    for (bending_nm, crushed) in [([100.0; 3], true), (interlock.bending_nm, false)] {
        let settings = Settings { fabric: Fabric { bending_nm, ..interlock.clone() }, ..Settings::default() };
        let drape = scene.drape(&settings).unwrap();
        let warned =
            |drape: &Drape| drape.warnings.iter().any(|w| w.contains("crushed to") && w.contains("bending_nm"));
        assert_eq!(warned(&drape), crushed);
        let certificate = certify(&scene, &settings.fabric, &drape.positions).unwrap();
        assert_eq!(certificate.finding("area kept").unwrap().passes, !crushed);
        assert_eq!(Metrics::of(&scene, &drape).verdict.contains("crushed to"), crushed);
        // Cloth that does not rest yet may still unfold.
        for steps in [0, 1, 2, 4, 8] {
            let unfinished = scene.drape(&Settings { refine: Refine::Steps(steps), ..settings.clone() }).unwrap();
            let rests = unfinished.state.as_ref().unwrap().stop == Stop::Converged;
            assert!(rests || !warned(&unfinished));
        }
    }
}
