//! Signed distance to the body, and the two repairs of a garment's placement that follow it outward.
//!
//! `signed_distance` has the definition, its equations and its limits; `tree` finds the nearest triangle; `push_out`
//! moves garment vertices out of the body before a drape.

pub(crate) mod push_out;
mod signed_distance;
mod tree;

pub(crate) use push_out::{OUTWARD, pull_off_protrusions};
pub(crate) use signed_distance::LATTICE_SIDE;
pub use signed_distance::{Body, DistanceError, SurfacePoint};
