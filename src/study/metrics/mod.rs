//! Metrics of a drape: plain numbers that the terminal, scripts, the rows of a sweep and recordings show.
//!
//! [`Metrics`] are deterministic; [`LevelCount`]s split them by level. Metrics that need a reference drape are `None`
//! without one.

mod drape_metrics;
mod ease;
mod faults;
mod levels;
mod method_metrics;

pub use drape_metrics::{Metrics, RESTS};
pub(crate) use ease::GirthEase;
pub use faults::{SlidPart, TightestOpening};
pub use levels::LevelCount;
pub(crate) use method_metrics::MethodMetrics;
