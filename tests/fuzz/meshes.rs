//! Readers of meshes and of a sweep's folder: files are written, read, draped and written back.

use std::fs;
use std::io::{Cursor, Read as _, Write as _};
use std::path::Path;

use glam::DVec3;
use partwise::drape::{drape, unobserved};
use partwise::mesh::export::write_imported;
use partwise::mesh::import::{Beside, ImportOptions, Imported, import_body, import_garment};
use partwise::mesh::{Axis, Frame, TriMesh, Unit};
use partwise::study::metrics::Metrics;
use partwise::study::sweep::{Existing, Manifest, Plan, Row, Store, Timing, csv_text, join};
use partwise::{Job, SceneSpec};

use super::readers::{Outcome, check, refused};
use super::{fuzz, fuzz_bytes};

/// A cube's eight corners and six quads, half a metre wide, a metre up.
const CUBE: &str = "v -0.25 -0.25 1\nv 0.25 -0.25 1\nv -0.25 0.25 1\nv 0.25 0.25 1\nv -0.25 -0.25 1.5\nv 0.25 -0.25 1.5\n\
    v -0.25 0.25 1.5\nv 0.25 0.25 1.5\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

/// A sheet over it, in groups, with texture coordinates.
fn sheet() -> String {
    let mut text = "mtllib cloth.mtl\no sheet\n".to_owned();
    for i in 0..36 {
        let (x, y) = (0.14 * f64::from(i % 6) - 0.35, 0.14 * f64::from(i / 6) - 0.35);
        text += &format!("v {x:.3} {y:.3} 1.51\nvt {x:.3} {y:.3}\n");
    }
    for i in 0..25 {
        let a = i / 5 * 6 + i % 5 + 1;
        let corner = |v: i32| format!("{v}/{v}");
        text += &format!("g row-{}\nf {} {} {} {}\n", i / 5, corner(a), corner(a + 1), corner(a + 7), corner(a + 6));
    }
    text
}

fn objs() -> Vec<String> {
    let folded = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf -4 -2 -1\nl 1 2\nf 1 2 \\\n 3 4\n";
    vec![CUBE.to_owned(), sheet(), folded.to_owned()]
}

fn whole(imported: &Imported) -> Result<(), String> {
    let (mesh, report) = (&imported.mesh, &imported.report);
    let n = mesh.vertex_count();
    check(mesh.positions.iter().all(|p| p.is_finite()), "a position is no number")?;
    check(mesh.triangles.iter().flatten().all(|&v| (v as usize) < n), "a triangle has a vertex that is not there")?;
    let groups = if mesh.groups.is_empty() { 0 } else { mesh.triangles.len() };
    check(
        mesh.triangle_group.len() == groups && [0, mesh.triangles.len()].contains(&imported.texture.len()),
        "lists of unlike lengths",
    )?;
    check(report.vertices == n && report.triangles == mesh.triangles.len(), "the report counts otherwise")?;
    let mut used = vec![false; n];
    mesh.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    check(used.iter().all(|&used| used), "a vertex is in no triangle")
}

/// A mesh with the name of each triangle's group: groups are numbered in the order of the file, used or not.
fn named(mesh: &TriMesh) -> (&[DVec3], &[[u32; 3]], Vec<&str>) {
    let names = mesh.triangle_group.iter().map(|&g| mesh.groups[g as usize].as_str());
    (&mesh.positions, &mesh.triangles, names.collect())
}

/// Reads a file as a body and as a garment, and writes the garment as OBJ, which must read back as the same mesh.
fn read_and_write(folder: &Path, bytes: &[u8]) -> Result<Outcome, String> {
    let path = folder.join("input");
    fs::write(&path, bytes).map_err(|e| e.to_string())?;
    let metres = ImportOptions { unit: Some(Unit::M), up: Some(Axis::Z), ..ImportOptions::default() };
    let open_body = bytes.len().is_multiple_of(2);
    if let Ok(body) = import_body(&path, &ImportOptions { open_body, ..ImportOptions::default() }) {
        whole(&body)?;
    }
    let garment = match import_garment(&path, &metres, &Beside::File(&Frame::given(Unit::M, Axis::Z))) {
        Ok(garment) => garment,
        Err(e) => return refused(&e),
    };
    whole(&garment)?;
    let out = folder.join("out.obj");
    write_imported(&out, &garment, &garment.mesh.positions).map_err(|e| e.to_string())?;
    let again = import_garment(&out, &metres, &Beside::File(&Frame::given(Unit::M, Axis::Z)));
    let again = again.map_err(|e| format!("written and refused: {e}"))?;
    check(named(&again.mesh) == named(&garment.mesh), "it reads back as another")?;
    Ok(Outcome::Taken)
}

#[test]
fn meshes() {
    let folder = tempfile::tempdir().unwrap();
    fuzz("obj", 1.0, objs(), move |text| read_and_write(folder.path(), text.as_bytes()));
}

/// The files of other programs with this ending, up to 9 kB: larger ones take as long and find no more.
fn files(ending: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/files");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == ending) && path.metadata().unwrap().len() < 9_000);
    paths.sort();
    assert!(!paths.is_empty(), "no .{ending}");
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

fn read_binary(class: &'static str, seeds: &[Vec<u8>]) {
    let folder = tempfile::tempdir().unwrap();
    fuzz_bytes(class, 1.0, seeds, move |bytes| read_and_write(folder.path(), bytes));
}

#[test]
fn plys() {
    read_binary("ply", &files("ply"));
}

#[test]
fn stls() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 1.5\nvertex 1 0 1.5\nvertex 0 1 1.5\nendloop\nendfacet\n";
    let text = format!("solid one\n{facet}endsolid one\nsolid two\n{facet}endsolid two\n");
    read_binary("stl", &[files("stl"), vec![text.into_bytes()]].concat());
}

