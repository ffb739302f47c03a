//! Errors of mesh files: file, line, found, expected, remedy.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::base::files::{Unreadable, listed};

/// Errors of reading or writing a mesh file.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum MeshError {
    /// The file cannot be read at all.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// The file has another format.
    #[error(
        "{file}: found {found}, expected a mesh as OBJ, PLY, STL, glTF (.glb) or NumPy archive (.npz); export it as one of these"
    )]
    UnknownFormat { file: PathBuf, found: &'static str },
    /// The contents of a file without lines are wrong.
    #[error("{file}: {problem}")]
    Broken { file: PathBuf, problem: String },
    /// One line is wrong.
    #[error("{file}, line {line}: {problem}")]
    Line { file: PathBuf, line: usize, problem: String },
    /// An entry of an array is wrong.
    #[error("{problem}")]
    Array { problem: String },
    /// No triangle left.
    #[error(
        "{file}: the mesh is empty: found {vertices} vertices and {faces} faces of three corners or more, and in them no \
         triangle of three different vertices; expected at least one{}",
        if *faces == 0 && *vertices > 0 { "; a cloud of points has no surface, so make one of it first" } else { "" }
    )]
    Empty { file: PathBuf, vertices: usize, faces: usize },
    /// Too many triangles about one vertex.
    #[error(
        "{file}: found {triangles} triangles about vertex {vertex}, at ({:.4}, {:.4}, {:.4}) of the file, expected {max_fan} at most, \
         because the time of a drape grows with the cube of that number; remesh the file there, so that the triangles are about \
         as long as wide",
        .at.x, .at.y, .at.z
    )]
    Fan { file: PathBuf, vertex: usize, at: DVec3, triangles: usize, max_fan: usize },
    /// No group of that name.
    #[error("{file}: no group \"{asked}\"; {there_are}", there_are = there_are(available))]
    UnknownGroup { file: PathBuf, asked: String, available: Vec<String> },
    /// Not a unit, or not an axis.
    #[error("unknown {what} \"{found}\"; expected {expected}")]
    UnknownName { what: &'static str, found: String, expected: &'static str },
    /// No unit makes this a body.
    #[error(
        "{file}: the unit cannot be guessed: the body is {height} units tall, which is between 0.5 and 2.5 m in none of \
         m, dm, cm and mm; name it with --unit (and --up), or for the body alone with --body-unit and --body-up"
    )]
    UnknownScale { file: PathBuf, height: f64 },
    /// No frame puts the garment near the body.
    #[error(
        "{file}: found no unit (m, dm, cm, mm) and up axis in which this garment lies about the body: it measures {} units, the \
         body {} m (with z up); name them with --garment-unit and --garment-up, or place the garment around the body",
        by(*garment),
        by(*body_m)
    )]
    NoFrame { file: PathBuf, garment: DVec3, body_m: DVec3 },
    /// The body has holes.
    #[error(
        "{file}: the body is not closed: {edges} boundary edges in {loops} loops, the first at vertices {a} and {b} of \
         the file; expected a closed surface, which alone has an inside. {hint}Fill the holes, or take --open-body to go by \
         the normals alone"
    )]
    BodyOpen { file: PathBuf, edges: usize, loops: usize, a: usize, b: usize, hint: String },
    /// Two meshes that should correspond do not.
    #[error(
        "{file}: not the topology of {other}: {difference}; expected the same vertices and faces in the same order"
    )]
    OtherTopology { file: PathBuf, other: PathBuf, difference: String },
    /// A file cannot be written.
    #[error("{file}: cannot be written: {reason}; nothing was left behind")]
    Unwritable { file: PathBuf, reason: String },
    /// Positions for another mesh.
    #[error("{found} positions for a mesh of {expected} vertices; pass one position a vertex")]
    WrongCount { found: usize, expected: usize },
}

impl MeshError {
    /// A fault of a file without lines, by the element in which it is.
    pub(super) fn broken(file: &Path, problem: impl Into<String>) -> Self {
        Self::Broken { file: file.to_owned(), problem: problem.into() }
    }
}

/// "0.4 × 0.3 × 1.7".
fn by(extent: DVec3) -> String {
    extent.to_array().map(|length| format!("{length:.3}")).join(" × ")
}

fn there_are(groups: &[String]) -> String {
    if groups.is_empty() { "the file has no groups".to_owned() } else { format!("there are: {}", listed(groups)) }
}
