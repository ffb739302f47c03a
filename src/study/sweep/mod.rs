//! Sweeps: a file of range tables and other parameters run point by point, a row on disk after each.
//!
//! [`Plan::read`] turns a sweep file into points, each a [`Job`](crate::Job); [`sweep`] runs those that have no row
//! yet, with whatever makes rows of points (a [`Bench`], as a rule), and keeps the rows in a [`Store`]; [`merge`] joins
//! the stores of shards. Equal plans give equal rows, whatever was interrupted, however many jobs and shards there
//! were, timings aside.
//!
//! [`tables`] documents how a file names range tables, [`mod@file`] all its keys, [`plan`] the order of points,
//! [`point`] what their ids are made of, [`store`] the files; [`sweep_file`] writes one of jobs.

mod axes;
mod bench;
mod bodies;
mod disk;
mod error;
pub mod file;
mod garments;
mod inputs;
mod manifest;
mod merge;
pub mod plan;
pub mod point;
mod row;
mod run;
pub mod store;
pub mod tables;
mod timing;
mod written;

pub use bench::{Bench, Pass, PointError, result_hash, row_of};
pub use disk::{Append, Medium};
pub use error::{MergeError, PlanError, StoreError};
pub use manifest::{Listed, Manifest, Shard, is_id};
pub use merge::{join, merge};
pub use plan::{MOST_PASSES, Plan};
pub use point::{Point, VERSION};
pub use row::{Row, Status, cell, columns, csv_text};
pub use run::{Maker, Outcome, Run, SweepProgress, run_missing, sweep};
pub use store::{Existing, Store};
pub use timing::Timing;
pub use written::sweep_file;
