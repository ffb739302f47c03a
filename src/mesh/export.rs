//! Writes meshes, in the format that the ending of the file names (`Export`), and OBJ files: a draped garment with the faces, groups,
//! texture coordinates, unit and axes of its file, or any mesh.
//!
//! Vertices that no face uses are left out, so a file without any keeps its numbers. Normals are left out, as those of the
//! file belong to its shape. Limit: faces without area are written too, and vertices of such faces alone stay where they were.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::error::MeshError;
use super::exported::{Export, write};
use super::glb::write_glb;
use super::import::Imported;
use super::ply::write_ply;
use super::source::MeshSource;
use super::topology::NONE;
use super::usda::write_usda;
use super::{TriMesh, renumbered};
use crate::base::files::has_ending;

/// The endings of files that are written; others are written as OBJ.
pub(crate) const ENDINGS: [&str; 4] = ["obj", "ply", "glb", "usda"];

/// Writes it as glTF, PLY or USD where the path ends in `.glb`, `.ply` or `.usda`, else as OBJ.
///
/// # Errors
/// [`MeshError::WrongCount`] where there are not as many colours as vertices, [`MeshError::Unwritable`].
pub(crate) fn export(path: &Path, export: &Export<'_>) -> Result<(), MeshError> {
    let expected = export.mesh.vertex_count();
    if let Some(found) = export.colours.map(<[_]>::len).filter(|&found| found != expected) {
        return Err(MeshError::WrongCount { found, expected });
    }
    match (export.imported, export.texture) {
        _ if has_ending(path, "glb") => write_glb(path, export),
        _ if has_ending(path, "usda") => write_usda(path, export),
        (Some(imported), _) if has_ending(path, "ply") => {
            let positions = imported.in_file(&export.mesh.positions);
            let mut source = imported.source.clone();
            source.positions = positions;
            let frame = format!("{}, {} up", imported.report.frame.unit, imported.report.frame.up);
            let of_file = |colours: &[[u8; 4]]| -> Vec<[u8; 4]> {
                let of = |v: &u32| colours.get(*v as usize).copied().unwrap_or([255; 4]);
                imported.mesh_vertex.iter().map(of).collect()
            };
            write_ply(path, &source, &frame, export.colours.map(of_file).as_deref())
        }
        (None, texture) if has_ending(path, "ply") => {
            write_ply(path, &MeshSource::of_mesh(export.mesh, texture), "m, z up", export.colours)
        }
        (Some(imported), _) => write_imported(path, imported, &export.mesh.positions),
        (None, Some(texture)) => write_textured(path, export.mesh, texture),
        (None, None) => write_mesh(path, export.mesh),
    }
}

/// Writes the imported mesh with its vertices at `positions` (m, z up), in the frame of the file it came from.
pub fn write_imported(path: &Path, imported: &Imported, positions: &[DVec3]) -> Result<(), MeshError> {
    write(path, imported_text(imported, positions)?)
}

/// Writes a mesh in metres, z up, with a `g` line before each run of triangles of one group.
pub fn write_mesh(path: &Path, mesh: &TriMesh) -> Result<(), MeshError> {
    write(path, mesh_text(mesh))
}

/// Writes a mesh with the texture coordinates of each triangle's corners, m; each is written once.
pub fn write_textured(path: &Path, mesh: &TriMesh, texture: &[[DVec2; 3]]) -> Result<(), MeshError> {
    write(path, textured_text(mesh, texture))
}

/// The text of [`write_textured`].
pub(crate) fn textured_text(mesh: &TriMesh, texture: &[[DVec2; 3]]) -> String {
    text_of(mesh, Some(texture))
}

/// The text of [`write_mesh`].
#[must_use]
pub fn mesh_text(mesh: &TriMesh) -> String {
    text_of(mesh, None)
}

