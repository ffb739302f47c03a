//! Sweeps: runs a file of range tables and other parameters point by point and writes a row to disk after each.
//!
//! [`Plan::read`] turns a sweep file into points, each a [`Job`](crate::Job); [`sweep`] runs the points without a row
//! by a function from point to row (usually a [`Bench`]), and writes the rows to a [`Store`]; `merge` joins
//! the stores of shards. Equal plans give equal rows except for timings, independent of interruptions, jobs and
//! shards.
//!
//! `file` documents the keys of a sweep file, `tables` the entries of range tables, `plan` the order of points,
//! `point` their ids, `store` the files on disk; `sweep_file` writes jobs as a sweep file.

mod axes;
mod bench;
mod bodies;
mod disk;
mod error;
mod file;
mod garments;
mod inputs;
mod manifest;
mod merge;
mod plan;
mod point;
mod row;
mod run;
pub(crate) mod store;
mod tables;
mod timing;
mod written;

#[cfg(feature = "python")]
pub(crate) use bench::Scenes;
pub use bench::{Bench, PointError, result_hash};
pub(crate) use disk::Medium;
pub use error::{MergeError, PlanError, StoreError};
pub(crate) use manifest::is_id;
pub use manifest::{Listed, Manifest, Shard};
pub use merge::join;
pub(crate) use merge::merge;
pub(crate) use plan::MAX_PASSES;
pub use plan::Plan;
pub use point::Point;
pub(crate) use row::cell;
#[cfg(feature = "python")]
pub(crate) use row::columns;
pub use row::{Row, Status, csv_text};
pub use run::{Outcome, Run, SweepProgress, sweep};
pub use store::{Existing, Store};
pub use timing::Timing;
pub(crate) use written::sweep_file;

#[cfg(test)]
mod tests;
