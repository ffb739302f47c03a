//! What can be wrong with a mesh file, in words a user can act on.

use std::path::PathBuf;

use crate::base::files::{Unreadable, listed};

/// Why a mesh was refused.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum MeshError {
    /// The file cannot be read at all.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// Some other format.
    #[error(
        "{file}: found {found}, expected a Wavefront OBJ text (lines that begin with v and f); export the mesh as .obj"
    )]
    NotObj { file: PathBuf, found: &'static str },
    /// One line is wrong.
    #[error("{file}, line {line}: {problem}")]
    Line { file: PathBuf, line: usize, problem: LineProblem },
    /// No triangle left.
    #[error(
        "{file}: the mesh is empty: found {vertices} vertices and {faces} faces of three corners or more, and in them no \
         triangle of three different vertices; expected at least one"
    )]
    Empty { file: PathBuf, vertices: usize, faces: usize },
    /// No group of that name.
    #[error("{file}: no group \"{asked}\"; {there_are}", there_are = there_are(available))]
    UnknownGroup { file: PathBuf, asked: String, available: Vec<String> },
    /// Not a unit.
    #[error("unknown unit \"{found}\"; expected one of m, dm, cm, mm, in, ft")]
    UnknownUnit { found: String },
    /// Not an axis.
    #[error("unknown up axis \"{found}\"; expected x, y or z")]
    UnknownAxis { found: String },
    /// No unit makes this a body.
    #[error(
        "{file}: the unit cannot be guessed: the body is {height} units tall, which is between 0.5 and 2.5 m in none of \
         m, dm, cm and mm; name it with --unit (and --up)"
    )]
    UnknownScale { file: PathBuf, height: f64 },
    /// No frame puts the garment near the body.
    #[error(
        "{file}: no unit and up axis puts this garment around the body; name them with --unit and --up, or place the \
         garment around the body"
    )]
    NoFrame { file: PathBuf },
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

/// What can be wrong with one line of an OBJ file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum LineProblem {
    /// Not a number.
    #[error("found \"{found}\", expected a number{}", .of.of())]
    NotANumber { found: String, of: Keyword },
    /// NaN or infinity.
    #[error(
        "found the coordinate {found}, expected a finite number; the export that wrote it went wrong, make it again"
    )]
    NotFinite { found: String },
    /// A number that no mesh of ours has.
    #[error(
        "found the coordinate {found}, expected at most {limit:e} either way: no body or garment is that large in any \
         unit; the export that wrote it went wrong, make it again"
    )]
    TooLarge { found: String, limit: f64 },
    /// Too few numbers.
    #[error("found {found} numbers, expected {expected}{}", .of.of())]
    TooFew { found: usize, expected: usize, of: Keyword },
    /// A corner that is not `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    #[error("found the corner \"{found}\", expected v, v/vt, v//vn or v/vt/vn with whole numbers")]
    BadCorner { found: String },
    /// A number that points at nothing.
    #[error("found {found}, expected {}", range(*there_are, *so_far, *of))]
    OutOfRange { found: i64, there_are: usize, so_far: usize, of: Keyword },
}

/// Statements of an OBJ file that errors speak of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keyword {
    /// `v`.
    Vertex,
    /// `vt`.
    Texture,
}

impl Keyword {
    fn of(self) -> &'static str {
        match self {
            Self::Vertex => " for a vertex (v x y z)",
            Self::Texture => " for a texture coordinate (vt u v)",
        }
    }

    fn plural(self) -> &'static str {
        match self {
            Self::Vertex => "vertices",
            Self::Texture => "texture coordinates",
        }
    }
}

/// The indices there are, in words.
fn range(there_are: usize, so_far: usize, of: Keyword) -> String {
    match (there_are, so_far) {
        (0, _) => format!("no index, as the file has no {}", of.plural()),
        (_, 0) => format!("1 to {there_are}, the {} of the file", of.plural()),
        _ => format!("1 to {there_are}, the {} of the file, or -1 to -{so_far} counted back from here", of.plural()),
    }
}

fn there_are(groups: &[String]) -> String {
    if groups.is_empty() { "the file has no groups".to_owned() } else { format!("there are: {}", listed(groups)) }
}
