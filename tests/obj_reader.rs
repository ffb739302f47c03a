//! Generated OBJ texts in all forms of the format are read correctly, and mistakes are reported with their line.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use std::fmt::Write as _;

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

/// A polygon: vertex and texture coordinate of each corner, and a number whose bits choose among the forms of a face.
type Polygon = (Vec<(usize, usize)>, u8);

fn polygons() -> impl Strategy<Value = Vec<Polygon>> {
    prop::collection::vec((prop::collection::vec((0usize..1000, 0usize..1000), 1..7), any::<u8>()), 1..12)
}

/// The text of a mesh, in which faces use the forms that their numbers choose.
fn written(points: &[[f64; 3]], textures: &[[f64; 2]], polygons: &[Polygon]) -> String {
    let mut text = String::from("mtllib none.mtl\n");
    for (i, [x, y, z]) in points.iter().enumerate() {
        let more = ["", " 2", " 0.1 0.2 0.3", " # a corner"][i % 4];
        writeln!(text, "v {x:e} {y} {z}{more}").unwrap();
    }
    textures.iter().for_each(|[u, v]| writeln!(text, "vt {u} {v}").unwrap());
    for (number, (corners, form)) in polygons.iter().enumerate() {
        let bit = |k: u8| form >> k & 1 == 1;
        if bit(0) {
            writeln!(text, "g part{}\nusemtl cloth\nl 1 2", number % 3).unwrap();
        }
        text.push_str(if bit(1) { "f" } else { "fo" });
        for (k, (v, t)) in corners.iter().enumerate() {
            // Counted from the end as well as from the beginning.
            let index = |i: usize, n: usize| if bit(2) { (i % n) as i64 - n as i64 } else { (i % n) as i64 + 1 };
            let (vertex, texture) = (index(*v, points.len()), index(*t, textures.len()));
            match (is_textured(*form, k), bit(3)) {
                (true, false) => write!(text, " {vertex}/{texture}").unwrap(),
                (true, true) => write!(text, " {vertex}/{texture}/9").unwrap(),
                (false, false) => write!(text, " {vertex}").unwrap(),
                (false, true) => write!(text, " {vertex}//9").unwrap(),
            }
            if bit(4) {
                text.push_str(" \\\n");
            }
        }
        text.push('\n');
    }
    text
}

/// Whether the corner `k` of a face has a texture coordinate: none, every one or every second one.
fn is_textured(form: u8, k: usize) -> bool {
    [false, true, k % 2 == 1, true][usize::from(form >> 5 & 3)]
}

proptest! {
    #[test]
    fn corners_groups_and_order_are_those_of_the_text(
        points in prop::collection::vec(prop::array::uniform3(-1e6..1e6f64), 3..20),
        textures in prop::collection::vec(prop::array::uniform2(-10.0..10.0f64), 1..30),
        polygons in polygons(),
    ) {
        let text = written(&points, &textures, &polygons);
        let imported = match read_with(&text, None) {
            Ok(imported) => imported,
            // No face has three different vertices.
            Err(MeshError::Empty { .. }) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        };
        let source = &imported.source;
        prop_assert_eq!(&source.positions, &points.iter().copied().map(DVec3::from_array).collect::<Vec<_>>());
        let read: Vec<Vec<_>> = source.faces.iter().map(|face| source.corners_of(face).iter().map(|corner| {
            (corner.vertex as usize, source.textures.get(corner.texture as usize).map(DVec2::to_array))
        }).collect()).collect();
        let larger = || polygons.iter().filter(|(corners, _)| corners.len() > 2);
        let expected: Vec<Vec<_>> = larger().map(|(corners, form)| corners.iter().enumerate().map(|(k, (v, t))| {
            (v % points.len(), is_textured(*form, k).then(|| textures[t % textures.len()]))
        }).collect()).collect();
        prop_assert_eq!(read, expected);
        // Lines of a `g` and a `usemtl` stand before the face they stood before.
        let mut before = vec![(0, "mtllib none.mtl".to_owned())];
        let mut count = 0;
        for (number, (corners, form)) in polygons.iter().enumerate() {
            if form & 1 == 1 {
                before.extend([(count, format!("g part{}", number % 3)), (count, "usemtl cloth".to_owned())]);
            }
            count += u32::from(corners.len() > 2);
        }
        prop_assert_eq!(&source.statements, &before);
    }

    #[test]
    fn a_mistake_is_reported_with_its_line(
        points in prop::collection::vec(prop::array::uniform3(-1e6..1e6f64), 3..20),
        textures in prop::collection::vec(prop::array::uniform2(-10.0..10.0f64), 1..30),
        polygons in polygons(),
        (place, wrong) in (any::<usize>(), 0usize..12),
    ) {
        let wrong = [
            "v 1 2", "v 1 nan 2", "v 1 2 -inf", "v 1 1e8 2", "v 1 2 x", "vt", "vt 0 NaN",
            "f 1 2 9999", "f 1 2 -9999", "f 1/0 2 3", "f 1/1 2/-9999 3", "f 1 2 3///",
        ][wrong];
        let text = written(&points, &textures, &polygons);
        let mut lines: Vec<&str> = text.lines().collect();
        // Not into a continued line.
        let ends: Vec<usize> = (1..=lines.len()).filter(|&i| !lines[i - 1].ends_with('\\')).collect();
        // Corners counted back from a face that is above the last vertex are not those of the text.
        let at = ends[place % ends.len()].max(1 + points.len() + textures.len());
        lines.insert(at, wrong);
        let message = read_with(&lines.join("\n"), None).unwrap_err().to_string();
        prop_assert!(message.contains(&format!("mesh.obj, line {}: found", at + 1)), "{wrong}: {message}");
    }
}

