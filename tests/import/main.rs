//! Other people's OBJ files: everything that was met in the wild, from texts made here.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

mod frames;
mod repairs;

use std::fs;
use std::path::PathBuf;

use glam::{DVec2, DVec3};
use partwise::mesh::export::{write_imported, write_mesh};
use partwise::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use partwise::mesh::report::{Remark, Repair};
use partwise::mesh::{Axis, Frame, MeshError, TriMesh, Unit};
use proptest::prelude::*;
use tempfile::TempDir;

const METRES: ImportOptions =
    ImportOptions { group: None, unit: Some(Unit::M), up: Some(Axis::Z), weld: false, open_body: true, source: None };

fn file(text: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn read_with(text: &str, options: &ImportOptions) -> Result<Imported, MeshError> {
    let (_folder, path) = file(text);
    import_garment(&path, options, &Beside::File(&Frame::given(Unit::M, Axis::Z)))
}

fn read(text: &str) -> Imported {
    read_with(text, &METRES).unwrap()
}

/// Four vertices of a unit square in the xy plane.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn all_four_face_forms_quads_ngons_and_negative_indices_in_one_file() {
    let text = "\
        v 0 0 0\nv 1 0 0\nvt 0.5 0.25\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n\
        f 1 2 3\nf 1/1 3/1 4/1\n\
        v 2 0 0\nv 2 1 0\nf 2//1 5//1 6//1 3//1\n\
        v 3 0 0\nv 3.5 0.5 0\nv 3 1 0\nf -5/1/1 -3/1/1 -2/1/1 -1/1/1 -4/1/1\n";
    let imported = read(text);
    assert_eq!(imported.mesh.vertex_count(), 9);
    assert_eq!(imported.mesh.triangles.len(), 1 + 1 + 2 + 3);
    let area: f64 = imported.mesh.triangle_areas().iter().sum();
    assert!((area - (1.0 + 1.0 + 1.0 + 0.25)).abs() < 1e-12, "{area}");
    assert!(imported.mesh.vertex_normals().iter().all(|n| (*n - DVec3::Z).length() < 1e-12));
    assert!(imported.report.repairs.contains(&Repair::PolygonsCut { quads: 1, larger: 1 }));
    // Texture coordinates stay with the corners that have them.
    assert_eq!(imported.texture[0], None);
    assert_eq!(imported.texture[1], Some([DVec2::new(0.5, 0.25); 3]));
    assert_eq!(imported.texture[2], None);
}

#[test]
fn junk_comments_crlf_exponents_continued_lines_and_missing_materials_are_no_obstacle() {
    let text = "\
        \u{feff}# header\r\nfoo bar 1 2\r\nmtllib missing.mtl\r\nusemtl cloth\r\ns off\r\n\
        v  0.0e0 0 0 1.0\r\nv 1E+0 0 0 0.5 0.5 0.5\r\nv 100e-2 1 0\r\n  v\t0 1 0   # a corner\r\n\
        cstype bezier\r\nf 1 2 \\\r\n 3 4 # a face\r\nl 1 2\r\np 1\r\nend";
    let imported = read(text);
    assert_eq!(imported.mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]);
    assert_eq!(imported.mesh.triangles.len(), 2);
    let unknown = imported.report.remarks.iter().find_map(|remark| match remark {
        Remark::UnknownLines { count, line, text } => Some((*count, *line, text.clone())),
        _ => None,
    });
    assert_eq!(unknown, Some((3, 2, "foo bar 1 2".to_owned())));
    // Lines as old Macintosh programs end them.
    let old = read(&format!("{SQUARE}f 1 2 3 4\n").replace('\n', "\r"));
    assert_eq!((old.mesh.vertex_count(), old.mesh.triangles.len()), (4, 2));
}

#[test]
fn topology_is_that_of_positions_where_texture_seams_have_more_coordinates() {
    let text = format!("{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 5 5\nvt 6 6\nvt 5 6\nf 1/1 2/2 3/3\nf 1/4 3/5 4/6\n");
    let imported = read(&text);
    assert_eq!(imported.mesh.vertex_count(), 4);
    assert_eq!(imported.report.boundary_loops, 1);
    assert_eq!(imported.texture[1], Some([DVec2::new(5.0, 5.0), DVec2::new(6.0, 6.0), DVec2::new(5.0, 6.0)]));
}