fn text_of(mesh: &TriMesh, texture: Option<&[[DVec2; 3]]>) -> String {
    let note = if texture.is_some() { "; texture coordinates are the flat pattern in m" } else { "" };
    let mut text = format!("# {} m, z up{note}\n", env!("CARGO_PKG_NAME"));
    mesh.positions.iter().for_each(|p| write_vertex(&mut text, *p));
    let mut numbers: BTreeMap<(u32, [u64; 2]), usize> = BTreeMap::new();
    let mut faces = String::new();
    let mut last = None;
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let group = mesh.triangle_group.get(t).copied();
        if group != last {
            last = group;
            if let Some(name) = group.and_then(|g| mesh.groups.get(g as usize)) {
                let _ = writeln!(faces, "g {name}");
            }
        }
        faces.push('f');
        for (k, v) in triangle.iter().enumerate() {
            let _ = write!(faces, " {}", v + 1);
            if let Some(uv) = texture.map(|texture| texture[t][k]) {
                let next = numbers.len() + 1;
                let number = *numbers.entry((*v, [uv.x.to_bits(), uv.y.to_bits()])).or_insert(next);
                if number == next {
                    let _ = writeln!(text, "vt {} {}", uv.x, uv.y);
                }
                let _ = write!(faces, "/{number}");
            }
        }
        faces.push('\n');
    }
    text + &faces
}

fn imported_text(imported: &Imported, positions: &[DVec3]) -> Result<String, MeshError> {
    let source = &imported.source;
    let expected = imported.mesh.vertex_count();
    if positions.len() != expected {
        return Err(MeshError::WrongCount { found: positions.len(), expected });
    }
    let used = source.used_vertices();
    let vertex = renumbered(used.len(), |v| used[v]);
    let mut textured = vec![false; source.textures.len()];
    let corners = source.faces.iter().flat_map(|face| source.corners_of(face));
    corners.filter(|corner| corner.texture != NONE).for_each(|corner| textured[corner.texture as usize] = true);
    let texture = renumbered(textured.len(), |t| textured[t]);
    let mut text = String::new();
    let frame = &imported.report.frame;
    let _ = writeln!(text, "# {} {}, {} up", env!("CARGO_PKG_NAME"), frame.unit, frame.up);
    let mut statements = source.statements.iter().peekable();
    // Material files come first, also those named late in the file.
    for (_, library) in source.statements.iter().filter(|(_, line)| line.starts_with("mtllib")) {
        let _ = writeln!(text, "{library}");
    }
    for file_vertex in (0..used.len()).filter(|&v| used[v]) {
        let v = imported.mesh_vertex[file_vertex];
        // A vertex that did not move keeps its digits; so does one of degenerate faces only, which is in no triangle. The file tells
        // where it was, not the mesh, whose open seams may have been drawn shut since.
        let own = source.positions[file_vertex];
        let moved = positions.get(v as usize).filter(|now| **now != frame.to_metres(own));
        write_vertex(&mut text, moved.map_or(own, |now| frame.to_file(*now)));
    }
    for uv in (0..textured.len()).filter(|&t| textured[t]).map(|t| source.textures[t]) {
        let _ = writeln!(text, "vt {} {}", uv.x, uv.y);
    }
    let mut pending: Vec<&str> = Vec::new();
    for face in &source.faces {
        while let Some((_, line)) = statements.next_if(|(before, _)| *before <= face.number) {
            let keyword = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
            pending.retain(|old| keyword(old) != keyword(line));
            pending.push(line);
        }
        for line in pending.drain(..).filter(|line| !line.starts_with("mtllib")) {
            let _ = writeln!(text, "{line}");
        }
        text.push('f');
        for corner in source.corners_of(face) {
            let _ = write!(text, " {}", vertex[corner.vertex as usize] + 1);
            if corner.texture != NONE {
                let _ = write!(text, "/{}", texture[corner.texture as usize] + 1);
            }
        }
        text.push('\n');
    }
    Ok(text)
}

/// Shortest digits that read back as the same number. Writing into a String cannot fail.
fn write_vertex(text: &mut String, p: DVec3) {
    // Adding zero turns -0 into 0.
    let p = p + 0.0;
    let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
}
