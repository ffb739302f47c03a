//! The built-in garments: the paper's sizes, well-shaped triangles, their openings, nothing inside the body.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::sync::LazyLock;

use glam::DVec2;
use partwise::DVec3;
use partwise::body::distance::Body;
use partwise::body::dress_form::{BodySpec, DressForm};
use partwise::body::girth::{Plane, section};
use partwise::garment::builtin::{TABLE_4_SIZES, garment_on};
use partwise::garment::{BUILT_IN, GarmentRequest, GarmentSpec, PlacedGarment};
use partwise::mesh::self_intersection::{crossing_pairs, self_intersecting_pairs};
use partwise::mesh::{Topology, TriMesh};

static FORM: LazyLock<DressForm> = LazyLock::new(|| DressForm::new(&BodySpec::default()).unwrap());
static BODY: LazyLock<TriMesh> = LazyLock::new(|| FORM.mesh(15_000).unwrap());

/// Every garment at both sizes of Table 4.
static WARDROBE: LazyLock<Vec<(usize, PlacedGarment)>> = LazyLock::new(|| {
    let sizes = BUILT_IN.iter().zip(TABLE_4_SIZES).flat_map(|(name, sizes)| sizes.map(|n| (*name, n)));
    sizes.map(|(name, n)| (n, make(name, Some(n)))).collect()
});

fn make(name: &str, vertices: Option<usize>) -> PlacedGarment {
    garment_on(&GarmentSpec::by_name(name).unwrap(), &FORM, vertices).unwrap()
}

/// The openings of each garment and how many edges each has.
fn openings(name: &str) -> BTreeMap<&'static str, usize> {
    BTreeMap::from_iter(match name {
        "flared-skirt" => vec![("hem", 1), ("waistband", 1)],
        "low-cut-dress" => vec![("hem", 1), ("neckline", 1), ("armholes", 2)],
        _ => vec![("hem", 1), ("neckline", 1), ("cuffs", 2)],
    })
}

#[test]
fn vertex_counts_are_those_of_table_4() {
    for (count, garment) in WARDROBE.iter() {
        assert_eq!(garment.mesh.vertex_count(), *count, "{}", garment.name);
    }
    for (name, [larger, _]) in BUILT_IN.iter().zip(TABLE_4_SIZES) {
        assert_eq!(GarmentSpec::by_name(name).unwrap().vertices, Some(larger));
    }
}

#[test]
fn each_garment_is_one_manifold_with_its_openings() {
    for (_, PlacedGarment { name, mesh, .. }) in WARDROBE.iter() {
        let topology = Topology::new(mesh);
        assert!(topology.edge_valence.iter().all(|&v| v <= 2), "{name}");
        assert_eq!(topology.components().1, 1, "{name}");
        let mut directed: Vec<(u32, u32)> =
            mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        directed.sort_unstable();
        assert!(directed.windows(2).all(|w| w[0] != w[1]), "{name}: winding");

        // A sphere with as many holes as there are openings: V − E + F = 2 − holes.
        let loops = topology.boundary_loops();
        let holes: usize = openings(name).values().sum();
        let euler = mesh.positions.len() + mesh.triangles.len() + holes;
        assert_eq!((loops.len(), euler), (holes, topology.edges.len() + 2), "{name}");

        // Each loop's triangles are all in the group of its opening.
        let mut found: BTreeMap<&str, usize> = BTreeMap::new();
        for boundary in &loops {
            let on = |v: u32| boundary.contains(&v);
            let groups: std::collections::BTreeSet<&str> = (0..mesh.triangles.len())
                .filter(|&t| mesh.triangles[t].iter().any(|&v| on(v)))
                .map(|t| mesh.groups[mesh.triangle_group[t] as usize].as_str())
                .collect();
            assert_eq!(groups.len(), 1, "{name}: {groups:?}");
            *found.entry(groups.first().unwrap()).or_default() += 1;
        }
        assert_eq!(found, openings(name), "{name}");
    }
}

#[test]
fn openings_are_at_their_heights() {
    let centre = |mesh: &TriMesh, group: &str| {
        let g = mesh.groups.iter().position(|n| n == group).unwrap() as u32;
        let points: Vec<DVec3> =
            (0..mesh.triangles.len()).filter(|&t| mesh.triangle_group[t] == g).flat_map(|t| mesh.corners(t)).collect();
        points.iter().sum::<DVec3>() / points.len() as f64
    };
    for (_, PlacedGarment { name, mesh, held, .. }) in WARDROBE.iter() {
        let low = mesh.bounds().unwrap().0.z;
        assert!((centre(mesh, "hem").z - low).abs() < 0.02, "{name}");
        if name == "flared-skirt" {
            assert!((centre(mesh, "waistband").z - FORM.measures.waist_height).abs() < 0.02);
            // Held are exactly the vertices of the upper edge.
            let top = Topology::new(mesh).boundary_loops().into_iter().find(|l| l.contains(&held[0])).unwrap();
            let mut top = top;
            top.sort_unstable();
            assert_eq!(&top, held);
            assert!(held.iter().all(|&v| (mesh.positions[v as usize].z - FORM.measures.waist_height).abs() < 1e-5));
        } else {
            let z = centre(mesh, "neckline").z;
            assert!((FORM.measures.bust_height..FORM.measures.cervicale_height).contains(&z), "{name}: {z}");
            assert!(held.is_empty());
        }
    }
}

