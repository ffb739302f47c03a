//! Garments before they are worn: fabrics, the five built-in garments, sewing patterns, and sewing a pattern around a body.

pub mod builtin;
mod cache;
pub mod fabric;
pub(crate) mod lab_sheet;
pub mod pattern;
pub mod sewing;

pub use builtin::{BUILT_IN, GarmentRequest, GarmentSpec, PlacedGarment, garment};
pub use cache::MeshCache;
