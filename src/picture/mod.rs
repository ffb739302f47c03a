//! Pictures of a draped garment, drawn by the processor alone and written as PNG. They need no viewer, no window and no graphics card,
//! and have the same pixels on every machine.
//!
//! [`Figure`] is one view of a body and its garment with caption and colour bar; [`Sheet`] sets figures in rows. [`Subject`] holds the data
//! of a figure: positions, PARTs, and values per vertex in the colours of a recording.

mod figure;
mod raster;
mod shading;
mod sheet;
mod subject;
mod text;
mod viewpoint;

pub(crate) use figure::Figure;
pub(crate) use sheet::Sheet;
pub(crate) use subject::{Quantity, Subject};
pub(crate) use viewpoint::Viewpoint;
