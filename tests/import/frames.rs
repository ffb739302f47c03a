//! The frames of body and garment, each guessed from its own file.

use glam::DVec3;
use partwise::SceneSpec;
use partwise::body::BodySpec;
use partwise::body::distance::Body;
use partwise::mesh::TriMesh;
use partwise::mesh::export::write_mesh;
use partwise::mesh::import::{Beside, ImportOptions, import_body, import_garment};
use partwise::mesh::{Axis, Unit};
use partwise::scene::closeness;

const UNITS: [(Unit, f64); 4] = [(Unit::M, 1.0), (Unit::Dm, 10.0), (Unit::Cm, 100.0), (Unit::Mm, 1000.0)];
const AXES: [Axis; 3] = [Axis::Z, Axis::Y, Axis::X];

/// The mesh (m, z up) in another frame.
fn in_frame(mesh: &TriMesh, per_metre: f64, up: Axis) -> TriMesh {
    let turned = |p: &DVec3| match up {
        Axis::Z => *p,
        Axis::Y => DVec3::new(p.x, p.z, -p.y),
        Axis::X => DVec3::new(p.z, p.y, -p.x),
    };
    mesh.with_positions(mesh.positions.iter().map(|p| turned(p) * per_metre).collect())
}

/// A tube of this radius about a vertical axis through (x, y), m.
fn tube(radius: f64, [x, y]: [f64; 2], [low, high]: [f64; 2]) -> TriMesh {
    let mut mesh = TriMesh::default();
    for z in [low, 0.5 * (low + high), high] {
        mesh.positions.extend((0..24).map(|i| {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / 24.0).sin_cos();
            DVec3::new(x + radius * c, y + radius * s, z)
        }));
    }
    for (j, i) in (0..2).flat_map(|j| (0..24).map(move |i| (j, i))) {
        let [a, b] = [24 * j + i, 24 * j + (i + 1) % 24];
        mesh.triangles.extend([[a, b, a + 24], [b, b + 24, a + 24]]);
    }
    mesh
}

/// A horizontal square of 1.2 m above the head.
fn cloth() -> TriMesh {
    let at = |i: u32| DVec3::new(0.1 * f64::from(i % 13) - 0.6, 0.1 * f64::from(i / 13) - 0.6, 1.75);
    let squares = (0..12).flat_map(|j| (0..12).map(move |i| 13 * j + i));
    let triangles = squares.flat_map(|a| [[a, a + 1, a + 14], [a, a + 14, a + 13]]).collect();
    TriMesh::new((0..169).map(at).collect(), triangles)
}

#[test]
fn a_garment_is_found_in_its_own_frame_whatever_the_frame_of_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let form = partwise::body::dress_form(&BodySpec::default()).unwrap();
    let made = |name: &str| SceneSpec::new("form", name).load().unwrap().scene.garment;
    let mut garments: Vec<(&str, TriMesh)> =
        ["pullover-1@900", "flared-skirt@700", "low-cut-dress@900"].map(|name| (name, made(name))).into();
    garments.push(("belt", tube(0.17, [0.0, 0.0], [1.03, 1.08])));
    garments.push(("leg warmer", tube(0.075, [0.09, 0.0], [0.15, 0.4])));
    let mut wrong = Vec::new();
    let mut tried = 0;
    for (body_unit, body_up, lifted) in [(0, 0, 0.0), (3, 1, 0.0), (0, 1, -0.9), (2, 0, -0.9)] {
        let up = DVec3::Z * lifted;
        let moved = |mesh: &TriMesh| mesh.with_positions(mesh.positions.iter().map(|p| *p + up).collect());
        let (unit, per_metre) = UNITS[body_unit];
        write_mesh(&path("body.obj"), &in_frame(&moved(&form), per_metre, AXES[body_up])).unwrap();
        let own = import_body(&path("body.obj"), &ImportOptions::default()).unwrap();
        assert_eq!((own.report.frame.unit, own.report.frame.up), (unit, AXES[body_up]));
        let body = Body::new(&own.mesh).unwrap();
        let closeness = |points: &[DVec3]| closeness(&body, points);
        let beside =
            Beside::Body { frame: &own.report.frame, bounds: own.mesh.bounds().unwrap(), closeness: &closeness };
        for (name, garment) in &garments {
            for ((unit, per_metre), up) in UNITS.into_iter().flat_map(|unit| AXES.map(|up| (unit, up))) {
                write_mesh(&path("garment.obj"), &in_frame(&moved(garment), per_metre, up)).unwrap();
                let found = import_garment(&path("garment.obj"), &ImportOptions::default(), &beside);
                let frame = found.map(|found| found.report.frame);
                tried += 1;
                if !frame.as_ref().is_ok_and(|frame| (frame.unit, frame.up) == (unit, up)) {
                    wrong.push(format!("{name} in {unit}, {up} up, body {body_unit} {body_up} {lifted}: {frame:?}"));
                }
            }
        }
        // In the body's frame even a cloth that does not overlap it, and a bracelet.
        for (name, garment) in [("cloth", cloth()), ("bracelet", tube(0.04, [0.3, 0.0], [0.9, 0.91]))] {
            write_mesh(&path("garment.obj"), &in_frame(&moved(&garment), UNITS[body_unit].1, AXES[body_up])).unwrap();
            let found = import_garment(&path("garment.obj"), &ImportOptions::default(), &beside).unwrap();
            assert_eq!(found.report.frame.reason, "as the body", "{name}: {:?}", found.report.frame);
        }
    }
    assert!(wrong.is_empty(), "{} of {tried}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_body_in_millimetres_and_a_garment_in_metres_meet_and_options_name_each_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let name = |file: &str| path(file).display().to_string();
    let form = partwise::body::dress_form(&BodySpec::default()).unwrap();
    let garment = SceneSpec::new("form", "flared-skirt@700").load().unwrap().scene.garment;
    write_mesh(&path("body.obj"), &in_frame(&form, 1000.0, Axis::Y)).unwrap();
    write_mesh(&path("garment.obj"), &garment).unwrap();
    let spec = SceneSpec { push_out: false, ..SceneSpec::new(name("body.obj"), name("garment.obj")) };
    let placed = |spec: &SceneSpec| spec.load().map(|loaded| loaded.scene.garment.bounds().unwrap());
    let expected = garment.bounds().unwrap();
    let close = |(low, high): (DVec3, DVec3)| low.distance(expected.0) + high.distance(expected.1) < 1e-5;
    assert!(close(placed(&spec).unwrap()));
    let notes = spec.load().unwrap().notes().join("\n");
    assert!(notes.contains("in m, z up") && notes.contains("0 in mm, y up, as the body)"), "{notes}");
    // Each frame has its options; those of both files apply where they have none.
    let given = SceneSpec {
        body_unit: Some(Unit::Mm),
        body_up: Some(Axis::Y),
        garment_unit: Some(Unit::M),
        garment_up: Some(Axis::Z),
        ..spec.clone()
    };
    assert!(close(placed(&given).unwrap()));
    let both = SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), garment_unit: None, garment_up: None, ..given };
    assert!(close(placed(&both).unwrap()));
    // A garment that fits in no frame is refused with its size.
    write_mesh(&path("garment.obj"), &in_frame(&garment, 1e-7, Axis::Z)).unwrap();
    let refusal = spec.load().unwrap_err().to_string();
    assert!(refusal.contains("found no unit") && refusal.contains("--garment-unit"), "{refusal}");
}
