//! Our reader of OBJ against another one, and against files whose cost must not run away.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};
use partwise::mesh::import::{Beside, ImportOptions, Imported, import_garment};
use partwise::mesh::{Axis, Frame, MeshError, Unit};
use proptest::prelude::*;

fn read_with(text: &str, group: Option<&str>) -> Result<Imported, MeshError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    std::fs::write(&path, text).unwrap();
    let options = ImportOptions {
        group: group.map(str::to_owned),
        unit: Some(Unit::M),
        up: Some(Axis::Z),
        ..ImportOptions::default()
    };
    import_garment(&path, &options, &Beside::File(&Frame::given(Unit::M, Axis::Z)))
}

/// The corners of all faces as tobj reads them, face after face: position and texture coordinate.
fn by_tobj(text: &str) -> Vec<(DVec3, Option<[f64; 2]>)> {
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), |_: &Path| Ok(Default::default()))
            .unwrap();
    let mut corners = Vec::new();
    for mesh in models.iter().map(|model| &model.mesh) {
        for (k, &i) in mesh.indices.iter().enumerate() {
            let place = DVec3::from_slice(&mesh.positions[3 * i as usize..3 * i as usize + 3]);
            let texture = mesh.texcoord_indices.get(k).map(|&t| [0, 1].map(|c| mesh.texcoords[2 * t as usize + c]));
            corners.push((place, texture));
        }
    }
    corners
}

proptest! {
    #[test]
    fn every_corner_is_where_another_reader_has_it(
        points in prop::collection::vec(prop::array::uniform3(-1e6..1e6f64), 3..20),
        textures in prop::collection::vec(prop::array::uniform2(-10.0..10.0f64), 1..9),
        faces in prop::collection::vec((prop::collection::vec((0usize..1000, 0usize..1000), 3..7), any::<bool>()), 1..12),
        textured in any::<bool>(),
    ) {
        let mut text = String::new();
        points.iter().for_each(|[x, y, z]| writeln!(text, "v {x:e} {y} {z}").unwrap());
        // A file with coordinates that no face has reads there as if every face had the first.
        let given = if textured { textures.as_slice() } else { &[] };
        given.iter().for_each(|[u, v]| writeln!(text, "vt {u} {v}").unwrap());
        for (number, (corners, backwards)) in faces.iter().enumerate() {
            writeln!(text, "g part{}", number % 3).unwrap();
            text.push('f');
            for (v, t) in corners {
                let (v, t) = (v % points.len(), t % textures.len());
                // Counted from the end as well as from the beginning.
                let index = |i: usize, n: usize| if *backwards { i as i64 - n as i64 } else { i as i64 + 1 };
                write!(text, " {}", index(v, points.len())).unwrap();
                if textured {
                    write!(text, "/{}", index(t, textures.len())).unwrap();
                }
            }
            text.push('\n');
        }
        let ours = match read_with(&text, None) {
            Ok(ours) => ours,
            // Every face between fewer than three vertices.
            Err(MeshError::Empty { .. }) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let source = &ours.source;
        let read: Vec<_> = source.faces.iter().flat_map(|face| source.corners_of(face)).map(|corner| {
            let texture = source.textures.get(corner.texture as usize).map(DVec2::to_array);
            (source.positions[corner.vertex as usize], texture)
        }).collect();
        prop_assert_eq!(read, by_tobj(&text));
    }
}

#[test]
fn coordinates_that_no_garment_has_are_refused_by_line() {
    for (number, refused) in [("1e200", true), ("-1e8", true), ("1e7", false), ("-9999999", false)] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 3\n");
        let read = read_with(&text, None);
        assert_eq!(read.is_err(), refused, "{number}");
        if let Err(error) = read {
            let said = error.to_string();
            assert!(said.contains("mesh.obj, line 3: found the coordinate") && said.contains(number), "{said}");
        }
    }
    let said = read_with("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1e200\nf 1 2 3\n", None).unwrap_err().to_string();
    assert!(said.contains("line 4") && said.contains("1e200"), "{said}");
}

#[test]
fn words_of_any_length_are_quoted_by_their_beginning() {
    let text = format!("v 0 0 {}\n", "ä".repeat(100_000));
    let said = read_with(&text, None).unwrap_err().to_string();
    assert!(said.contains("200000 bytes") && said.len() < 400, "{said}");
}

#[test]
fn a_hundred_thousand_names_cost_no_more_than_their_lines() {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n");
    for i in 0..100_000 {
        writeln!(text, "g name{i}\nf 1 2 {}", 3 + i % 2).unwrap();
    }
    let started = Instant::now();
    assert_eq!(read_with(&text, Some("name99999")).unwrap().report.faces, 1);
    let said = read_with(&text, Some("none")).unwrap_err().to_string();
    assert!(said.contains("and 99980 more") && said.len() < 1000, "{said}");
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
}

#[test]
fn a_face_of_twenty_thousand_corners_is_cut_at_once() {
    let n = 20_000;
    let mut text = String::new();
    for i in 0..n {
        let (r, a) = (if i % 2 == 0 { 0.3 } else { 0.2 }, std::f64::consts::TAU * f64::from(i) / f64::from(n));
        writeln!(text, "v {} {} 1", r * a.cos(), r * a.sin()).unwrap();
    }
    text.push('f');
    (1..=n).for_each(|i| write!(text, " {i}").unwrap());
    let started = Instant::now();
    assert_eq!(read_with(&text, None).unwrap().mesh.triangles.len(), 19_998);
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
}
