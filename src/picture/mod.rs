//! Pictures of a draped garment, drawn by the processor alone and written as PNG. They need no viewer, no window and no graphics card,
//! and have the same pixels on every machine.
//!
//! `Figure` is one view of a body and its garment with caption and colour bar; `Sheet` sets figures in rows. `Subject` holds the data
//! of a figure: positions, PARTs, and values per vertex in the colours of a recording ([`colour`]).

pub mod colour;
#[cfg(feature = "cli")]
mod figure;
#[cfg(feature = "cli")]
mod raster;
#[cfg(feature = "cli")]
mod shading;
#[cfg(feature = "cli")]
mod sheet;
#[cfg(feature = "cli")]
mod subject;
#[cfg(feature = "cli")]
mod text;
#[cfg(feature = "cli")]
mod viewpoint;

#[cfg(feature = "cli")]
pub(crate) use figure::Figure;
#[cfg(feature = "cli")]
pub(crate) use sheet::Sheet;
#[cfg(feature = "cli")]
pub(crate) use subject::{Quantity, Subject};
#[cfg(feature = "cli")]
pub(crate) use viewpoint::Viewpoint;