#[test]
fn a_group_or_object_is_chosen_by_name_and_a_wrong_name_lists_them() {
    let text = format!(
        "o figure\ng body\n{SQUARE}f 1 2 3\ng eyes#2\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 5 6 7\no hat\ng body\nf 1 3 4\n"
    );
    let all = read(&text);
    assert_eq!(all.mesh.groups, ["body", "eyes#2"]);
    assert_eq!(all.mesh.triangle_group, [0, 1, 0]);
    let chosen = |name: &str| read_with(&text, &ImportOptions { group: Some(name.to_owned()), ..METRES });
    let eyes = chosen("eyes#2").unwrap();
    assert_eq!(eyes.mesh.positions[0], DVec3::splat(5.0));
    assert_eq!((eyes.mesh.vertex_count(), eyes.mesh.triangles.len()), (3, 1));
    assert!(eyes.report.repairs.contains(&Repair::GroupChosen { name: "eyes#2".to_owned(), left_out: 2 }));
    assert_eq!(chosen("body").unwrap().mesh.triangles.len(), 2);
    assert_eq!(chosen("hat").unwrap().mesh.triangles.len(), 1);
    let said = chosen("torso").unwrap_err().to_string();
    assert!(said.contains("torso") && ["body", "eyes#2", "hat", "figure"].iter().all(|n| said.contains(n)), "{said}");
}

#[test]
fn a_group_line_that_names_no_face_leaves_objects_as_groups() {
    let text = format!("o sheet\n{SQUARE}f 1 2 3 4\n");
    for line in ["g\n", "g trailing\n"] {
        assert_eq!(read(&format!("{text}{line}")).mesh.groups, ["sheet"], "{line}");
    }
    assert_eq!(read(&format!("g\n{text}")).mesh.groups, ["sheet"]);
}

#[test]
fn hundreds_of_groups_and_components_open() {
    let mut text = String::new();
    for i in 0..154 {
        text += &format!("g part{}\nv {i} 0 0\nv {i}.5 0 0\nv {i} 1 0\nf -3 -2 -1\n", i % 139);
    }
    let imported = read(&text);
    assert_eq!(imported.report.components, 154);
    assert_eq!(imported.mesh.groups.len(), 139);
}

/// A closed box 0.4 × 0.3 × 1.7 m, y up, in decimetres, facing inward.
fn inward_box() -> String {
    let mut text = String::new();
    for i in 0..8 {
        let bit = |k: i32, length: f64| if i >> k & 1 == 1 { length } else { 0.0 };
        text += &format!("v {} {} {}\n", bit(0, 4.0), bit(1, 17.0), bit(2, 3.0));
    }
    // Outward for these corners, reversed.
    for quad in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        text += &format!("f {} {} {} {}\n", quad[3], quad[2], quad[1], quad[0]);
    }
    text
}

#[test]
fn a_closed_body_faces_outward_and_an_open_one_is_refused_unless_allowed() {
    let (_folder, path) = file(&inward_box());
    let upright = ImportOptions { up: Some(Axis::Y), ..ImportOptions::default() };
    let body = import_body(&path, &upright).unwrap();
    assert!(body.report.is_closed());
    assert!(body.report.repairs.contains(&Repair::TurnedOutward { components: 1 }));
    assert_eq!(body.report.frame.unit, Unit::Dm);
    let (lo, hi) = body.mesh.bounds().unwrap();
    assert!((hi - lo - DVec3::new(0.4, 0.3, 1.7)).length() < 1e-12);
    let distance = partwise::body::distance::Body::new(&body.mesh).unwrap();
    assert!(distance.nearest((lo + hi) / 2.0).signed_distance < 0.0);

    let lines: Vec<String> = inward_box().lines().map(str::to_owned).collect();
    let (_folder, path) = file(&lines[..lines.len() - 1].join("\n"));
    let said = import_body(&path, &upright).unwrap_err().to_string();
    assert!(said.contains("4 boundary edges in 1 loop") && said.contains("--open-body"), "{said}");
    let open = import_body(&path, &ImportOptions { open_body: true, ..upright }).unwrap();
    assert!(open.report.remarks.contains(&Remark::Open { edges: 4, loops: 1 }));
}