fn angles(c: [DVec3; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i: usize| (c[(i + 1) % 3] - c[i]).angle_between(c[(i + 2) % 3] - c[i]).to_degrees())
}

#[test]
fn triangles_are_well_shaped_and_of_even_size() {
    for (_, PlacedGarment { name, mesh, .. }) in WARDROBE.iter() {
        let small = (0..mesh.triangles.len()).filter(|&t| angles(mesh.corners(t)).iter().any(|&a| a < 20.0)).count();
        assert!(small * 100 <= mesh.triangles.len(), "{name}: {small}");
        // No long triangles anywhere, so none where a sleeve meets the bodice.
        let lengths: Vec<f64> = Topology::new(mesh)
            .edges
            .iter()
            .map(|e| mesh.positions[e[0] as usize].distance(mesh.positions[e[1] as usize]))
            .collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        assert!(longest < 1.8 * mean, "{name}: {longest} {mean}");
    }
}

#[test]
fn no_direction_of_edges_is_preferred() {
    // In the flat frames of the skirt's cone, edges at angle θ: the means of cos 2θ, sin 2θ, cos 6θ, sin 6θ vanish for a
    // mesh without direction. A grid of squares with one diagonal has 0.33 or more in one of the first two.
    let (_, skirt) = WARDROBE.iter().find(|(_, g)| g.name == "flared-skirt").unwrap();
    let mut sums = [DVec2::ZERO; 2];
    let mut count = 0.0;
    for corners in &skirt.rest.corners {
        for i in 0..3 {
            let theta = (corners[(i + 1) % 3] - corners[i]).to_angle();
            for (sum, m) in sums.iter_mut().zip([2.0, 6.0]) {
                *sum += DVec2::from_angle(m * theta);
            }
            count += 1.0;
        }
    }
    // The fullness of the rest shape turns edges a little towards the weft, which the bound allows for.
    assert!(sums[0].length() / count < 0.2 && sums[1].length() / count < 0.2, "{:?}", sums.map(|s| s.length() / count));
}

#[test]
fn garments_are_outside_the_body_and_do_not_intersect() {
    let body = Body::new(&BODY).unwrap();
    for (_, PlacedGarment { name, mesh, .. }) in WARDROBE.iter() {
        let least = body.nearest_all(&mesh.positions).iter().map(|p| p.signed_distance).fold(f64::INFINITY, f64::min);
        assert!(least > 0.003, "{name}: {least}");
        assert_eq!(crossing_pairs(mesh, &BODY), Vec::<[u32; 2]>::new(), "{name}");
        assert_eq!(self_intersecting_pairs(mesh), Vec::<[u32; 2]>::new(), "{name}");
    }
}

#[test]
fn normals_point_away_from_the_body() {
    let body = Body::new(&BODY).unwrap();
    for (_, PlacedGarment { name, mesh, .. }) in WARDROBE.iter().take(9).step_by(2) {
        let normals = mesh.vertex_normals();
        let facing = body
            .nearest_all(&mesh.positions)
            .iter()
            .zip(&normals)
            .filter(|(near, n)| near.normal.dot(**n) > 0.0)
            .count();
        assert!(facing * 100 > 97 * normals.len(), "{name}: {facing} of {}", normals.len());
    }
}

#[test]
fn the_rest_shape_is_the_placed_one_except_for_fullness() {
    for (_, PlacedGarment { name, mesh, rest, .. }) in WARDROBE.iter().step_by(2) {
        assert_eq!(rest.corners.len(), mesh.triangles.len());
        let mut lengths: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        let (mut placed_area, mut rest_area) = (0.0, 0.0);
        for (t, corners) in rest.corners.iter().enumerate() {
            let double = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
            assert!(double > 0.0, "{name}: triangle {t} is turned over");
            rest_area += 0.5 * double;
            placed_area += 0.5 * mesh.double_area_vector(t).length();
            for i in 0..3 {
                let (a, b) = (mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]);
                let length = corners[i].distance(corners[(i + 1) % 3]);
                // Two triangles agree on the edge between them.
                let first = *lengths.entry((a.min(b), a.max(b))).or_insert(length);
                assert!((first - length).abs() < 1e-12, "{name}");
            }
        }
        let more = rest_area / placed_area;
        match name.as_str() {
            "flared-skirt" => assert!((1.2..1.45).contains(&more), "{more}"),
            "low-cut-dress" | "long-sleeved-dress" => assert!((1.01..1.1).contains(&more), "{more}"),
            _ => assert!((more - 1.0).abs() < 1e-12, "{name}: {more}"),
        }
    }
}

