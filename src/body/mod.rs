//! The built-in dress form and distances to any body.
//!
//! [`mod@dress_form`] makes the form from measurements; [`girth`] measures it; [`distance`] has closest points and signed
//! distances. The form and the built-in garments are implicit solids (`solid`, `anatomy`) that are contoured and clipped
//! (`contour`) and remeshed to even triangles. Everything is deterministic: the same spec gives the same bits on any number of
//! threads.

pub(crate) mod anatomy;
pub(crate) mod contour;
pub mod distance;
pub mod dress_form;
pub mod girth;
pub(crate) mod jet;
pub(crate) mod measures;
mod sizes;
pub(crate) mod solid;

pub use dress_form::dress_form;
pub use measures::{BodySpec, ShapeError};
