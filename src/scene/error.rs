//! Errors of loading a scene; the user can correct all of them.

use std::path::PathBuf;

use super::materials::CutError;
use crate::base::files::{Unreadable, listed};
use crate::body::ShapeError;
use crate::body::distance::DistanceError;
use crate::garment::pattern::PatternError;
use crate::mesh::rest::RestError;
use crate::mesh::{Axis, Front, MeshError};

/// A body or garment that cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum SceneError {
    /// A mesh file that cannot be used.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A body to which no distance can be measured.
    #[error(transparent)]
    Distance(#[from] DistanceError),
    /// A rest shape that cannot be used.
    #[error(transparent)]
    Rest(#[from] RestError),
    /// A sewing pattern that cannot be used.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// Measurements or a garment from which no mesh can be made.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The same, in a file.
    #[error("{file} cannot be used: {source}")]
    ShapeFile { file: String, source: ShapeError },
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// An unknown name of a body.
    #[error(
        "no body is called `{found}`; expected `form` (the built-in dress form), a TOML file of its measurements, or a mesh file (OBJ, PLY, STL, glTF, NumPy)"
    )]
    UnknownBody { found: String },
    /// A built-in garment on a body from a file.
    #[error(
        "the built-in garments are cut for the dress form, not for {body}; give --garment a mesh file placed around that \
         body, or leave --body out and give its measurements (--bust, --waist, ...)"
    )]
    NotCutForIt { body: String },
    /// Measurements on the command line from which no body can be made.
    #[error("the dress form's measurements make no body: {0}")]
    Measurements(#[source] ShapeError),
    /// A front along the vertical.
    #[error("--front {front}: found the vertical of the body's file, where {up} is up, expected one of its other axes")]
    FrontIsUp { front: Front, up: Axis },
    /// A garment that is not near the body.
    #[error(
        "no body near the garment: the nearest vertex is {nearest:.2} m from the body, expected less than {limit} m; are both in \
         the same place, and are unit and up axis right (--unit, --up, or of one file --body-unit, --garment-unit, --body-up, --garment-up)?"
    )]
    NotNear { nearest: f64, limit: f64 },
    /// A garment worn over itself.
    #[error(
        "{coincident} of its {vertices} vertices lie exactly on a garment below it, expected a garment around that one; is it given \
         twice? Give it once, with a fabric of twice the mass if its cloth is double, or export the outer one some millimetres wider"
    )]
    Coincident { coincident: usize, vertices: usize },
    /// Fabrics that cannot be assigned.
    #[error(transparent)]
    Cut(Box<CutError>),
    /// A group without a boundary edge.
    #[error("--hold {what}: found no open edge there; expected one, such as the edge of a waistband")]
    NoEdge { what: String },
    /// A connected part that does not exist.
    #[error("--hold: found \"{found}\", expected `top:1` to `top:{parts}`: the garment has {parts} connected parts")]
    UnknownPart { found: String, parts: usize },
    /// A group that does not exist.
    #[error("--hold: found no group \"{found}\" in the garment, expected `top`, `top:N`{}", or_one_of(known))]
    UnknownGroup { found: String, known: Vec<String> },
    /// A folder of poses that cannot be read.
    #[error("{folder}: the folder of poses cannot be read: {source}")]
    PoseFolder { folder: PathBuf, source: std::io::Error },
    /// A folder without poses.
    #[error("{folder}: found no body in this folder, expected mesh files of one body in several poses")]
    NoPoses { folder: PathBuf },
    /// Any of these, with the name of the body, garment or file it concerns.
    #[error("{name}: {source}")]
    In { name: String, source: Box<SceneError> },
}

impl SceneError {
    pub(super) fn about<E: Into<Self>>(name: &str) -> impl FnOnce(E) -> Self {
        move |source| Self::In { name: name.to_owned(), source: Box::new(source.into()) }
    }

    pub(super) fn in_file(file: &str) -> impl FnOnce(ShapeError) -> Self {
        move |source| Self::ShapeFile { file: file.to_owned(), source }
    }
}

impl From<CutError> for SceneError {
    fn from(error: CutError) -> Self {
        Self::Cut(Box::new(error))
    }
}

fn or_one_of(groups: &[String]) -> String {
    if groups.is_empty() {
        return ", as its file has no groups (lines that begin with g or o)".to_owned();
    }
    format!(" or one of {}", listed(groups))
}
