//! Garments over each other, and what self-contact and cover are for.

use partwise::Scene;
use partwise::drape::{Drape, Refine, Settings, drape, unobserved};
use partwise::garment::fabric::Fabric;
use partwise::mesh::self_intersection::crossing_pairs;
use partwise::scene::{DistanceTo, SceneSpec};
use partwise::study::certificate::certify;

fn outfit(distance_to: DistanceTo) -> Scene {
    let over = vec!["pullover-1@900".to_owned()];
    let spec = SceneSpec { garment: "flared-skirt@700".into(), over, distance_to, ..SceneSpec::default() };
    spec.load().unwrap().scene
}

fn skin(scene: &Scene, drape: &Drape) -> usize {
    crossing_pairs(&scene.garment.with_positions(drape.positions.clone()), scene.body.mesh()).len()
}

#[test]
fn a_pullover_over_a_skirt_rests_without_intersections_on_any_number_of_threads() {
    let scene = outfit(DistanceTo::Body);
    let settings = Settings::default();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| drape(&scene, &settings, &mut unobserved).unwrap())
    };
    let (one, two) = (on(1), on(2));
    assert!(one.positions == two.positions);
    assert_eq!((one.self_intersecting_pairs, one.penetrating_vertices, skin(&scene, &one)), (0, 0, 0));
    let certificate = certify(&scene, &settings.fabric, &one.positions).unwrap();
    for line in ["residual", "forces add up", "friction", "inside the body", "cloth through cloth"] {
        let finding = certificate.finding(line).unwrap();
        assert!(finding.passes, "{finding:?}");
    }
    // The hem of the pullover lies outside the skirt, at a larger distance from the axis of the body.
    let [skirt, pullover] = &scene.layers[..] else { panic!("{:?}", scene.layers) };
    let x = &one.positions;
    let of = |range: &std::ops::Range<usize>| x[range.clone()].to_vec();
    let waist = of(&skirt.vertices).iter().map(|x| x.z).fold(0.0, f64::max);
    let below = of(&pullover.vertices).into_iter().filter(|x| x.z < waist - 0.02 && x.x.abs() < 0.2);
    let radius = |x: glam::DVec3| (x.x * x.x + x.y * x.y).sqrt();
    let (mut outside, mut all) = (0, 0);
    for v in below {
        let beside = of(&skirt.vertices).into_iter().min_by(|a, b| a.distance(v).total_cmp(&b.distance(v))).unwrap();
        all += 1;
        outside += usize::from(radius(v) > radius(beside) - 0.01);
    }
    assert!(all > 50 && outside * 20 > all * 19, "{outside} of {all}");
}

#[test]
fn each_garment_has_its_own_fabric_and_all_of_them_rest() {
    let fabrics = ["denim", "interlock"].map(str::to_owned).to_vec();
    let over = vec!["pullover-1@900".to_owned()];
    let spec = SceneSpec { garment: "flared-skirt@700".into(), over, fabrics, ..SceneSpec::default() };
    let loaded = spec.load().unwrap();
    let scene = &loaded.scene;
    // No garment uses the fabric of the settings.
    let settings = Settings { fabric: Fabric::by_name("silk").unwrap(), ..Settings::default() };
    assert_eq!(scene.fabric_names(&settings.fabric), "denim + interlock");
    let [skirt, pullover] = &scene.layers[..] else { panic!("{:?}", scene.layers) };
    assert!(skirt.triangles.clone().all(|t| scene.rest.fabric_of(t) == 0));
    assert!(pullover.triangles.clone().all(|t| scene.rest.fabric_of(t) == 1));
    let draped = drape(scene, &settings, &mut unobserved).unwrap();
    let certificate = certify(scene, &settings.fabric, &draped.positions).unwrap();
    for line in ["residual", "forces add up", "friction", "inside the body", "cloth through cloth"] {
        let finding = certificate.finding(line).unwrap();
        assert!(finding.passes, "{finding:?}");
    }
    // Denim's is not the drape of a skirt in interlock, nor one in which it counts as interlock at rest.
    let soft = Scene { own_fabrics: vec![Some(Fabric::by_name("interlock").unwrap()); 2], ..scene.clone() };
    assert!(!certify(&soft, &settings.fabric, &draped.positions).unwrap().finding("residual").unwrap().passes);
    // The same fabric given once or once per garment gives the same bits.
    let of = |fabrics: Vec<String>, dial: &str| {
        let scene = SceneSpec { fabrics, ..spec.clone() }.load().unwrap().scene;
        let refine = Refine::Steps(2);
        drape(
            &scene,
            &Settings { fabric: Fabric::by_name(dial).unwrap(), refine, ..Settings::default() },
            &mut unobserved,
        )
    };
    let twice = of(vec!["denim".into(), "denim".into()], "silk").unwrap();
    assert!(twice.positions == of(Vec::new(), "denim").unwrap().positions);
}

#[test]
fn parts_do_not_span_garments_and_distances_count_to_the_chosen_surface() {
    let settings = Settings { refine: Refine::Steps(0), ..Settings::default() };
    let (to_body, to_below) = (outfit(DistanceTo::Body), outfit(DistanceTo::Below));
    let both = drape(&to_body, &settings, &mut unobserved).unwrap();
    let alone = |name: &str| {
        let scene = SceneSpec::new("form", name).load().unwrap().scene;
        drape(&scene, &settings, &mut unobserved).unwrap().parts.len()
    };
    assert_eq!(both.parts.len(), alone("flared-skirt@700") + alone("pullover-1@900"));
    assert_eq!(both.outcomes.len(), both.parts.len());
    let below = drape(&to_below, &settings, &mut unobserved).unwrap();
    let skirt = to_body.layers[0].vertices.clone();
    assert_eq!(below.distance[skirt.clone()], both.distance[skirt.clone()]);
    let nearer = (skirt.end..below.distance.len()).filter(|&v| below.distance[v] < both.distance[v] - 1e-3).count();
    let farther = (0..below.distance.len()).filter(|&v| below.distance[v] > both.distance[v] + 1e-12).count();
    assert!(nearer > 100 && farther == 0, "{nearer} {farther}");
}

#[test]
fn without_self_contact_cloth_crosses_and_coarse_cloth_shows_skin() {
    let scene = SceneSpec { garment: "pullover-1@900".into(), ..SceneSpec::default() }.load().unwrap().scene;
    let of = |self_contact| {
        let drape = drape(&scene, &Settings { self_contact, ..Settings::default() }, &mut unobserved).unwrap();
        skin(&scene, &drape)
    };
    let (with, without) = (of(true), of(false));
    assert!(with == 0 && without > 0, "{with} {without}");
}
