//! A sewing pattern put on a body: its panels are placed around this body, and their seams are closed.
//!
//! `put_on` sews the pattern in a few edge lengths, long ones first: on some hundred vertices the seams close in a tenth of a
//! second, and each finer garment starts from the one before, interpolated in the flat panels. `draw_shut` closes the open
//! seams of a garment mesh from a file.

mod arap;
mod arrange;
mod landmarks;
mod put_on;
mod shoulders;
mod skirt;
mod tube;
mod waves;

pub(crate) use arap::laid_flat;
pub use landmarks::Landmarks;
pub(crate) use landmarks::crotch_z;
pub use put_on::PutOn;
pub(crate) use put_on::{draw_shut, put_on};
