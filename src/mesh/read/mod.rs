//! Reads mesh files into [`MeshSource`]. The format is recognised by the content, not by the name of the file.
//!
//! | format | read |
//! |---|---|
//! | OBJ | polygons, groups and objects, texture coordinates |
//! | PLY | text and both binary orders; polygons, triangle strips, texture coordinates, the groups of an own export |
//! | STL | text and binary; several solids are objects |
//! | glTF 2.0 | `.glb`, and `.gltf` with `data:` buffers; nodes are objects, materials groups; skins in the pose of the nodes |
//! | `.npz` | arrays of vertices and faces as SMPL's users save them |
//!
//! Memory grows with the bytes that the file has, not with the counts that it states. Nothing that a file names is opened.

mod gltf;
mod npz;
mod obj;
mod ply;
mod stl;

use std::path::Path;

use super::error::MeshError;
use super::source::MeshSource;
use crate::base::files::{MAX_MESH, Unreadable, bounded};

impl MeshSource {
    /// Reads a file.
    pub(crate) fn read(file: &Path) -> Result<Self, MeshError> {
        let bytes = bounded(file, MAX_MESH).map_err(|e| Unreadable::new(file, &e))?;
        let reader = match format_of(file, &bytes) {
            Format::Obj => obj::parse,
            Format::Ply => ply::parse,
            Format::Stl => stl::parse,
            Format::Gltf => gltf::parse,
            Format::Npz => npz::parse,
            Format::Other(found) => return Err(MeshError::UnknownFormat { file: file.to_owned(), found }),
        };
        reader(file, &bytes)
    }
}

#[derive(Clone, Copy)]
enum Format {
    Obj,
    Ply,
    Stl,
    Gltf,
    Npz,
    /// A format that is not read, as messages name it.
    Other(&'static str),
}

/// The format of a file by its first bytes; DXF also by the extension, as its text has no signature.
fn format_of(file: &Path, bytes: &[u8]) -> Format {
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(512)]).into_owned();
    let text = head.trim_start_matches('\u{feff}').trim_start();
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let is_gltf = starts(b"glTF") || text.starts_with('{') && String::from_utf8_lossy(bytes).contains("\"asset\"");
    let is_dxf =
        starts(b"AutoCAD Binary DXF") || text.starts_with('0') && text.contains("SECTION") || extension == "dxf";
    let known = [
        (is_gltf, Format::Gltf),
        (stl::is_binary(bytes) || text.starts_with("solid") && text.contains("facet"), Format::Stl),
        (text.starts_with("ply\n") || text.starts_with("ply\r"), Format::Ply),
        (starts(b"PK\x03\x04") && npz::has_arrays(bytes), Format::Npz),
        (starts(b"\x93NUMPY"), Format::Other("a single NumPy array; save vertices and faces together by numpy.savez")),
        (
            starts(b"\x80") && bytes.get(1).is_some_and(|version| *version <= 5),
            Format::Other(
                "a Python pickle, which can run programs when it is read; save its v_template and f by numpy.savez",
            ),
        ),
        (starts(b"Kaydara FBX"), Format::Other("an FBX scene")),
        (is_dxf, Format::Other("a DXF drawing, which is read as a sewing pattern (--pattern), never as a mesh")),
        (starts(b"PK\x03\x04"), Format::Other("a ZIP archive (3MF, USDZ, or a packed file)")),
        (starts(b"BLENDER"), Format::Other("a Blender scene")),
        (starts(b"#usda") || starts(b"PXR-USDC"), Format::Other("a USD scene")),
        (text.starts_with("OFF") || text.starts_with("COFF"), Format::Other("an OFF mesh")),
        (text.starts_with("<?xml") || text.starts_with("<COLLADA"), Format::Other("an XML file (COLLADA?)")),
        (bytes.contains(&0), Format::Other("binary data")),
    ];
    known.into_iter().find(|(matches, _)| *matches).map_or(Format::Obj, |(_, format)| format)
}