#[test]
fn coordinates_that_no_garment_has_are_refused_by_line() {
    for (number, refused) in [("1e200", true), ("-1e8", true), ("1e7", false), ("-9999999", false)] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 3\n");
        let read = read_with(&text, None);
        assert_eq!(read.is_err(), refused, "{number}");
        if let Err(error) = read {
            let message = error.to_string();
            assert!(
                message.contains("mesh.obj, line 3: found the coordinate") && message.contains(number),
                "{message}"
            );
        }
    }
    let message = read_with("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1e200\nf 1 2 3\n", None).unwrap_err().to_string();
    assert!(message.contains("line 4") && message.contains("1e200"), "{message}");
}

#[test]
fn the_first_of_several_mistakes_in_the_file_is_reported() {
    let message = read_with("v 0 0 0\nv 1 0 0\nf 1 2 9\nv 0 x 0\n", None).unwrap_err().to_string();
    assert!(message.contains("line 3: found 9, expected 1 to 3"), "{message}");
}

#[test]
fn coordinates_keep_every_bit() {
    // The neighbours of halfway cases, subnormal numbers, and more digits than a number has.
    for number in [
        "0.1",
        "1.00000000000000011102230246251565",
        "1.000000000000000111022302462515654042363166809082031250000001",
        "9007199.254740993",
        "5e-324",
        "2.2250738585072011e-308",
        "-0.0",
    ] {
        let text = format!("v {number} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        let read = read_with(&text, None).unwrap().source.positions[0].x;
        assert_eq!(read.to_bits(), number.parse::<f64>().unwrap().to_bits(), "{number}");
    }
}

#[test]
fn words_of_any_length_are_quoted_by_their_beginning() {
    let text = format!("v 0 0 {}\n", "ä".repeat(100_000));
    let message = read_with(&text, None).unwrap_err().to_string();
    assert!(message.contains("200000 bytes") && message.len() < 400, "{message}");
}

#[test]
fn a_hundred_thousand_names_are_read_and_listed_in_short() {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n");
    for i in 0..100_000 {
        writeln!(text, "g name{i}\nf 1 2 {}", 3 + i % 2).unwrap();
    }
    assert_eq!(read_with(&text, Some("name99999")).unwrap().report.faces, 1);
    let message = read_with(&text, Some("none")).unwrap_err().to_string();
    assert!(message.contains("and 99980 more") && message.len() < 1000, "{message}");
}

#[test]
fn a_face_of_twenty_thousand_corners_is_cut() {
    let n = 20_000;
    let mut text = String::new();
    for i in 0..n {
        let (r, a) = (if i % 2 == 0 { 0.3 } else { 0.2 }, std::f64::consts::TAU * f64::from(i) / f64::from(n));
        writeln!(text, "v {} {} 1", r * a.cos(), r * a.sin()).unwrap();
    }
    text.push('f');
    (1..=n).for_each(|i| write!(text, " {i}").unwrap());
    assert_eq!(read_with(&text, None).unwrap().mesh.triangles.len(), 19_998);
}
