//! Which panel is cut from which fabric: the file that says so, and what comes of it.

use std::fs;
use std::path::Path;

use partwise::drape::{Drape, Settings, drape, unobserved};
use partwise::garment::fabric::Fabric;
use partwise::mechanics::energy::Cloth;
use partwise::mechanics::energy::membrane::Triangle;
use partwise::scene::Loaded;
use partwise::study::certificate::{Certificate, certify};
use partwise::study::job::Job;
use partwise::study::sweep::Plan;
use partwise::{GRAVITY, Scene, SceneSpec};
use tempfile::TempDir;

/// A T-shirt with `fabrics` beside it; none where that is empty.
fn shirt(fabrics: &str) -> (TempDir, SceneSpec) {
    let folder = TempDir::new().unwrap();
    let asset = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/patterns/tshirt.json");
    fs::copy(asset, folder.path().join("shirt_specification.json")).unwrap();
    if !fabrics.is_empty() {
        fs::write(folder.path().join("shirt.fabrics.toml"), fabrics).unwrap();
    }
    let garment = folder.path().join("shirt_specification.json").display().to_string();
    (folder, SceneSpec { edge_cm: 4.0, ..SceneSpec::new("form", garment) })
}

fn load(fabrics: &str) -> Result<Loaded, String> {
    let (_folder, spec) = shirt(fabrics);
    spec.load().map_err(|e| e.to_string())
}

fn by_name(name: &str) -> Fabric {
    Fabric::by_name(name).unwrap()
}

#[test]
fn panels_get_the_fabrics_of_the_file_beside_the_pattern() {
    let dial = by_name("wool");
    let of = |loaded: &Loaded, panel: &str| {
        let group = loaded.scene.garment.groups.iter().position(|g| g == panel).unwrap() as u32;
        let fabrics = loaded.scene.fabrics(&dial);
        let triangles = loaded.scene.garment.triangle_group.iter().enumerate().filter(|(_, g)| **g == group);
        let mut names: Vec<&str> =
            triangles.map(|(t, _)| fabrics[loaded.scene.rest.fabric_of(t)].name.as_str()).collect();
        names.dedup();
        names.join(" ")
    };
    for (file, front, back) in [
        ("", "wool", "wool"),
        ("default = \"denim\"\n", "denim", "denim"),
        ("[panels]\nback = \"denim\"\n", "wool", "denim"),
        ("default = \"silk\"\n[panels]\nback = \"denim\"\n", "silk", "denim"),
        ("[panels]\n\"*\" = \"silk\"\nback = \"denim\"\n", "silk", "denim"),
        ("[panels]\n\"fr*t\" = \"silk\"\n\"*k\" = \"denim\"\n", "silk", "denim"),
    ] {
        let loaded = load(file).unwrap();
        assert_eq!((of(&loaded, "front").as_str(), of(&loaded, "back").as_str()), (front, back), "{file}");
        let several = front != back;
        assert_eq!(loaded.scene.rest.cut_from.is_empty(), !several, "{file}");
        assert_eq!(loaded.notes().iter().any(|note| note.contains("cut: shirt: denim")), back == "denim", "{file}");
        assert_eq!(loaded.scene.takes_the_settings_fabric(), front == "wool", "{file}");
    }
}

#[test]
fn a_fabrics_file_counts_from_the_file_that_names_it() {
    let (folder, spec) = shirt("[panels]\nback = \"own.toml\"\n");
    let own = Fabric { name: "mine".into(), friction: 0.9, ..by_name("denim") };
    fs::write(folder.path().join("own.toml"), toml::to_string(&own).unwrap()).unwrap();
    assert_eq!(spec.load().unwrap().scene.fabric_names(&by_name("jersey")), "jersey + mine");
    let names = |ending: &str| spec.files().iter().any(|file| file.ends_with(ending));
    assert!(names("own.toml") && names("shirt.fabrics.toml"), "{:?}", spec.files());
    // A point of a sweep is another where the fabric is.
    let id = || Plan::of_jobs("t", vec![Job { scene: spec.clone(), ..Job::default() }]).unwrap().points[0].id.clone();
    let before = id();
    assert_eq!(before, id());
    fs::write(folder.path().join("own.toml"), toml::to_string(&Fabric { friction: 0.8, ..own }).unwrap()).unwrap();
    assert_ne!(before, id());
}

