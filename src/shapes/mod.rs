//! The built-in dress form and the five garments, made from measurements.
//!
//! [`body`] is the form, [`mod@garment`] the wardrobe, [`girth`] measures either. Both are solids given by a field ([`solid`], [`anatomy`]),
//! contoured ([`contour`]) and remeshed to even triangles (`remesh`). Everything here is deterministic: the same spec gives
//! the same bits on any number of threads.

pub mod anatomy;
pub mod body;
pub mod contour;
mod cut;
pub mod fitting;
pub mod garment;
pub mod girth;
pub mod jet;
mod limbs;
pub mod measures;
pub mod profile;
mod remesh;
pub mod solid;

pub use body::dress_form;
pub use garment::{BUILT_IN, Garment, GarmentRequest, GarmentSpec, garment};
pub use measures::BodySpec;
pub use remesh::Density;

/// What can be wrong with a shape that is asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A spec that cannot be read.
    #[error("the spec cannot be read: {0}")]
    Spec(String),
    /// A measurement outside what a body can have.
    #[error("{name} is {found_cm} cm; a body's is from {low_cm:.0} to {high_cm:.0} cm")]
    Measurement {
        /// Which.
        name: &'static str,
        /// What was given, cm.
        found_cm: f64,
        /// The least accepted, cm.
        low_cm: f64,
        /// The most accepted, cm.
        high_cm: f64,
    },
    /// A length of a garment that makes none.
    #[error("{name} is {found}; it must be from {low} to {high}")]
    Length {
        /// Its name in the spec.
        name: &'static str,
        /// What was given.
        found: f64,
        /// The least accepted.
        low: f64,
        /// The most accepted.
        high: f64,
    },
    /// Heights that do not ascend.
    #[error(
        "{upper} is {upper_cm:.1} cm, which is not 2 cm above {lower} at {lower_cm:.1} cm; give both heights, or neither"
    )]
    Order {
        /// The height that should be the lower one.
        lower: &'static str,
        /// Its value, cm.
        lower_cm: f64,
        /// The height that should be the upper one.
        upper: &'static str,
        /// Its value, cm.
        upper_cm: f64,
    },
    /// Too coarse to be that shape.
    #[error("{found} {what} are too few to make out its shape; ask for {least} or more")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many were asked.
        found: usize,
        /// How many it takes.
        least: usize,
    },
    /// More than the program is made for.
    #[error("{found} {what} are too many; ask for {most} or fewer")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many were asked.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// A name that is not in the wardrobe.
    #[error("there is no garment called {found:?}; the built-in ones are {known}")]
    Unknown {
        /// What was asked.
        found: String,
        /// What there is.
        known: String,
    },
    /// The surface came out broken, which the limits above should exclude.
    #[error("the {what} has no manifold surface at these measurements; bring them nearer to each other")]
    NotManifold {
        /// Which surface.
        what: &'static str,
    },
}
