//! Sweeps: a file of range tables and other parameters run point by point, a row on disk after each.
//!
//! [`Plan::read`] turns a sweep file into points; [`sweep`] runs those that have no row yet through any [`Solve`] and keeps
//! the rows in a [`Store`]; [`merge`] joins the stores of shards. Equal plans give equal rows, whatever was interrupted,
//! however many jobs and shards there were, timings aside.
//!
//! [`tables`] documents how a file names range tables, [`mod@file`] all its keys, [`plan`] the order of points, [`point`] what their
//! ids are made of, [`store`] the files.

mod axes;
mod bodies;
mod choice;
mod disk;
mod error;
pub mod file;
mod garments;
mod inputs;
mod journal;
mod lines;
mod manifest;
mod merge;
pub mod plan;
pub mod point;
mod row;
mod run;
mod solve;
pub mod store;
pub mod tables;
mod timing;

pub use axes::DEFAULT_FABRIC;
pub use bodies::DEFAULT_BODY;
pub use choice::{BodyChoice, FabricChoice, Input, ModelChoice, Refine, TableChoice, TableRule};
pub use disk::Append;
pub use error::{MergeError, PlanError, StoreError};
pub use garments::DEFAULT_GARMENT;
pub use journal::Medium;
pub use manifest::{Listed, Manifest, Shard, is_id};
pub use merge::{join, merge};
pub use plan::Plan;
pub use point::{Point, VERSION};
pub use row::{COLUMNS, Measures, Row, Status};
pub use run::{Outcome, Progress, Run, run_missing, sweep};
pub use solve::{PointError, Solve, Solved, result_hash, row_of};
pub use store::{Existing, Store};
pub use timing::{Spread, Times, Timing};
