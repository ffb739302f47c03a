//! The content of an export, and the writing of its bytes: shared by all formats.

use std::path::Path;

use glam::DVec2;

use super::TriMesh;
use super::error::MeshError;
use super::import::Imported;
use crate::base::atomic_file::AtomicFile;

/// A mesh with everything that a format may hold.
#[derive(Clone, Copy)]
pub(crate) struct Export<'a> {
    /// The mesh, m, z up.
    pub(crate) mesh: &'a TriMesh,
    /// The file that it comes from: OBJ and PLY keep its polygons, unit and axes.
    pub(crate) imported: Option<&'a Imported>,
    /// Texture coordinates of each triangle's corners.
    pub(crate) texture: Option<&'a [[DVec2; 3]]>,
    /// Colour of each vertex: red, green, blue, opacity. OBJ has none.
    pub(crate) colours: Option<&'a [[u8; 4]]>,
    /// The body, m, z up, for formats that hold several meshes: glTF and USD.
    pub(crate) body: Option<&'a TriMesh>,
}

/// Writes the bytes of a file; where that fails, nothing is left behind.
pub(super) fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), MeshError> {
    let unwritable = |e: std::io::Error| MeshError::Unwritable { file: path.to_owned(), reason: e.to_string() };
    AtomicFile::write(path, contents).map_err(unwritable)
}