#[test]
fn a_body_of_loose_faces_needs_weld_and_a_scene_needs_a_group() {
    // Each face of the box with its own four corners, as formats without shared vertices write it.
    let corners: Vec<String> = inward_box().lines().filter(|l| l.starts_with('v')).map(str::to_owned).collect();
    let mut loose = String::new();
    for line in inward_box().lines().filter(|l| l.starts_with('f')) {
        for v in line.split_whitespace().skip(1) {
            loose += &format!("{}\n", corners[v.parse::<usize>().unwrap() - 1]);
        }
        loose += "f -4 -3 -2 -1\n";
    }
    let upright = ImportOptions { up: Some(Axis::Y), ..ImportOptions::default() };
    let (_folder, path) = file(&loose);
    let said = import_body(&path, &upright).unwrap_err().to_string();
    assert!(said.contains("24 boundary edges in 6 loops") && said.contains("try --weld"), "{said}");
    let welded = import_body(&path, &ImportOptions { weld: true, ..upright.clone() }).unwrap();
    assert!(welded.report.is_closed() && welded.mesh.vertex_count() == 8);

    let scene = format!("g body\n{}g scarf\nv 0 9 9\nv 1 9 9\nv 0 9 8\nf -1 -2 -3\n", inward_box());
    let (_folder, path) = file(&scene);
    let said = import_body(&path, &upright).unwrap_err().to_string();
    assert!(said.contains("2 groups") && said.contains("--body-group"), "{said}");
    assert!(import_body(&path, &ImportOptions { group: Some("body".to_owned()), ..upright }).is_ok());
}

#[test]
fn a_garment_inside_out_is_turned_to_face_away_from_the_body() {
    let (_folder, path) = file(&inward_box());
    let body = import_body(&path, &ImportOptions { up: Some(Axis::Y), ..ImportOptions::default() }).unwrap();
    let distance = partwise::body::distance::Body::new(&body.mesh).unwrap();
    // A square before the body (outward is towards -y there) that faces it, and one behind that faces away.
    let text = "v 1 0.2 2\nv 2 0.2 2\nv 2 0.2 4\nv 1 0.2 4\nv 1 -4 2\nv 2 -4 2\nv 2 -4 4\nv 1 -4 4\n\
                f 1 2 3 4\nf 5 6 7 8\n";
    let options = ImportOptions { unit: Some(Unit::Dm), up: Some(Axis::Z), ..METRES };
    let mut garment = read_with(text, &options).unwrap();
    let inward = partwise::scene::facing_body(&garment.mesh, &distance);
    garment.turn_outward(&inward);
    assert!(garment.report.repairs.contains(&Repair::TurnedOutward { components: 1 }));
    let normals: Vec<f64> = (0..4).map(|t| garment.mesh.double_area_vector(t).y.signum()).collect();
    assert_eq!(normals, [1.0, 1.0, -1.0, -1.0]);
}