#[test]
fn invalid_fabric_files_are_refused_with_the_cause() {
    for (file, words) in [
        ("[panels]\nback = \"tweed\"\n", &["shirt.fabrics.toml", "line 2", "panels.back", "tweed", "denim"][..]),
        ("[panels]\n\n\"sleeve*\" = \"silk\"\n", &["line 3", "sleeve*", "shirt", "front, back"]),
        ("default = \"tweed\"\n", &["line 1", "default", "tweed"]),
        ("default = 3\n", &["shirt.fabrics.toml", "line 1", "expected", "[panels]"]),
        ("[panels\n", &["shirt.fabrics.toml", "line 1", "expected"]),
        ("[pannels]\nback = \"silk\"\n", &["pannels", "panels"]),
        ("[panels]\nback = \"missing.toml\"\n", &["line 2", "missing.toml", "cannot be read"]),
        ("[panels]\n\"b*\" = \"silk\"\n\"*k\" = \"denim\"\n", &["back", "b*", "*k", "a line for this panel"]),
    ] {
        let message = load(file).err().unwrap_or_default();
        for word in words {
            assert!(message.contains(word), "{file:?} should say {word:?}: {message}");
        }
    }
    let (folder, spec) = shirt("default = \"silk\"\n");
    let wrong = |spec: &SceneSpec| spec.load().unwrap_err().to_string();
    let given = |fabrics: &[&str]| fabrics.iter().map(|f| (*f).to_owned()).collect();
    let message = wrong(&SceneSpec { fabrics: given(&["denim"]), ..spec.clone() });
    assert!(
        message.contains("silk") && message.contains("denim") && message.contains("take one of them away"),
        "{message}"
    );
    let message = wrong(&SceneSpec { fabrics: given(&["denim", "silk"]), ..spec.clone() });
    assert!(message.contains("2 fabrics for 1 garments"), "{message}");
    let nowhere = folder.path().join("nowhere.toml").display().to_string();
    let message = wrong(&SceneSpec { fabrics_file: Some(nowhere.clone()), ..spec.clone() });
    assert!(message.contains("nowhere.toml") && message.contains("cannot be read"), "{message}");
    let message = wrong(&SceneSpec { fabrics_file: Some(nowhere), over: given(&["flared-skirt"]), ..spec });
    assert!(message.contains("2 garments, expected one"), "{message}");
}

/// How far nine in ten triangles of a panel are stretched at most, along the weft or the warp.
fn stretched(loaded: &Loaded, drape: &Drape, panel: u32) -> f64 {
    let scene = &loaded.scene;
    let of_panel = (0..scene.garment.triangles.len()).filter(|&t| scene.garment.triangle_group[t] == panel);
    let strain = |t: usize| {
        let [a, b, c] = scene.garment.triangles[t].map(|v| drape.positions[v as usize]);
        let rest = Triangle::new([0, 1, 2], scene.rest.corners[t]).unwrap();
        let [u, v] = rest.deformation(&[a, b, c]);
        (u.length() - 1.0).max(v.length() - 1.0)
    };
    let mut strains: Vec<f64> = of_panel.map(strain).collect();
    strains.sort_by(f64::total_cmp);
    strains[strains.len() * 9 / 10]
}

#[test]
fn a_denim_back_stretches_less_than_a_jersey_back_and_has_its_weight() {
    let settings = Settings { fabric: by_name("jersey"), ..Settings::default() };
    let (jersey, half) = (load("").unwrap(), load("[panels]\nback = \"denim\"\n").unwrap());
    let [of_jersey, of_half] = [&jersey, &half].map(|loaded| drape(&loaded.scene, &settings, &mut unobserved).unwrap());
    let back = jersey.scene.garment.groups.iter().position(|g| g == "back").unwrap() as u32;
    let [soft, stiff] = [stretched(&jersey, &of_jersey, back), stretched(&half, &of_half, back)];
    assert!(stiff < 0.5 * soft, "the back is strained by {stiff} in denim and {soft} in jersey");
    let scene = &half.scene;
    let certified = |scene: &Scene| certify(scene, &settings.fabric, &of_half.positions).unwrap();
    let (own, of_one) = (certified(scene), certified(&jersey.scene));
    let value = |certificate: &Certificate| certificate.finding("residual").unwrap().value;
    assert!(value(&own) < 2e-3 && own.finding("forces add up").unwrap().passes, "{own:?}");
    assert!(value(&of_one) > 0.1, "at rest in denim and jersey, and in jersey alone: {of_one:?}");
    let fabrics = scene.fabrics(&settings.fabric);
    let density = |t: usize| fabrics[scene.rest.fabric_of(t)].density_kg_per_m2;
    let weight: f64 = scene.rest.areas().iter().enumerate().map(|(t, area)| GRAVITY * area * density(t)).sum();
    let cloth = Cloth::new(&scene.garment, &scene.topology, &scene.rest, &fabrics, &[]).unwrap();
    assert!((cloth.weight - weight).abs() < 1e-12 * weight, "{} N, {weight} N", cloth.weight);
}
