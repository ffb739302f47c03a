//! Repairs on import: dropped, joined and reversed faces, and their notes.

use std::fs;

use glam::DVec3;
use partwise::SceneSpec;
use partwise::mesh::export::write_imported;
use partwise::mesh::import::ImportOptions;
use partwise::mesh::report::{Remark, Repair};
use partwise::mesh::{Axis, Unit};

use super::{METRES, SQUARE, file, read, read_with};

#[test]
fn degenerate_duplicate_and_unused_parts_are_dropped_with_a_note() {
    let text = format!("v 9 9 9\n{SQUARE}f 2 3 4\nf 2 4 5\nf 4 3 2\nf 2 2 3\nf 2 3 3 4\nf 2 3\n");
    let imported = read(&text);
    assert_eq!((imported.mesh.vertex_count(), imported.mesh.triangles.len()), (4, 2));
    for repair in [
        Repair::DuplicatesDropped { triangles: 2 },
        Repair::DegenerateDropped { triangles: 2 },
        Repair::UnusedDropped { vertices: 1 },
    ] {
        assert!(imported.report.repairs.contains(&repair), "{repair:?} in {:?}", imported.report.repairs);
    }
    assert!(imported.report.remarks.contains(&Remark::SmallFaces { count: 1 }));
    assert_eq!(imported.file_vertices(), [1, 2, 3, 4]);
}

#[test]
fn a_part_that_is_there_twice_is_taken_once_and_exported_as_one() {
    let text = format!("{SQUARE}f 1 2 3 4\nv 9 9 9\n{SQUARE}f -1 -2 -3 -4\n");
    let imported = read(&text);
    assert_eq!((imported.mesh.vertex_count(), imported.mesh.triangles.len(), imported.report.components), (4, 2, 1));
    assert!(imported.report.repairs.contains(&Repair::DuplicatePartsDropped { parts: 1, triangles: 2 }));
    assert!(imported.report.remarks.is_empty(), "{:?}", imported.report.remarks);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.obj");
    let moved: Vec<DVec3> = imported.mesh.positions.iter().map(|p| *p + DVec3::Z).collect();
    write_imported(&out, &imported, &moved).unwrap();
    let written = fs::read_to_string(&out).unwrap();
    assert_eq!(written.lines().filter(|line| line.starts_with("v ") && line.ends_with(" 1")).count(), 8, "{written}");
    // A part that extends beyond the other is kept, with a note.
    let larger = read(&format!("{SQUARE}f 1 2 3\n{SQUARE}f -4 -3 -2\nf -4 -2 -1\n"));
    assert_eq!((larger.mesh.triangles.len(), larger.report.components), (3, 2));
}

#[test]
fn panels_drawn_at_one_place_are_a_rest_shape_of_panels_that_are_apart() {
    let faces = "f 1 2 3 4\nf 5 6 7 8\n";
    let garment = read(&format!("{SQUARE}{}{faces}", SQUARE.replace(" 0\n", " 1\n")));
    assert_eq!((garment.mesh.vertex_count(), garment.report.components), (8, 2));
    let rest = read(&format!("{SQUARE}{SQUARE}{faces}"));
    assert_eq!(rest.mesh.vertex_count(), 4);
    let shaped = garment.in_the_shape_of(&rest).unwrap();
    assert_eq!(shaped.triangles, garment.mesh.triangles);
    assert_eq!(shaped.positions[..4], shaped.positions[4..]);
}

#[test]
fn welding_is_off_by_default() {
    // Two triangles whose common edge is there twice.
    let text = format!("{SQUARE}v 0 0 0\nv 1 1 -0\nf 1 2 3\nf 5 6 4\n");
    let apart = read(&text);
    assert_eq!(apart.report.components, 2);
    assert!(apart.report.remarks.contains(&Remark::Coincident { vertices: 2 }));
    let joined = read_with(&text, &ImportOptions { weld: true, ..METRES }).unwrap();
    assert_eq!((joined.report.components, joined.mesh.vertex_count()), (1, 4));
    assert!(joined.report.repairs.contains(&Repair::Welded { vertices: 2 }));
    assert_eq!(joined.file_vertices(), [0, 1, 2, 3]);
}

#[test]
fn winding_is_made_consistent_and_odd_edges_and_vertices_are_counted() {
    let turned = read(&format!("{SQUARE}v 2 0 0\nf 1 2 3\nf 1 4 3\nf 2 5 3\n"));
    assert!(turned.report.repairs.contains(&Repair::WindingTurned { triangles: 1 }));
    assert!(turned.mesh.vertex_normals().iter().all(|n| (*n - DVec3::Z).length() < 1e-12));
    // A third triangle stands on the diagonal; two more touch the square at one corner.
    let odd = read(&format!("{SQUARE}v 0 0 1\nv 2 1 0\nv 2 2 0\nf 1 2 3\nf 1 3 4\nf 1 3 5\nf 3 6 7\n"));
    assert!(odd.report.remarks.contains(&Remark::NonManifold { edges: 1 }));
    assert!(odd.report.remarks.iter().any(|remark| matches!(remark, Remark::Pinched { .. })));
}

#[test]
fn triangles_without_rest_area_are_dropped_with_their_vertices() {
    // A tip without area on its own two vertices, a quad of which half has none, a sliver that is kept.
    let text = format!("{SQUARE}v 2 1 0\nv 3 1 0\nv 0.5 2 0\nf 1 2 3 4\nf 3 5 6\nf 4 3 7\n");
    let (folder, path) = file(&text);
    let body = "v -9 -9 -2\nv 9 -9 -2\nv 0 9 -2\nv 0 0 -0.5\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    fs::write(folder.path().join("body.obj"), body).unwrap();
    let name = |file: &str| folder.path().join(file).to_string_lossy().into_owned();
    let mut spec = SceneSpec::new(name("body.obj"), path.to_string_lossy());
    (spec.unit, spec.up, spec.push_out) = (Some(Unit::M), Some(Axis::Z), false);
    let loaded = spec.load().unwrap();
    assert_eq!(loaded.reports[1].repairs.last(), Some(&Repair::NoAreaDropped { triangles: 1, first: 2 }));
    assert_eq!((loaded.scene.garment.vertex_count(), loaded.scene.garment.triangles.len()), (5, 3));
    assert_eq!((loaded.reports[1].vertices, loaded.reports[1].triangles), (5, 3));
    assert_eq!(loaded.scene.rest.areas(), [0.5, 0.5, 0.5]);
    let notes = loaded.notes().join("\n");
    assert!(notes.contains("1 triangles that have no area at rest, the first of face 2"), "{notes}");
    assert!(!notes.contains("note:"), "{notes}");
    let moved: Vec<_> = loaded.scene.garment.positions.iter().map(|p| *p + DVec3::Z).collect();
    let out = folder.path().join("out.obj");
    loaded.write(&out, &moved).unwrap();
    let again = read(&fs::read_to_string(out).unwrap());
    assert_eq!(again.mesh.positions, moved);
    assert_eq!(again.mesh.triangles, loaded.scene.garment.triangles);
    // Of a garment without any area there is nothing to drape.
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap();
    let nothing = spec.load().unwrap_err().to_string();
    assert!(nothing.contains("mesh.obj") && nothing.contains("1 triangles of the rest shape"), "{nothing}");
}