#[test]
fn an_export_gives_faces_groups_and_texture_back() {
    let text = format!(
        "mtllib a.mtl\n{SQUARE}v 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 0.1 0.7\nvt 0 1\no dress\ng front\nusemtl red\n\
         f 1/1 2/2 3/3 4/4\ng back\nf 2 5 6 3\n"
    );
    let options = ImportOptions { unit: Some(Unit::Cm), up: Some(Axis::Y), ..METRES };
    let imported = read_with(&text, &options).unwrap();
    let (_folder, path) = file("");
    let moved: Vec<DVec3> = imported.mesh.positions.iter().map(|p| p + DVec3::new(0.0, 0.0, 0.01)).collect();
    write_imported(&path, &imported, &moved).unwrap();
    let written = fs::read_to_string(&path).unwrap();
    let tail: Vec<&str> = written.lines().skip_while(|line| !line.starts_with("vt")).collect();
    let expected =
        "vt 0 0\nvt 1 0\nvt 0.1 0.7\nvt 0 1\no dress\ng front\nusemtl red\nf 1/1 2/2 3/3 4/4\ng back\nf 2 5 6 3";
    assert_eq!(tail.join("\n"), expected);
    assert!(written.contains("mtllib a.mtl\nv "));
    let again = import_garment(&path, &options, &Beside::File(&Frame::given(Unit::M, Axis::Z))).unwrap();
    for (p, q) in again.mesh.positions.iter().zip(&moved) {
        assert!((p - q).length() < 1e-15);
    }
    assert_eq!(again.mesh.triangles, imported.mesh.triangles);
    // Vertices that did not move are written with the digits of the input.
    write_imported(&path, &imported, &imported.mesh.positions).unwrap();
    let same = fs::read_to_string(&path).unwrap();
    let vertices = |text: &str| text.lines().filter(|l| l.starts_with("v ")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(vertices(&same), vertices(&text));
    // A mesh that moved after it was read, as one whose seams are drawn shut does, is written where it is.
    let mut shut = imported.clone();
    shut.mesh.positions.clone_from(&moved);
    write_imported(&path, &shut, &moved).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), written);
    let short = write_imported(&path, &imported, &moved[1..]);
    assert!(matches!(short, Err(MeshError::WrongCount { found: 5, expected: 6 })));
}

#[test]
fn the_rest_shape_comes_from_a_second_file_of_the_same_faces() {
    let garment = read(&format!("{SQUARE}f 1 2 3 4\n"));
    // A rhomb that on its own would be cut along the other diagonal.
    let rest = read("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 1 0\nf 1 2 3 4\n");
    let shaped = garment.in_the_shape_of(&rest).unwrap();
    assert_eq!(shaped.triangles, garment.mesh.triangles);
    assert_eq!(shaped.positions, rest.mesh.positions);
    let other = read("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 1 0\nf 2 3 4 1\n");
    assert!(garment.in_the_shape_of(&other).unwrap_err().to_string().contains("face 1"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_mesh_is_read_back_bit_for_bit(
        points in prop::collection::vec(prop::array::uniform3(-1e3..1e3f64), 3..40),
        picks in prop::collection::vec((0usize..1000, 0usize..1000, 0usize..1000), 1..60),
    ) {
        let positions: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let n = positions.len();
        let triangles: Vec<[u32; 3]> =
            picks.into_iter().map(|(a, b, c)| [a % n, b % n, c % n].map(|v| v as u32)).collect();
        let (_folder, path) = file("");
        write_mesh(&path, &TriMesh::new(positions.clone(), triangles.clone())).unwrap();
        let beside = Frame::given(Unit::M, Axis::Z);
        let mut sound: Vec<[u32; 3]> =
            triangles.into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect();
        sound.iter_mut().for_each(|t| t.sort_unstable());
        sound.sort_unstable();
        sound.dedup();
        match import_garment(&path, &METRES, &Beside::File(&beside)) {
            Ok(imported) => {
                let number = imported.file_vertices();
                for (p, &v) in imported.mesh.positions.iter().zip(&number) {
                    prop_assert_eq!(*p, positions[v as usize]);
                }
                let mut read: Vec<[u32; 3]> =
                    imported.mesh.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect();
                read.iter_mut().for_each(|t| t.sort_unstable());
                read.sort_unstable();
                prop_assert_eq!(read, sound);
            }
            Err(error) => {
                let empty = matches!(error, MeshError::Empty { .. });
                prop_assert!(empty && sound.is_empty());
            }
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(
        lines in prop::collection::vec("(v|vt|f|g|o|s|l|#)?( -?[0-9a/.e-]{0,6}){0,5}", 0..12),
    ) {
        let _ = read_with(&lines.join("\n"), &METRES);
    }
}
