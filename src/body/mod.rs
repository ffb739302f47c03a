//! The built-in dress form and the five garments, made from measurements.
//!
//! [`mod@dress_form`] is the form; [`girth`] measures it and the built-in garments. Both are solids given by a field (`solid`,
//! `anatomy`), contoured (`contour`) and remeshed to even triangles. Everything here is deterministic: the same spec gives
//! the same bits on any number of threads.

pub(crate) mod anatomy;
pub(crate) mod contour;
pub(crate) mod cut;
pub mod distance;
pub mod dress_form;
pub(crate) mod fitting;
pub mod girth;
pub(crate) mod jet;
mod limbs;
pub(crate) mod measures;
pub(crate) mod profile;
pub(crate) mod solid;

pub use dress_form::dress_form;
pub use measures::BodySpec;

/// What can be wrong with a shape that is asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message says what each field is")]
pub enum ShapeError {
    /// A spec that cannot be read.
    #[error("the spec cannot be read: {0}")]
    Spec(String),
    /// A measurement outside what a body can have.
    #[error("{name} is {found_cm} cm; a body's is from {low_cm:.0} to {high_cm:.0} cm")]
    Measurement { name: &'static str, found_cm: f64, low_cm: f64, high_cm: f64 },
    /// A length of a garment that makes none.
    #[error("{name} is {found}; it must be from {low} to {high}")]
    Length { name: &'static str, found: f64, low: f64, high: f64 },
    /// Heights that do not ascend.
    #[error(
        "{upper} is {upper_cm:.1} cm, expected {gap_cm:.0} cm or more above {lower} at {lower_cm:.1} cm; give both heights, or neither"
    )]
    Order { lower: &'static str, lower_cm: f64, upper: &'static str, upper_cm: f64, gap_cm: f64 },
    /// Too coarse to be that shape.
    #[error("{found} {what} are too few to make out its shape; ask for {least} or more")]
    TooFew { what: &'static str, found: usize, least: usize },
    /// More than the program is made for.
    #[error("{found} {what} are too many; ask for {most} or fewer")]
    TooMany { what: &'static str, found: usize, most: usize },
    /// A name that is not in the wardrobe.
    #[error("there is no garment called {found:?}; the built-in ones are {known}")]
    Unknown { found: String, known: String },
    /// The surface came out broken, which the limits above should exclude.
    #[error("the {what} has no manifold surface at these measurements; bring them nearer to each other")]
    NotManifold { what: &'static str },
}
