//! What can be wrong with a mesh file, in words a user can act on.

use std::path::PathBuf;

/// Why a mesh was refused.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be read at all.
    #[error("{file}: cannot be read: {reason}; check the path and its permissions", file = file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Some other format.
    #[error(
        "{file}: found {found}, expected a Wavefront OBJ text (lines that begin with v and f); export the mesh as .obj",
        file = file.display()
    )]
    NotObj {
        /// The file.
        file: PathBuf,
        /// What it looks like.
        found: &'static str,
    },
    /// One line is wrong.
    #[error("{file}, line {line}: {problem}", file = file.display())]
    Line {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: LineProblem,
    },
    /// No triangle left.
    #[error(
        "{file}: the mesh is empty: found {vertices} vertices and {faces} faces of three corners or more, and in them no \
         triangle of three different vertices; expected at least one",
        file = file.display()
    )]
    Empty {
        /// The file.
        file: PathBuf,
        /// Vertices in it.
        vertices: usize,
        /// Faces with at least three corners.
        faces: usize,
    },
    /// No group of that name.
    #[error("{file}: no group \"{asked}\"; {there_are}", file = file.display(), there_are = list(available))]
    UnknownGroup {
        /// The file.
        file: PathBuf,
        /// The name asked for.
        asked: String,
        /// The names there are.
        available: Vec<String>,
    },
    /// Not a unit.
    #[error("unknown unit \"{found}\"; expected one of m, dm, cm, mm, in, ft")]
    UnknownUnit {
        /// What was written.
        found: String,
    },
    /// Not an axis.
    #[error("unknown up axis \"{found}\"; expected x, y or z")]
    UnknownAxis {
        /// What was written.
        found: String,
    },
    /// No unit makes this a body.
    #[error(
        "{file}: the unit cannot be guessed: the body is {height} units tall, which is between 0.5 and 2.5 m in none of \
         m, dm, cm and mm; name it with --unit (and --up)",
        file = file.display()
    )]
    UnknownScale {
        /// The file.
        file: PathBuf,
        /// Its height in its own unit.
        height: f64,
    },
    /// No frame puts the garment near the body.
    #[error(
        "{file}: no unit and up axis puts this garment around the body; name them with --unit and --up, or place the \
         garment around the body",
        file = file.display()
    )]
    NoFrame {
        /// The file.
        file: PathBuf,
    },
    /// The garment is elsewhere.
    #[error(
        "no body near the garment: the nearest vertex is {nearest:.2} m from the body, expected less than {limit} m; are both in \
         the same unit, up axis and place (--unit, --up)?"
    )]
    NotNear {
        /// Distance of the nearest garment vertex, m.
        nearest: f64,
        /// The limit, m.
        limit: f64,
    },
    /// The body has holes.
    #[error(
        "{file}: the body is not closed: {edges} boundary edges in {loops} loops, the first at vertices {a} and {b} of \
         the file; expected a closed surface, which alone has an inside. {hint}Fill the holes, or take --open-body to go by \
         the normals alone",
        file = file.display()
    )]
    BodyOpen {
        /// The file.
        file: PathBuf,
        /// Edges with one triangle.
        edges: usize,
        /// Loops they form.
        loops: usize,
        /// First vertex of the first edge, numbered as in the file, from 1.
        a: usize,
        /// Its second vertex.
        b: usize,
        /// What else may help with this file; empty or a sentence with a space behind it.
        hint: String,
    },
    /// Two meshes that should correspond do not.
    #[error("{file}: not the topology of {other}: {difference}; expected the same vertices and faces in the same order", file = file.display(), other = other.display())]
    OtherTopology {
        /// The second file.
        file: PathBuf,
        /// The garment's file.
        other: PathBuf,
        /// What differs first.
        difference: String,
    },
    /// A file cannot be written.
    #[error("{file}: cannot be written: {reason}; nothing was left behind", file = file.display())]
    Unwritable {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Positions for another mesh.
    #[error("{found} positions for a mesh of {expected} vertices; pass one position a vertex")]
    WrongCount {
        /// Positions passed.
        found: usize,
        /// Vertices of the mesh.
        expected: usize,
    },
}

/// What can be wrong with one line of an OBJ file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LineProblem {
    /// Not a number.
    #[error("found \"{found}\", expected a number{}", .of.of())]
    NotANumber {
        /// The word.
        found: String,
        /// What it stands for.
        of: Keyword,
    },
    /// NaN or infinity.
    #[error(
        "found the coordinate {found}, expected a finite number; the export that wrote it went wrong, make it again"
    )]
    NotFinite {
        /// The word.
        found: String,
    },
    /// A number that no mesh of ours has.
    #[error(
        "found the coordinate {found}, expected at most {limit:e} either way: no body or garment is that large in any \
         unit; the export that wrote it went wrong, make it again"
    )]
    TooLarge {
        /// The word.
        found: String,
        /// The largest there may be.
        limit: f64,
    },
    /// Too few numbers.
    #[error("found {found} numbers, expected {expected}{}", .of.of())]
    TooFew {
        /// Numbers found.
        found: usize,
        /// Numbers needed.
        expected: usize,
        /// What they stand for.
        of: Keyword,
    },
    /// A corner that is not `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    #[error("found the corner \"{found}\", expected v, v/vt, v//vn or v/vt/vn with whole numbers")]
    BadCorner {
        /// The word.
        found: String,
    },
    /// A number that points at nothing.
    #[error("found {found}, expected {}", range(*there_are, *so_far, *of))]
    OutOfRange {
        /// The number in the file.
        found: i64,
        /// How many there are in all.
        there_are: usize,
        /// How many there are above the line.
        so_far: usize,
        /// What it counts.
        of: Keyword,
    },
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

/// The groups of a file in a sentence; the first twenty of many.
fn list(names: &[String]) -> String {
    const SHOWN: usize = 20;
    if names.is_empty() {
        return "the file has no groups".to_owned();
    }
    let shown = names.iter().take(SHOWN).map(String::as_str).collect::<Vec<_>>().join(", ");
    match names.len() - names.len().min(SHOWN) {
        0 => format!("there are: {shown}"),
        more => format!("there are: {shown} and {more} more"),
    }
}
