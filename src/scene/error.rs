//! Why there is no scene. The user can mend all of these.

use crate::distance::DistanceError;
use crate::files::Unreadable;
use crate::mesh::MeshError;
use crate::mesh::rest::RestError;
use crate::shapes::ShapeError;

/// A body or garment that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A mesh file, or a garment nowhere near the body.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A body that no distance can be measured to.
    #[error(transparent)]
    Distance(#[from] DistanceError),
    /// A rest shape that is none.
    #[error(transparent)]
    Rest(#[from] RestError),
    /// Measurements or a garment that make no shape.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The same, in a file.
    #[error("{file} cannot be used: {source}")]
    ShapeFile {
        /// The file.
        file: String,
        /// What is wrong in it.
        source: ShapeError,
    },
    /// A file that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A body by a name that means nothing.
    #[error(
        "no body is called `{found}`; expected `form` (the built-in dress form), a TOML file of its measurements, or an OBJ file"
    )]
    UnknownBody {
        /// What was asked for.
        found: String,
    },
    /// A built-in garment on somebody's body.
    #[error(
        "the built-in garments are cut for the dress form, not for {body}; give --garment an OBJ file placed around that \
         body, or leave --body out and give its measurements (--bust, --waist, ...)"
    )]
    NotCutForIt {
        /// The body.
        body: String,
    },
    /// Nothing to hold.
    #[error("--hold top: the garment has no edge to hold")]
    NoEdge,
    /// A group to hold that is not there.
    #[error("--hold: no group \"{found}\" in the garment; expected `top` or one of {known}")]
    UnknownGroup {
        /// What was asked for.
        found: String,
        /// What there is.
        known: String,
    },
}

impl SceneError {
    pub(super) fn in_file(file: &str) -> impl FnOnce(ShapeError) -> Self {
        move |source| Self::ShapeFile { file: file.to_owned(), source }
    }
}