#[test]
fn the_skirt_s_hem_holds_its_fullness_and_its_waist_none() {
    let (_, skirt) = WARDROBE.iter().find(|(_, g)| g.name == "flared-skirt").unwrap();
    let topology = Topology::new(&skirt.mesh);
    let rest: BTreeMap<(u32, u32), f64> = skirt
        .mesh
        .triangles
        .iter()
        .zip(&skirt.rest.corners)
        .flat_map(|(t, c)| (0..3).map(|i| ((t[i], t[(i + 1) % 3]), c[i].distance(c[(i + 1) % 3]))).collect::<Vec<_>>())
        .collect();
    for boundary in topology.boundary_loops() {
        let pairs = (0..boundary.len()).map(|i| (boundary[i], boundary[(i + 1) % boundary.len()]));
        let (mut placed, mut flat) = (0.0, 0.0);
        for (a, b) in pairs {
            placed += skirt.mesh.positions[a as usize].distance(skirt.mesh.positions[b as usize]);
            flat += rest.get(&(a, b)).or_else(|| rest.get(&(b, a))).unwrap();
        }
        let expected = if skirt.held.contains(&boundary[0]) { 1.0 } else { 1.45 };
        assert!((flat / placed - expected).abs() < 0.01, "{}", flat / placed);
    }
}

#[test]
fn lengths_and_eases_agree_with_the_spec() {
    for (_, PlacedGarment { name, mesh, .. }) in WARDROBE.iter().step_by(2) {
        let spec = GarmentSpec::by_name(name).unwrap();
        let (low, high) = mesh.bounds().unwrap();
        // Along the middle of the shoulder the cloth rises a little towards the neck.
        assert!((100.0 * (high.z - low.z) - spec.length_cm).abs() < 1.5, "{name}: {}", high.z - low.z);
        let girth = |z: f64| {
            section(mesh, Plane::horizontal(z))
                .iter()
                .filter(|l| l.closed && l.centre().x.abs() < 0.03)
                .map(|l| 100.0 * l.tape_length())
                .fold(0.0, f64::max)
        };
        let m = &FORM.measures;
        let waist = girth(m.waist_height - 0.002) - 100.0 * m.waist;
        // Where the body is wider than the tube, the cloth follows it: more ease than requested, and at most a centimetre less.
        assert!((spec.ease.waist_cm - 1.0..spec.ease.waist_cm + 4.0).contains(&waist), "{name}: {waist}");
        // Under a sleeve the bust's plane cuts the sleeve as well.
        if name == "low-cut-dress" {
            let bust = girth(m.bust_height) - 100.0 * m.bust;
            assert!((spec.ease.bust_cm - 1.0..spec.ease.bust_cm + 4.0).contains(&bust), "{name}: {bust}");
        }
    }
}

/// The greatest share of x in the directions in which the cloth leaves the lowest centimetre of its armholes: 0 where it runs straight up.
fn lip(mesh: &TriMesh) -> f64 {
    let topology = Topology::new(mesh);
    let normals: Vec<DVec3> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(c - a).normalize()
        })
        .collect();
    let group = mesh.groups.iter().position(|name| name == "armholes").unwrap() as u32;
    let mut edges = Vec::new();
    for (t, &[a, b, c]) in mesh.triangles.iter().enumerate().filter(|(t, _)| mesh.triangle_group[*t] == group) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let ends = [from.min(to), from.max(to)];
            let edge = topology.edges.binary_search(&ends).unwrap();
            if topology.edge_valence[edge] == 1 {
                let [from, to] = [from, to].map(|v| mesh.positions[v as usize]);
                edges.push((0.5 * (from + to), (to - from).normalize().cross(normals[t])));
            }
        }
    }
    let lowest = edges.iter().map(|(middle, _)| middle.z).fold(f64::INFINITY, f64::min);
    let low = edges.iter().filter(|(middle, _)| middle.z < lowest + 0.01);
    low.map(|(_, out)| out.x.abs()).fold(0.0, f64::max)
}

#[test]
fn cloth_runs_straight_up_to_an_armhole_under_the_arm() {
    for size in [34, 38, 44, 48] {
        let form = DressForm::new(&BodySpec::eu_size(size).unwrap()).unwrap();
        for bust_cm in [6.0, 12.0] {
            let mut spec = GarmentSpec::by_name("low-cut-dress").unwrap();
            spec.ease.bust_cm = bust_cm;
            let dress = garment_on(&spec, &form, Some(5628)).unwrap();
            let lip = lip(&dress.mesh);
            assert!(lip < 0.45, "EU {size}, ease {bust_cm} cm: {lip:.2}");
        }
    }
}

