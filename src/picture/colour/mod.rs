//! Colours of PARTs and of values on the mesh. Recordings, exports and Python show the same ones.

pub(crate) mod cells;
pub(crate) mod legend;
pub(crate) mod map;
pub(crate) mod palette;
mod values;

pub(crate) use palette::level_colours;
pub use values::Overlay;
pub(crate) use values::{FORCE_QUANTILE, QUANTILE, of_drape};