#[test]
fn glbs() {
    read_binary("glb", &files("glb"));
}

#[test]
fn gltfs() {
    let seeds = files("gltf").into_iter().map(|bytes| String::from_utf8(bytes).unwrap()).collect();
    let folder = tempfile::tempdir().unwrap();
    fuzz("gltf", 1.0, seeds, move |text| read_and_write(folder.path(), text.as_bytes()));
}

#[test]
fn archives() {
    read_binary("npz", &files("npz"));
}

/// Arrays within an archive whose checksums are right.
#[test]
fn arrays() {
    let mut seeds = Vec::new();
    for bytes in files("npz") {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        for number in 0..archive.len() {
            let mut array = Vec::new();
            archive.by_index(number).unwrap().read_to_end(&mut array).unwrap();
            seeds.push(array);
        }
    }
    let mut faces = b"\x93NUMPY\x01\0\x3c\0{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3), }\n".to_vec();
    faces.extend([0, 1, 2, 2, 1, 3]);
    let folder = tempfile::tempdir().unwrap();
    fuzz_bytes("npy", 1.0, &seeds, move |array| {
        let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        // As vertices, or as vertices and as faces.
        for name in ["v.npy", "f.npy"] {
            archive.start_file(name, options).map_err(|e| e.to_string())?;
            let bytes = if name == "f.npy" && array.len() % 2 == 0 { &faces } else { array };
            archive.write_all(bytes).map_err(|e| e.to_string())?;
        }
        read_and_write(folder.path(), &archive.finish().map_err(|e| e.to_string())?.into_inner())
    });
}

#[test]
fn drapes() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("body.obj"), CUBE).unwrap();
    let name = |file: &str| folder.path().join(file).to_string_lossy().into_owned();
    let spec =
        SceneSpec { unit: Some(Unit::M), up: Some(Axis::Z), ..SceneSpec::new(name("body.obj"), name("input.obj")) };
    let seeds = vec![sheet(), sheet().replace(" 1.51\n", " 1.49\n")];
    fuzz("drape", 0.05, seeds, move |text| {
        fs::write(folder.path().join("input.obj"), text).map_err(|e| e.to_string())?;
        let mut spec = spec.clone();
        if text.len() % 3 == 0 {
            spec.rest = "texture".to_owned();
        }
        let loaded = match spec.load() {
            Ok(loaded) => loaded,
            Err(e) => return refused(&e),
        };
        let scene = &loaded.scene;
        let settings = Job::preview().settings;
        let found = match drape(scene, &settings, &mut unobserved) {
            Ok(found) => found,
            // In the garment's own terms, never in the solver's.
            Err(e) if e.to_string().contains("definite") => return Err(e.to_string()),
            Err(e) => return refused(&e),
        };
        check(found.positions.iter().all(|p| p.is_finite()), "a position is no number")?;
        let inside = |p: &&DVec3| scene.body.nearest(**p).signed_distance < 0.0;
        check(
            found.positions.iter().filter(inside).count() == found.penetrating_vertices,
            "penetration counts otherwise",
        )?;
        check(found.parts.part_of_vertex.iter().all(|&p| (p as usize) < found.parts.len()), "a vertex is in no PART")?;
        let counts = found.parts.part_of_vertex.len() == scene.garment.vertex_count()
            && scene.rest.corners.len() == scene.garment.triangles.len();
        check(counts, "PARTs, rest shape and mesh count otherwise")?;
        let out = folder.path().join("out.obj");
        loaded.write(&out, &found.positions).map_err(|e| e.to_string())?;
        Ok(Outcome::Taken)
    });
}

#[test]
fn rows() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("body.obj"), CUBE).unwrap();
    fs::write(folder.path().join("sheet.obj"), sheet()).unwrap();
    let plan = "name = \"plan\"\n[base]\nbody = \"body.obj\"\ngarment = \"sheet.obj\"\n[grid]\nmin_parts = [1, 2, 3]\n";
    let plan = Plan::parse(plan, "plan", folder.path(), &Job::preview()).unwrap();
    let kept = folder.path().join("kept");
    let mut store = Store::open(&kept, Manifest::of(&plan, None), Existing::Refuse).unwrap();
    let point = &plan.points[0];
    let scene = point.job.scene.load().unwrap().scene;
    let solved = point.job.drape(&scene, &mut unobserved).unwrap();
    store.append(Row::solved(point, &Metrics::of(&scene, &solved), "00ff", &Timing::default())).unwrap();
    store.append(Row::failed(&plan.points[1], "it failed")).unwrap();
    store.append(Row::failed(&plan.points[2], "it failed")).unwrap();
    drop(store);
    let text = |name: &str| fs::read_to_string(kept.join(name)).unwrap();
    let seeds = vec![text("plan.json") + "\n=====\n" + &text("rows.jsonl")];
    fuzz("rows", 0.2, seeds, move |text| {
        let (plan, rows) = text.split_once("\n=====\n").unwrap_or((text, ""));
        fs::write(kept.join("plan.json"), plan).map_err(|e| e.to_string())?;
        fs::write(kept.join("rows.jsonl"), rows).map_err(|e| e.to_string())?;
        match join(std::slice::from_ref(&kept)) {
            Err(e) => refused(&e),
            Ok((manifest, rows)) => {
                check(rows.len() == manifest.points.len(), "rows and points count otherwise")?;
                let text = csv_text(&rows);
                check(text.iter().filter(|&&b| b == b'\n').count() > rows.len(), "the CSV has fewer lines")?;
                check(folder.path().is_dir(), "")?;
                Ok(Outcome::Taken)
            }
        }
    });
}