#[test]
fn length_edge_length_and_vertex_count_can_be_changed() {
    let text = include_str!("../assets/garments/flared-skirt.toml");
    let mut spec = GarmentSpec::from_toml(&text.replace("length_cm = 60.0", "length_cm = 75.0")).unwrap();
    let longer = garment_on(&spec, &FORM, Some(900)).unwrap();
    assert_eq!(longer.mesh.vertex_count(), 900);
    let (low, high) = longer.mesh.bounds().unwrap();
    assert!((high.z - low.z - 0.75).abs() < 1e-4);

    spec.vertices = None;
    spec.edge_length_cm = Some(3.0);
    let coarse = garment_on(&spec, &FORM, None).unwrap();
    let edges = Topology::new(&coarse.mesh).edges;
    let mean = edges
        .iter()
        .map(|e| coarse.mesh.positions[e[0] as usize].distance(coarse.mesh.positions[e[1] as usize]))
        .sum::<f64>()
        / edges.len() as f64;
    assert!((mean - 0.03).abs() < 0.003, "{mean}");

    let fine = make("flared-skirt", Some(30_000));
    assert_eq!(fine.mesh.vertex_count(), 30_000);
}

#[test]
fn requests_name_a_garment_and_a_count() {
    let plain: GarmentRequest = "pullover-1".parse().unwrap();
    assert_eq!((plain.name.as_str(), plain.vertices), ("pullover-1", None));
    let sized: GarmentRequest = "flared-skirt@3613".parse().unwrap();
    assert_eq!((sized.name.as_str(), sized.vertices), ("flared-skirt", Some(3613)));
    let error = "flared-skirt@many".parse::<GarmentRequest>().unwrap_err().to_string();
    assert!(error.contains("many") && error.contains("flared-skirt@5000"), "{error}");
}

#[test]
fn errors_of_garments_name_the_value() {
    let unknown = GarmentSpec::by_name("cape").unwrap_err().to_string();
    assert!(unknown.contains("cape") && unknown.contains("low-cut-dress"), "{unknown}");
    let text = include_str!("../assets/garments/pullover-1.toml");
    let error = |from: &str, to: &str| {
        assert!(text.contains(from));
        GarmentSpec::from_toml(&text.replace(from, to)).unwrap_err().to_string()
    };
    assert!(error("length_cm = 62.0", "length_cm = -3.0").contains("length_cm is -3"));
    assert!(error("length_cm = 62.0", "lenght_cm = 62.0").contains("lenght_cm"));
    assert!(error("bust_cm = 10.0", "bust_cm = nan").contains("ease.bust_cm is NaN"));
    let spec = GarmentSpec::by_name("flared-skirt").unwrap();
    let ask = |vertices| garment_on(&spec, &FORM, Some(vertices)).unwrap_err().to_string();
    assert!(ask(10).contains("10 vertices") && ask(2_000_000).contains("2000000 vertices"));
    let floor_length = GarmentSpec { length_cm: 120.0, ..spec.clone() };
    assert!(garment_on(&floor_length, &FORM, None).unwrap_err().to_string().contains("120"));
}

#[test]
fn garments_fit_other_bodies() {
    let body = |stature_cm, bust_cm, waist_cm: f64, hip_cm: f64| BodySpec {
        stature_cm,
        bust_cm,
        underbust_cm: bust_cm - 13.0,
        waist_cm,
        hip_cm,
        thigh_cm: 0.6 * hip_cm,
        biceps_cm: 0.3 * hip_cm,
        ..BodySpec::default()
    };
    for spec in [body(152.0, 80.0, 68.0, 90.0), body(175.0, 108.0, 100.0, 115.0)] {
        let form = DressForm::new(&spec).unwrap();
        let mesh = form.mesh(8_000).unwrap();
        let body = Body::new(&mesh).unwrap();
        for name in BUILT_IN {
            let garment = garment_on(&GarmentSpec::by_name(name).unwrap(), &form, Some(2_000)).unwrap();
            let holes: usize = openings(name).values().sum();
            assert_eq!(Topology::new(&garment.mesh).boundary_loops().len(), holes, "{name}");
            let least = body
                .nearest_all(&garment.mesh.positions)
                .iter()
                .map(|p| p.signed_distance)
                .fold(f64::INFINITY, f64::min);
            assert!(least > 0.003, "{name} on {}: {least}", spec.stature_cm);
        }
    }
}

#[test]
fn the_same_spec_gives_the_same_bits_on_any_number_of_threads() {
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| make("low-cut-dress", Some(1_500)))
    };
    assert_eq!(on(1), on(3));
}
