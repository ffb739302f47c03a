//! Sewing patterns: flat panels, and which of their edges are sewn together.
//!
//! Reads GarmentCode's JSON (`*_specification.json`), the open format of research garments (Korosteleva and Sorkine-Hornung:
//! "GarmentCode: Programming parametric sewing patterns", ACM TOG 42(6), 2023), and DXF as pattern makers' programs write it ([`dxf`]), checks it, meshes the panels and sews them
//! into one mesh that keeps its panels, its seams and its flat coordinates. [`read`] and [`parse`] give a [`SewingPattern`],
//! [`sew`] makes a [`SewnGarment`] of it, and [`to_svg`] draws it.
//!
//! Lengths are metres. A panel lies in its own plane, x along the weft and y along the warp (the grain), as pattern makers
//! draw it. Panels are placed in space with z up, the body looking along −y and its left at +x: the file's y (up) and z (to
//! the front) become z and −y.
//!
//! Limits: a panel is one closed loop without holes. The file has neither fabric nor seam
//! allowance nor body.

mod check;
mod curve;
mod drawing;
pub mod dxf;
mod error;
mod panel_mesh;
mod panels;
mod read;
mod sew;

pub use curve::Curve;
pub use drawing::{laid_out, to_svg};
pub use error::PatternError;
pub(crate) use panels::EdgeAt;
pub use panels::{PatternPanel, SewingPattern};
pub use read::{parse, read, read_unsewn};
pub use sew::{SewnGarment, sew};

/// Default edge length of a meshed pattern, m.
pub(crate) const DEFAULT_EDGE_M: f64 = 0.015;
