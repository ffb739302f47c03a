//! An OBJ file in its own unit and axes: polygons, groups and texture coordinates, from which an export is written.

use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use super::error::MeshError;
use super::frame::Frame;
use super::obj_lines::{Corner, Face, ObjContents};
use super::topology::NONE;
use crate::base::files::{MOST_MESH, Unreadable, bounded};

/// The contents of an OBJ file that an export writes again at other positions.
#[derive(Debug, Clone)]
pub struct ObjSource {
    /// The file read.
    pub file: PathBuf,
    /// Its unit and up axis.
    pub frame: Frame,
    /// Corners of all faces, face after face.
    pub corners: Vec<Corner>,
    /// The faces of three or more corners; those of the chosen group, if one was chosen.
    pub faces: Vec<Face>,
    /// Grouping and material lines, each with the number of the face it stands before.
    pub statements: Vec<(u32, String)>,
    /// Positions by file vertex, in the file's frame.
    pub positions: Vec<DVec3>,
    /// Texture coordinates of the file.
    pub textures: Vec<DVec2>,
    /// Mesh vertex of each file vertex, or [`NONE`] where no face uses it.
    pub mesh_vertex: Vec<u32>,
}

impl ObjSource {
    /// The corners of one face.
    #[must_use]
    pub fn corners_of(&self, face: &Face) -> &[Corner] {
        face.among(&self.corners)
    }

    /// The file vertex, from 0, of each mesh vertex: the first of those welded into it.
    #[must_use]
    pub fn file_vertices(&self) -> Vec<u32> {
        let count = self.mesh_vertex.iter().filter(|&&v| v != NONE).max().map_or(0, |&v| v as usize + 1);
        let mut file_vertices = vec![NONE; count];
        for (file_vertex, &v) in self.mesh_vertex.iter().enumerate().rev() {
            if v != NONE {
                file_vertices[v as usize] = file_vertex as u32;
            }
        }
        file_vertices
    }
}

/// Reads a file.
pub(super) fn read(file: &Path) -> Result<ObjContents, MeshError> {
    let bytes = bounded(file, MOST_MESH).map_err(|e| Unreadable::new(file, &e))?;
    if let Some(found) = other_format(file, &bytes) {
        return Err(MeshError::NotObj { file: file.to_owned(), found });
    }
    // Comments and names may be in any encoding; numbers are ASCII in all of them.
    let text = String::from_utf8_lossy(&bytes);
    // Line ends of Mac OS 9 and earlier.
    if text.contains('\r') && !text.contains('\n') {
        return ObjContents::new(file, &text.replace('\r', "\n"));
    }
    ObjContents::new(file, &text)
}

/// The format of a file that is not an OBJ, recognised by its first bytes; DXF also by the extension, as its text has no signature.
fn other_format(file: &Path, bytes: &[u8]) -> Option<&'static str> {
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(512)]).into_owned();
    let text = head.trim_start();
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let binary_stl = || {
        let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        count.is_some_and(|n| bytes.len() as u64 == 84 + 50 * u64::from(n))
    };
    if starts(b"glTF") || (text.starts_with('{') && String::from_utf8_lossy(bytes).contains("\"asset\"")) {
        Some("a glTF scene")
    } else if (text.starts_with("solid") && text.contains("facet")) || binary_stl() {
        Some("an STL mesh")
    } else if text.starts_with("ply\n") || text.starts_with("ply\r") {
        Some("a PLY mesh")
    } else if starts(b"Kaydara FBX") {
        Some("an FBX scene")
    } else if starts(b"AutoCAD Binary DXF") || (text.starts_with('0') && text.contains("SECTION")) || extension == "dxf"
    {
        Some("a DXF drawing")
    } else if starts(b"PK\x03\x04") {
        Some("a ZIP archive (3MF, or a packed OBJ)")
    } else if starts(b"BLENDER") {
        Some("a Blender scene")
    } else if text.starts_with("OFF") || text.starts_with("COFF") {
        Some("an OFF mesh")
    } else if text.starts_with("<?xml") || text.starts_with("<COLLADA") {
        Some("an XML file (COLLADA?)")
    } else if bytes.contains(&0) {
        Some("binary data")
    } else {
        None
    }
}
